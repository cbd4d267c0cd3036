//! Buckets: what lies there, what is refused, what an interruption of publishing leaves, and the check of a copy.
//!
//! The store is one in memory; `tests/foreign/bucket.sh` and `tests/cluster/bucket.sh` do the
//! same with a server that speaks S3.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;

use futures_util::TryStreamExt as _;
use futures_util::stream::BoxStream;
use ntp::publish::{Difference, PublishError, publish, verify};
use ntp::store::{Bucket, BucketUrl, Creation, Folder, Store as _, StoreError};
use object_store::memory::InMemory;
use object_store::path::Path as Location;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore,
    ObjectStoreExt as _, PutMode, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};

use crate::publish::{Place, place, publication};

/// What a store does wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    None,
    /// It overwrites, whatever the condition.
    PassesOverConditions,
    /// It refuses what has a condition.
    KnowsNoConditions,
    /// It stores other bytes than it is given.
    SpoilsTables,
}

#[derive(Debug)]
struct Faulty {
    inner: InMemory,
    fault: Fault,
}

impl fmt::Display for Faulty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a store in memory")
    }
}

/// What `async fn` in the trait stands for.
type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T>> + Send + 'a>>;

impl ObjectStore for Faulty {
    fn put_opts<'s, 'l, 'a>(
        &'s self,
        location: &'l Location,
        payload: PutPayload,
        mut options: PutOptions,
    ) -> Answer<'a, PutResult>
    where
        's: 'a,
        'l: 'a,
        Self: 'a,
    {
        let is_conditional = options.mode == PutMode::Create;
        let spoils = self.fault == Fault::SpoilsTables && location.as_ref().ends_with(".parquet");
        match self.fault {
            Fault::KnowsNoConditions if is_conditional => {
                let (operation, implementer) = ("put".to_owned(), self.to_string());
                return Box::pin(async move { Err(Error::NotImplemented { operation, implementer }) });
            }
            Fault::PassesOverConditions => options.mode = PutMode::Overwrite,
            _ => {}
        }
        let payload = if spoils { PutPayload::from_static(b"something else") } else { payload };
        self.inner.put_opts(location, payload, options)
    }

    fn put_multipart_opts<'s, 'l, 'a>(
        &'s self,
        location: &'l Location,
        options: PutMultipartOptions,
    ) -> Answer<'a, Box<dyn MultipartUpload>>
    where
        's: 'a,
        'l: 'a,
        Self: 'a,
    {
        self.inner.put_multipart_opts(location, options)
    }

    fn get_opts<'s, 'l, 'a>(&'s self, location: &'l Location, options: GetOptions) -> Answer<'a, GetResult>
    where
        's: 'a,
        'l: 'a,
        Self: 'a,
    {
        self.inner.get_opts(location, options)
    }

    fn delete_stream(&self, locations: BoxStream<'static, Result<Location>>) -> BoxStream<'static, Result<Location>> {
        self.inner.delete_stream(locations)
    }

    fn list(&self, prefix: Option<&Location>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.inner.list(prefix)
    }

    fn list_with_delimiter<'s, 'l, 'a>(&'s self, prefix: Option<&'l Location>) -> Answer<'a, ListResult>
    where
        's: 'a,
        'l: 'a,
        Self: 'a,
    {
        self.inner.list_with_delimiter(prefix)
    }

    fn copy_opts<'s, 'f, 't, 'a>(&'s self, from: &'f Location, to: &'t Location, options: CopyOptions) -> Answer<'a, ()>
    where
        's: 'a,
        'f: 'a,
        't: 'a,
        Self: 'a,
    {
        self.inner.copy_opts(from, to, options)
    }
}

fn store(fault: Fault) -> Arc<Faulty> {
    Arc::new(Faulty { inner: InMemory::new(), fault })
}

fn url() -> BucketUrl {
    BucketUrl { bucket: "robots".to_owned(), prefix: "towers/six".to_owned() }
}

fn bucket(store: &Arc<Faulty>) -> Bucket {
    Bucket::new(&url(), Arc::clone(store) as Arc<dyn ObjectStore>).unwrap()
}

fn wait<T>(answer: impl Future<Output = Result<T>>) -> T {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(answer).unwrap()
}

/// Every object with its bytes.
fn objects(store: &Faulty) -> BTreeMap<String, Vec<u8>> {
    wait(async {
        let found: Vec<ObjectMeta> = store.inner.list(None).try_collect().await?;
        let mut objects = BTreeMap::new();
        for object in found {
            let bytes = store.inner.get(&object.location).await?.bytes().await?;
            objects.insert(object.location.to_string(), bytes.to_vec());
        }
        Ok(objects)
    })
}

fn put(store: &Faulty, name: &str, content: &'static str) {
    wait(store.inner.put(&Location::from(name), PutPayload::from_static(content.as_bytes())));
}

fn publish_to(place: &Place, store: &Arc<Faulty>) -> std::result::Result<ntp::publish::PublishSummary, PublishError> {
    publish(&place.dataset, &bucket(store), &publication(), || true)
}

/// Every file below a folder with its bytes.
fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let names = Folder::new(root).list("").unwrap();
    names.into_iter().map(|name| (format!("towers/six/{name}"), std::fs::read(root.join(&name)).unwrap())).collect()
}

