//! The documents: commands that the program knows, links that lead somewhere, figures that a run printed.

use std::path::{Path, PathBuf};

use clap::Parser as _;
use ntp::cli::Cli;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn text(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(Path::new(ROOT).join(path)).unwrap()
}

/// Every Markdown page for people, but for what runs printed.
fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    for folder in ["", "docs", "pipelines", "schemas", "schemas/mcap", "schemas/parquet", "data", "tests"] {
        for entry in std::fs::read_dir(Path::new(ROOT).join(folder)).unwrap() {
            let path = Path::new(folder).join(entry.unwrap().file_name());
            if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    pages.push("docs/results/README.md".into());
    pages.sort();
    pages
}

/// The commands of a page's console blocks: what stands behind `$`, without remarks.
fn commands(page: &str) -> Vec<String> {
    let blocks = page.split("```console\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix("$ "));
    lines.map(|line| line.split("  #").next().unwrap().trim().to_owned()).collect()
}

/// Words of a command line; those in double quotes are one.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (position, part) in line.split('"').enumerate() {
        if position % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

#[test]
fn every_command_in_a_document_is_one_that_the_program_knows() {
    let mut n_commands = 0;
    for page in pages() {
        for line in commands(&text(&page)) {
            let own = line.strip_prefix("ntp ").or(line.strip_prefix("cargo run --release -- "));
            let Some(arguments) = own else { continue };
            // What follows when a command fails is the shell's.
            let arguments = arguments.split(" || ").next().unwrap();
            let parsed = Cli::try_parse_from(std::iter::once("ntp".to_owned()).chain(words(arguments)));
            let is_help = parsed.as_ref().err().is_some_and(|error| error.exit_code() == 0);
            assert!(parsed.is_ok() || is_help, "{}: {line}: {}", page.display(), parsed.unwrap_err());
            for file in words(arguments).iter().filter(|word| word.starts_with("pipelines/")) {
                assert!(Path::new(ROOT).join(file).is_file(), "{}: {file} is not there", page.display());
            }
            n_commands += 1;
        }
    }
    assert!(n_commands > 40, "{n_commands}");
}

#[test]
fn every_link_of_a_document_leads_somewhere() {
    let mut n_links = 0;
    for page in pages() {
        let (folder, content) = (page.parent().unwrap(), text(&page));
        let targets = content.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for target in targets.filter(|target| !target.starts_with("http") && !target.starts_with('#')) {
            let file = target.split('#').next().unwrap();
            assert!(Path::new(ROOT).join(folder).join(file).exists(), "{}: {target} is not there", page.display());
            n_links += 1;
        }
    }
    assert!(n_links > 40, "{n_links}");
}

#[test]
fn the_front_page_is_short_and_its_commands_are_those_that_are_checked() {
    let (page, check) = (text("README.md"), text(".ci/run"));
    assert!(page.lines().count() <= 150, "{} lines", page.lines().count());
    for command in ["cargo run --release -- run pipelines/quickstart.toml", "cargo test --release"] {
        assert!(commands(&page).iter().any(|line| line == command), "{command} is not on the front page");
        assert!(check.contains(command), "{command} is not checked");
    }
    let picture = std::fs::metadata(Path::new(ROOT).join("data/pictures/rollout.gif")).unwrap();
    assert!(picture.len() < 1_500_000, "{} bytes", picture.len());
}

#[test]
fn every_figure_of_the_front_page_is_one_of_the_results() {
    let (page, results) = (text("README.md"), text("docs/results/README.md"));
    let (_, rows) = page.split_once("| figure | measured |").unwrap();
    let measured: Vec<&str> = rows.lines().skip(2).map_while(|row| row.split(" | ").nth(1)).collect();
    assert_eq!(measured.len(), 7, "{measured:?}");
    for figure in measured {
        assert!(results.contains(figure.trim_end_matches(" |")), "{figure} is not in docs/results/README.md");
    }
}

#[test]
fn rows_of_results_are_those_that_a_run_printed() {
    let results = text("docs/results/README.md");
    let mut n_rows = 0;
    for part in results.split("<!-- rows of ").skip(1) {
        let (source, rest) = part.split_once(" -->").unwrap();
        let printed = text(source);
        let rows = rest.split("<!-- end -->").next().unwrap().lines().filter(|line| line.starts_with('|'));
        for row in rows {
            assert!(printed.lines().any(|line| line == row), "not in {source}: {row}");
            n_rows += 1;
        }
    }
    assert!(n_rows > 30, "{n_rows}");
}
