//! Checks of settings: each in its range, and the conditions between them.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::model::filament;
use crate::model::parameters::{PARAMETERS, Violation};
use crate::model::pose::Pose;
use crate::model::settings::{Ends, RemovalGoal, Settings, ToolKind, unit_normal};
use crate::model::trim::{self, Trim};
use crate::workpiece::Part;

/// Smallest component of the workpiece's unit normal perpendicular to the tool axis.
const MIN_NORMAL_ACROSS: f64 = 1e-6;

/// Paths of the penetration depth and of the force that may replace it.
const DEPTH: &str = "process.penetration_depth_m";
const FORCE: &str = "process.tool_force_n";
/// Path of the radius of a bore.
const RADIUS: &str = "workpiece.radius_m";
/// Depth at which settings that state a force are checked, over the free length or the clearance,
/// whichever is smaller.
const CHECKED_DEPTH_SHARE: f64 = 1e-3;

/// Relative rounding error of the difference of two reaches.
const ROUNDING: f64 = 1e-12;

/// Largest angle between wavy filaments and the plane of rotation, in rad.
const MAX_WAVY_ELEVATION_RAD: f64 = 1.0;

/// Largest ratio of the diameters at the ends of a filament.
const MAX_TAPER: f64 = 1e3;

impl Settings {
    /// Checks every setting on its own, and then the conditions between them.
    ///
    /// # Errors
    /// The first setting that is outside its range.
    pub fn check(&self) -> Result<(), Violation> {
        self.check_ranges()?;
        self.check_vectors()?;
        self.check_relations()
    }

    /// Checks every scalar setting on its own.
    ///
    /// # Errors
    /// The first one that is outside its range.
    pub fn check_ranges(&self) -> Result<(), Violation> {
        PARAMETERS
            .iter()
            .filter(|parameter| match self.process.tool_force_n {
                Some(_) if parameter.path == DEPTH => false,
                Some(_) if parameter.path == FORCE => true,
                _ => parameter.instead_of.is_empty(),
            })
            .try_for_each(|parameter| {
                parameter
                    .read(self)
                    .map_or(Ok(()), |value| parameter.check(value))
            })
    }

    fn check_vectors(&self) -> Result<(), Violation> {
        let gravity = self.process.gravity_m_s2;
        if !gravity.iter().all(|component| component.is_finite()) {
            return Err(Violation::of(
                "process.gravity_m_s2",
                gravity,
                "three finite numbers, in m/s²",
            ));
        }
        // If the normal is zero or infinite these are NaN.
        let normal = unit_normal(&self.workpiece);
        let [x, y, _] = Pose::of(&self.tool).to_tool(normal);
        let is_across = Trim::of(self).is_radial() && x.hypot(y) < MIN_NORMAL_ACROSS;
        if is_across || !normal.iter().all(|component| component.is_finite()) {
            return Err(Violation::of(
                "workpiece.normal",
                self.workpiece.kind.normal(),
                "three finite numbers that do not point along the axis of a tool with radial filaments",
            ));
        }
        Ok(())
    }

    /// Checks the trim of the tool.
    fn check_trim(&self) -> Result<(), Violation> {
        let (tool, trim) = (&self.tool, Trim::of(self));
        if tool.kind == ToolKind::Cone && tool.filament_angle_rad.is_none() {
            return Err(Violation {
                path: "tool.filament_angle_rad",
                value: "left out".to_owned(),
                allowed: "given for a tool of kind `cone`: the angle of its filaments to the axis, in rad".to_owned(),
            });
        }
        let crossing = trim.ends().iter().any(|&s| trim.root(s)[0] <= 0.0);
        if !trim.is_radial() && crossing {
            let [_, half] = trim.ends();
            let least = half * trim.elevation.sin().abs();
            return Err(Violation::of(
                "tool.body_radius_m",
                tool.body_radius_m,
                format!(
                    "greater than {least:.4e}, in m: nearer to the axis, filaments of a trim this wide would be rooted across it"
                ),
            ));
        }
        if trim.elevation.abs() > MAX_WAVY_ELEVATION_RAD
            && self.filament.waviness_amplitude_m != 0.0
        {
            return Err(Violation::of(
                "filament.waviness_amplitude_m",
                self.filament.waviness_amplitude_m,
                format!(
                    "0: waves lie in the plane of rotation, across which filaments at less than {:.1} rad to the axis stand",
                    FRAC_PI_2 - MAX_WAVY_ELEVATION_RAD
                ),
            ));
        }
        if self.brush.is_some() && !trim.is_radial() {
            return Err(Violation::of(
                "tool.filament_angle_rad",
                tool.filament_angle_rad(),
                "π/2 with [brush]: filaments that touch each other are simulated on radial trims only; leave [brush] out, \
                          or run with --alone, for filaments alone",
            ));
        }
        Ok(())
    }

