//! What the page says about a brush beyond its metrics.

use bristle::brush::{BrushResult, FilamentResult};
use bristle::simulation::{Pass, Sampling, SimulationError};

use crate::cases::{OperatingPoint, TILT};

/// Mean impulse of the filaments that count in N s.
pub fn impulse(brush: &BrushResult) -> f64 {
    brush.tool.contact_normal_impulse_n_s
}

/// Impulse of a filament alone in N s.
pub fn impulse_alone(brush: &BrushResult) -> f64 {
    brush.alone.contact_normal_impulse_n_s
}

/// The filaments that count.
pub fn counted(brush: &BrushResult) -> impl Iterator<Item = &FilamentResult> {
    brush
        .filaments
        .iter()
        .filter(|filament| filament.is_counted)
}

/// The standard error of the mean impulse, over the mean, if filaments are independent.
pub fn standard_error(brush: &BrushResult) -> f64 {
    brush.stretch.scatter / (counted(brush).count() as f64).sqrt()
}

/// Impulse along the normal of the workpiece with which neighbours lift each filament, in N s;
/// negative where they press it down.
pub fn lifts(brush: &BrushResult) -> Vec<f64> {
    let mut lifts = vec![0.0; brush.filaments.len()];
    for pair in &brush.pairs {
        let [_, up, _] = pair.vector_impulse_n_s;
        for ([column, row], sign) in [(pair.filament, 1.0), (pair.other, -1.0)] {
            lifts[column * brush.rows + row] += sign * up;
        }
    }
    lifts
}

/// How neighbours press on each other, as means over pairs of filaments that count.
pub struct Presses {
    /// Impulse in N s.
    pub impulse: f64,
    /// Impulse along the normal of the workpiece on the filament that is ahead, in N s.
    pub lift_ahead: f64,
    /// Largest force in N.
    pub peak: f64,
    /// Time of contact in s.
    pub time: f64,
    /// Distance from the root in m, weighted by the impulse.
    pub arc_length: f64,
}

impl Presses {
    /// Those of a brush; none if filaments that count do not touch.
    pub fn of(brush: &BrushResult) -> Option<Self> {
        let counts = |column: usize| (brush.stretch.first..=brush.stretch.last).contains(&column);
        let pairs: Vec<_> = brush
            .pairs
            .iter()
            .filter(|pair| counts(pair.filament[0]) && counts(pair.other[0]))
            .collect();
        let mean = |value: &dyn Fn(&bristle::brush::PairResult) -> f64| {
            pairs.iter().map(|pair| value(pair)).sum::<f64>() / pairs.len() as f64
        };
        let impulse = mean(&|pair| pair.impulse_n_s);
        (!pairs.is_empty()).then(|| Self {
            impulse,
            lift_ahead: mean(&|pair| {
                let is_ahead = pair.filament[0] < pair.other[0];
                if is_ahead {
                    pair.vector_impulse_n_s[1]
                } else {
                    -pair.vector_impulse_n_s[1]
                }
            }),
            peak: pairs
                .iter()
                .map(|pair| pair.peak_force_n)
                .fold(0.0, f64::max),
            time: mean(&|pair| pair.contact_time_s),
            arc_length: mean(&|pair| pair.impulse_n_s * pair.arc_length_m) / impulse,
        })
    }
}

/// Impulses of the columns of a planar row in N s.
pub fn by_column(row: &BrushResult) -> Vec<f64> {
    row.filaments
        .iter()
        .map(|filament| filament.metrics.contact_normal_impulse_n_s)
        .collect()
}

/// How many columns at the beginning and at the end of a row differ by more than a share from the
/// mean of those that count.
pub fn unsteady_columns(row: &BrushResult, share: f64) -> [usize; 2] {
    let (impulses, mean) = (by_column(row), impulse(row));
    let differs = |impulse: &f64| (impulse - mean).abs() > share * mean;
    let (first, last) = (row.stretch.first, row.stretch.last);
    let before = impulses[..first]
        .iter()
        .rposition(differs)
        .map_or(0, |column| column + 1);
    let after = impulses[last..]
        .iter()
        .position(differs)
        .map_or(0, |column| impulses.len() - last - column);
    [before, after]
}

/// By filament: how far its tip goes sideways from its root at most, in m, as far as frames show
/// it.
pub fn sideways(brush: &BrushResult) -> Vec<f64> {
    let largest = |index: usize, filament: &FilamentResult| {
        let tips = brush
            .frames
            .iter()
            .filter_map(|frame| frame.nodes_m[index].last());
        tips.map(|[_, _, z]| (f64::from(*z) - filament.root_z_m).abs())
            .fold(0.0, f64::max)
    };
    brush
        .filaments
        .iter()
        .enumerate()
        .map(|(index, filament)| largest(index, filament))
        .collect()
}

/// A filament alone whose clamp is tilted.
pub struct Tilted {
    /// Its impulse in N s.
    pub impulse: f64,
    /// How far its tip goes sideways in m.
    pub sideways: f64,
}

impl Tilted {
    /// That of a place.
    ///
    /// # Errors
    /// If it cannot be simulated.
    pub fn at(place: OperatingPoint) -> Result<Self, SimulationError> {
        let mut settings = place.settings();
        settings.filament.lateral_tilt_rad = TILT;
        let metrics = Pass::new(&settings).simulate(Sampling::default())?.metrics;
        Ok(Self {
            impulse: metrics.contact_normal_impulse_n_s,
            sideways: metrics.lateral_amplification * settings.filament.length_m * TILT.sin(),
        })
    }
}

/// Mean, least and largest impulse in N s of the third quarter of the columns of a row: far from
/// its beginning, and not at its end.
pub fn in_the_middle(row: &BrushResult) -> [f64; 3] {
    let impulses = by_column(row);
    let middle = &impulses[impulses.len() / 2..impulses.len() * 3 / 4];
    let mean = middle.iter().sum::<f64>() / middle.len() as f64;
    [
        mean,
        middle.iter().copied().fold(f64::INFINITY, f64::min),
        middle.iter().copied().fold(0.0, f64::max),
    ]
}
