//! The trim of a tool, and the places of filaments along it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::equations::sin_cos;
use crate::model::pose::Pose;
use crate::model::settings::{Settings, unit_normal};

/// One revolution per minute in rad/s.
const RPM_RAD_S: f64 = TAU / 60.0;

/// Filament of the trim that stands for others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Place `s` along the trim in m; zero in the middle.
    pub s: f64,
    /// Share of the tool's filaments for which it stands.
    pub weight: f64,
}

/// Undeformed trim in the tool's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Radius `r_g` of the roots in the middle of the trim, in m.
    pub body_radius: f64,
    /// Width `b` in m.
    pub width: f64,
    /// Free length `l_f` in m.
    pub length: f64,
    /// `π/2 − γ` in rad: zero for radial filaments.
    pub elevation: f64,
}

impl Trim {
    /// Returns the trim of the tool that `settings` state.
    pub fn of(settings: &Settings) -> Self {
        Self {
            body_radius: settings.tool.body_radius_m,
            width: settings.tool.width_m,
            length: settings.filament.length_m,
            elevation: FRAC_PI_2 - settings.tool.filament_angle_rad(),
        }
    }

    /// Returns `true` if all filaments are radial.
    pub fn is_radial(&self) -> bool {
        self.elevation == 0.0
    }

    /// Returns distance from the axis and `z` in m of the root at `s` (m).
    pub fn root(&self, s: f64) -> [f64; 2] {
        let (cos_angle, sin_angle) = sin_cos(self.elevation);
        [self.body_radius - s * cos_angle, s * sin_angle]
    }

    /// Returns distance from the axis, `R(s)`, and `z` in m of the tip of the undeformed filament
    /// at `s` (m).
    pub fn tip(&self, s: f64) -> [f64; 2] {
        let (cos_angle, sin_angle) = sin_cos(self.elevation);
        let [radius, height] = self.root(s);
        [
            radius + self.length * sin_angle,
            height + self.length * cos_angle,
        ]
    }

    /// Returns the ends of the trim, as `s` in m.
    pub fn ends(&self) -> [f64; 2] {
        [-self.width / 2.0, self.width / 2.0]
    }
}

impl Settings {
    /// Returns the undeformed radius of the tool in the middle of its trim, `R(0) = r_g + l_f sin
    /// γ`, in m.
    #[must_use]
    pub fn tool_radius_m(&self) -> f64 {
        let [radius, _] = Trim::of(self).tip(0.0);
        radius
    }

    /// Returns the reach of the undeformed tips, from the tool's centre along the inward normal of
    /// the workpiece, in m: `R` of a round tool on a plane.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        let [tips, _] = reaches(self);
        tips
    }

    /// Returns the angular velocity of the tool, `ω = v_b/R`, in rad/s.
    #[must_use]
    pub fn angular_velocity_rad_s(&self) -> f64 {
        self.process.brushing_velocity_m_s / self.tool_radius_m()
    }

    /// Returns the distance by which the undeformed tips are nearer to the workpiece than the
    /// roots, in m: the largest possible penetration depth.
    #[must_use]
    pub fn clearance_m(&self) -> f64 {
        let [tips, roots] = reaches(self);
        tips - roots
    }

    /// Returns the rotational speed of the tool in revolutions per minute: `n_w = 60 ω/(2π)`.
    #[must_use]
    pub fn rotational_speed_rpm(&self) -> f64 {
        self.angular_velocity_rad_s() / RPM_RAD_S
    }

    /// Sets the brushing velocity to that of the tips at this rotational speed in revolutions per
    /// minute.
    pub fn set_rotational_speed_rpm(&mut self, speed_rpm: f64) {
        self.process.brushing_velocity_m_s = speed_rpm * RPM_RAD_S * self.tool_radius_m();
    }
}

/// Returns the reach, in m along the inward normal of a surface, of a turning point at `radius`
/// from the axis and at `height`. The outward normal is given in the tool's frame.
pub(crate) fn reach_of([radius, height]: [f64; 2], [x, y, z]: [f64; 3]) -> f64 {
    radius * x.hypot(y) - height * z
}

/// Returns the filaments that stand for all: one, unless filaments along the trim differ (MODEL,
/// "Rotary tools of any kind and pose"). Then they are at Gauss–Legendre points, with weights in
/// proportion to their root radius.
pub fn places(settings: &Settings) -> Vec<Place> {
    if settings.tool.positions == Some(1) || !differ(settings) {
        return vec![Place {
            s: 0.0,
            weight: 1.0,
        }];
    }
    let trim = Trim::of(settings);
    let count = settings
        .tool
        .positions
        .unwrap_or_else(|| match lifts_off(settings, &trim) {
            true => POSITIONS_OF_LIFTED_TRIM,
            false => settings.tool.positions(),
        });
    let mut places: Vec<Place> = (0..count)
        .map(|i| {
            let [point, weight] = gauss_legendre(count, i);
            let s = point * trim.width / 2.0;
            Place {
                s,
                weight: weight * trim.root(s)[0],
            }
        })
        .collect();
    let sum: f64 = places.iter().map(|place| place.weight).sum();
    for place in &mut places {
        place.weight /= sum;
    }
    places
}