    /// Checks that filaments can be simulated in a bore narrower than the brush.
    fn check_tube(&self) -> Result<(), Violation> {
        let Some(tube) = self.tube() else {
            return Ok(());
        };
        let feed_velocity_m_s = self.workpiece.feed_velocity_m_s;
        if feed_velocity_m_s != 0.0 {
            let allowed =
                "0 in a bore narrower than the brush, which would be fed against the tool";
            return Err(Violation::of(
                "workpiece.feed_velocity_m_s",
                feed_velocity_m_s,
                allowed,
            ));
        }
        let refused = |allowed: String| {
            let allowed = format!(
                "{allowed}: filaments that touch each other all round the tool need a closed ring of \
                 columns, which is not simulated"
            );
            Err(Violation::of(RADIUS, tube.radius, allowed))
        };
        if self.brush.is_some() {
            let least = self.tool_radius_m() - tube.eccentricity();
            return refused(format!(
                "at least {least:.4e} with [brush], so that filaments come free; or leave [brush] out, \
                 or run with --alone"
            ));
        }
        let thickest = self.filament.diameter_m.max(self.filament.tip_diameter_m());
        let spacing = self.spacing_in(&tube);
        if spacing < thickest {
            return refused(format!(
                "wider, as it squeezes the trim: filaments {thickest:?} m thick would stand \
                 {spacing:.4e} m apart there"
            ));
        }
        Ok(())
    }

    /// Checks the goal of the removal and the observed edge.
    fn check_removal(&self) -> Result<(), Violation> {
        let Some(removal) = &self.removal else {
            return Ok(());
        };
        let is_sane = |value: f64| value.is_finite() && value > 0.0;
        let wrong = |path, value: String, allowed: &str| {
            Err(Violation {
                path,
                value,
                allowed: allowed.to_owned(),
            })
        };
        if let Some(observed) = removal.observed {
            let value = format!(
                "{{ edge_radius_m = {:?}, time_s = {:?} }}",
                observed.edge_radius_m, observed.time_s
            );
            if !is_sane(observed.edge_radius_m) || !is_sane(observed.time_s) {
                return wrong(
                    "removal.observed",
                    value,
                    "two finite numbers greater than 0, in m and s",
                );
            }
            if let Some(std) = observed.edge_radius_std_m.filter(|std| !is_sane(*std)) {
                let value = format!("{{ edge_radius_std_m = {std:?} }}");
                let allowed = "a finite standard deviation greater than 0, in m, or none";
                return wrong("removal.observed", value, allowed);
            }
            if removal.preston_m2_n.is_some() {
                let allowed = "left out beside removal.preston_m2_n: the observed edge is there to find that coefficient";
                return wrong("removal.observed", value, allowed);
            }
        }
        match removal.until {
            Some(
                RemovalGoal::EdgeRadiusM(goal)
                | RemovalGoal::Turns(goal)
                | RemovalGoal::TimeS(goal),
            ) if !is_sane(goal) => wrong(
                "removal.until",
                format!("{goal:?}"),
                "a finite number greater than 0",
            ),
            _ => Ok(()),
        }
    }

    /// Checks the taper and the waviness of the filament.
    fn check_shape(&self) -> Result<(), Violation> {
        let Settings { filament, .. } = self;
        let (root_m, tip_m, length_m) = (
            filament.diameter_m,
            filament.tip_diameter_m(),
            filament.length_m,
        );
        if !(root_m / MAX_TAPER..=root_m * MAX_TAPER).contains(&tip_m) || tip_m >= length_m {
            return Err(Violation::of(
                "filament.tip_diameter_m",
                tip_m,
                format!(
                    "less than filament.length_m = {length_m:?}, and from a thousandth to a thousand times \
                     filament.diameter_m = {root_m:?}"
                ),
            ));
        }
        let steepest = filament::sines_of_inclinations(filament)
            .fold(0.0, |steepest: f64, sine| steepest.max(sine.abs()));
        if steepest >= 1.0 {
            let amplitude_m = filament.waviness_amplitude_m;
            return Err(Violation::of(
                "filament.waviness_amplitude_m",
                amplitude_m,
                format!(
                    "between ±{:.4e}: with filament.waviness_length_m = {:?} no segment may lie across the clamp direction",
                    amplitude_m.abs() / steepest,
                    filament.waviness_length_m(),
                ),
            ));
        }
        Ok(())
    }

