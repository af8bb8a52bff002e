//! Slices through the grid of a study: two settings vary, the others have one value each.
//!
//! Figures and comparisons show a study slice by slice.

use crate::measured::Speed;
use crate::study::{DEPTH, SPEED, Study, VELOCITY};
use crate::text::number::short;
use bristle::model::parameters::Parameter;

/// The path of the setting that says where the workpiece is.
const OFFSET: &str = "workpiece.offset_m";

/// One of the two settings that vary.
#[derive(Clone, Debug)]
pub struct Side {
    /// The setting.
    pub parameter: &'static Parameter,
    /// The distinct values in SI units, ascending. There is at least one.
    pub values: Vec<f64>,
    /// Offset in case numbers of each value from the first value of its sweep.
    offsets: Vec<usize>,
}

/// A slice.
#[derive(Clone, Debug)]
pub struct Slice {
    /// The horizontal setting.
    pub x: Side,
    /// The vertical setting.
    pub y: Side,
    /// The swept settings that have one value in this slice and other values in other slices.
    pub fixed: Vec<(&'static Parameter, f64)>,
    /// Number of the case at the first value of both sides.
    origin: usize,
}

impl Side {
    /// A swept setting, or one that has the same value in all cases.
    fn new(study: &Study, parameter: &'static Parameter) -> Self {
        let mut stride = study.case_count();
        for sweep in study.sweeps() {
            stride /= sweep.values().len();
            if sweep.parameter().path == parameter.path {
                let mut sorted: Vec<(f64, usize)> =
                    sweep.values().iter().enumerate().map(|(index, &value)| (value, index * stride)).collect();
                sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
                sorted.dedup_by(|next, first| next.0 == first.0);
                let (values, offsets) = sorted.into_iter().unzip();
                return Self { parameter, values, offsets };
            }
        }
        Self { parameter, values: vec![parameter.get(study.base())], offsets: vec![0] }
    }

    /// Whether the setting has more than one value.
    pub fn varies(&self) -> bool {
        self.values.len() > 1
    }

    /// Symbol or key, without the unit.
    pub fn symbol(&self) -> &'static str {
        symbol(self.parameter)
    }

    /// A short word for file names.
    pub fn word(&self) -> &'static str {
        match self.parameter.path {
            VELOCITY => "velocity",
            SPEED => "speed",
            DEPTH => "depth",
            OFFSET => "offset",
            _ => self.parameter.key(),
        }
    }

    /// The full name with its unit, for an axis.
    pub fn label(&self) -> String {
        match self.parameter.path {
            VELOCITY => "brushing velocity v_b in m/s".to_owned(),
            SPEED => "rotational speed n_w in rpm".to_owned(),
            DEPTH => "penetration depth a_e in mm".to_owned(),
            OFFSET => "offset of the workpiece in mm".to_owned(),
            path if self.parameter.unit.is_empty() => path.to_owned(),
            path => format!("{path} in {}", self.parameter.unit),
        }
    }

    /// From SI to the unit of the label.
    pub fn factor(&self) -> f64 {
        factor(self.parameter)
    }

    /// The values in the unit of the label.
    pub fn shown(&self) -> Vec<f64> {
        self.values.iter().map(|value| value * self.factor()).collect()
    }
}

