//! Recordings of robots: rows, episodes and pictures are those of the messages, and every message is accounted for.

mod fuzz;
mod messages;
mod recover;

use std::path::{Path, PathBuf};

use arrow::array::{AsArray as _, RecordBatch};
use arrow::datatypes::{Float32Type, Int64Type};
use ntp::ingest::{IngestError, IngestSummary, Map, TopicCounts, ingest, propose};
use ntp::video::{Mp4Reader, decode_png};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::{Value, json};

use crate::pipeline::run;
use messages::{Bag, base64, joint_state_cdr, jpeg, png, video};

const MS: u64 = 1_000_000;

/// A recording and the dataset that a map makes of it.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new(bags: &[Bag]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (number, bag) in bags.iter().enumerate() {
            bag.write(&folder.path().join(format!("bag-{number}.mcap")));
        }
        Self { folder }
    }

    fn files(&self) -> Vec<PathBuf> {
        (0..).map(|number| self.path(&format!("bag-{number}.mcap"))).take_while(|path| path.exists()).collect()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    #[expect(clippy::result_large_err, reason = "tests look at the error")]
    fn ingest(&self, map: &str) -> Result<IngestSummary, IngestError> {
        let path = self.path("map.toml");
        std::fs::write(&path, map).unwrap();
        let to = self.path("dataset");
        if to.exists() {
            std::fs::remove_dir_all(&to).unwrap();
        }
        ingest(&self.files(), &Map::read(&path)?, &to)
    }

    fn rows(&self) -> RecordBatch {
        table(&self.path("dataset/data/chunk-000/file-000.parquet"))
    }

    fn episodes(&self) -> RecordBatch {
        table(&self.path("dataset/meta/episodes/chunk-000/file-000.parquet"))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.path("dataset").join(name)).unwrap()).unwrap()
    }
}

fn table(path: &Path) -> RecordBatch {
    let file = std::fs::File::open(path).unwrap();
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let schema = builder.schema().clone();
    let batches: Vec<RecordBatch> = builder.build().unwrap().map(Result::unwrap).collect();
    arrow::compute::concat_batches(&schema, &batches).unwrap()
}

fn floats(rows: &RecordBatch, name: &str) -> Vec<f32> {
    let column = rows.column_by_name(name).unwrap();
    let values = column.as_fixed_size_list_opt().map_or(column, |list| list.values());
    values.as_primitive::<Float32Type>().values().to_vec()
}

fn numbers(rows: &RecordBatch, name: &str) -> Vec<i64> {
    rows.column_by_name(name).unwrap().as_primitive::<Int64Type>().values().to_vec()
}

const HEAD: &str = "fps = 10\ntask = \"lift\"\n";

/// One joint that says its own time in seconds, every 40 ms, for a second.
fn clock_like() -> Bag {
    let mut bag = Bag::default();
    for step in 0..=25 {
        bag.json("/joint", step * 40 * MS, json!({ "position": [step as f64 * 0.04, 1.0] }));
    }
    bag
}

fn joint_map(matching: &str) -> String {
    format!(
        "{HEAD}[[feature]]\nname = \"observation.state\"\nmatch = \"{matching}\"\nmax_age_secs = 0.1\n\
         from = [{{ topic = \"/joint\", field = \"position\" }}]\n"
    )
}

