//! The messages of one Rerun store, a recording or a blueprint, built without a clock.
//!
//! Rerun's own recording stream stamps each message with ids made of the time of day. Here they are made of the
//! store's name and of the message's position, so that the same episode gives the same bytes.

use rerun::external::re_log_types::external::re_tuid::Tuid;
use rerun::external::re_log_types::{
    BlueprintActivationCommand, EntityPath, SetStoreInfo, StoreInfo, StoreKind, StoreSource,
};
use rerun::log::{Chunk, ChunkId, ChunkResult, LogMsg, TimeColumn};
use rerun::{AsComponents, SerializedComponentColumn, StoreId};
use sha2::{Digest as _, Sha256};

use crate::visualize::{APPLICATION_ID, VisualizeError};

/// Bits of an id that count rows inside of one message.
const ROW_BITS: u32 = 32;

/// The messages of one store, in order.
pub(super) struct Store {
    id: StoreId,
    /// Upper half of every id; below 2^60, a time of day long past.
    id_base: u64,
    messages: Vec<LogMsg>,
}

impl Store {
    /// An empty recording.
    pub(super) fn recording(id: &str) -> Self {
        Self::new(StoreKind::Recording, id)
    }

    /// An empty blueprint.
    pub(super) fn blueprint(id: &str) -> Self {
        Self::new(StoreKind::Blueprint, id)
    }

    fn new(kind: StoreKind, id: &str) -> Self {
        let digest = Sha256::digest(format!("{kind}/{id}").as_bytes());
        let mut first = [0_u8; 8];
        first.copy_from_slice(&digest[..8]);
        let id_base = u64::from_be_bytes(first) >> 4;
        let id = StoreId::new(kind, APPLICATION_ID, id);
        let info = StoreInfo::new(id.clone(), StoreSource::Other("ntp".to_owned()));
        let row_id = Tuid::from_nanos_and_inc(id_base, 0);
        Self { id, id_base, messages: vec![LogMsg::SetStoreInfo(SetStoreInfo { row_id, info })] }
    }

    /// Logs what holds at all times.
    pub(super) fn put_static(
        &mut self,
        path: impl Into<EntityPath>,
        what: &dyn AsComponents,
    ) -> Result<(), VisualizeError> {
        self.put(&path.into(), what, [], None)
    }

    /// Logs one row with all instances.
    pub(super) fn put_whole(
        &mut self,
        path: impl Into<EntityPath>,
        times: impl IntoIterator<Item = TimeColumn>,
        what: &dyn AsComponents,
    ) -> Result<(), VisualizeError> {
        self.put(&path.into(), what, times, None)
    }

    /// Logs one row a time, one instance a row.
    pub(super) fn put_rows(
        &mut self,
        path: impl Into<EntityPath>,
        times: impl IntoIterator<Item = TimeColumn>,
        what: &dyn AsComponents,
    ) -> Result<(), VisualizeError> {
        let times: Vec<TimeColumn> = times.into_iter().collect();
        let n_rows = times.first().map_or(0, TimeColumn::num_rows);
        self.put(&path.into(), what, times, Some(&vec![1; n_rows]))
    }

    /// Logs one row a time; `lengths` says how many instances each row has. A row of none clears the entity.
    pub(super) fn put_ragged_rows(
        &mut self,
        path: impl Into<EntityPath>,
        times: impl IntoIterator<Item = TimeColumn>,
        what: &dyn AsComponents,
        lengths: &[usize],
    ) -> Result<(), VisualizeError> {
        self.put(&path.into(), what, times, Some(lengths))
    }

    fn put(
        &mut self,
        path: &EntityPath,
        what: &dyn AsComponents,
        times: impl IntoIterator<Item = TimeColumn>,
        lengths: Option<&[usize]>,
    ) -> Result<(), VisualizeError> {
        if lengths.is_some_and(<[usize]>::is_empty) {
            return Ok(());
        }
        let message = self.chunk(path, what, times, lengths);
        let message =
            message.map_err(|source| VisualizeError::Data { entity: path.to_string(), source: Box::new(source) })?;
        self.messages.push(message);
        Ok(())
    }

    fn chunk(
        &self,
        path: &EntityPath,
        what: &dyn AsComponents,
        times: impl IntoIterator<Item = TimeColumn>,
        lengths: Option<&[usize]>,
    ) -> ChunkResult<LogMsg> {
        let columns: Vec<SerializedComponentColumn> = what
            .as_serialized_batches()
            .into_iter()
            .map(|batch| match lengths {
                Some(lengths) => batch.partitioned(lengths.iter().copied()),
                None => {
                    let n_instances = batch.array.len();
                    batch.partitioned([n_instances])
                }
            })
            .collect::<Result<_, _>>()?;
        let times = times.into_iter().map(|column| (*column.timeline().name(), column)).collect();
        let chunk = Chunk::from_auto_row_ids(self.next_id(), path.clone(), times, columns.into_iter().collect())?;
        Ok(LogMsg::ArrowMsg(self.id.clone(), chunk.to_arrow_msg()?))
    }

    fn next_id(&self) -> ChunkId {
        ChunkId::from_tuid(Tuid::from_nanos_and_inc(self.id_base, (self.messages.len() as u64) << ROW_BITS))
    }

    /// Makes a finished blueprint the one to show, now and for later recordings.
    pub(super) fn activate(&mut self) {
        let command =
            BlueprintActivationCommand { blueprint_id: self.id.clone(), make_active: true, make_default: true };
        self.messages.push(LogMsg::BlueprintActivationCommand(command));
    }

    /// Which store it is.
    pub(super) fn id(&self) -> &StoreId {
        &self.id
    }

    /// All messages.
    pub(super) fn into_messages(self) -> Vec<LogMsg> {
        self.messages
    }
}