/// Number of filaments along a trim of which a part lifts off. Where contact begins, the force
/// rises within some ten micrometres of depth. With 33 filaments the force of the paper's brush at
/// a tilt of 0.1 rad and 1 mm is accurate to a per cent; with 5 it is off by up to 17 %.
const POSITIONS_OF_LIFTED_TRIM: usize = 33;

/// Returns `true` if an end of the trim comes free of the workpiece, or nearly so.
fn lifts_off(settings: &Settings, trim: &Trim) -> bool {
    /// Depth of an end that is nearly free, over the depth of the deepest tip.
    const NEARLY_FREE_SHARE: f64 = 0.1;
    let normal = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let [reach, _] = reaches(settings);
    let depth = settings.process.penetration_depth_m;
    trim.ends()
        .into_iter()
        .any(|s| reach - reach_of(trim.tip(s), normal) >= (1.0 - NEARLY_FREE_SHARE) * depth)
}

/// Returns `true` if the filaments along the trim differ: the tool is tilted or conical, or skewed
/// over a workpiece that is no plane.
pub(crate) fn differ(settings: &Settings) -> bool {
    let tool = &settings.tool;
    let skewed = tool.skew_rad != 0.0 && !settings.workpiece.kind.is_plane();
    tool.tilt_rad() != 0.0 || !Trim::of(settings).is_radial() || skewed
}

/// Returns the place in m of the deepest filament of the trim, among those of [`reaches`].
pub(crate) fn deepest(settings: &Settings) -> f64 {
    let normal = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let trim = Trim::of(settings);
    let depth = |s: &f64| reach_of(trim.tip(*s), normal);
    considered(settings, &trim)
        .into_iter()
        .max_by(|a, b| depth(a).total_cmp(&depth(b)))
        .unwrap_or(0.0)
}

/// Returns the places among which the deepest is: the ends of the trim or, if one filament stands
/// for all, its middle.
fn considered(settings: &Settings, trim: &Trim) -> Vec<f64> {
    let whole = differ(settings) && settings.tool.positions != Some(1);
    if whole {
        trim.ends().to_vec()
    } else {
        vec![0.0]
    }
}

/// Returns the reach of tips and roots of the undeformed turning tool, in m from its centre along
/// the inward normal: the largest of the whole trim or, if one filament stands for all, that
/// filament's.
pub(crate) fn reaches(settings: &Settings) -> [f64; 2] {
    let normal = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let trim = Trim::of(settings);
    let places = considered(settings, &trim);
    let deepest = |point: fn(&Trim, f64) -> [f64; 2]| {
        places
            .iter()
            .map(|&s| reach_of(point(&trim, s), normal))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    [deepest(Trim::tip), deepest(Trim::root)]
}

/// Returns point `i` of the `count` Gauss–Legendre points in `[−1, 1]`, in ascending order, and its
/// weight.
fn gauss_legendre(count: usize, i: usize) -> [f64; 2] {
    let n = count as f64;
    let mut x = -(PI * (i as f64 + 0.75) / (n + 0.5)).cos();
    let mut slope = 1.0;
    // Newton's method doubles the digits at each iteration.
    for _ in 0..8 {
        let (mut before, mut here) = (1.0, x);
        for k in 1..count {
            let k = k as f64;
            (before, here) = (here, ((2.0 * k + 1.0) * x * here - k * before) / (k + 1.0));
        }
        slope = n * (x * here - before) / (x * x - 1.0);
        x -= here / slope;
    }
    if 2 * i + 1 == count {
        x = 0.0;
    }
    [x, 2.0 / ((1.0 - x * x) * slope * slope)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_legendre_integrates_polynomials() {
        for count in [2, 5, 9, 17] {
            let points: Vec<[f64; 2]> = (0..count).map(|i| gauss_legendre(count, i)).collect();
            assert!(
                points.windows(2).all(|pair| pair[0][0] < pair[1][0]),
                "{points:?}"
            );
            for power in 0..2 * count as i32 {
                let found: f64 = points
                    .iter()
                    .map(|[x, weight]| weight * x.powi(power))
                    .sum();
                let expected = if power % 2 == 0 {
                    2.0 / f64::from(power + 1)
                } else {
                    0.0
                };
                assert!((found - expected).abs() < 1e-14, "{count} {power}: {found}");
            }
        }
    }
}
