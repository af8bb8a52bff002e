//! Slices through the grid of a study: two settings vary, the others have one value each.
//!
//! Figures and comparisons show a study slice by slice.

use bristle::model::parameters::Parameter;
use bristle_study::grid::{DEPTH, FORCE, OFFSET, SPEED, Setting, Study, Sweep, TOOL};
use bristle_study::input::measured::{Quantity, Speed};
use bristle_study::text::number::rounded;

/// One of the two settings that vary.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The setting.
    pub setting: Setting,
    /// Distinct values in SI units, ascending; positions of named tools. There is at least one.
    pub values: Vec<f64>,
    /// Offset in case numbers of each value from the first value of its sweep.
    offsets: Vec<usize>,
}

/// A slice through the grid of a study.
#[derive(Clone, Debug)]
pub struct Slice {
    /// The horizontal setting.
    pub x: Varied,
    /// The vertical setting.
    pub y: Varied,
    /// Swept settings with one value in this slice and other values in other slices.
    pub fixed: Vec<(Setting, f64)>,
    /// Number of the case at the first value of both sides.
    origin: usize,
}

impl Varied {
    /// Creates an axis of the study, or a setting with a single value in all cases.
    fn new(study: &Study, setting: &Setting) -> Self {
        let setting = setting.clone();
        let mut stride = study.case_count();
        for sweep in study.sweeps() {
            stride /= sweep.values().len();
            if sweep.path() == setting.path() {
                let mut sorted: Vec<(f64, usize)> = sweep
                    .values()
                    .iter()
                    .enumerate()
                    .map(|(index, &value)| (value, index * stride))
                    .collect();
                sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
                sorted.dedup_by(|next, first| next.0 == first.0);
                let (values, offsets) = sorted.into_iter().unzip();
                return Self {
                    setting,
                    values,
                    offsets,
                };
            }
        }
        Self {
            values: vec![study.value(&setting, 0)],
            setting,
            offsets: vec![0],
        }
    }

    /// Returns `true` if the setting has more than one value.
    pub fn varies(&self) -> bool {
        self.values.len() > 1
    }

    /// Returns the values in the unit for display.
    pub fn shown(&self) -> Vec<f64> {
        self.values
            .iter()
            .map(|value| value * self.setting.factor())
            .collect()
    }
}

impl Slice {
    /// Returns the position of a tool's speed along the horizontal side of a slice of
    /// [`process_slices`].
    pub fn at_speed(&self, study: &Study, speed: Speed) -> f64 {
        let quantity = if self.x.setting.path() == SPEED {
            Quantity::RotationalSpeed
        } else {
            Quantity::Velocity
        };
        if speed.quantity() == quantity {
            return speed.value();
        }
        speed
            .stated_by(quantity, &study.settings(self.case(0, 0)))
            .value()
    }

    /// Returns the number of the case at these positions along the sides.
    pub fn case(&self, x: usize, y: usize) -> usize {
        self.origin + self.x.offsets[x] + self.y.offsets[y]
    }

