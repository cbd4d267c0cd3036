//! An `.rrd` file, written store by store under a temporary name.
//!
//! Rerun's own encoder writes the stores of a file's footer, and the columns of each store, in the order of hash maps.
//! Here the stores are in the order in which they came and the columns in that of their names, so that the same stores
//! give the same bytes.

use std::collections::HashMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use rerun::external::arrow::datatypes::{FieldRef, Schema};
use rerun::external::re_chunk_store::external::re_chunk::{Chunk, Span};
use rerun::external::re_log_encoding::{
    Compression, CrateVersion, Encodable, EncodingOptions, MessageHeader, MessageKind, RRD_FOURCC, RrdFooter,
    RrdManifestBuilder, StreamFooter, StreamHeader, ToTransport as _,
};
use rerun::log::LogMsg;

use crate::artifact::{AtomicFile, IoError};
use crate::visualize::VisualizeError;
use crate::visualize::store::Store;

/// A file on its way.
pub(super) struct RrdFile {
    file: AtomicFile,
    path: PathBuf,
    n_bytes: u64,
    /// One store each, in order.
    footers: Vec<RrdFooter>,
}

impl RrdFile {
    /// Begins a file.
    pub(super) fn create(path: &Path) -> Result<Self, VisualizeError> {
        let file = AtomicFile::create(path)?;
        let mut this = Self { file, path: path.to_owned(), n_bytes: 0, footers: Vec::new() };
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let header = StreamHeader { fourcc: RRD_FOURCC, version: CrateVersion::LOCAL.to_bytes(), options };
        this.write(&header)?;
        Ok(this)
    }

    /// Appends all messages of a store.
    pub(super) fn append(&mut self, store: Store) -> Result<(), VisualizeError> {
        let id = store.id().clone();
        let mut manifest = RrdManifestBuilder::default();
        for message in store.into_messages() {
            let transport = message.to_transport(Compression::LZ4).map_err(|error| self.encode_error(error))?;
            let begin = self.n_bytes;
            self.write(&transport)?;
            if let LogMsg::ArrowMsg(_, message) = &message {
                let header = MessageHeader::ENCODED_SIZE_BYTES as u64;
                let span = Span { start: begin + header, len: self.n_bytes - begin - header };
                let chunk = Chunk::from_arrow_msg(message).map_err(|error| self.encode_error(error))?;
                let batch = chunk.to_chunk_batch().map_err(|error| self.encode_error(error))?;
                manifest
                    .append(&batch, span, transport.byte_size_uncompressed())
                    .map_err(|error| self.encode_error(error))?;
            }
        }
        let mut manifest = manifest.build(id.clone()).map_err(|error| self.encode_error(error))?;
        manifest.sorbet_schema = sorted(&manifest.sorbet_schema);
        self.footers.push(RrdFooter { manifests: HashMap::from([(id, manifest)]) });
        Ok(())
    }

    /// Writes the footer and gives the file its name. Returns its size in bytes.
    pub(super) fn finish(mut self) -> Result<u64, VisualizeError> {
        let mut footer = RrdFooter::default().to_transport(()).map_err(|error| self.encode_error(error))?;
        for part in std::mem::take(&mut self.footers) {
            footer.manifests.extend(part.to_transport(()).map_err(|error| self.encode_error(error))?.manifests);
        }
        let payload = self.encoded(&footer)?;
        self.write(&MessageHeader { kind: MessageKind::End, len: payload.len() as u64 })?;
        let begin = self.n_bytes;
        self.write_bytes(&payload)?;
        self.write(&StreamFooter::from_rrd_footer_bytes(begin, &payload))?;
        self.file.commit()?;
        Ok(self.n_bytes)
    }

    fn write(&mut self, what: &dyn Encodable) -> Result<(), VisualizeError> {
        let bytes = self.encoded(what)?;
        self.write_bytes(&bytes)
    }

    fn encoded(&self, what: &dyn Encodable) -> Result<Vec<u8>, VisualizeError> {
        let mut bytes = Vec::new();
        what.to_rrd_bytes(&mut bytes).map_err(|error| self.encode_error(error))?;
        Ok(bytes)
    }

    fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), VisualizeError> {
        self.file.write_all(bytes).map_err(IoError::system("write", &self.path))?;
        self.n_bytes += bytes.len() as u64;
        Ok(())
    }

    fn encode_error(&self, error: impl std::error::Error + Send + Sync + 'static) -> VisualizeError {
        VisualizeError::Encode { path: self.path.clone(), source: Box::new(error) }
    }
}

/// The same schema with its columns in the order of their names; Rerun leaves them in the order of a hash map.
fn sorted(schema: &Schema) -> Schema {
    let mut fields: Vec<FieldRef> = schema.fields().iter().cloned().collect();
    fields.sort_by(|a, b| a.name().cmp(b.name()));
    Schema::new_with_metadata(fields, schema.metadata().clone())
}
