//! The process boundary: streams, exit codes, help.

use std::path::Path;

use assert_cmd::Command;

use crate::smoke;

fn ntp() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ntp"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

#[test]
fn help_names_every_command_and_the_exit_codes() {
    let output = ntp().arg("--help").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    insta::assert_snapshot!(text);
}

#[test]
fn a_stage_that_does_not_exist_is_refused_with_those_that_do() {
    let output = ntp().args(["run", "pipelines/smoke.toml", "--from", "bake"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("bake") && text.contains("generate"), "{text}");
}

#[test]
fn a_folder_is_made_behind_a_link_and_in_place_of_the_current_one_but_not_within_what_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    ntp().args(["run", "pipelines/smoke.toml", "--to", "convert", "--out"]).arg(&out).assert().success();
    let dataset = out.join("dataset");
    let [target, link, here] = ["target", "link", "here"].map(|name| folder.path().join(name));
    std::fs::create_dir(&target).unwrap();
    std::fs::create_dir(&here).unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    let filter = |to: &std::path::Path| {
        let mut command = ntp();
        command
            .current_dir(&here)
            .args(["dataset", "filter"])
            .arg(&dataset)
            .args(["--min-frames", "1", "--to"])
            .arg(to);
        command.output().unwrap()
    };
    for (to, made) in [(link.as_path(), &target), (std::path::Path::new("."), &here)] {
        let output = filter(to);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        ntp().arg("validate").arg(made).assert().success();
    }
    let within = filter(&dataset.join("videos/new"));
    assert_eq!(within.status.code(), Some(2));
    assert!(String::from_utf8(within.stderr).unwrap().contains("which is read; choose a folder elsewhere"));
    assert!(!dataset.join("videos/new").exists() && link.is_symlink());
}

#[test]
fn something_that_is_nothing_of_ours_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = ntp().arg("inspect").arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("dataset (meta/info.json)"), "{text}");
}

