//! A bucket in an S3-compatible store.
//!
//! An object appears whole or not at all. A store that passes over the condition that nothing of a name is there can be
//! found out before anything is written. What a store refuses for a while (`503 SlowDown` and the like) is tried again,
//! ten times in three minutes at most. The parts of a large file whose upload was killed are no object: a rule of the
//! bucket removes them (`AbortIncompleteMultipartUpload`).

use std::fs::File;
use std::hash::{BuildHasher as _, RandomState};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use futures_util::{StreamExt as _, TryStreamExt as _};
use object_store::aws::AmazonS3Builder;
use object_store::path::Path as Location;
use object_store::{Error, ObjectStore, ObjectStoreExt as _, PutMode, PutOptions, PutPayload, WriteMultipart};
use sha2::{Digest as _, Sha256};
use tokio::runtime::{Builder, Runtime};

use crate::artifact::{AtomicFile, IoError, hex};
use crate::store::{BucketUrl, Creation, Store, StoreError};

/// Larger files are uploaded in parts of this many bytes, so that memory does not grow with them.
const PART: usize = 8 << 20;
/// Parts on their way at a time.
const CONCURRENT_PARTS: usize = 4;
/// Small files that are asked for at a time.
const CONCURRENT_READS: usize = 32;
/// How the names begin of what shows whether conditional writes are kept to, and is removed again.
const PROBE: &str = ".ntp-conditional-write";

/// A place in a bucket.
#[derive(Debug)]
pub struct Bucket {
    url: BucketUrl,
    store: Arc<dyn ObjectStore>,
    runtime: Runtime,
}

impl Bucket {
    /// A bucket of the store that the environment names: `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`,
    /// for stores of others `AWS_ENDPOINT`, without encryption `AWS_ALLOW_HTTP`.
    ///
    /// # Errors
    ///
    /// When settings contradict each other, or there are no threads to be had.
    pub fn from_env(url: &BucketUrl) -> Result<Self, StoreError> {
        let store = AmazonS3Builder::from_env().with_bucket_name(&url.bucket).build();
        let store = store.map_err(failed("open", url.to_string().into()))?;
        Self::new(url, Arc::new(store))
    }

    /// A place in a store.
    ///
    /// # Errors
    ///
    /// When the system refuses.
    pub fn new(url: &BucketUrl, store: Arc<dyn ObjectStore>) -> Result<Self, StoreError> {
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(IoError::system("begin to talk to", url.to_string()))?;
        Ok(Self { url: url.clone(), store, runtime })
    }

    fn location(&self, file: &str) -> Location {
        let prefix = self.url.prefix.split('/').filter(|part| !part.is_empty());
        Location::from_iter(prefix.chain(file.split('/')))
    }

    fn failed(&self, action: &'static str, file: &str) -> impl FnOnce(Error) -> StoreError {
        failed(action, self.path(file))
    }

    /// Writes on the condition that nothing of the name is there.
    async fn put_new(&self, file: &str, content: Vec<u8>) -> Result<Creation, Error> {
        let options = PutOptions::from(PutMode::Create);
        match self.store.put_opts(&self.location(file), PutPayload::from(content), options).await {
            Ok(_) => Ok(Creation::Stored),
            Err(Error::AlreadyExists { .. }) => Ok(Creation::Taken),
            Err(error) => Err(error),
        }
    }

    /// Whether a second conditional write of a name is refused.
    async fn keeps_conditions(&self, probe: &str) -> Result<bool, Error> {
        let first = self.put_new(probe, Vec::new()).await;
        let second = match first {
            Ok(_) => self.put_new(probe, Vec::new()).await,
            Err(error) => Err(error),
        };
        let answer = match second {
            Ok(creation) => creation == Creation::Taken,
            Err(error) if is_unsupported(&error) => return Ok(false),
            Err(error) => return Err(error),
        };
        self.store.delete(&self.location(probe)).await?;
        Ok(answer)
    }

    /// Uploads in parts; after an error none of them is left.
    async fn upload(&self, source: &Path, mut reader: File, file: &str) -> Result<(), StoreError> {
        let upload = self.store.put_multipart(&self.location(file)).await.map_err(self.failed("upload", file))?;
        let mut writer = WriteMultipart::new_with_chunk_size(upload, PART);
        loop {
            let mut part = Vec::with_capacity(PART);
            let read = (&mut reader).take(PART as u64).read_to_end(&mut part);
            let sent = match read.map_err(IoError::system("read", source)) {
                Err(error) => Err(error.into()),
                Ok(0) => break,
                Ok(_) => writer.wait_for_capacity(CONCURRENT_PARTS).await.map_err(self.failed("upload", file)),
            };
            if let Err(error) = sent {
                // What went wrong first is what is told.
                drop(writer.abort().await);
                return Err(error);
            }
            writer.put(part.into());
        }
        writer.finish().await.map_err(self.failed("upload", file))?;
        Ok(())
    }

    async fn hash(&self, file: &str) -> Result<Option<String>, Error> {
        let found = match self.store.get(&self.location(file)).await {
            Err(Error::NotFound { .. }) => return Ok(None),
            found => found?,
        };
        let (mut stream, mut hasher) = (found.into_stream(), Sha256::new());
        while let Some(bytes) = stream.try_next().await? {
            hasher.update(&bytes);
        }
        Ok(Some(hex(&hasher.finalize())))
    }

