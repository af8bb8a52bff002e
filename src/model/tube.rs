//! Bores around the tool, and tubes: those narrower than the brush (MODEL, "A bore narrower than the
//! brush").

use std::f64::consts::TAU;

use crate::model::settings::{RoundSettings, Settings, WorkpieceKind};
use crate::model::trim::Trim;

/// A bore around the tool, with lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bore {
    /// Radius.
    pub radius: f64,
    /// Position of its axis in the plane of rotation, from the tool's axis.
    pub centre: [f64; 2],
}

impl Bore {
    /// Distance of its axis from the tool's in m.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        let [x, y] = self.centre;
        x.hypot(y)
    }
}

impl Settings {
    /// The bore that the settings state, if their workpiece is one.
    #[must_use]
    pub fn bore(&self) -> Option<Bore> {
        let WorkpieceKind::Bore(RoundSettings { offset_m, radius_m }) = self.workpiece.kind else {
            return None;
        };
        let ground = self.process.penetration_depth_m - self.reach_m();
        Some(Bore {
            radius: radius_m,
            centre: [offset_m, ground + radius_m],
        })
    }

    /// The bore, if undeformed radial filaments penetrate it during the whole turn of an upright
    /// tool.
    #[must_use]
    pub fn tube(&self) -> Option<Bore> {
        let is_upright = self.tool.tilt_rad() == 0.0 && self.tool.skew_rad == 0.0;
        self.bore().filter(|bore| {
            is_upright
                && Trim::of(self).is_radial()
                && bore.eccentricity() + bore.radius <= self.tool_radius_m()
        })
    }

    /// `true` if the filament starts with a lean: without friction, a straight filament in a tube
    /// would buckle to either side.
    #[must_use]
    pub fn starts_leaning(&self) -> bool {
        self.contact.friction_coefficient == 0.0
            && self.filament.waviness_amplitude_m == 0.0
            && self.tube().is_some()
    }

    /// Returns the settings with the default of a penetration depth that is zero, without a force
    /// in its place: that of a bore narrower than the brush is concentric with the tool.
    #[must_use]
    pub fn with_default_depth(self) -> Self {
        let is_stated =
            self.process.penetration_depth_m != 0.0 || self.process.tool_force_n.is_some();
        match self.workpiece.kind {
            WorkpieceKind::Bore(RoundSettings { radius_m, .. })
                if !is_stated && radius_m < self.reach_m() =>
            {
                self.at_depth(self.reach_m() - radius_m)
            }
            _ => self,
        }
    }

    /// Mean distance in m of the filaments where they meet the nearest side of a tube.
    pub(crate) fn spacing_in(&self, tube: &Bore) -> f64 {
        let nearest = tube.radius - tube.eccentricity();
        (TAU * nearest * self.tool.width_m / self.tool.filament_count).sqrt()
    }
}