#[test]
fn a_bucket_holds_what_a_folder_would_and_verifies() {
    let (place, store) = (place(), store(Fault::None));
    put(&store, "towers/sixteen/README.md", "another's");
    let summary = publish_to(&place, &store).unwrap();
    publish(&place.dataset, &Folder::new(&place.to), &publication(), || true).unwrap();
    let mut found = objects(&store);
    assert!(found.remove("towers/sixteen/README.md").is_some());
    assert_eq!(found, files(&place.to));
    let verified = verify(&bucket(&store)).unwrap();
    assert_eq!((verified.files + 1, verified.differences.len()), (summary.files, 0));
}

#[test]
fn an_interrupted_publication_goes_on_and_a_whole_one_is_left_alone() {
    let (place, store) = (place(), store(Fault::None));
    let n_asked = std::cell::Cell::new(0);
    let go_on = || n_asked.replace(n_asked.get() + 1) < 3;
    let interrupted = publish(&place.dataset, &bucket(&store), &publication(), go_on);
    assert!(matches!(interrupted, Err(PublishError::Interrupted)));
    assert!(matches!(verify(&bucket(&store)), Err(PublishError::Unpublished { .. })));
    // A process that was killed while it asked the store.
    put(&store, "towers/six/.ntp-conditional-write", "");
    let summary = publish_to(&place, &store).unwrap();
    assert_eq!(summary.kept, 3);
    let before = objects(&store);
    assert!(!before.contains_key("towers/six/.ntp-conditional-write"));
    assert_eq!(publish_to(&place, &store).unwrap().copied, 0);
    assert_eq!(objects(&store), before);
}

#[test]
fn a_store_without_conditional_writes_is_refused_before_anything_is_written() {
    for fault in [Fault::PassesOverConditions, Fault::KnowsNoConditions] {
        let (place, store) = (place(), store(fault));
        let error = publish_to(&place, &store).unwrap_err();
        assert!(matches!(error, PublishError::Store(StoreError::NoConditionalWrites { .. })), "{error}");
        assert!(error.to_string().contains("s3://robots/towers/six"), "{error}");
        assert!(objects(&store).is_empty(), "{fault:?}");
    }
}

#[test]
fn what_lies_there_is_never_overwritten() {
    let (place, foreign) = (place(), store(Fault::None));
    put(&foreign, "towers/six/mine.txt", "precious");
    let error = publish_to(&place, &foreign).unwrap_err();
    assert!(matches!(error, PublishError::Foreign { .. }), "{error}");
    assert!(error.to_string().contains("s3://robots/towers/six/mine.txt"), "{error}");
    for file in ["meta/info.json", "README.md", "SHA256SUMS"] {
        let other = store(Fault::None);
        put(&other, &format!("towers/six/{file}"), "of another publication");
        let error = publish_to(&place, &other).unwrap_err();
        assert!(matches!(error, PublishError::Differs { .. }) && error.to_string().contains(file), "{error}");
        assert_eq!(objects(&other)[&format!("towers/six/{file}")], b"of another publication");
    }
}

