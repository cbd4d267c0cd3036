//! Numbers and paths in messages for people.

use std::fmt::{Debug, Display};
use std::path::Path;

/// A number of things in words: `1 episode`, `2 episodes`, `0 entries`.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(n: N, thing: &str) -> String {
    format!("{n} {}", noun(n, thing))
}

/// What so many things are called.
pub fn noun<N: PartialEq + From<u8>>(n: N, thing: &str) -> String {
    if n == N::from(1) { thing.to_owned() } else { plural(thing) }
}

/// Several of a thing.
pub fn plural(thing: &str) -> String {
    let ends_with = |ends: &[&str]| ends.iter().any(|end| thing.ends_with(end));
    match thing.strip_suffix('y') {
        Some(stem) if !stem.ends_with(['a', 'e', 'o', 'u']) => format!("{stem}ies"),
        _ if ends_with(&["s", "x", "ch", "sh"]) => format!("{thing}es"),
        _ => format!("{thing}s"),
    }
}

/// What is there, or that nothing is.
pub fn or_nothing<T: Debug>(found: Option<T>) -> String {
    found.map_or_else(|| "nothing".to_owned(), |found| format!("{found:?}"))
}

/// A word as a shell reads it back.
pub fn shell_word(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "/._-+=:,@%".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// A path as a shell reads it back.
pub fn shell_path(path: &Path) -> String {
    shell_word(&path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::{counted, plural, shell_word};

    #[test]
    fn one_is_one_and_all_else_are_several() {
        assert_eq!([0_u64, 1, 2].map(|n| counted(n, "episode")), ["0 episodes", "1 episode", "2 episodes"]);
        assert_eq!(
            ["entry", "day", "box", "scoping label"].map(plural),
            ["entries", "days", "boxes", "scoping labels"]
        );
    }

    #[test]
    fn words_are_quoted_where_a_shell_would_read_them_otherwise() {
        assert_eq!(shell_word("pipelines/a.toml"), "pipelines/a.toml");
        assert_eq!(shell_word("--time=1:00"), "--time=1:00");
        assert_eq!(shell_word("it's $HOME"), "'it'\\''s $HOME'");
        assert_eq!(shell_word(""), "''");
    }
}
