//! States as words of eight bytes, which keep every bit.
//!
//! A record lists its numbers and its counts once, as places: the writer reads those of a copy, and the reader fills them.

use super::gmres;
use crate::equations::{LANES, Lanewise};

/// A state that is being written.
#[derive(Clone, Debug, Default)]
pub struct Writer(Vec<u8>);

impl Writer {
    /// Adds a number.
    pub fn number(&mut self, value: f64) {
        self.0.extend(value.to_le_bytes());
    }

    /// Adds a count.
    pub fn count(&mut self, value: usize) {
        self.0.extend((value as u64).to_le_bytes());
    }

    /// Adds a number of single precision.
    pub fn single(&mut self, value: f32) {
        self.0.extend(value.to_le_bytes());
    }

    /// Adds the blocks of some segments, lane by lane.
    pub fn blocks(&mut self, blocks: &gmres::GroupPart) {
        blocks.iter().flatten().for_each(|value| (0..LANES).for_each(|lane| self.number(value.lane(lane))));
    }

    /// Adds the numbers of a record, of which these belong to a copy.
    pub fn numbers<'a>(&mut self, values: impl IntoIterator<Item = &'a mut f64>) {
        values.into_iter().for_each(|value| self.number(*value));
    }

    /// Adds the counts of a record, of which these belong to a copy.
    pub fn counts<'a>(&mut self, values: impl IntoIterator<Item = &'a mut usize>) {
        values.into_iter().for_each(|value| self.count(*value));
    }

    /// What was written.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

/// A state that is being read. Each read is `None` at its end.
#[derive(Clone, Debug)]
pub struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    /// The next number.
    pub fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    /// The next count.
    pub fn count(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.take()?)).ok()
    }

    /// The next number of single precision.
    pub fn single(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// Sets the blocks of some segments to the next numbers.
    pub fn blocks(&mut self, blocks: &mut gmres::GroupPart) -> Option<()> {
        for value in blocks.iter_mut().flatten() {
            for lane in 0..LANES {
                value.set_lane(lane, self.number()?);
            }
        }
        Some(())
    }

    /// Sets the numbers of a record to the next ones.
    pub fn numbers<'a>(&mut self, values: impl IntoIterator<Item = &'a mut f64>) -> Option<()> {
        values.into_iter().try_for_each(|value| self.number().map(|number| *value = number))
    }

    /// Sets the counts of a record to the next ones.
    pub fn counts<'a>(&mut self, values: impl IntoIterator<Item = &'a mut usize>) -> Option<()> {
        values.into_iter().try_for_each(|value| self.count().map(|count| *value = count))
    }
}
