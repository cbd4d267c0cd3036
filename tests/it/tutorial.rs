//! The tutorial, followed word by word in an empty directory.

use std::path::Path;
use std::process::Command;

/// The text between a fence of this kind and its end, for each such block.
pub(crate) fn blocks<'t>(page: &'t str, kind: &str) -> Vec<&'t str> {
    let fence = format!("```{kind}\n");
    page.split(fence.as_str()).skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

/// Does every command of a page in an empty directory, in which the page's pipeline is saved; all must succeed.
#[track_caller]
pub(crate) fn follow(page: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let [pipeline] = blocks(page, "toml")[..] else { panic!("one pipeline is to be saved") };
    std::fs::write(folder.path().join("towers.toml"), pipeline).unwrap();
    follow_commands(page, folder.path());
    folder
}

/// Does every command of a page in a directory; all must succeed.
#[track_caller]
pub(crate) fn follow_commands(page: &str, folder: &Path) {
    let binary = Path::new(env!("CARGO_BIN_EXE_ntp")).parent().unwrap().to_string_lossy().into_owned();
    let commands: Vec<&str> = blocks(page, "console").into_iter().flat_map(str::lines).collect();
    for command in commands.iter().filter_map(|line| line.strip_prefix("$ ")) {
        let line = format!("PATH={binary}:$PATH; {command}");
        let output = Command::new("sh").args(["-c", &line]).current_dir(folder).output().unwrap();
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{command}: {:?}\n{stdout}\n{stderr}", output.status.code());
    }
    assert!(commands.len() > 5);
}

#[test]
fn every_command_of_the_tutorial_does_what_it_says_in_an_empty_directory() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tutorial.md")).unwrap();
    let folder = follow(&page);
    for made in ["demonstrations.rrd", "rollout.rrd", "towers/croissant.json", "run/report/index.html"] {
        assert!(folder.path().join(made).is_file(), "{made} is not there");
    }
}