#[test]
fn what_a_store_spoils_is_found_by_reading_it_back_and_no_checksums_are_written() {
    let (place, store) = (place(), store(Fault::SpoilsTables));
    let error = publish_to(&place, &store).unwrap_err();
    assert!(matches!(error, PublishError::Store(StoreError::Spoiled { .. })), "{error}");
    assert!(!objects(&store).contains_key("towers/six/SHA256SUMS"));
}

#[test]
fn a_large_file_is_uploaded_in_parts_and_is_the_same() {
    let (folder, store) = (tempfile::tempdir().unwrap(), store(Fault::None));
    let bytes: Vec<u8> = (0..20_000_000_u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let source = folder.path().join("large.bin");
    std::fs::write(&source, &bytes).unwrap();
    let bucket = bucket(&store);
    bucket.copy(&source, "data/large.bin").unwrap();
    assert!(objects(&store)["towers/six/data/large.bin"] == bytes);
    assert_eq!(bucket.sha256("data/large.bin").unwrap(), Some(ntp::artifact::sha256_bytes(&bytes)));
    assert_eq!(bucket.sha256("data/small.bin").unwrap(), None);
    assert_eq!(bucket.create("data/large.bin", b"other").unwrap(), Creation::Taken);
}

#[test]
fn each_way_in_which_a_copy_in_a_bucket_differs_is_named() {
    let (place, store) = (place(), store(Fault::None));
    publish_to(&place, &store).unwrap();
    wait(store.inner.delete(&Location::from("towers/six/ntp/info.json")));
    put(&store, "towers/six/meta/info.json", "{}");
    put(&store, "towers/six/stray.txt", "hello");
    let found = verify(&bucket(&store)).unwrap().differences;
    let found: Vec<(&str, Difference)> = found.iter().map(|of| (of.path.as_str(), of.difference)).collect();
    let expected = [
        ("meta/info.json", Difference::Changed),
        ("ntp/info.json", Difference::Missing),
        ("stray.txt", Difference::Extra),
    ];
    assert_eq!(found, expected);
}

#[test]
fn conditions_are_asked_for_by_many_at_once_and_a_store_without_them_is_refused() {
    let good = store(Fault::None);
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| bucket(&good).check_conditions().unwrap());
        }
    });
    assert!(objects(&good).is_empty());
    for fault in [Fault::PassesOverConditions, Fault::KnowsNoConditions] {
        let careless = store(fault);
        let error = bucket(&careless).check_conditions().unwrap_err();
        assert!(matches!(error, StoreError::NoConditionalWrites { .. }), "{error}");
        assert!(objects(&careless).is_empty(), "{fault:?}");
    }
}

#[test]
fn files_of_a_folder_are_listed_read_together_and_brought_by_their_hashes() {
    let (folder, store) = (tempfile::tempdir().unwrap(), store(Fault::None));
    let bucket = bucket(&store);
    for (name, content) in [("a/2", "two"), ("a/1", "one"), ("ab/3", "three")] {
        assert_eq!(bucket.create(name, content.as_bytes()).unwrap(), Creation::Stored);
    }
    assert_eq!(bucket.list("a").unwrap(), ["a/1", "a/2"]);
    assert_eq!(bucket.list("").unwrap(), ["a/1", "a/2", "ab/3"]);
    assert!(bucket.list("b").unwrap().is_empty());
    let names = ["ab/3", "c", "a/1"].map(str::to_owned);
    assert_eq!(bucket.read_all(&names).unwrap(), [Some(b"three".to_vec()), None, Some(b"one".to_vec())]);
    let to = folder.path().join("below/one");
    bucket.fetch("a/1", &to, &ntp::artifact::sha256_bytes(b"one")).unwrap();
    assert_eq!(std::fs::read(&to).unwrap(), b"one");
    let error = bucket.fetch("a/2", &to, &ntp::artifact::sha256_bytes(b"one")).unwrap_err();
    assert!(matches!(error, StoreError::Spoiled { .. }) && error.to_string().contains("towers/six/a/2"), "{error}");
    assert_eq!(std::fs::read(&to).unwrap(), b"one");
    assert_eq!(std::fs::read_dir(to.parent().unwrap()).unwrap().count(), 1, "something half-written is left");
    assert!(bucket.fetch("c", &to, "").is_err());
    bucket.replace("a/1", b"other").unwrap();
    assert_eq!(bucket.read("a/1").unwrap(), Some(b"other".to_vec()));
}
