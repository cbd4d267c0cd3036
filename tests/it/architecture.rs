//! The layers: what may use what, and that the map is true.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The modules in reading order: each may use those before it and none after it. `rollout` and `trace` use the task's
/// types; `task` names no later module.
const ORDER: &[&str] = &[
    "words",
    "date",
    "process",
    "feature",
    "geometry",
    "seed",
    "arm",
    "scene",
    "program",
    "artifact",
    "store",
    "table",
    "progress",
    "task",
    "trace",
    "render",
    "video",
    "perception",
    "robot",
    "sim",
    "remote",
    "expert",
    "recording",
    "dataset",
    "ingest",
    "model",
    "training",
    "rollout",
    "annotate",
    "deploy",
    "visualize",
    "report",
    "query",
    "pipeline",
    "cluster",
    "lineage",
    "publish",
    "cli",
];

/// Crates that only these modules may use.
const OWNERS: [(&str, &[&str]); 11] = [
    ("rapier3d", &["sim"]),
    ("burn", &["model", "training", "rollout/learned"]),
    ("mcap", &["recording"]),
    ("re_ros_msg", &["ingest"]),
    ("prost_reflect", &["ingest"]),
    ("rerun", &["visualize"]),
    ("polars", &["report", "query"]),
    ("arrow", &["table", "dataset"]),
    ("parquet", &["table", "dataset"]),
    ("object_store", &["store/bucket"]),
    ("tokio", &["store/bucket"]),
];

