//! Coefficients of friction of abrasive filaments on workpieces, for files that do not state
//! theirs, and advice about this doubt.
//!
//! No measured coefficients of such filaments were found. Each range is a guess, as wide as the
//! values found for similar pairs.

use crate::text::layout::wrap;
use crate::text::number::short;

/// Path of the setting.
pub const FRICTION: &str = "contact.friction_coefficient";

/// Word that `bristle explain` answers with advice about friction.
pub const TOPIC: &str = "friction";

/// Remedy for the doubt about a coefficient that is not stated.
pub(crate) const REMEDY: &str = "Measured forces remove this doubt: name them in [measured], or drag the brush (docs/trust.md).";

/// Abrasive polyamide filaments on a workpiece.
#[derive(Debug)]
pub struct Pairing {
    /// Material of the workpiece.
    pub workpiece: &'static str,
    /// `"dry"` or `"wet"`: with water, coolant or oil.
    pub condition: &'static str,
    /// Least and the largest coefficient to expect.
    pub range: [f64; 2],
    /// Source of the range.
    pub source: &'static str,
}

/// All pairings, by workpiece.
pub const PAIRINGS: &[Pairing] = &[
    Pairing {
        workpiece: "steel",
        condition: "dry",
        range: [0.2, 0.6],
        source: "a guess about plain polyamide on steel: 0.3 (PTC, Windchill Risk and Reliability, friction coefficients), 0.4 \
                 (Engineering ToolBox, friction coefficients). Grains that cut can have more",
    },
    Pairing {
        workpiece: "steel",
        condition: "wet",
        range: [0.05, 0.4],
        source: "a guess: a lubricant carries polyamide; grains that cut reach through it",
    },
    Pairing {
        workpiece: "ceramic",
        condition: "dry",
        range: [0.1, 0.6],
        source: "a guess: as on steel, or less where hard grains slide without cutting, as diamond does on metal with 0.1 to 0.15 \
                 (Engineering ToolBox)",
    },
    Pairing {
        workpiece: "ceramic",
        condition: "wet",
        range: [0.05, 0.4],
        source: "a guess: as on wet steel",
    },
    Pairing {
        workpiece: "wood",
        condition: "dry",
        range: [0.2, 0.7],
        source: "a guess about metal on dry wood: 0.2 to 0.6 (Engineering ToolBox). Grains that cut can have more",
    },
    Pairing {
        workpiece: "wood",
        condition: "wet",
        range: [0.1, 0.6],
        source: "a guess about metal on wet wood: 0.2 (Engineering ToolBox)",
    },
    Pairing {
        workpiece: "aluminium",
        condition: "dry",
        range: [0.2, 0.6],
        source: "a guess: as on steel",
    },
    Pairing {
        workpiece: "aluminium",
        condition: "wet",
        range: [0.05, 0.4],
        source: "a guess: as on wet steel",
    },
    Pairing {
        workpiece: "plastic",
        condition: "dry",
        range: [0.1, 0.6],
        source: "a guess about polymers on themselves: 0.04 to 0.67 (CRC Materials Science and Engineering Handbook, 2001, \
                 table 399). Grains that cut can have more",
    },
    Pairing {
        workpiece: "plastic",
        condition: "wet",
        range: [0.05, 0.4],
        source: "a guess: as on wet steel",
    },
    Pairing {
        workpiece: "other",
        condition: "dry",
        range: [0.1, 0.7],
        source: "all of the above",
    },
    Pairing {
        workpiece: "other",
        condition: "wet",
        range: [0.05, 0.6],
        source: "all of the above",
    },
];

/// Abrasive filaments on dry metal, where nobody names the workpiece.
pub const USUAL: &Pairing = &PAIRINGS[0];

impl Pairing {
    /// Returns the pairing with a workpiece, which is wet or dry.
    #[must_use]
    pub fn find(workpiece: &str, is_wet: bool) -> Option<&'static Self> {
        let condition = if is_wet { "wet" } else { "dry" };
        PAIRINGS
            .iter()
            .find(|pairing| pairing.workpiece == workpiece && pairing.condition == condition)
    }

    /// Returns the names of all workpieces.
    #[must_use]
    pub fn workpieces() -> Vec<&'static str> {
        PAIRINGS
            .chunk_by(|one, next| one.workpiece == next.workpiece)
            .map(|pairings| pairings[0].workpiece)
            .collect()
    }

    /// Returns the middle of the range.
    #[must_use]
    pub fn middle(&self) -> f64 {
        f64::midpoint(self.range[0], self.range[1])
    }

    /// Returns the standard deviation of a normal distribution of which the range contains 95 %.
    #[must_use]
    pub fn std(&self) -> f64 {
        (self.range[1] - self.range[0]) / 4.0
    }

    /// Returns the range in words, as in "0.2 to 0.6".
    #[must_use]
    pub fn range_text(&self) -> String {
        let [least, largest] = self.range.map(short);
        format!("{least} to {largest}")
    }
}

/// Returns the least and the largest coefficient of all pairings.
#[must_use]
pub fn range_of_all() -> [f64; 2] {
    PAIRINGS.iter().fold(
        [f64::INFINITY, 0.0],
        |[least, largest], Pairing { range, .. }| [range[0].min(least), range[1].max(largest)],
    )
}

/// Returns the advice about friction that a file does not state, in lines of at most `width`
/// columns.
#[must_use]
pub fn friction_advice(width: usize) -> String {
    let [least, largest] = range_of_all().map(short);
    let mut text = String::new();
    let doubt = format!(
        "Friction is the largest doubt about a force. A file that does not state {FRICTION} has none, as in the paper: its forces are \
         upper bounds. Abrasive filaments may have {least} to {largest}:"
    );
    wrap(width, &mut text, "", &doubt);
    text.push_str(&pairing_list(width));
    wrap(width, &mut text, "", REMEDY);
    text
}

/// Lists all pairings with their sources, in lines of at most `width` columns.
pub(crate) fn pairing_list(width: usize) -> String {
    let mut text = String::new();
    for pairing in PAIRINGS {
        let Pairing {
            workpiece,
            condition,
            source,
            ..
        } = pairing;
        wrap(
            width,
            &mut text,
            &format!("  {workpiece:9} {condition}  {:13}", pairing.range_text()),
            source,
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairings_have_ranges_and_sources() {
        for Pairing {
            workpiece,
            condition,
            range: [least, largest],
            source,
        } in PAIRINGS
        {
            assert!(
                (0.0..*largest).contains(least) && !source.is_empty(),
                "{workpiece}, {condition}"
            );
        }
        assert_eq!(range_of_all(), [0.05, 0.7]);
        for workpiece in Pairing::workpieces() {
            let [dry, wet] =
                [false, true].map(|is_wet| Pairing::find(workpiece, is_wet).expect(workpiece));
            assert!(wet.middle() < dry.middle(), "{workpiece}");
        }
        assert_eq!(USUAL.middle(), 0.4);
        assert!((USUAL.std() - 0.1).abs() < 1e-15);
    }
}
