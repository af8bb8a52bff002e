//! Distances of filaments from the workpiece.

use super::BundleMember;
use crate::equations::linear::dot;
use crate::simulation::Filament;
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Distance of a filament from the workpiece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance {
    /// Largest speed relative to the workpiece in m/s, if the filament turns with the body;
    /// infinite for a workpiece that does not only translate.
    pub(super) speed: f64,
    /// Velocity of the workpiece in m/s.
    pub(super) workpiece_velocity: [f64; 3],
    /// See [`BundleMember::contacts`].
    pub(super) contacts: [f64; 2],
    /// Time of the last comparison in s.
    pub(super) time: f64,
    /// Path of its nodes relative to the body at that time, in m.
    pub(super) way: f64,
    /// Distance of the nearest node at that time, in m.
    pub(super) gap: f64,
    /// Distance in m below which the filament is always compared with the workpiece: the beginning
    /// of a contact is found from the distance before it.
    pub(super) noticed: f64,
}

impl Clearance {
    /// Distance below which filaments are always compared, as a share of their length: the path of
    /// the tip in five of the longest steps.
    const COMPARED_SHARE: f64 = 0.025;

    /// Creates an unknown clearance.
    pub(super) fn new<M: ClampMotion>(
        BundleMember {
            filament, contacts, ..
        }: &BundleMember<M>,
        rate: f64,
    ) -> Self {
        let Filament {
            chain,
            motion,
            workpiece,
            ..
        } = filament;
        let [x, y, _] = motion.at(0.0).position;
        let length = chain.length * chain.segments() as f64;
        let radius = x.hypot(y) + length;
        let workpiece_velocity = workpiece.surface([0.0; 3], 0.0).velocity;
        let along = dot(workpiece_velocity, workpiece_velocity).sqrt();
        let speed = if workpiece.translates() {
            radius * rate.abs() + along
        } else {
            f64::INFINITY
        };
        Self {
            speed,
            workpiece_velocity,
            contacts: *contacts,
            time: 0.0,
            way: 0.0,
            gap: f64::NEG_INFINITY,
            noticed: Self::COMPARED_SHARE * length,
        }
    }

    /// Returns `true` if the filament does not meet the workpiece yet at `time` (s).
    pub(super) fn is_early(&self, time: f64) -> bool {
        time < self.contacts[0]
    }

    /// Returns a lower bound of the distance in m at `time` (s), after a path of `way` (m).
    pub(super) fn bound(&self, time: f64, way: f64) -> f64 {
        self.gap - (way - self.way) - self.speed * (time - self.time).abs()
    }
}
