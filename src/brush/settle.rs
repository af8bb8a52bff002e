//! Filaments that lean on their neighbours before they meet anything.
//!
//! Tilts, waves and lengths of their own would put undeformed filaments into each other. From the
//! regular arrangement these deviations grow to their values, in rungs, with contact between
//! filaments on, strong damping, and neither workpiece nor gravity, while the brush turns. Once the
//! filaments are at rest relative to the body, their pose is where the motion begins.

use std::f64::consts::TAU;

use crate::equations::PolarAxis;
use crate::equations::linear::{add, scale, sub};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::{FilamentSettings, Settings};

/// `e` and `ė` of each segment of a filament, from the root on, turned back by the angle of the
/// tool.
pub type Pose = Vec<[[f64; 3]; 2]>;

/// Steps of a rung.
pub const STEPS: usize = 12;
/// The tips move by so much of the diameter in a rung, if there are fewer than [`MOST_GROWING`].
const WAY: f64 = 0.25;
const MOST_GROWING: usize = 40;
/// Rungs without growth after which a brush that does not come to rest is given up.
const MOST_RESTING: usize = 100;
/// Those that a brush is expected to need.
const USUAL_RESTING: usize = 6;
/// The largest speed of a node relative to the body that counts as rest, over the brushing velocity
/// and over that of a vibration in the first mode by a diameter: where points press on kinks of a
/// polyline, some of it remains.
const REST: [f64; 2] = [3e-4, 3e-3];

/// How far filaments have settled.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settling {
    /// Rungs that are done, and those of which the deviations grow.
    rung: usize,
    growing: usize,
    /// The time of a step in s.
    pub length: f64,
    /// Pose of each filament, group by group.
    pub poses: Vec<Vec<Pose>>,
    /// The largest speed of a node relative to the body in m/s.
    pub speed: f64,
}

impl Settling {
    /// Filaments with these poses, without deviations of their own, by which undeformed tips move
    /// by at most `way` (m).
    pub fn new(settings: &Settings, way: f64, poses: Vec<Vec<Pose>>) -> Self {
        let period = TAU / first_natural_frequency(&settings.filament);
        let growing = (way / (WAY * settings.filament.diameter_m)).ceil().max(2.0) as usize;
        Self {
            rung: 0,
            growing: growing.min(MOST_GROWING),
            length: 0.25 * period / STEPS as f64,
            poses,
            speed: f64::INFINITY,
        }
    }

    /// The steps that are done, and those that it is expected to need.
    pub fn steps(&self) -> [usize; 2] {
        let expected = self.growing + USUAL_RESTING;
        [self.rung.min(expected - 1), expected].map(|rungs| STEPS * rungs)
    }

    /// What the filaments have in common in the next rung.
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

    /// A filament in the next rung, between the [common](Self::calm) settings and its `own`.
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

    /// Takes the poses at the end of a rung, on a body that turns at `rate` (rad/s). Returns
    /// whether the filaments are at rest.
    pub fn take(
        &mut self,
        poses: Vec<Vec<Pose>>,
        own: impl Fn(usize, usize) -> f64,
        rate: f64,
        settings: &Settings,
    ) -> bool {
        self.rung += 1;
        let speed = |(group, poses): (usize, &Vec<Pose>)| {
            let of = |(index, pose): (usize, &Pose)| fastest(pose, own(group, index), rate);
            poses.iter().enumerate().map(of).fold(0.0, f64::max)
        };
        self.speed = poses.iter().enumerate().map(speed).fold(0.0, f64::max);
        self.poses = poses;
        let vibration = settings.filament.diameter_m * first_natural_frequency(&settings.filament);
        let rest = (REST[0] * settings.process.brushing_velocity_m_s).max(REST[1] * vibration);
        self.rung >= self.growing && self.speed <= rest
    }

    /// Whether it has taken so long that it will not come to rest.
    pub fn is_hopeless(&self) -> bool {
        self.rung >= self.growing + MOST_RESTING
    }

    /// Goes back to a state. `None` if it is not one of these filaments.
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

/// Coordinates about `z` and rates of the segments of a pose when the tool is at `angle` (rad).
pub fn coordinates(pose: &Pose, angle: f64) -> [Vec<[f64; 2]>; 2] {
    let segments = pose.iter().map(|[e, rate]| {
        let [q, v, _] =
            PolarAxis::Z.coordinates([turned(*e, angle), turned(*rate, angle), [0.0; 3]]);
        (q, v)
    });
    let (q, v) = segments.unzip();
    [q, v]
}

/// A vector turned about `z`.
pub fn turned([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// The largest speed of a node relative to a body that turns about `z` at `rate` (rad/s), with
/// segments of `length` (m).
fn fastest(pose: &Pose, length: f64, rate: f64) -> f64 {
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
