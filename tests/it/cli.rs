//! The process boundary: streams, exit codes, help.

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
