//! Observations as rows of numbers: how tables hold them and networks read them. What stands where in a row is known
//! here alone.
//!
//! # Shapes
//!
//! A row is x, y and z of each slot minus the gripper's, in metres along the world's axes, slot after slot; then the
//! gripper, (1, 0) open or (0, 1) closed. [`Observation::width`] numbers in all.

use crate::scene::SlotIndex;
use crate::trace::Observation;

/// Numbers of the gripper, at the end of a row.
const GRIPPER_WIDTH: usize = 2;

/// Observations of the same slots, one after another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservationRows {
    n_slots: usize,
    values: Vec<f32>,
}

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservationRow<'r> {
    /// Of each slot relative to the gripper.
    pub positions: &'r [[f32; 3]],
    /// (open, closed)
    pub gripper: &'r [f32],
}

/// One row, to be changed.
#[derive(Debug)]
pub struct ObservationRowMut<'r> {
    /// Of each slot relative to the gripper.
    pub positions: &'r mut [[f32; 3]],
    /// (open, closed)
    pub gripper: &'r mut [f32],
}

impl ObservationRows {
    /// Rows that are already numbers, row by row; numbers behind the last whole row are left out.
    pub fn new(n_slots: usize, mut values: Vec<f32>) -> Self {
        values.truncate(values.len() / Observation::width(n_slots) * Observation::width(n_slots));
        Self { n_slots, values }
    }

    /// Those of observations, each of so many slots.
    pub fn of<'o>(n_slots: usize, observations: impl IntoIterator<Item = &'o Observation>) -> Self {
        Self::new(n_slots, observations.into_iter().flat_map(Observation::to_flat).collect())
    }

    /// Slots of each row.
    pub fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// How many rows.
    pub fn len(&self) -> usize {
        self.values.len() / Observation::width(self.n_slots)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The same, to keep.
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }

    /// One row; nothing beyond the last.
    pub fn get(&self, row: usize) -> Option<ObservationRow<'_>> {
        let width = Observation::width(self.n_slots);
        Some(ObservationRow::new(self.values.get(row * width..)?.get(..width)?))
    }

    /// Each row.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = ObservationRow<'_>> {
        self.values.chunks_exact(Observation::width(self.n_slots)).map(ObservationRow::new)
    }

    /// Each row, to be changed.
    pub fn iter_mut(&mut self) -> impl ExactSizeIterator<Item = ObservationRowMut<'_>> {
        self.values.chunks_exact_mut(Observation::width(self.n_slots)).map(ObservationRowMut::new)
    }

    /// Adds the rows of others, which have as many slots.
    pub fn append(&mut self, other: &Self) {
        debug_assert_eq!(self.n_slots, other.n_slots, "rows of other slots");
        self.values.extend_from_slice(&other.values);
    }

    /// Adds a row of zeros, which is nobody's.
    pub fn push_nothing(&mut self) {
        self.values.extend(std::iter::repeat_n(0.0, Observation::width(self.n_slots)));
    }

    /// Some of them.
    #[must_use]
    pub fn slice(&self, rows: std::ops::Range<usize>) -> Self {
        let width = Observation::width(self.n_slots);
        Self { n_slots: self.n_slots, values: self.values[rows.start * width..rows.end * width].to_vec() }
    }
}

impl<'r> ObservationRow<'r> {
    /// A row from its numbers.
    pub fn new(values: &'r [f32]) -> Self {
        let (positions, gripper) = values.split_at(values.len().saturating_sub(GRIPPER_WIDTH));
        Self { positions: positions.as_chunks().0, gripper }
    }

    /// Where a slot is.
    pub fn position(&self, slot: SlotIndex) -> [f32; 3] {
        self.positions[usize::from(slot.0)]
    }

    /// Whether the gripper holds nothing.
    pub fn is_open(&self) -> bool {
        self.gripper.first().is_some_and(|open| *open > 0.5)
    }
}

impl<'r> ObservationRowMut<'r> {
    fn new(values: &'r mut [f32]) -> Self {
        let (positions, gripper) = values.split_at_mut(values.len().saturating_sub(GRIPPER_WIDTH));
        Self { positions: positions.as_chunks_mut().0, gripper }
    }

    /// To be looked at.
    pub fn as_row(&self) -> ObservationRow<'_> {
        ObservationRow { positions: self.positions, gripper: self.gripper }
    }
}

#[cfg(test)]
mod tests {
    use super::ObservationRows;
    use crate::scene::SlotIndex;
    use crate::trace::Observation;

    #[test]
    fn a_row_has_positions_slot_by_slot_and_then_the_gripper() {
        let open = Observation { slots_m: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], closed: false };
        let closed = Observation { closed: true, ..open.clone() };
        let mut rows = ObservationRows::of(2, [&open, &closed]);
        assert_eq!(rows.values()[..8], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1.0, 0.0]);
        assert_eq!((rows.len(), rows.get(1).unwrap().position(SlotIndex(1))), (2, [4.0, 5.0, 6.0]));
        assert_eq!(rows.iter().map(|row| row.is_open()).collect::<Vec<_>>(), [true, false]);
        rows.iter_mut().for_each(|row| row.positions[0][2] = 9.0);
        assert_eq!(rows.slice(1..2).values(), [1.0, 2.0, 9.0, 4.0, 5.0, 6.0, 0.0, 1.0]);
        assert_eq!(rows.get(2), None);
    }
}