#[test]
fn a_row_takes_the_message_before_the_nearest_or_what_lies_between() {
    let case = Case::new(&[clock_like()]);
    // Rows are at 0, 0.1, …, 1.0; messages at 0, 0.04, 0.08, 0.12, …
    let expected: [(&str, [f32; 4]); 3] =
        [("last", [0.0, 0.08, 0.2, 0.28]), ("nearest", [0.0, 0.08, 0.2, 0.28]), ("linear", [0.0, 0.1, 0.2, 0.3])];
    for (matching, values) in expected {
        let summary = case.ingest(&joint_map(matching)).unwrap();
        assert_eq!((summary.episodes, summary.frames, summary.cut, summary.tasks), (1, 11, 0, 1), "{matching}");
        let found: Vec<f32> = floats(&case.rows(), "observation.state").chunks(2).map(|row| row[0]).collect();
        for (found, value) in found.iter().zip(values) {
            assert!((found - value).abs() < 1e-6, "{matching}: {found} is not {value}");
        }
    }
    let timestamps: Vec<f32> = (0..11).map(|row| row as f32 / 10.0).collect();
    assert_eq!(floats(&case.rows(), "timestamp"), timestamps);
    assert_eq!(numbers(&case.rows(), "index"), (0..11).collect::<Vec<_>>());
    let info = case.json("meta/info.json");
    assert_eq!(info["features"]["observation.state"]["shape"], json!([2]));
    assert_eq!(
        (&info["total_frames"], &info["fps"], &info["codebase_version"]),
        (&json!(11), &json!(10), &json!("v3.0"))
    );
    let stats = case.json("meta/stats.json");
    assert!((stats["observation.state"]["mean"][0].as_f64().unwrap() - 0.5).abs() < 1e-6);
}

#[test]
fn messages_are_counted_by_what_became_of_them() {
    let case = Case::new(&[clock_like()]);
    let summary = case.ingest(&joint_map("last")).unwrap();
    let expected = TopicCounts { messages: 26, dropped: 15, ..TopicCounts::default() };
    assert_eq!(summary.topics["/joint"], expected);

    let mut bag = clock_like();
    // 0.5 s late is put in order; 0.9 s late finds its row written; the last two have no number.
    bag.json_at(20, "/joint", 300 * MS + 1, json!({ "position": [9.0, 1.0] }));
    bag.json_at(27, "/joint", 10 * MS, json!({ "position": [9.0, 1.0] }));
    bag.json("/joint", 1000 * MS, json!({ "velocity": [1.0] }));
    bag.json("/joint", 1000 * MS, json!({ "position": [1.0] }));
    let case = Case::new(&[bag]);
    let summary = case.ingest(&joint_map("last")).unwrap();
    let counts = summary.topics["/joint"];
    assert_eq!((counts.messages, counts.out_of_order, counts.late, counts.unusable), (30, 1, 1, 2));
    assert!(summary.why_unusable["/joint"].starts_with("the first at 1.000 s: it has no \"position\""), "{summary:?}");
    // Nothing is rounded to be of another type.
    let whole =
        joint_map("last").replace("name = \"observation.state\"", "name = \"observation.state\"\ndtype = \"int64\"");
    assert!(whole.contains("int64"), "{whole}");
    let summary = case.ingest(&whole).unwrap();
    assert_eq!(summary.topics["/joint"].unusable, 26);
    let why = "the first at 0.040 s: \"position\" holds 0.04, which is none of the dtype that the map asks for";
    assert_eq!(summary.why_unusable["/joint"], why);
    let error = case.ingest(&whole.replace("\"last\"", "\"linear\"")).unwrap_err().to_string();
    assert!(error.contains("between whole numbers there is no line"), "{error}");
    let error = case.ingest(&joint_map("last").replace("fps = 10", "fps = 29.97")).unwrap_err().to_string();
    assert!(error.contains("fps is 29.97; it is a whole number from 1 to 1000"), "{error}");
}

#[test]
fn an_episode_ends_where_a_feature_has_nothing_young_enough() {
    let mut bag = Bag::default();
    for step in (0..10).chain(20..30) {
        bag.json("/joint", step * 100 * MS, json!({ "position": [step, 1] }));
    }
    let case = Case::new(&[bag]);
    let summary = case.ingest(&joint_map("last")).unwrap();
    // The row at 1.0 s still has the message of 0.9 s, which is 0.1 s old.
    assert_eq!((summary.episodes, summary.frames, summary.cut), (2, 21, 1));
    assert_eq!(numbers(&case.episodes(), "length"), [11, 10]);
    assert_eq!(numbers(&case.episodes(), "dataset_from_index"), [0, 11]);
    assert_eq!(numbers(&case.rows(), "frame_index")[11], 0);
    assert_eq!(floats(&case.rows(), "observation.state")[2 * 11], 20.0);
    assert_eq!(summary.topics["/joint"].repeated, 1);
}