#[test]
fn replay_without_a_purpose_says_what_to_choose() {
    let out = smoke::whole();
    let output = ntp().arg("replay").arg(out.join("recordings")).args(["--episode", "0"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("--save FILE.rrd"));
    let output =
        ntp().arg("replay").arg(out.join("recordings")).args(["--episode", "99", "--verify"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("no episode 99 among the 9"));
}

/// Exit code and what was said on stderr.
fn said(command: &mut Command) -> (Option<i32>, String) {
    let output = command.output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn episodes_are_named_alike_by_every_command() {
    let out = smoke::whole();
    let recordings = out.join("recordings");
    let verified = |option: &str, ranges: &str| {
        let output = ntp().arg("replay").arg(&recordings).args([option, ranges, "--verify"]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let lines = String::from_utf8(output.stdout).unwrap();
        lines.lines().map(|line| line.split(' ').nth(1).unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(verified("--episode", "2-4,0"), ["2", "3", "4", "0"]);
    assert_eq!(verified("--episodes", "8"), ["8"]);
    let (code, text) = said(ntp().arg("replay").arg(&recordings).args(["--episode", "7-9", "--verify"]));
    assert!(code == Some(1) && text.contains("no episode 9 among the 9"), "{text}");
    let (code, text) = said(ntp().arg("replay").arg(&recordings).args(["--episode", "4-2", "--verify"]));
    assert!(code == Some(2) && text.contains("\"4-2\" is no range of episodes such as 0-9, or 12"), "{text}");
    let (code, text) = said(ntp().arg("render").arg(&recordings).args(["--episode", "0-3", "--png", "x.png"]));
    assert!(code == Some(2) && text.contains("\"0-3\" is not the number of one episode, such as 3"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    let filter = ntp()
        .args(["dataset", "filter", "--episode", "1-2"])
        .arg(out.join("dataset"))
        .arg("--to")
        .arg(folder.path().join("two"))
        .output()
        .unwrap();
    let told = String::from_utf8(filter.stdout).unwrap();
    assert!(told.contains("two: 2 episodes, 7 left out, "), "{told}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_stdout_is_told() {
    let out = smoke::whole();
    for arguments in
        [&["query", "dataset", "SELECT program FROM calls"][..], &["inspect", "dataset"], &["completions", "bash"]]
    {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_ntp"));
        let output = command.args(arguments).current_dir(out).stdout(full).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert_eq!(text, "ntp: failed to write to stdout: No space left on device (os error 28)\n");
    }
}

#[cfg(unix)]
#[test]
fn a_file_takes_the_place_of_a_file_alone_and_of_none_that_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    smoke::copy_folder(smoke::whole(), &run);
    let path = |name: &str| folder.path().join(name);
    let query = |to: &Path| {
        said(ntp().arg("query").arg(run.join("dataset")).args(["SELECT program FROM calls", "--parquet"]).arg(to))
    };
    // A link, so that a fault costs a link and not the device.
    std::os::unix::fs::symlink("/dev/null", path("null")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
    std::fs::create_dir(path("taken")).unwrap();
    for (name, found) in [("null", "a device"), ("pipe", "a pipe"), ("taken", "a folder")] {
        let (code, text) = query(&path(name));
        let told =
            format!("cannot write {}: it is {found}; allowed: a new name, or the name of a file", path(name).display());
        assert!(code == Some(1) && text.contains(&told), "{text}");
        assert!(std::fs::metadata(path(name)).unwrap().file_type() != std::fs::metadata(file!()).unwrap().file_type());
    }
    assert!(path("null").is_symlink());
    // What has the name of a result goes, behind a link too, and the link stays.
    std::fs::write(path("old"), "old").unwrap();
    std::os::unix::fs::symlink(path("old"), path("link")).unwrap();
    assert_eq!(query(&path("link")).0, Some(0));
    assert!(path("link").is_symlink() && std::fs::read(path("old")).unwrap().starts_with(b"PAR1"));
    let frames = run.join("dataset/data/chunk-000/file-000.parquet");
    let before = std::fs::read(&frames).unwrap();
    let (code, text) = query(&frames);
    assert!(code == Some(2) && text.contains("is read; choose another name"), "{text}");
    assert!(std::fs::read(&frames).unwrap() == before);
    let recordings = run.join("recordings");
    let shard = recordings.join("shard-00000-of-00003.mcap");
    for (command, option) in [("render", "--png"), ("render", "--mp4"), ("render", "--gif"), ("replay", "--save")] {
        let arguments = ["--episode", "0", option];
        let (code, text) = said(ntp().arg(command).arg(&recordings).args(arguments).arg(&shard));
        assert!(code == Some(2) && text.contains(&format!("{option} {}", shard.display())), "{text}");
    }
    let (code, text) = said(
        ntp().args(["dataset", "filter", "--min-frames", "1"]).arg(run.join("dataset")).arg("--to").arg(path("old")),
    );
    assert!(code == Some(1) && text.contains("only a new or empty folder is written, but"), "{text}");
    assert!(text.contains("is no folder"), "{text}");
}

#[test]
fn a_stage_by_itself_says_what_it_reads_that_is_stale() {
    let folder = smoke::copy_to("report");
    let pipeline = folder.path().join("changed pipeline.toml");
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(smoke::PIPELINE)).unwrap();
    let report = |text: &str| {
        std::fs::write(&pipeline, text).unwrap();
        said(ntp().arg("report").arg(&pipeline).arg("--out").arg(folder.path()))
    };
    let (code, told) = report(&text);
    assert!(code == Some(0) && told.contains("report: up to date") && !told.contains("stale"), "{told}");
    let changed = text.replacen("trials_per_task = ", "trials_per_task = 1", 1);
    assert_ne!(changed, text);
    let (code, told) = report(&changed);
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("stale: generate: its setting episodes changed\n"), "{told}");
    let again = format!(
        "report takes it as it is; ntp run '{}' --out {} makes it anew",
        pipeline.display(),
        folder.path().display()
    );
    assert!(told.contains(&again), "{told}");
}

#[test]
fn completions_are_printed_for_a_shell() {
    let output = ntp().args(["completions", "bash"]).output().unwrap();
    assert!(String::from_utf8(output.stdout).unwrap().contains("_ntp()"));
}

#[test]
fn inspect_says_what_each_part_of_a_run_is() {
    let out = smoke::whole();
    let kind = |part: &str| {
        let output = ntp().arg("inspect").arg(out.join(part)).arg("--json").output().unwrap();
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        value["kind"].as_str().unwrap().to_owned()
    };
    let parts = [
        ("", "run"),
        ("tasks", "tasks"),
        ("recordings", "recordings"),
        ("recordings/shard-00000-of-00003.mcap", "recording"),
        ("dataset", "dataset"),
        ("models/ntp-seed0", "model"),
        ("rollouts/oracle/stacking_unseen", "rollouts"),
        ("report", "report"),
    ];
    for (part, expected) in parts {
        assert_eq!(kind(part), expected, "{part}");
    }
}

#[cfg(unix)]
#[test]
fn what_cannot_be_carried_on_ends_at_the_first_interrupt_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = smoke::whole();
    let clips = folder.path().join("clips");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_ntp"))
        .args(["render", "--episode", "0", "--size", "1920x1080", "--fps", "60"])
        .arg(out.join("recordings"))
        .arg("--mp4")
        .arg(clips.join("long.mp4"))
        .spawn()
        .unwrap();
    let has_begun = || std::fs::read_dir(&clips).is_ok_and(|mut entries| entries.next().is_some());
    while !has_begun() {
        assert!(child.try_wait().unwrap().is_none(), "ended before it was interrupted");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let interrupt = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!has_begun(), "something is left");
}
