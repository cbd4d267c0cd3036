//! The file as other readers of MCAP see it.

use std::collections::BTreeMap;

use mcap::MessageStream;
use mcap::read::{LinearReader, Summary};
use mcap::records::Record;

use super::{Recording, stacking_episodes};

#[test]
fn log_times_start_at_zero_and_never_go_back_and_sequences_count() {
    let bytes = Recording::of(&stacking_episodes(5)).bytes();
    let mut last = 0;
    let mut next: BTreeMap<String, u32> = BTreeMap::new();
    for (position, message) in MessageStream::new(&bytes).unwrap().enumerate() {
        let message = message.unwrap();
        assert!(position > 0 || message.log_time == 0);
        assert!(message.log_time >= last, "time goes back at message {position}");
        assert_eq!(message.publish_time, message.log_time);
        last = message.log_time;
        let next = next.entry(message.channel.topic.clone()).or_default();
        assert_eq!(message.sequence, *next, "{}", message.channel.topic);
        *next += 1;
    }
    assert_eq!(next.len(), 10);
}

#[test]
fn episodes_are_one_second_apart() {
    let episodes = stacking_episodes(3);
    let bytes = Recording::of(&episodes).bytes();
    let messages: Vec<_> = MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let times = |topic: &str| -> Vec<u64> {
        messages.iter().filter(|message| message.channel.topic == topic).map(|message| message.log_time).collect()
    };
    let (starts, ends) = (times("/ntp/episode/start"), times("/ntp/episode/end"));
    for (episode, (start, end)) in episodes.iter().zip(starts.iter().zip(&ends)) {
        assert_eq!(end - start, episode.frames.last().unwrap().time_nanos);
    }
    assert!(starts[1..].iter().zip(&ends).all(|(start, end)| start - end == 1_000_000_000));
}

#[test]
fn metadata_comes_first_and_the_plan_last() {
    let bytes = Recording::of(&stacking_episodes(2)).bytes();
    let records: Vec<Record<'_>> = LinearReader::new(&bytes).unwrap().map(Result::unwrap).collect();
    let Record::Header(header) = &records[0] else { panic!("no header") };
    assert_eq!(header.profile, "");
    assert_eq!(header.library, format!("ntp/{} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER));
    let Record::Metadata(metadata) = &records[1] else { panic!("no metadata behind the header") };
    assert_eq!(metadata.name, "ntp.recording");
    assert_eq!(metadata.metadata["task_family"], "block_stacking");
    assert_eq!(metadata.metadata["schema_version"], "1");
    let end = records.iter().position(|record| matches!(record, Record::DataEnd(_))).unwrap();
    assert!(matches!(&records[end - 1], Record::Attachment { header, .. } if header.name == "plan.json"));
    assert!(records[2..end - 1].iter().all(|record| matches!(record, Record::Chunk { .. } | Record::MessageIndex(_))));
}

#[test]
fn the_summary_is_complete_and_in_the_order_of_ids() {
    let bytes = Recording::of(&stacking_episodes(2)).bytes();
    let summary = Summary::read(&bytes).unwrap().unwrap();
    let statistics = summary.stats.unwrap();
    assert_eq!((statistics.schema_count, statistics.channel_count), (11, 11));
    assert_eq!((statistics.attachment_count, statistics.metadata_count), (1, 1));
    assert_eq!(summary.chunk_indexes.len(), 1);
    let records: Vec<Record<'_>> = LinearReader::new(&bytes).unwrap().map(Result::unwrap).collect();
    let end = records.iter().position(|record| matches!(record, Record::DataEnd(_))).unwrap();
    let ids = |is_schema: bool| -> Vec<u16> {
        let id = |record: &Record<'_>| match record {
            Record::Schema { header, .. } if is_schema => Some(header.id),
            Record::Channel(channel) if !is_schema => Some(channel.id),
            _ => None,
        };
        records[end..].iter().filter_map(id).collect()
    };
    assert_eq!(ids(true), (1..=11).collect::<Vec<_>>());
    assert_eq!(ids(false), (1..=11).collect::<Vec<_>>());
    assert!(matches!(records[end + 1], Record::Schema { .. }), "schemas come first");
}