#[test]
fn episodes_are_files_or_between_markers_or_gaps() {
    let mut marked = clock_like();
    for (at, value) in [(200, true), (500, false), (700, true), (900, false)] {
        marked.json("/recording", at * MS, json!({ "data": value }));
    }
    marked.sort();
    let marker = "[episodes]\nby = \"marker\"\ntopic = \"/recording\"\nfield = \"data\"\nstart = true\nend = false\n";
    let only_marked = Case::new(&[marked]);
    let with = |episodes: &str| joint_map("last").replace("[[feature]]", &format!("{episodes}[[feature]]"));
    let lengths = |case: &Case| numbers(&case.episodes(), "length");

    let case = Case::new(&[clock_like(), clock_like()]);
    case.ingest(&joint_map("last")).unwrap();
    assert_eq!(lengths(&case), [11, 11]);
    // From 0.2 s up to 0.5 s, and from 0.7 s up to 0.9 s.
    let summary = only_marked.ingest(&with(marker)).unwrap();
    assert_eq!((lengths(&only_marked), summary.empty), (vec![3, 2], 0));

    let mut bag = Bag::default();
    for step in (0..10).chain(30..40) {
        bag.json("/joint", step * 100 * MS, json!({ "position": [step, 1] }));
    }
    let gaps = Case::new(&[bag]);
    let summary = gaps.ingest(&with("[episodes]\nby = \"gap\"\ntopic = \"/joint\"\nsecs = 0.5\n")).unwrap();
    assert_eq!((lengths(&gaps), summary.cut), (vec![10, 10], 0));
}

#[test]
fn the_tasks_text_is_what_its_topic_says_last() {
    let mut bag = clock_like();
    bag.json_at(0, "/task", 0, json!({ "data": "pour" }));
    let case = Case::new(&[bag, clock_like()]);
    let map = joint_map("last").replace("task = \"lift\"", "task = { topic = \"/task\", field = \"data\" }");
    let error = case.ingest(&map).unwrap_err();
    assert!(error.to_string().starts_with("no text on topic /task before the episode at 0.000 s"), "{error}");
    std::fs::remove_file(case.path("bag-1.mcap")).unwrap();
    case.ingest(&map).unwrap();
    let tasks = case.episodes().column_by_name("tasks").unwrap().as_list::<i32>().value(0);
    assert_eq!(tasks.as_string::<i32>().value(0), "pour");
}

#[test]
fn joints_are_picked_by_name_and_several_topics_make_one_feature() {
    let mut bag = Bag::default();
    for step in 0..5_u64 {
        let at = step * 100 * MS;
        bag.ros2("/joint_states", at, joint_state_cdr(at, &[("b", 2.0), ("a", step as f64)]));
        bag.json("/gripper", at, json!({ "data": 0.5 }));
        // Neither is a row's: one has no number, the other lacks a joint.
        bag.ros2("/joint_states", at, joint_state_cdr(at, &[("a", f64::NAN), ("b", 2.0)]));
        bag.ros2("/joint_states", at, joint_state_cdr(at, &[("a", 9.0)]));
    }
    let case = Case::new(&[bag]);
    let map = format!(
        "clock = \"header\"\n{HEAD}[[feature]]\nname = \"action\"\nfrom = [\n\
         {{ topic = \"/joint_states\", field = \"position\", joints = [\"a\", \"b\"] }},\n\
         {{ topic = \"/gripper\", field = \"data\" }},\n]\n"
    );
    let summary = case.ingest(&map).unwrap();
    assert_eq!((summary.frames, summary.topics["/joint_states"].unusable), (5, 10));
    assert_eq!(floats(&case.rows(), "action")[3..6], [1.0, 2.0, 0.5]);
    assert_eq!(case.json("meta/info.json")["features"]["action"]["names"], json!(["a", "b", "value"]));
}

