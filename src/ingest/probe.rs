//! The features of a dataset, as the first messages of the recordings show them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::decode::Decoder;
use super::error::IngestError;
use super::map::{FeatureMap, Map, NumberType, Store};
use super::observe::Observer;
use super::picture::{Reason, packet_size};
use super::sample::{Content, ContentKind, Sampler};
use crate::dataset::plain::{Dtype, PlainFeature, PlainKind};
use crate::recording::read_messages;
use crate::words::counted;

/// A feature of the map with what it holds.
pub(super) struct Feature<'m> {
    pub(super) map: &'m FeatureMap,
    pub(super) kind: PlainKind,
    /// How many numbers each source gives; 0 of what is not numbers.
    pub(super) widths: Vec<usize>,
}

impl Feature<'_> {
    pub(super) fn declared(&self) -> PlainFeature {
        PlainFeature { name: self.map.name.clone(), kind: self.kind.clone() }
    }

    /// Why what a message gives has no place in a feature; nothing where it has. `width` numbers come from its topic.
    pub(super) fn misfit(&self, found: &ContentKind, width: usize) -> Option<Reason> {
        match (found, &self.kind) {
            (ContentKind::Numbers(names), PlainKind::Numbers(..)) => {
                let n = names.len();
                (n != width).then(|| format!("it has {}, and the first message had {width}", counted(n, "number")))
            }
            (ContentKind::Text, PlainKind::Text) | (ContentKind::Packets, PlainKind::Video(_)) => None,
            (ContentKind::Image(found), PlainKind::Image(size) | PlainKind::Video(size)) => {
                let [[width, height], [of_first, high]] = [found, size];
                (found != size)
                    .then(|| format!("it is of {width}x{height} pixels, and the first one of {of_first}x{high}"))
            }
            _ => Some("it is of another kind than the first message".to_owned()),
        }
    }
}

/// What has been seen of a source.
enum Seen {
    Nothing(String),
    Kind(ContentKind),
    /// A video of this size.
    Video([u32; 2]),
}

/// Looks at the first file until every source has shown what it gives.
pub(super) fn features<'m>(files: &[PathBuf], map: &'m Map) -> Result<Vec<Feature<'m>>, IngestError> {
    let Some(path) = files.first() else { return Err(IngestError::NoEpisode { told: "no file".to_owned() }) };
    let sources = map.features.iter().flat_map(|feature| feature.from.iter().map(move |source| (feature, source)));
    let mut samplers: Vec<Sampler<'_>> =
        sources.clone().map(|(feature, source)| Sampler::new(feature, source)).collect();
    let topics: Vec<&str> = sources.map(|(_, source)| source.topic.as_str()).collect();
    let mut seen: Vec<Seen> = topics.iter().map(|_| Seen::Nothing(String::new())).collect();
    let mut decoders = BTreeMap::new();
    let mut all_topics = BTreeSet::new();
    read_messages(path, |message| {
        let topic = &message.channel.topic;
        if !all_topics.contains(topic) {
            all_topics.insert(topic.clone());
        }
        let wanted = (0..topics.len()).filter(|&at| topics[at] == topic && matches!(seen[at], Seen::Nothing(_)));
        let wanted: Vec<usize> = wanted.collect();
        if wanted.is_empty() {
            return Ok::<_, IngestError>(ControlFlow::Continue(()));
        }
        let decoder = decoder(path, &mut decoders, message.channel)?;
        let decoded = decoder.decode(message.data);
        for at in wanted {
            let taken = decoded.as_ref().map_err(Clone::clone).and_then(|value| samplers[at].take(value));
            seen[at] = match taken {
                Ok((Content::Packet(packet, true), _)) => match packet_size(&packet) {
                    Ok(size) => Seen::Video(size),
                    Err(reason) => Seen::Nothing(reason),
                },
                Ok((Content::Packet(..), _)) => Seen::Nothing("it is no key frame".to_owned()),
                Ok((_, kind)) => Seen::Kind(kind),
                Err(reason) => Seen::Nothing(reason),
            };
        }
        let is_known = |seen: &Seen| !matches!(seen, Seen::Nothing(_));
        Ok(if seen.iter().all(is_known) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })?;
    let mut seen = seen.into_iter();
    let feature = |feature: &'m FeatureMap| {
        let of_sources: Vec<Seen> = seen.by_ref().take(feature.from.len()).collect();
        resolve(path, feature, of_sources, &all_topics)
    };
    map.features.iter().map(feature).collect()
}

