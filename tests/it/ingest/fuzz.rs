//! Damaged recordings and maps: none stops the program, leaves a folder behind, or is taken for whole.

use ntp::ingest::propose;

use super::messages::{Bag, base64, files, joint_state_cdr, jpeg};
use super::{Case, MS, joint_map};
use crate::fuzz::change::{changed, changes, changes_of_text};
use crate::fuzz::run;
use serde_json::json;

const MAP_OF_ALL: &str = "[[feature]]\nname = \"observation.joints\"\n\
    from = [{ topic = \"/joint_states\", field = \"position\", joints = [\"b\", \"a\"] }]\n\
    [[feature]]\nname = \"observation.images.front\"\nfrom = [{ topic = \"/camera\" }]\n\
    [episodes]\nby = \"marker\"\ntopic = \"/record\"\nfield = \"data\"\nstart = 1\nend = 0\n";

/// Numbers, joints of ROS 2, pictures and a marker, for a second.
fn recording() -> Case {
    let mut bag = Bag::default();
    for step in 0..10_u64 {
        let at = step * 100 * MS;
        bag.json("/joint", at, json!({ "position": [step, 1] }));
        bag.ros2("/joint_states", at, joint_state_cdr(at, &[("a", step as f64), ("b", 2.0)]));
        bag.json("/camera", at, json!({ "format": "jpeg", "data": base64(&jpeg(step as u8)) }));
        bag.json("/record", at, json!({ "data": u8::from(step < 8) }));
    }
    Case::new(&[bag])
}

#[test]
fn fuzz_recordings_of_others() {
    let case = recording();
    let map = format!("{}{MAP_OF_ALL}", joint_map("last"));
    assert!(case.ingest(&map).unwrap().episodes > 0);
    let made = files(&case.path("dataset"));
    let path = case.path("bag-0.mcap");
    let whole = std::fs::read(&path).unwrap();
    run(100, &changes(), |changes| {
        std::fs::write(&path, changed(&whole, &changes)).unwrap();
        let _proposed = propose(&path);
        match case.ingest(&map) {
            Ok(_) => assert!(files(&case.path("dataset")) == made, "a damaged recording was taken for whole"),
            Err(_) => assert!(!case.path("dataset").exists(), "a folder was left behind"),
        }
    });
}

#[test]
fn fuzz_maps() {
    let case = recording();
    let map = format!("{}{MAP_OF_ALL}", joint_map("interpolated"));
    run(50, &changes_of_text(), |changes| {
        let Ok(map) = String::from_utf8(changed(map.as_bytes(), &changes)) else { return };
        let made = case.ingest(&map).is_ok();
        assert_eq!(case.path("dataset").exists(), made, "{map}");
    });
}
