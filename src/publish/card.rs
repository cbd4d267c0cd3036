//! `README.md`: the dataset card, filled in from the data.

use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use crate::publish::tables::TableFacts;
use crate::publish::{Facts, Publication};
use crate::words::counted;

const TEMPLATE: &str = include_str!("card.md.j2");

/// What the template is filled in with.
#[derive(Serialize)]
struct Card<'a> {
    name: &'a str,
    /// As YAML has it.
    quoted_name: String,
    license: &'static str,
    license_title: &'static str,
    license_url: String,
    date: String,
    release: String,
    tags: &'static [&'static str],
    size: &'static str,
    facts: &'a Facts,
    tables: &'a [TableFacts],
    pipeline: Option<&'a str>,
    /// `owner/name` at the hub, or a stand-in for it.
    repository: &'a str,
}

/// The whole text.
pub(super) fn render(facts: &Facts, publication: &Publication) -> Result<Vec<u8>, String> {
    let card = Card {
        name: &publication.name,
        quoted_name: serde_json::to_string(&publication.name).map_err(|error| error.to_string())?,
        license: publication.license.hub,
        license_title: publication.license.title,
        license_url: publication.license.url(),
        date: publication.date.to_string(),
        release: publication.release.to_string(),
        tags: facts.tags,
        size: size_category(facts.summary.total_frames),
        facts,
        tables: &facts.tables,
        pipeline: facts.pipeline.as_deref(),
        repository: publication.repository().unwrap_or("OWNER/NAME"),
    };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.set_keep_trailing_newline(true);
    environment.set_auto_escape_callback(|_| minijinja::AutoEscape::None);
    environment.add_filter("counted", |n: u64, thing: String| counted(n, &thing));
    let text = environment.render_named_str("card.md", TEMPLATE, card).map_err(|error| format!("{error:#}"))?;
    Ok(text.into_bytes())
}

/// The hub's word for how many rows readers open by default.
fn size_category(rows: u64) -> &'static str {
    match rows {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        1_000_000..10_000_000 => "1M<n<10M",
        10_000_000..100_000_000 => "10M<n<100M",
        100_000_000..1_000_000_000 => "100M<n<1B",
        _ => "1B<n<10B",
    }
}