    /// Checks the conditions between several settings. Each setting must already be valid on its
    /// own.
    pub fn check_relations(&self) -> Result<(), Violation> {
        if let Some(force_n) = self.process.tool_force_n {
            if self
                .bore()
                .is_some_and(|bore| bore.radius < self.tool_radius_m())
            {
                let allowed = "left out in a bore narrower than the brush: its radius decides the \
                               force, and the depth only moves the tool off its axis";
                return Err(Violation::of(FORCE, force_n, allowed));
            }
            // A depth so small that only other settings can be wrong.
            let shallow = CHECKED_DEPTH_SHARE * self.filament.length_m.min(self.clearance_m());
            return self
                .at_depth(shallow.max(f64::MIN_POSITIVE))
                .check_relations();
        }
        let length_m = self.filament.length_m;
        if self.filament.diameter_m >= length_m {
            return Err(Violation::of(
                "filament.diameter_m",
                self.filament.diameter_m,
                format!("less than filament.length_m = {length_m:?}"),
            ));
        }
        self.check_shape()?;
        self.check_removal()?;
        if self.contact.radius_m >= length_m {
            return Err(Violation::of(
                "contact.radius_m",
                self.contact.radius_m,
                format!("less than filament.length_m = {length_m:?}"),
            ));
        }
        self.check_trim()?;
        let penetration_depth_m = self.process.penetration_depth_m;
        let [tips, roots] = trim::reaches(self);
        if tips <= roots {
            // Report the angle that is stated.
            let (path, value) = match (self.tool.tilt_rad, self.tool.filament_angle_rad) {
                (None, Some(angle)) => ("tool.filament_angle_rad", angle),
                _ => ("tool.tilt_rad", self.tool.tilt_rad()),
            };
            let allowed = "such that filaments reach the workpiece: at this angle the body of the tool comes first";
            return Err(Violation::of(path, value, allowed));
        }
        if penetration_depth_m >= (tips - roots) * (1.0 - ROUNDING) {
            let allowed = match self.tool.tilt_rad() == 0.0 && Trim::of(self).is_radial() {
                true if penetration_depth_m >= length_m => {
                    format!("less than filament.length_m = {length_m:?}")
                }
                true => {
                    format!("less than {tips:.4e}, the reach of the tips along workpiece.normal")
                }
                false => format!(
                    "less than {:.4e}, by which the tips are nearer to the workpiece than the body",
                    tips - roots
                ),
            };
            return Err(Violation::of(DEPTH, penetration_depth_m, allowed));
        }
        let (_, passage) = Part::of(self)?;
        if passage.all_round {
            self.check_tube()?;
            return self.check_brush();
        }
        let nominal_angle_rad = passage.window.angle;
        let angles = [
            (
                "process.lead_angle_rad",
                "lead",
                self.process.lead_angle_rad,
            ),
            (
                "process.tail_angle_rad",
                "tail",
                self.process.tail_angle_rad,
            ),
        ];
        let free_rad = TAU - nominal_angle_rad;
        // Report the larger of the two.
        let [(path, _, larger), (_, other, smaller)] = if angles[0].2 > angles[1].2 {
            angles
        } else {
            [angles[1], angles[0]]
        };
        if larger >= free_rad - smaller {
            let allowed = format!(
                "less than {:.4}, one turn less the {other} angle {smaller:?} and the nominal contact angle {nominal_angle_rad:.4}",
                free_rad - smaller
            );
            return Err(Violation::of(path, larger, allowed));
        }
        self.check_brush()
    }

    /// Checks that the rows of a brush repeat along the axis where its ends are periodic.
    fn check_brush(&self) -> Result<(), Violation> {
        let brush = self.brush_or_default();
        if self.brush.is_some()
            && trim::differ(self)
            && brush.ends == Ends::Periodic
            && self.brush_rows() > 1
        {
            let allowed =
                "\"free\" on a tilted tool, whose rows differ: they do not repeat along the axis";
            return Err(Violation::of("brush.ends", "periodic", allowed));
        }
        Ok(())
    }
}
