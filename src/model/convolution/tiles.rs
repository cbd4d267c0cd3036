//! Which numbers of a picture a patch is made of, and in which portions patches are worked on.

use std::ops::Range;

/// Most numbers of a tile: they stay in a core's second cache.
const TILE: usize = 1 << 17;

/// Sizes of a convolution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry {
    /// Pictures, height, width, channels.
    pub(crate) pictures: [usize; 4],
    /// Pixels across and down a patch.
    pub(crate) kernel: usize,
    /// Pixels from one patch to the next.
    pub(crate) stride: usize,
    /// Pixels of zeros around a picture.
    pub(crate) padding: usize,
}

/// A line of a patch: where it lies in the patch, which part of it lies in the picture, and where.
struct Line {
    whole: Range<usize>,
    inside: Range<usize>,
    from: usize,
}

impl Geometry {
    /// Rows and columns of an output.
    pub(super) fn outputs(&self) -> [usize; 2] {
        let [_, height, width, _] = self.pictures;
        [height, width].map(|size| (size + 2 * self.padding).saturating_sub(self.kernel) / self.stride + 1)
    }

    /// How many pictures.
    pub(super) fn n_pictures(&self) -> usize {
        self.pictures[0]
    }

    /// Numbers of a picture.
    pub(super) fn picture_len(&self) -> usize {
        self.pictures[1..].iter().product()
    }

    /// Numbers of a patch.
    pub(super) fn patch_len(&self) -> usize {
        self.kernel * self.kernel * self.pictures[3]
    }

    /// How many whole pictures are worked on by one thread at a time.
    pub(super) fn chunk(&self) -> usize {
        let [rows, columns] = self.outputs();
        (TILE / (rows * columns * self.patch_len()).max(1)).max(1)
    }

    /// Rows of outputs, counted through `n_pictures`, in portions that fit the cache.
    pub(super) fn tiles(&self, n_pictures: usize) -> impl Iterator<Item = Range<usize>> {
        let [rows, columns] = self.outputs();
        let (n_rows, portion) = (n_pictures * rows, (TILE / (columns * self.patch_len()).max(1)).max(1));
        (0..n_rows).step_by(portion).map(move |first| first..(first + portion).min(n_rows))
    }

    /// Copies the patches of rows out of pictures.
    pub(super) fn gather(&self, pictures: &[f32], rows: Range<usize>, patches: &mut [f32]) {
        for (patch, origin) in patches.chunks_exact_mut(self.patch_len()).zip(self.origins(rows)) {
            for Line { whole, inside, from } in self.lines(origin) {
                let n = inside.len();
                patch[whole.start..inside.start].fill(0.0);
                patch[inside.end..whole.end].fill(0.0);
                patch[inside].copy_from_slice(&pictures[from..from + n]);
            }
        }
    }

    /// Adds the patches of rows to pictures.
    pub(super) fn scatter(&self, patches: &[f32], rows: Range<usize>, pictures: &mut [f32]) {
        for (patch, origin) in patches.chunks_exact(self.patch_len()).zip(self.origins(rows)) {
            for Line { inside, from, .. } in self.lines(origin) {
                let to = &mut pictures[from..from + inside.len()];
                to.iter_mut().zip(&patch[inside]).for_each(|(sum, value)| *sum += value);
            }
        }
    }

    /// Picture, row and column of the first pixel of each patch, counted in the padded picture.
    fn origins(&self, rows: Range<usize>) -> impl Iterator<Item = [usize; 3]> {
        let ([n_rows, n_columns], stride) = (self.outputs(), self.stride);
        rows.flat_map(move |row| {
            (0..n_columns).map(move |column| [row / n_rows, row % n_rows * stride, column * stride])
        })
    }

    fn lines(&self, [picture, row, column]: [usize; 3]) -> impl Iterator<Item = Line> {
        let &Self { pictures: [_, height, width, channels], kernel, padding, .. } = self;
        let first = padding.saturating_sub(column).min(kernel);
        let last = (width + padding).saturating_sub(column).clamp(first, kernel);
        (0..kernel).map(move |line| {
            let start = line * kernel * channels;
            let whole = start..start + kernel * channels;
            match (row + line).checked_sub(padding).filter(|row| *row < height) {
                Some(row) => Line {
                    whole,
                    inside: start + first * channels..start + last * channels,
                    from: ((picture * height + row) * width + column + first - padding) * channels,
                },
                None => Line { inside: whole.end..whole.end, whole, from: 0 },
            }
        })
    }
}
