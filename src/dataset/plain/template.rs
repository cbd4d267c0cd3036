//! Path templates as `meta/info.json` has them: `data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet`.

/// What a name stands for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Word<'w> {
    Number(u32),
    Text(&'w str),
}

/// Fills in a template; `None` where it names something unknown or cannot be understood.
pub(super) fn fill(template: &str, words: &[(&str, Word<'_>)]) -> Option<String> {
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, behind)) = rest.split_once('{') {
        let (inside, behind) = behind.split_once('}')?;
        let (name, format) = inside.split_once(':').unwrap_or((inside, ""));
        let (_, word) = words.iter().find(|(known, _)| *known == name)?;
        filled.push_str(before);
        filled.push_str(&formatted(*word, format)?);
        rest = behind;
    }
    filled.push_str(rest);
    Some(filled)
}

/// Python's `03d` for numbers, and nothing for texts.
fn formatted(word: Word<'_>, format: &str) -> Option<String> {
    match word {
        Word::Text(text) if format.is_empty() => Some(text.to_owned()),
        Word::Number(number) if format.is_empty() => Some(number.to_string()),
        Word::Number(number) => {
            let width: usize = format.strip_suffix('d')?.parse().ok().filter(|width| *width <= 20)?;
            Some(if format.starts_with('0') { format!("{number:0width$}") } else { format!("{number:width$}") })
        }
        Word::Text(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Word, fill};

    #[test]
    fn numbers_are_padded_and_texts_stand_as_they_are() {
        let words = [("key", Word::Text("a.b")), ("chunk", Word::Number(7)), ("file", Word::Number(1234))];
        let filled = fill("videos/{key}/chunk-{chunk:03d}/file-{file:03d}-{chunk}.mp4", &words);
        assert_eq!(filled.as_deref(), Some("videos/a.b/chunk-007/file-1234-7.mp4"));
        for wrong in ["{other}", "{chunk:3x}", "{key:03d}", "{chunk", "{chunk:0999d}"] {
            assert_eq!(fill(wrong, &words), None, "{wrong}");
        }
    }
}