#[test]
fn encoded_pictures_stay_as_they_are_and_raw_ones_become_png() {
    let mut bag = Bag::default();
    for step in 0..4_u64 {
        let at = step * 100 * MS;
        bag.json("/jpeg", at, json!({ "format": "jpeg", "data": base64(&jpeg(step as u8)) }));
        let raw: Vec<u8> = (0..8 * 6).flat_map(|_| [10, 20, step as u8]).collect();
        let picture = json!({ "width": 8, "height": 6, "encoding": "bgr8", "step": 24, "data": base64(&raw) });
        bag.json("/raw", at, picture);
    }
    let case = Case::new(&[bag]);
    let feature =
        |name: &str| format!("[[feature]]\nname = \"observation.images.{name}\"\nfrom = [{{ topic = \"/{name}\" }}]\n");
    case.ingest(&format!("{HEAD}{}{}", feature("jpeg"), feature("raw"))).unwrap();
    let rows = case.rows();
    let bytes = |name: &str, row: usize| {
        let pictures = rows.column_by_name(name).unwrap().as_struct().column_by_name("bytes").unwrap().clone();
        pictures.as_binary::<i32>().value(row).to_vec()
    };
    for step in 0..4 {
        assert_eq!(bytes("observation.images.jpeg", step), jpeg(step as u8));
        let picture = decode_png(&bytes("observation.images.raw", step)).unwrap();
        assert_eq!((picture.size_px, &picture.bytes[..3]), ([8, 6], &[step as u8, 20, 10][..]));
    }
    let info = case.json("meta/info.json");
    assert_eq!(info["features"]["observation.images.raw"]["shape"], json!([6, 8, 3]));
    let mean = case.json("meta/stats.json")["observation.images.raw"]["mean"][1][0][0].as_f64().unwrap();
    assert!((mean - 20.0 / 255.0).abs() < 1e-9);
    assert_eq!(propose(&case.files()[0]).unwrap().matches("observation.images.").count(), 2);
    assert_eq!(png(&[0; 12], [2, 2])[..4], *b"\x89PNG");
}

/// 20 pictures of a video at 10 Hz with a key frame every 8.
fn filmed() -> (Bag, Vec<Vec<u8>>) {
    let packets = video(20, 8);
    let mut bag = Bag::default();
    for (step, packet) in packets.iter().enumerate() {
        let at = step as u64 * 100 * MS;
        bag.json("/joint", at, json!({ "position": [step, 1] }));
        bag.json("/video", at, json!({ "format": "h264", "data": base64(packet) }));
    }
    (bag, packets)
}

const VIDEO: &str = "[[feature]]\nname = \"observation.images.front\"\nfrom = [{ topic = \"/video\" }]\n";
const MP4: &str = "dataset/videos/observation.images.front/chunk-000/file-000.mp4";