fn source_files() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    let mut folders: Vec<PathBuf> = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
                files.push((name, std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

fn module_of(name: &str) -> &str {
    name.split('/').next().unwrap().trim_end_matches(".rs")
}

/// Words behind `crate::` in code, not in comments.
fn used_modules(text: &str) -> Vec<String> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let mut modules = Vec::new();
    for line in code {
        for rest in line.split("crate::").skip(1) {
            let names = match rest.strip_prefix('{') {
                Some(group) => group.split(',').map(str::trim).collect(),
                None => vec![rest],
            };
            let word =
                |name: &str| name.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect::<String>();
            modules.extend(names.into_iter().map(word).filter(|word| !word.is_empty()));
        }
    }
    modules
}

#[test]
fn no_module_uses_a_later_one() {
    let place: BTreeMap<&str, usize> = ORDER.iter().enumerate().map(|(place, module)| (*module, place)).collect();
    let mut wrong = Vec::new();
    for (name, text) in source_files() {
        let Some(own) = place.get(module_of(&name)) else { continue };
        for used in used_modules(&text) {
            if place.get(used.as_str()).is_some_and(|used_place| used_place > own) {
                wrong.push(format!("{name} uses {used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The rooms of `dataset` in reading order: each may use those before it and none after it.
const DATASET_ORDER: &[&str] = &[
    "config",
    "files",
    "tables",
    "schema",
    "statistics",
    "pictures",
    "plain",
    "write",
    "read",
    "validate",
    "edit",
    "export",
    "labelled",
    "import",
    "relabel",
];

/// What a file of `dataset` uses of it: the paths behind `crate::dataset::`, without names of types.
fn used_rooms(text: &str) -> Vec<String> {
    let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let code = code.join("\n");
    let mut used = Vec::new();
    for rest in code.split("crate::dataset::").skip(1) {
        let is_path = |c: &char| c.is_ascii_lowercase() || *c == '_' || *c == ':';
        let path: String = rest.chars().take_while(is_path).collect();
        let group = rest[path.len()..].strip_prefix('{').and_then(|group| Some(group.split_once('}')?.0));
        let names = group.into_iter().flat_map(|group| group.split(',')).map(str::trim);
        used.push(path.trim_end_matches(':').to_owned());
        used.extend(names.map(|name| format!("{path}{}", name.split(' ').next().unwrap_or_default())));
    }
    used
}

#[test]
fn no_room_of_the_dataset_uses_a_later_one() {
    let place = |room: &str| DATASET_ORDER.iter().position(|known| *known == room);
    let mut wrong = Vec::new();
    for (name, text) in source_files() {
        let Some(own) = name.strip_prefix("dataset/") else { continue };
        let own = place(module_of(own)).unwrap_or_else(|| panic!("{name} is missing from the order"));
        for used in used_rooms(&text) {
            if place(used.split("::").next().unwrap_or_default()).is_some_and(|used| used > own) {
                wrong.push(format!("{name} uses {used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_files_of_the_dataset_use_each_other_in_no_circle() {
    let files: BTreeMap<String, String> = source_files().into_iter().collect();
    let file_of = |path: &str| {
        let parts: Vec<&str> = path.split("::").collect();
        let candidates = (1..=parts.len()).rev().map(|n| format!("dataset/{}.rs", parts[..n].join("/")));
        candidates.into_iter().find(|file| files.contains_key(file))
    };
    let mut left: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (name, text) in files.iter().filter(|(name, _)| name.starts_with("dataset/")) {
        let used = used_rooms(text).iter().filter_map(|path| file_of(path)).filter(|used| used != name).collect();
        left.insert(name, used);
    }
    assert!(left.len() > 80);
    while !left.is_empty() {
        let leaves: Vec<&str> = left
            .iter()
            .filter(|(_, used)| used.iter().all(|of| !left.contains_key(of.as_str())))
            .map(|(of, _)| *of)
            .collect();
        assert!(!leaves.is_empty(), "in a circle, or used by one: {:#?}", left.keys());
        leaves.iter().for_each(|leaf| drop(left.remove(leaf)));
    }
}

#[test]
fn every_module_has_its_place_in_the_order_and_in_the_map() {
    let map = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    for (name, _) in source_files() {
        let module = module_of(&name);
        let is_edge = ["lib", "main", "commands"].contains(&module);
        assert!(is_edge || ORDER.contains(&module), "{module} is missing from the order");
        assert!(module == "lib" || map.contains(&format!("`{module}`")), "{module} is missing from ARCHITECTURE.md");
    }
}

#[test]
fn each_heavy_crate_is_used_in_its_own_module_alone() {
    let mut wrong = Vec::new();
    for (name, text) in source_files() {
        for (owned, owners) in OWNERS {
            let path = format!("{owned}::");
            let uses = text.lines().filter(|line| !line.trim_start().starts_with("//")).any(|line| {
                line.match_indices(&path).any(|(at, _)| {
                    let before = line[..at].chars().next_back();
                    !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
                })
            });
            let inside = owners
                .iter()
                .any(|owner| name.trim_end_matches(".rs") == *owner || name.starts_with(&format!("{owner}/")));
            if uses && !inside {
                wrong.push(format!("{name} uses {owned}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_file_begins_by_saying_what_it_is() {
    for (name, text) in source_files() {
        assert!(text.starts_with("//! "), "{name} does not begin with a //! line");
    }
}

#[test]
fn no_folder_has_a_mod_rs() {
    for (name, _) in source_files() {
        assert!(!name.ends_with("mod.rs"), "{name}");
    }
}

#[test]
fn library_code_reads_no_clock_but_for_progress_and_cpu_time() {
    for (name, text) in source_files() {
        let reads = ["Instant::now", "SystemTime::now"].iter().any(|clock| text.contains(clock));
        assert!(!reads || name.starts_with("progress"), "{name} reads a clock");
    }
}

#[test]
fn which_family_a_task_is_of_is_asked_in_the_families_own_files_alone() {
    let mut wrong = Vec::new();
    for (name, text) in source_files() {
        if name == "program.rs" || name == "task/family.rs" || name.starts_with("task/family/") {
            continue;
        }
        for family in ntp::task::Family::ALL {
            let names = [format!("Family::{family:?}"), format!("Program::{:?}", family.root_program())];
            wrong.extend(names.iter().filter(|word| text.contains(*word)).map(|word| format!("{name} names {word}")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
