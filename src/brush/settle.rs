//! Filaments that lean on their neighbours before they meet anything.
//!
//! With tilts, waves and lengths of their own, undeformed filaments would overlap. These deviations
//! grow from the regular arrangement in load increments (rungs), while the brush turns. Filaments
//! touch each other, damping is strong, and there is neither workpiece nor gravity. The motion
//! begins with their pose at rest relative to the body.

use std::f64::consts::TAU;

use crate::equations::PolarAxis;
use crate::equations::linear::{add, scale, sub};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::{FilamentSettings, Settings};

/// `e` and `ė` of each segment of a filament, from the root on, turned back by the angle of the
/// tool.
pub type FilamentPose = Vec<[[f64; 3]; 2]>;

/// Steps of a load increment.
pub const STEPS_PER_RUNG: usize = 12;
/// Motion of the tips in a load increment over the diameter, up to [`MAX_GROWING_RUNGS`].
const GROWTH_PER_RUNG: f64 = 0.25;
const MAX_GROWING_RUNGS: usize = 40;
/// Load increments without growth before settling fails.
const MAX_RESTING_RUNGS: usize = 100;
/// Expected number of these load increments.
const EXPECTED_RESTING_RUNGS: usize = 6;
/// Largest speeds of a node relative to the body that count as rest, over the brushing velocity and
/// over the speed of a vibration in the first mode by a diameter. Points that press on kinks of a
/// polyline keep some speed.
const MAX_REST_SPEEDS: [f64; 2] = [3e-4, 3e-3];

/// Progress of settling filaments.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settling {
    /// Load increments done, and those with growing deviations.
    rung: usize,
    growing: usize,
    /// Step size in s.
    pub length: f64,
    /// Pose of each filament, group by group.
    pub poses: Vec<Vec<FilamentPose>>,
    /// Largest speed of a node relative to the body in m/s.
    pub speed: f64,
}

impl Settling {
    /// Starts from poses without deviations, which move undeformed tips by at most `way` (m).
    pub fn new(settings: &Settings, way: f64, poses: Vec<Vec<FilamentPose>>) -> Self {
        let period = TAU / first_natural_frequency(&settings.filament);
        let growing = (way / (GROWTH_PER_RUNG * settings.filament.diameter_m))
            .ceil()
            .max(2.0) as usize;
        Self {
            rung: 0,
            growing: growing.min(MAX_GROWING_RUNGS),
            length: 0.25 * period / STEPS_PER_RUNG as f64,
            poses,
            speed: f64::INFINITY,
        }
    }

    /// Returns the steps done, and the expected number of steps.
    pub fn steps(&self) -> [usize; 2] {
        let expected = self.growing + EXPECTED_RESTING_RUNGS;
        [self.rung.min(expected - 1), expected].map(|rungs| STEPS_PER_RUNG * rungs)
    }

    /// Returns the common settings of the filaments while they settle.
    pub fn calm(settings: &Settings) -> Settings {
        let mut calm = settings.clone();
        calm.process.gravity_m_s2 = [0.0; 3];
        // The workpiece may be anywhere.
        calm.contact.stiffness_n_m = 0.0;
        let brush = calm.brush.get_or_insert_default();
        brush.friction_coefficient = 0.0;
        brush.damping_s_m = 0.0;
        calm
    }

    /// Returns a filament in the next load increment, between [common](Self::calm) and `own`
    /// settings.
    pub fn grown(&self, calm: &Settings, own: &Settings) -> Settings {
        let share = ((self.rung + 1) as f64 / self.growing as f64).min(1.0);
        let (from, to) = (&calm.filament, &own.filament);
        let between = |a: f64, b: f64| if share < 1.0 { a + share * (b - a) } else { b };
        let filament = FilamentSettings {
            length_m: between(from.length_m, to.length_m),
            diameter_m: between(from.diameter_m, to.diameter_m),
            tip_diameter_m: from
                .tip_diameter_m
                .zip(to.tip_diameter_m)
                .map(|(a, b)| between(a, b)),
            waviness_amplitude_m: between(from.waviness_amplitude_m, to.waviness_amplitude_m),
            waviness_phase_rad: between(from.waviness_phase_rad, to.waviness_phase_rad),
            lateral_tilt_rad: between(from.lateral_tilt_rad, to.lateral_tilt_rad),
            damping_ratio: to.damping_ratio.max(1.0),
            ..to.clone()
        };
        Settings {
            filament,
            ..calm.clone()
        }
    }

    /// Takes the poses after a load increment, on a body that turns at `rate` (rad/s). Returns
    /// `true` if the filaments are at rest.
    pub fn take(
        &mut self,
        poses: Vec<Vec<FilamentPose>>,
        own: impl Fn(usize, usize) -> f64,
        rate: f64,
        settings: &Settings,
    ) -> bool {
        self.rung += 1;
        let speed = |(group, poses): (usize, &Vec<FilamentPose>)| {
            let of = |(index, pose): (usize, &FilamentPose)| fastest(pose, own(group, index), rate);
            poses.iter().enumerate().map(of).fold(0.0, f64::max)
        };
        self.speed = poses.iter().enumerate().map(speed).fold(0.0, f64::max);
        self.poses = poses;
        let vibration = settings.filament.diameter_m * first_natural_frequency(&settings.filament);
        let rest = (MAX_REST_SPEEDS[0] * settings.process.brushing_velocity_m_s)
            .max(MAX_REST_SPEEDS[1] * vibration);
        self.rung >= self.growing && self.speed <= rest
    }

    /// Returns `true` if settling takes too long.
    pub fn is_hopeless(&self) -> bool {
        self.rung >= self.growing + MAX_RESTING_RUNGS
    }

    /// Restores a state. Returns `None` if it does not fit these filaments.
    pub fn restore(&mut self, state: Self) -> Option<()> {
        let shape = |settling: &Self| -> Vec<Vec<usize>> {
            settling
                .poses
                .iter()
                .map(|poses| poses.iter().map(Vec::len).collect())
                .collect()
        };
        let fits = (state.growing, state.length) == (self.growing, self.length)
            && !state.is_hopeless()
            && shape(&state) == shape(self);
        *self = Some(state).filter(|_| fits)?;
        Some(())
    }
}

/// Returns coordinates about `z` and rates of the segments of a pose when the tool is at `angle`
/// (rad).
pub fn coordinates(pose: &FilamentPose, angle: f64) -> [Vec<[f64; 2]>; 2] {
    let segments = pose.iter().map(|[e, rate]| {
        let [q, v, _] =
            PolarAxis::Z.coordinates([turned(*e, angle), turned(*rate, angle), [0.0; 3]]);
        (q, v)
    });
    let (q, v) = segments.unzip();
    [q, v]
}

/// Returns a vector turned about `z`.
pub fn turned([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// Returns the largest speed of a node relative to a body that turns about `z` at `rate` (rad/s),
/// with segments of `length` (m).
fn fastest(pose: &FilamentPose, length: f64, rate: f64) -> f64 {
    let mut velocity = [0.0; 3];
    let speeds = pose.iter().map(|[e, own]| {
        let rigid = [-rate * e[1], rate * e[0], 0.0];
        velocity = add(velocity, scale(length, sub(*own, rigid)));
        velocity
            .iter()
            .map(|component| component * component)
            .sum::<f64>()
            .sqrt()
    });
    speeds.fold(0.0, f64::max)
}