#[test]
fn packets_of_a_video_are_carried_over_and_shown_at_the_times_of_their_rows() {
    let (mut bag, packets) = filmed();
    // An episode from 0.5 s to 1.0 s, another from 1.1 s on: neither begins at a key frame.
    for (at, value) in [(500, 1), (1000, 0), (1100, 1)] {
        bag.json("/episode", at * MS, json!({ "data": value }));
    }
    bag.sort();
    let case = Case::new(&[bag]);
    let marker = "[episodes]\nby = \"marker\"\ntopic = \"/episode\"\nfield = \"data\"\nstart = 1\nend = 0\n";
    let map = format!("{}{VIDEO}", joint_map("last").replace("[[feature]]", &format!("{marker}[[feature]]")));
    let summary = case.ingest(&map).unwrap();
    assert_eq!(summary.episodes, 2);
    let episodes = case.episodes();
    let seconds = |name: &str| {
        let name = format!("videos/observation.images.front/{name}");
        let column = episodes.column_by_name(&name).unwrap().as_primitive::<arrow::datatypes::Float64Type>();
        column.values().to_vec()
    };
    // Five packets before the first row, from the key frame at 0; three before the second episode's, from that at 0.8 s.
    assert_eq!(seconds("from_timestamp"), [0.5, 1.3]);
    assert_eq!(seconds("to_timestamp"), [1.0, 2.2]);
    let mut mp4 = Mp4Reader::open(&case.path(MP4)).unwrap();
    let order: Vec<usize> = (0..10).chain(8..20).collect();
    assert_eq!(mp4.samples().len(), order.len());
    let states: Vec<f32> = floats(&case.rows(), "observation.state").chunks(2).map(|row| row[0]).collect();
    let mut packet = Vec::new();
    for (sample, &source) in order.iter().enumerate() {
        mp4.read(sample, &mut packet).unwrap();
        assert!(packet.ends_with(&packets[source][packets[source].len() / 2..]), "sample {sample} is packet {source}");
        assert!((mp4.samples()[sample].seconds - sample as f64 / 10.0).abs() < 1e-4);
    }
    // The picture at a row's time is the one of its state.
    let times = (0..5).map(|row| 0.5 + row as f64 / 10.0).chain((0..9).map(|row| 1.3 + row as f64 / 10.0));
    for (time, state) in times.zip(&states) {
        let sample = mp4.samples().iter().position(|sample| (sample.seconds - time).abs() < 1e-4).unwrap();
        assert_eq!(order[sample] as f32, *state, "at {time}");
    }
}

#[test]
fn pictures_between_rows_are_kept_in_the_video_and_shown_by_none() {
    let (bag, packets) = filmed();
    let case = Case::new(&[bag]);
    let summary = case.ingest(&format!("{}{VIDEO}", joint_map("last").replace("fps = 10", "fps = 5"))).unwrap();
    assert_eq!((summary.frames, summary.topics["/video"].dropped), (10, 10));
    let mp4 = Mp4Reader::open(&case.path(MP4)).unwrap();
    // Without those that no row needs: the last, and the two before key frames that rows show.
    assert_eq!(mp4.samples().len(), packets.len() - 3);
    for time in (0..10).map(|row| row as f64 / 5.0) {
        assert!(mp4.samples().iter().any(|sample| (sample.seconds - time).abs() < 1e-4), "at {time}");
    }
}

#[test]
fn a_picture_is_not_shown_twice_unless_it_is_encoded_again() {
    let (bag, _) = filmed();
    let case = Case::new(&[bag]);
    let map = format!("{}{VIDEO}", joint_map("last").replace("fps = 10", "fps = 20"));
    let error = case.ingest(&map).unwrap_err();
    assert!(matches!(&error, IngestError::Repeated { secs, .. } if (secs - 0.05).abs() < 1e-9), "{error}");
    assert!(!case.path("dataset").exists());
    let summary = case.ingest(&format!("{map}store = \"h264\"\n")).unwrap();
    // Rows at 0, 0.05, …, 1.9; every other one shows the picture before.
    assert_eq!((summary.frames, summary.topics["/video"].repeated), (39, 19));
    assert_eq!(Mp4Reader::open(&case.path(MP4)).unwrap().samples().len(), 39);
    case.ingest(&format!("{map}store = \"png\"\n")).unwrap();
    assert_eq!(case.json("meta/info.json")["features"]["observation.images.front"]["dtype"], "image");
}