/// What makes observations of the first feature's numbers, if the map asks for them.
pub(super) fn observer(path: &Path, map: &Map, features: &[Feature<'_>]) -> Result<Option<Observer>, IngestError> {
    let Some(observations) = &map.observations else { return Ok(None) };
    let wrong = |problem: String| IngestError::Map { path: path.to_owned(), problem };
    Observer::check(features.first().map_or(&[], |first| &first.widths)).map_err(wrong)?;
    Observer::new(observations).map(Some).map_err(wrong)
}

/// The decoder of a channel, made when it is first needed.
pub(super) fn decoder<'d>(
    path: &Path,
    decoders: &'d mut BTreeMap<u16, Decoder>,
    channel: &crate::recording::AnyChannel,
) -> Result<&'d Decoder, IngestError> {
    use std::collections::btree_map::Entry;
    Ok(match decoders.entry(channel.id) {
        Entry::Occupied(known) => known.into_mut(),
        Entry::Vacant(unknown) => {
            let wrong = |problem| {
                let (path, topic) = (path.to_owned(), channel.topic.clone());
                IngestError::Encoding { path, topic, problem }
            };
            unknown.insert(Decoder::new(channel).map_err(wrong)?)
        }
    })
}

fn resolve<'m>(
    path: &Path,
    map: &'m FeatureMap,
    seen: Vec<Seen>,
    topics: &BTreeSet<String>,
) -> Result<Feature<'m>, IngestError> {
    let wrong = |problem: String| {
        let problem = format!("feature {:?}: {problem}", map.name);
        IngestError::Map { path: path.to_owned(), problem }
    };
    let (mut kinds, mut names, mut widths) = (Vec::new(), Vec::new(), Vec::new());
    for (seen, source) in seen.into_iter().zip(&map.from) {
        widths.push(0);
        match seen {
            Seen::Nothing(why) => {
                let (path, feature, topic) = (path.to_owned(), map.name.clone(), source.topic.clone());
                let why = if why.is_empty() { why } else { format!(": {why}") };
                return Err(IngestError::NoTopic {
                    path,
                    feature,
                    topic,
                    why,
                    topics: topics.iter().cloned().collect(),
                });
            }
            Seen::Kind(ContentKind::Numbers(of_source)) => {
                widths.pop();
                widths.push(of_source.len());
                names.extend(of_source);
            }
            Seen::Kind(ContentKind::Text | ContentKind::Packets) => kinds.push(PlainKind::Text),
            Seen::Kind(ContentKind::Image(size)) if map.store == Store::H264 => kinds.push(PlainKind::Video(size)),
            Seen::Kind(ContentKind::Image(size)) => kinds.push(PlainKind::Image(size)),
            Seen::Video(size) => kinds.push(PlainKind::Video(size)),
        }
    }
    let kind = match (kinds.as_slice(), names.is_empty()) {
        ([], false) => numbers(map, names).map_err(wrong)?,
        ([one], true) => one.clone(),
        _ => return Err(wrong("pictures and texts have one source, and stand alone".to_owned())),
    };
    if let PlainKind::Video(size) = kind
        && size.iter().any(|side| side % 2 > 0)
    {
        return Err(wrong(format!("H.264 has even sides, and these pictures are {}x{}", size[0], size[1])));
    }
    Ok(Feature { map, kind, widths })
}

fn numbers(map: &FeatureMap, found: Vec<String>) -> Result<PlainKind, String> {
    let dtype = match map.dtype {
        NumberType::Float32 => Dtype::Float32,
        NumberType::Float64 => Dtype::Float64,
        NumberType::Int64 => Dtype::Int64,
        NumberType::Bool => Dtype::Bool,
    };
    if dtype == Dtype::Bool && found.len() > 1 {
        return Err(format!("bool is of one value, and there are {}", found.len()));
    }
    let names = map.names.clone().unwrap_or_else(|| found.clone());
    if names.len() != found.len() {
        return Err(format!(
            "{} for {}: {}",
            counted(names.len(), "name"),
            counted(found.len(), "number"),
            found.join(", ")
        ));
    }
    Ok(PlainKind::Numbers(dtype, names))
}