    async fn small(&self, file: &str) -> Result<Option<Vec<u8>>, Error> {
        match self.store.get(&self.location(file)).await {
            Err(Error::NotFound { .. }) => Ok(None),
            found => Ok(Some(found?.bytes().await?.to_vec())),
        }
    }

    async fn download(&self, file: &str, to: &Path) -> Result<(AtomicFile, String), StoreError> {
        let found = self.store.get(&self.location(file)).await.map_err(self.failed("read", file))?;
        let (mut stream, mut hasher) = (found.into_stream(), Sha256::new());
        let mut writer = AtomicFile::create(to)?;
        while let Some(bytes) = stream.try_next().await.map_err(self.failed("read", file))? {
            hasher.update(&bytes);
            writer.write_all(&bytes).map_err(IoError::system("write", to))?;
        }
        Ok((writer, hex(&hasher.finalize())))
    }

    fn refuse_careless(&self, probe: &str) -> Result<(), StoreError> {
        let keeps_conditions = self.runtime.block_on(self.keeps_conditions(probe));
        if keeps_conditions.map_err(self.failed("write", probe))? {
            return Ok(());
        }
        Err(StoreError::NoConditionalWrites { url: self.url.to_string() })
    }

    async fn names(&self, folder: &str) -> Result<Vec<String>, Error> {
        let root = self.location("");
        let mut names = Vec::new();
        let mut objects = self.store.list(Some(&self.location(folder)));
        while let Some(object) = objects.try_next().await? {
            let Some(parts) = object.location.prefix_match(&root) else { continue };
            let name = parts.map(|part| part.as_ref().to_owned()).collect::<Vec<_>>().join("/");
            if !name.starts_with(PROBE) {
                names.push(name);
            }
        }
        names.sort();
        Ok(names)
    }
}

impl Store for Bucket {
    fn path(&self, file: &str) -> PathBuf {
        format!("{}/{file}", self.url).into()
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, StoreError> {
        self.runtime.block_on(self.names(folder)).map_err(failed("list", self.url.to_string().into()))
    }

    fn read(&self, file: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.runtime.block_on(self.small(file)).map_err(self.failed("read", file))
    }

    fn read_all(&self, files: &[String]) -> Result<Vec<Option<Vec<u8>>>, StoreError> {
        let read = |file: &String| {
            let file = file.clone();
            async move { self.small(&file).await.map_err(self.failed("read", &file)) }
        };
        let answers = futures_util::stream::iter(files.iter().map(read)).buffered(CONCURRENT_READS);
        self.runtime.block_on(answers.try_collect())
    }

    fn sha256(&self, file: &str) -> Result<Option<String>, StoreError> {
        self.runtime.block_on(self.hash(file)).map_err(self.failed("read", file))
    }

    fn prepare(&self) -> Result<(), StoreError> {
        self.refuse_careless(PROBE)
    }

    fn check_conditions(&self) -> Result<(), StoreError> {
        // Each process has a name of its own, so that none removes another's.
        self.refuse_careless(&format!("{PROBE}-{:016x}", RandomState::new().hash_one(PROBE)))
    }

    fn copy(&self, source: &Path, file: &str) -> Result<(), StoreError> {
        let reader = File::open(source).map_err(IoError::system("open", source))?;
        let bytes = reader.metadata().map_err(IoError::system("read", source))?.len();
        if bytes > PART as u64 {
            return self.runtime.block_on(self.upload(source, reader, file));
        }
        self.create(file, &crate::artifact::read(source)?).map(|_| ())
    }

    fn fetch(&self, file: &str, to: &Path, sha256: &str) -> Result<(), StoreError> {
        let (written, found) = self.runtime.block_on(self.download(file, to))?;
        if found != sha256 {
            return Err(StoreError::Spoiled { place: self.path(file), found, expected: sha256.to_owned() });
        }
        Ok(written.commit()?)
    }

    fn create(&self, file: &str, content: &[u8]) -> Result<Creation, StoreError> {
        self.runtime.block_on(self.put_new(file, content.to_vec())).map_err(self.failed("write", file))
    }

    fn replace(&self, file: &str, content: &[u8]) -> Result<(), StoreError> {
        let put = async { self.store.put(&self.location(file), PutPayload::from(content.to_vec())).await };
        self.runtime.block_on(put).map(|_| ()).map_err(self.failed("write", file))
    }
}

fn failed(action: &'static str, place: PathBuf) -> impl FnOnce(Error) -> StoreError {
    move |source| StoreError::Refused { action, place, source: Box::new(source) }
}

/// Whether a store says that it does not know conditional writes, in its own words or in those of HTTP.
fn is_unsupported(error: &Error) -> bool {
    match error {
        Error::NotImplemented { .. } | Error::NotSupported { .. } => true,
        Error::Generic { source, .. } => {
            let words = source.to_string();
            ["501", "NotImplemented"].iter().any(|word| words.contains(word))
        }
        _ => false,
    }
}
