//! The plan among the attachments of a file.

use std::path::Path;

use mcap::McapError;

use super::container::Fields;
use super::error::{Damage, RecordingError};
use super::index::broken;
use super::sink::PLAN;
use super::stream::damaged;
use crate::artifact::Plan;

/// The plan among attachments that are looked at in the order of the file. Others may have attached files too, also of
/// the same name: it is the first of its name that is a plan of a stage, or else the first of its name.
#[derive(Default)]
pub(super) struct PlanSearch {
    found: Option<String>,
    is_plan: bool,
    /// Of a text of its name that is none.
    refused: Option<RecordingError>,
}

impl PlanSearch {
    /// Looks at the attachment at an offset.
    ///
    /// # Errors
    ///
    /// When it has the plan's name and is damaged.
    pub(super) fn attachment(&mut self, path: &Path, offset: u64, record: &[u8]) -> Result<(), RecordingError> {
        let attachment = Attachment::parse(record).ok_or_else(|| broken(path, offset, "attachment"))?;
        if self.is_plan || attachment.name != PLAN.as_bytes() {
            return Ok(());
        }
        attachment.check(record).map_err(|error| damaged(path, offset, error))?;
        match std::str::from_utf8(attachment.data) {
            Ok(text) => {
                self.is_plan = serde_json::from_str::<Plan>(text).is_ok();
                if self.is_plan || self.found.is_none() {
                    self.found = Some(text.to_owned());
                }
            }
            Err(_error) => {
                let (path, source) = (path.to_owned(), Damage::Text { record: PLAN });
                self.refused = Some(RecordingError::Damaged { path, offset, source });
            }
        }
        Ok(())
    }

    /// The plan that was found.
    ///
    /// # Errors
    ///
    /// When all that has its name is no text.
    pub(super) fn finish(self) -> Result<Option<String>, RecordingError> {
        match (self.found, self.refused) {
            (None, Some(error)) => Err(error),
            (found, _) => Ok(found),
        }
    }
}

/// An attachment: log time, create time, name, media type, length, data, checksum.
pub(super) struct Attachment<'a> {
    times_nanos: [u64; 2],
    name: &'a [u8],
    media_type: &'a [u8],
    data: &'a [u8],
    saved: u32,
}

impl<'a> Attachment<'a> {
    pub(super) fn parse(record: &'a [u8]) -> Option<Self> {
        let (checked, checksum) = record.split_last_chunk()?;
        let mut fields = Fields::new(checked);
        let times_nanos = [fields.u64()?, fields.u64()?];
        let (name, media_type, length) = (fields.text()?, fields.text()?, fields.u64()?);
        let data = fields.rest();
        let saved = u32::from_le_bytes(*checksum);
        (length == data.len() as u64).then_some(Self { times_nanos, name, media_type, data, saved })
    }

    /// Holds the record, from which it was parsed, against its checksum. Zero says that there is none.
    pub(super) fn check(&self, record: &[u8]) -> Result<(), McapError> {
        let saved = self.saved;
        let calculated = if saved == 0 { 0 } else { crc32fast::hash(&record[..record.len() - size_of::<u32>()]) };
        if saved == calculated { Ok(()) } else { Err(McapError::BadAttachmentCrc { saved, calculated }) }
    }

    /// As the library writes it.
    pub(super) fn to_mcap(&self) -> mcap::Attachment<'a> {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let [log_time, create_time] = self.times_nanos;
        let (name, media_type) = (text(self.name), text(self.media_type));
        mcap::Attachment { log_time, create_time, name, media_type, data: self.data.into() }
    }
}