#[test]
fn what_a_map_names_and_a_file_lacks_is_told_with_what_there_is() {
    let case = Case::new(&[clock_like()]);
    let refused = |map: &str| case.ingest(map).unwrap_err().to_string();
    let error = refused(&joint_map("last").replace("\"/joint\"", "\"/joints\""));
    assert!(
        error.starts_with("feature observation.state: no usable message of topic /joints; topics are /joint: "),
        "{error}"
    );
    let error = refused(&joint_map("last").replace("\"position\"", "\"positions\""));
    assert!(error.contains("of topic /joint: it has no \"positions\"; it has position; topics"), "{error}");
    let error = refused(&joint_map("last").replace("fps = 10", "fps = 0"));
    assert!(error.ends_with("map.toml: fps is 0; it is 1 to 1000"), "{error}");
    let error = refused(&joint_map("last").replace("max_age_secs", "max_age"));
    assert!(error.contains("unknown field `max_age`"), "{error}");
    let pose = "{ topic = \"/tf\", field = \"transforms[child_frame_id={}].translation\" }";
    let slots = |names: &str| {
        let settings =
            format!("slots = {names}\ngripper = {pose}\nopening = {pose}\nclosed_below_m = 0.06\nobjects = {pose}");
        refused(&format!("{}\n[observations]\n{settings}\n", joint_map("last").replace("observation.state", "other")))
    };
    let error = slots("[\"cup\", \"mug\", \"cup\"]");
    assert!(error.ends_with("observations.slots: \"cup\" stands twice"), "{error}");
    let error = slots("[\"cup\", \"\"]");
    assert!(error.contains("observations.slots: a name is empty"), "{error}");
    let twice = [case.files(), case.files()].concat();
    std::fs::write(case.path("map.toml"), joint_map("last")).unwrap();
    let error =
        ingest(&twice, &Map::read(&case.path("map.toml")).unwrap(), &case.path("dataset")).unwrap_err().to_string();
    assert!(error.contains("it is given twice: ") && error.ends_with("bag-0.mcap"), "{error}");
    let error = refused(&joint_map("last").replace("observation.state", "timestamp"));
    assert!(error.contains("is none of timestamp, frame_index"), "{error}");

    let mut bag = Bag::default();
    bag.other("/joint", "ros1", "ros1msg");
    let case = Case::new(&[bag]);
    let error = case.ingest(&joint_map("last")).unwrap_err().to_string();
    assert!(
        error.contains("\"ros1\" with a schema in \"ros1msg\"; read are cdr with ros2msg, protobuf, and json"),
        "{error}"
    );
}

#[test]
fn bytes_do_not_depend_on_threads_and_a_proposed_map_can_be_used() {
    let (bag, _) = filmed();
    let case = Case::new(&[bag]);
    let text = |path: PathBuf| path.to_string_lossy().into_owned();
    let file = text(case.path("bag-0.mcap"));
    let (code, map, stderr) = run(&["ingest", &file, "--propose"]);
    assert_eq!(code, 0, "{stderr}");
    std::fs::write(case.path("map.toml"), &map).unwrap();
    let map = text(case.path("map.toml"));
    let mut made = Vec::new();
    for jobs in ["1", "4"] {
        let to = case.path(&format!("made-{jobs}"));
        let (code, stdout, stderr) = run(&["ingest", &file, "--map", &map, "--to", &text(to.clone()), "--jobs", jobs]);
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.starts_with("1 episode, 20 frames in "), "{stdout}");
        made.push(messages::files(&to));
    }
    assert!(made[0] == made[1] && made[0].len() == 6, "{:?}", made[0].keys());
    let (code, _, stderr) = run(&["ingest", &file]);
    assert_eq!((code, stderr.contains("--map and --to are needed")), (2, true));
}

/// A joint every 10 ms for two seconds, and topics with few messages.
fn with_few() -> Bag {
    let mut bag = Bag::default();
    for step in 0..200 {
        bag.json("/joint", step * 10 * MS, json!({ "position": [step, 1] }));
    }
    for (at, value) in [(200, true), (900, false), (1200, true), (1700, false)] {
        bag.json("/record", at * MS, json!({ "data": value }));
        bag.json("/gripper/closed", at * MS, json!({ "data": value }));
        bag.json("/battery", at * MS, json!({ "volts": 12.5 }));
        bag.json("/overview", at * MS, json!({ "format": "jpeg", "data": base64(&jpeg(7)) }));
    }
    bag.json("/task", 0, json!({ "data": "pour \"tea\"" }));
    bag.sort();
    bag
}