    /// Returns the values that distinguish this slice from the others, as text; empty if it is the
    /// only one.
    pub fn condition(&self) -> String {
        self.fixed
            .iter()
            .map(|(setting, value)| setting.equation(*value))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Returns the values that distinguish this slice from the others, as a suffix for file names.
    pub fn suffix(&self) -> String {
        let word = |setting: &Setting, value| match setting.names() {
            Some(_) => setting.file_word(value),
            None => decimal(value),
        };
        self.fixed
            .iter()
            .map(|(setting, value)| format!("_{}_{}", setting.key(), word(setting, *value)))
            .collect()
    }
}

/// Maximum characters of a number in a file name.
const MAX_NUMBER_CHARS: usize = 20;

/// Returns a number with four significant digits and without exponent, in SI units, for a file
/// name: 0.0001 next to 0.001. Only a number that would be too long has an exponent.
fn decimal(value: f64) -> String {
    let rounded = rounded(value, 4);
    let text = rounded.to_string();
    if text.len() <= MAX_NUMBER_CHARS {
        text
    } else {
        format!("{rounded:e}")
    }
}

/// Some or all of the slices of a study.
#[derive(Default)]
pub struct Slices {
    /// Chosen slices, evenly spread, at most as many as requested.
    pub chosen: Vec<Slice>,
    /// Number of all slices.
    pub total: usize,
}

/// Returns at most `limit` slices of penetration depth and brushing velocity, or rotational speed
/// if the study states that.
pub fn process_slices(study: &Study, limit: usize) -> Slices {
    let [velocity, depth] = process_settings(study);
    slices(study, &velocity, &depth, limit)
}

/// Returns at most `limit` slices of the two most informative settings: the first two that vary
/// among velocity, depth and the further sweeps, fastest first. A study of one case has none.
pub fn telling_slices(study: &Study, limit: usize) -> Slices {
    let varying = varying(study);
    if varying.is_empty() {
        return Slices::default();
    }
    // If only one setting varies, the other side shows the single value of depth or velocity.
    let [velocity, depth] = process_settings(study);
    let single = [depth, velocity]
        .into_iter()
        .filter(|setting| !Varied::new(study, setting).varies());
    let settings: Vec<Setting> = varying.into_iter().chain(single).collect();
    slices(study, &settings[0], &settings[1], limit)
}

/// Returns at most `limit` slices of the most informative setting and the named tools; none if
/// there is one tool, or if these are [`telling_slices`] already.
pub fn tool_slices(study: &Study, limit: usize) -> Slices {
    match &varying(study)[..] {
        [first, _, .., tool] if tool.path() == TOOL => slices(study, first, tool, limit),
        _ => Slices::default(),
    }
}

/// Returns the settings that vary: velocity or rotational speed, depth, then the others from the
/// fastest to the named tools.
fn varying(study: &Study) -> Vec<Setting> {
    let process = process_settings(study);
    let is_further = |setting: &Setting| process.iter().all(|other| other.path() != setting.path());
    let further = study
        .sweeps()
        .iter()
        .rev()
        .map(|sweep| sweep.setting().clone())
        .filter(is_further);
    let all: Vec<Setting> = process.iter().cloned().chain(further).collect();
    all.into_iter()
        .filter(|setting| Varied::new(study, setting).varies())
        .collect()
}

/// Returns at most `limit` slices of the offset of the workpiece and penetration depth; none if one
/// of them does not vary.
pub fn offset_slices(study: &Study, limit: usize) -> Slices {
    match [OFFSET, DEPTH].map(|path| study.sweep(path).map(Sweep::setting)) {
        [Some(x), Some(y)]
            if [x, y]
                .iter()
                .all(|setting| Varied::new(study, setting).varies()) =>
        {
            slices(study, x, y, limit)
        }
        _ => Slices::default(),
    }
}

/// Returns velocity or rotational speed, and depth or the force in its place.
fn process_settings(study: &Study) -> [Setting; 2] {
    let pressing = if study.is_pressed_on() { FORCE } else { DEPTH };
    [
        study.speed(),
        Parameter::find(pressing).expect("the table has depth and force"),
    ]
    .map(Setting::Number)
}

fn slices(study: &Study, x: &Setting, y: &Setting, limit: usize) -> Slices {
    let further = study.sweeps().iter().map(Sweep::setting);
    let further: Vec<Varied> = further
        .filter(|setting| ![x.path(), y.path()].contains(&setting.path()))
        .map(|setting| Varied::new(study, setting))
        .filter(Varied::varies)
        .collect();
    let [x, y] = [x, y].map(|setting| Varied::new(study, setting));
    let total = further.iter().map(|side| side.values.len()).product();
    let slice = |number: usize| {
        let mut slice = Slice {
            x: x.clone(),
            y: y.clone(),
            fixed: Vec::new(),
            origin: 0,
        };
        let mut stride = total;
        for side in &further {
            stride /= side.values.len();
            let position = number / stride % side.values.len();
            slice
                .fixed
                .push((side.setting.clone(), side.values[position]));
            slice.origin += side.offsets[position];
        }
        slice
    };
    Slices {
        chosen: spread(total, limit).into_iter().map(slice).collect(),
        total,
    }
}

/// Returns at most `limit` positions of `count`, evenly spread from the first to the last; the
/// middle one if `limit` is one.
pub fn spread(count: usize, limit: usize) -> Vec<usize> {
    match limit {
        _ if count <= limit => (0..count).collect(),
        1 => vec![(count - 1) / 2],
        _ => (0..limit)
            .map(|index| index * (count - 1) / (limit - 1))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{self, brush};
    use bristle_study::grid::VELOCITY;

    #[test]
    fn a_selection_keeps_first_and_last() {
        assert_eq!(spread(3, 12), [0, 1, 2]);
        assert_eq!(spread(101, 5), [0, 25, 50, 75, 100]);
        assert_eq!(spread(5, 1), [2]);
    }

    fn study(sweeps: &str) -> Study {
        let process = "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1.0e-3\n";
        testing::study(&format!("{}{process}[study]\n{sweeps}", brush!(25)))
    }

    /// Returns the value of a setting in a case.
    fn value(study: &Study, case: usize, path: &str) -> f64 {
        Parameter::find(path)
            .expect(path)
            .get(&study.settings(case))
    }

    #[test]
    fn planes_find_their_cases_whatever_the_order() {
        let study = study(
            "brushing_velocity_m_s = [20.0, 5.0, 20.0]\n\"contact.exponent\" = [1.5]\n\
             penetration_depth_m = [3e-3, 1e-3]\n\"filament.segments\" = [4, 3]",
        );
        let Slices {
            chosen: slices,
            total,
        } = process_slices(&study, 9);
        assert_eq!(total, 2);
        assert_eq!(
            slices.iter().map(Slice::condition).collect::<Vec<_>>(),
            ["segments = 3", "segments = 4"]
        );
        assert_eq!(slices[0].suffix(), "_segments_3");
        for slice in slices {
            assert_eq!(
                (&slice.x.values[..], &slice.y.values[..]),
                (&[5.0, 20.0][..], &[1e-3, 3e-3][..])
            );
            for (x, velocity) in slice.x.values.iter().enumerate() {
                for (y, depth) in slice.y.values.iter().enumerate() {
                    let case = slice.case(x, y);
                    assert_eq!(value(&study, case, VELOCITY), *velocity);
                    assert_eq!(value(&study, case, DEPTH), *depth);
                    assert_eq!(value(&study, case, "filament.segments"), slice.fixed[0].1);
                }
            }
        }
    }

    #[test]
    fn the_two_settings_that_tell_most_make_the_planes() {
        let sides = |sweeps: &str| {
            let slices = telling_slices(&study(sweeps), 9).chosen;
            slices
                .iter()
                .map(|slice| [&slice.x, &slice.y].map(|side| side.setting.word()))
                .next()
        };
        let (velocity, depth) = (
            "brushing_velocity_m_s = [5.0, 6.0]\n",
            "penetration_depth_m = [1e-3, 2e-3]\n",
        );
        let segments = "\"filament.segments\" = [3, 4]\n";
        assert_eq!(
            sides(&format!("{velocity}{depth}{segments}")),
            Some(["velocity", "depth"])
        );
        assert_eq!(sides(velocity), Some(["velocity", "depth"]));
        assert_eq!(sides(depth), Some(["depth", "velocity"]));
        assert_eq!(
            sides(&format!("{depth}{segments}")),
            Some(["depth", "segments"])
        );
        assert_eq!(sides(segments), Some(["segments", "depth"]));
        assert_eq!(sides("\"filament.segments\" = [3]\n"), None);
        let one = telling_slices(&study(segments), 1).chosen.remove(0);
        assert_eq!(one.y.setting.equation(one.y.values[0]), "a_e = 1 mm");
    }
}
