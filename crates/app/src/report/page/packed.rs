//! Numbers of a page in few bytes: packed into two each, or rounded.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use bristle_study::text::number;
use serde::Serialize;

/// Numbers as multiples of 1/65535 of their range above the smallest, a step too fine to see in a
/// drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Packed {
    least: f64,
    step: f64,
    /// Unsigned 16-bit numbers, low byte first, in Base64.
    words: String,
}

impl Packed {
    /// Packs values, which must be finite.
    pub(super) fn new(values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().collect();
        // A page has a million values: in tests, which do not optimise this crate, iterators take
        // twice as long as loops.
        let [mut least, mut largest] = [values.first().copied().unwrap_or(0.0); 2];
        for &value in &values {
            if value < least {
                least = value;
            }
            if value > largest {
                largest = value;
            }
        }
        // Divided first, so that no range overflows.
        let step = largest / f64::from(u16::MAX) - least / f64::from(u16::MAX);
        let origin = least / step - 0.5;
        let mut bytes = vec![0; 2 * values.len()];
        let (pairs, _) = bytes.as_chunks_mut();
        for (pair, &value) in pairs.iter_mut().zip(&values) {
            // Rounded. Conversion to an integer is to the nearest bound, and to zero where the step
            // is zero.
            let word = (value / step - origin) as u16;
            *pair = word.to_le_bytes();
        }
        Self {
            least,
            step,
            words: STANDARD.encode(bytes),
        }
    }
}

/// Rounds to six significant digits, one more than the page shows.
pub(super) fn rounded(value: f64) -> f64 {
    number::rounded(value, 6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_numbers_come_back_to_half_a_step() {
        let values: Vec<f64> = (0..1000)
            .map(|i| -3.0 + (f64::from(i) * 0.7).sin() * f64::from(i))
            .collect();
        let Packed { least, step, words } = Packed::new(values.clone());
        let bytes = STANDARD.decode(words).expect("base 64");
        assert_eq!(bytes.len(), 2 * values.len());
        for (pair, value) in bytes.chunks(2).zip(values) {
            let word = u16::from_le_bytes([pair[0], pair[1]]);
            // Half a step, and rounding.
            assert!((least + step * f64::from(word) - value).abs() <= 0.500_001 * step);
        }
    }

    #[test]
    fn a_constant_and_nothing_can_be_packed() {
        let constant = Packed::new([2.5, 2.5]);
        assert_eq!(
            (constant.least, constant.step, constant.words.as_str()),
            (2.5, 0.0, "AAAAAA==")
        );
        let nothing = Packed::new([]);
        assert_eq!(
            (nothing.least, nothing.step, nothing.words.as_str()),
            (0.0, 0.0, "")
        );
    }
}