/// Symbol or key of a setting.
fn symbol(parameter: &'static Parameter) -> &'static str {
    match parameter.path {
        VELOCITY => "v_b",
        SPEED => "n_w",
        DEPTH => "a_e",
        OFFSET => "offset",
        _ => parameter.key(),
    }
}

/// Whether a setting is shown in mm.
fn is_in_mm(parameter: &Parameter) -> bool {
    [DEPTH, OFFSET].contains(&parameter.path)
}

/// From SI to the unit in which a setting is shown.
fn factor(parameter: &Parameter) -> f64 {
    if is_in_mm(parameter) { 1e3 } else { 1.0 }
}

/// A setting and its value, as in `v_b = 10 m/s`.
pub fn equation(parameter: &'static Parameter, value: f64) -> String {
    let number = short(value * factor(parameter));
    let unit = if is_in_mm(parameter) { "mm" } else { parameter.unit };
    format!("{} = {number} {unit}", symbol(parameter)).trim_end().to_owned()
}

impl Slice {
    /// Where the speed of a tool lies along the horizontal side of a slice of [`process_slices`].
    pub fn at_speed(&self, study: &Study, speed: Speed) -> f64 {
        let is_rotational = self.x.parameter.path == SPEED;
        let settings = || study.settings(self.case(0, 0));
        match speed {
            Speed::Velocity(velocity) if is_rotational => {
                let mut settings = settings();
                settings.process.brushing_velocity_m_s = velocity;
                settings.rotational_speed_rpm()
            }
            Speed::Rotational(speed) if !is_rotational => {
                let mut settings = settings();
                settings.set_rotational_speed_rpm(speed);
                settings.process.brushing_velocity_m_s
            }
            Speed::Velocity(value) | Speed::Rotational(value) => value,
        }
    }

    /// The number of the case at these positions along the sides.
    pub fn case(&self, x: usize, y: usize) -> usize {
        self.origin + self.x.offsets[x] + self.y.offsets[y]
    }

    /// The values that distinguish this slice from the others, as text. Empty if there is only one slice.
    pub fn condition(&self) -> String {
        self.fixed.iter().map(|&(parameter, value)| equation(parameter, value)).collect::<Vec<_>>().join(", ")
    }

    /// The values that distinguish this slice from the others, as a suffix for file names.
    pub fn suffix(&self) -> String {
        self.fixed.iter().map(|(parameter, value)| format!("_{}_{}", parameter.key(), short(*value))).collect()
    }
}

/// Some or all of the slices of a study.
pub struct Slices {
    /// At most the number requested, evenly spread.
    pub chosen: Vec<Slice>,
    /// The number of all slices.
    pub total: usize,
}

/// At most `limit` slices of brushing velocity, or of rotational speed if the study states that, and penetration depth.
pub fn process_slices(study: &Study, limit: usize) -> Slices {
    let [velocity, depth] = process_parameters(study);
    slices(study, velocity, depth, limit)
}

/// At most `limit` slices of the two most informative settings: the first two that vary among velocity, depth and the further
/// sweeps, fastest first. A study of one case has none.
pub fn telling_slices(study: &Study, limit: usize) -> Slices {
    let [velocity, depth] = process_parameters(study);
    let further = study.sweeps().iter().rev().map(|sweep| sweep.parameter());
    let further = further.filter(|parameter| ![velocity.path, DEPTH].contains(&parameter.path));
    let mut varying: Vec<&'static Parameter> =
        [velocity, depth].into_iter().chain(further).filter(|parameter| Side::new(study, parameter).varies()).collect();
    if varying.is_empty() {
        return Slices { chosen: Vec::new(), total: 0 };
    }
    // If only one setting varies, the other side shows the single value of depth or velocity.
    varying.extend([depth, velocity].into_iter().filter(|parameter| !Side::new(study, parameter).varies()));
    slices(study, varying[0], varying[1], limit)
}

/// At most `limit` slices of the offset of the workpiece and penetration depth; none if one of them does not vary.
pub fn offset_slices(study: &Study, limit: usize) -> Slices {
    let [x, y] = [OFFSET, DEPTH].map(|path| Parameter::find(path).expect("the table has offset and depth"));
    if ![x, y].iter().all(|parameter| Side::new(study, parameter).varies()) {
        return Slices { chosen: Vec::new(), total: 0 };
    }
    slices(study, x, y, limit)
}

fn process_parameters(study: &Study) -> [&'static Parameter; 2] {
    [study.speed(), Parameter::find(DEPTH).expect("the table has the depth")]
}

fn slices(study: &Study, x: &'static Parameter, y: &'static Parameter, limit: usize) -> Slices {
    let further = study.sweeps().iter().map(|sweep| sweep.parameter());
    let further: Vec<Side> = further
        .filter(|parameter| ![x.path, y.path].contains(&parameter.path))
        .map(|parameter| Side::new(study, parameter))
        .filter(Side::varies)
        .collect();
    let [x, y] = [x, y].map(|parameter| Side::new(study, parameter));
    let total = further.iter().map(|side| side.values.len()).product();
    let slice = |number: usize| {
        let mut slice = Slice { x: x.clone(), y: y.clone(), fixed: Vec::new(), origin: 0 };
        let mut stride = total;
        for side in &further {
            stride /= side.values.len();
            let position = number / stride % side.values.len();
            slice.fixed.push((side.parameter, side.values[position]));
            slice.origin += side.offsets[position];
        }
        slice
    };
    Slices { chosen: spread(total, limit).into_iter().map(slice).collect(), total }
}

/// At most `limit` positions of `count`, evenly spread from the first to the last.
pub fn spread(count: usize, limit: usize) -> Vec<usize> {
    if count <= limit {
        (0..count).collect()
    } else {
        (0..limit).map(|index| index * (count - 1) / (limit - 1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;

    #[test]
    fn a_selection_keeps_first_and_last() {
        assert_eq!(spread(3, 12), [0, 1, 2]);
        assert_eq!(spread(101, 5), [0, 25, 50, 75, 100]);
    }

    fn study(sweeps: &str) -> Study {
        let text = format!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n[filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n\
             [process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1.0e-3\n[study]\n{sweeps}"
        );
        Document::parse(&text, "case.toml").and_then(|document| document.study()).expect("a study")
    }

    /// The value of a setting in a case.
    fn value(study: &Study, case: usize, path: &str) -> f64 {
        Parameter::find(path).expect(path).get(&study.settings(case))
    }

    #[test]
    fn planes_find_their_cases_whatever_the_order() {
        let study = study(
            "brushing_velocity_m_s = [20.0, 5.0, 20.0]\n\"contact.exponent\" = [1.5]\n\
             penetration_depth_m = [3e-3, 1e-3]\n\"filament.segments\" = [4, 3]",
        );
        let Slices { chosen: slices, total } = process_slices(&study, 9);
        assert_eq!(total, 2);
        assert_eq!(slices.iter().map(Slice::condition).collect::<Vec<_>>(), ["segments = 3", "segments = 4"]);
        assert_eq!(slices[0].suffix(), "_segments_3");
        for slice in slices {
            assert_eq!((&slice.x.values[..], &slice.y.values[..]), (&[5.0, 20.0][..], &[1e-3, 3e-3][..]));
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
            slices.iter().map(|slice| [slice.x.word(), slice.y.word()]).next()
        };
        let (velocity, depth) = ("brushing_velocity_m_s = [5.0, 6.0]\n", "penetration_depth_m = [1e-3, 2e-3]\n");
        let segments = "\"filament.segments\" = [3, 4]\n";
        assert_eq!(sides(&format!("{velocity}{depth}{segments}")), Some(["velocity", "depth"]));
        assert_eq!(sides(velocity), Some(["velocity", "depth"]));
        assert_eq!(sides(depth), Some(["depth", "velocity"]));
        assert_eq!(sides(&format!("{depth}{segments}")), Some(["depth", "segments"]));
        assert_eq!(sides(segments), Some(["segments", "depth"]));
        assert_eq!(sides("\"filament.segments\" = [3]\n"), None);
        let one = telling_slices(&study(segments), 1).chosen.remove(0);
        assert_eq!(equation(one.y.parameter, one.y.values[0]), "a_e = 1 mm");
    }
}