#[test]
fn topics_with_few_messages_bound_episodes_and_are_no_features() {
    let case = Case::new(&[with_few()]);
    let map = propose(&case.files()[0]).unwrap();
    let marker = "[episodes]\nby = \"marker\"\ntopic = \"/record\"\nfield = \"data\"\nstart = true\nend = false\n";
    assert!(map.contains(marker), "{map}");
    assert_eq!((map.matches("[[feature]]").count(), map.contains("fps = 100\n")), (1, true), "{map}");
    for told in [
        "# /gripper/closed (, 4 messages): too few for rows; as bounds of episodes: by = \"marker\", \
         topic = \"/gripper/closed\", field = \"data\", start = true, end = false\n",
        "# /battery (, 4 messages): too few for rows, which take messages of up to 1 s before; max_age_secs",
        "# /overview (, 4 messages): too few",
        "# /task (, 1 message): too few for rows; as bounds of episodes: by = \"marker\", topic = \"/task\", \
         field = \"data\", start = 'pour \"tea\"' or the task: task = { topic = \"/task\", field = \"data\" }\n",
    ] {
        assert!(map.contains(told), "{told} is not in\n{map}");
    }
    let summary = case.ingest(&map).unwrap();
    // From 0.2 s up to 0.9 s, and from 1.2 s up to 1.7 s, at 100 Hz.
    assert_eq!((summary.cut, numbers(&case.episodes(), "length")), (0, vec![70, 50]));
}

#[test]
fn messages_without_a_stamp_are_told_where_the_clock_is_that_of_stamps() {
    let mut bag = clock_like();
    let stamp = json!({ "sec": 0, "nanosec": 500_000_000 });
    bag.json("/joint", 1040 * MS, json!({ "header": { "stamp": stamp }, "position": [7.0, 1.0] }));
    let case = Case::new(&[bag]);
    let log = case.ingest(&joint_map("last")).unwrap();
    assert_eq!((log.without_stamp.len(), log.lines().len()), (0, 1));
    let map = format!("clock = \"header\"\n{}", joint_map("last"));
    let summary = case.ingest(&map).unwrap();
    assert_eq!(summary.without_stamp["/joint"], 26);
    std::fs::remove_dir_all(case.path("dataset")).unwrap();
    let [file, map, to] =
        ["bag-0.mcap", "map.toml", "dataset"].map(|name| case.path(name).to_string_lossy().into_owned());
    let (code, stdout, stderr) = run(&["ingest", &file, "--map", &map, "--to", &to]);
    assert!(code == 0 || code == 3, "{stderr}");
    assert!(stdout.contains("/joint: 26 messages without a stamp, taken when recorded"), "{stdout}");
}

#[test]
fn other_readers_open_the_dataset() {
    let (bag, _) = filmed();
    let case = Case::new(&[bag]);
    case.ingest(&format!("{}{VIDEO}", joint_map("last"))).unwrap();
    let opened = crate::lerobot::open(&case.path("dataset"));
    assert_eq!((opened.episode_frames, opened.tasks), (vec![20], vec!["lift".to_owned()]));
    assert!(opened.features.contains("observation.images.front"));
}

/// Cut anywhere, or with bytes changed: an error, or a dataset of what was sound; never a panic, never a partial folder.
#[test]
fn damaged_recordings_are_refused_by_name() {
    let (bag, _) = filmed();
    let case = Case::new(&[bag]);
    let whole = std::fs::read(&case.files()[0]).unwrap();
    let map = format!("{}{VIDEO}", joint_map("last"));
    for at in (0..whole.len()).step_by(1 + whole.len() / 40) {
        std::fs::write(case.path("bag-0.mcap"), &whole[..at]).unwrap();
        assert!(case.ingest(&map).is_err() && !case.path("dataset").exists(), "cut at {at}");
        let mut changed = whole.clone();
        changed[at] ^= 0x20;
        std::fs::write(case.path("bag-0.mcap"), &changed).unwrap();
        assert!(case.ingest(&map).is_err() && !case.path("dataset").exists(), "changed at {at}");
    }
}
