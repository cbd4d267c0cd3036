//! How many labels must be put in, left out or changed to make one sequence of another.

/// The distance of Levenshtein.
pub(super) fn edit_distance<T: PartialEq>(a: &[T], b: &[T]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (at, a) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], at + 1);
        for (of, b) in b.iter().enumerate() {
            let changed = diagonal + usize::from(a != b);
            diagonal = row[of + 1];
            row[of + 1] = changed.min(diagonal + 1).min(row[of] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::edit_distance;

    #[test]
    fn known_distances() {
        assert_eq!(edit_distance(b"kitten", b"sitting"), 3);
        assert_eq!(edit_distance(b"", b"abc"), 3);
        assert_eq!(edit_distance(b"abc", b"abc"), 0);
    }
}
