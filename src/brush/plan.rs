//! Construction of sectors of a brush, and start of their motion.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::arrangement::{Arrangement, Root};
use super::bundle::Bundle;
use super::candidates::Layout;
use super::error::BrushError;
use super::filaments::{self, ToolFilament};
use super::group::BundleMember;
use super::presses::PressLaw;
use super::sector::{Accuracy, Sector, Timetable};
use super::settle::{self, FilamentPose};
use super::shortcuts::Shortcuts;
use crate::equations::linear::{add, scale};
use crate::model::settings::{Settings, Turns};
use crate::simulation::{Form, IntegrationError, Pass, SimulationError};
use crate::tool::{ClampMotion, Tool, Turning};

/// Returns the start of the motion in s, before any filament touches the workpiece. Filaments are
/// undeformed, unless `settled` has their coordinates at the tool angle zero.
///
/// # Errors
/// If a filament touches the workpiece wherever the tool begins.
pub(super) fn begin(
    pass: &Pass,
    arrangement: &Arrangement,
    own: &[Settings],
    settled: &dyn Fn(usize) -> Option<Vec<[f64; 2]>>,
) -> Result<f64, BrushError> {
    /// Angle of a step back in rad, and the largest number of such steps.
    const STEP_BACK: f64 = 5e-3;
    const MAX_STEPS_BACK: i32 = 200;
    /// Angle of a root in rad beyond which its filament cannot touch so early.
    const MAX_FIRST_ANGLE: f64 = FRAC_PI_2;
    let rate = pass.tool().rate;
    let is_first = |(_, root): &(usize, &Root)| root.angle < MAX_FIRST_ANGLE;
    let first = arrangement
        .roots
        .iter()
        .enumerate()
        .filter(is_first)
        .map(|(number, root)| {
            let filament = filaments::filament(&own[number], pass, root);
            let Turning {
                tool,
                initial_angle,
                ..
            } = filament.motion;
            let coordinates = settled(number).unwrap_or_else(|| {
                let [direction, _] = tool.undeformed(initial_angle, rate);
                filament.chain.relaxed(direction).collect()
            });
            (filament, coordinates)
        });
    let first: Vec<_> = first.collect();
    let touches = |(filament, coordinates): &(ToolFilament, Vec<[f64; 2]>), time: f64| {
        let angle = filament.motion.angle(time) - filament.motion.initial_angle;
        let clamp = filament.motion.at(time);
        let mut position = clamp.position;
        coordinates.iter().any(|[polar, azimuth]| {
            let (sin, cos) = (azimuth + angle).sin_cos();
            let direction = [polar.sin() * cos, polar.sin() * sin, polar.cos()];
            position = add(position, scale(filament.chain.length, direction));
            let [pressing, _] =
                filament
                    .law
                    .node_pressing(&filament.workpiece, position, clamp.velocity, time);
            pressing > 0.0
        })
    };
    let times = (0..MAX_STEPS_BACK).map(|step| -f64::from(step) * STEP_BACK / rate);
    let is_free = |time: &f64| !first.iter().any(|filament| touches(filament, *time));
    let free = times.clone().find(is_free);
    free.ok_or_else(|| SimulationError::from(IntegrationError::NotFree).into())
}

/// Data from which sectors are made.
pub(super) struct SectorPlan<'a> {
    pub settings: &'a Settings,
    pub pass: &'a Pass,
    pub arrangement: &'a Arrangement,
    /// Settings of each filament.
    pub own: &'a [Settings],
    pub form: Form,
    /// Number of contact points of a segment.
    pub points: usize,
    /// Start of the motion in s.
    pub begin: f64,
    pub accuracy: Accuracy,
    pub shortcuts: Shortcuts,
}

impl SectorPlan<'_> {
    /// Creates a sector of filaments by their numbers in the arrangement: undeformed, unless they
    /// have poses.
    pub fn sector(&self, members: &[usize], poses: Option<&[FilamentPose]>) -> Sector {
        let Self {
            settings,
            pass,
            arrangement,
            own,
            form,
            points,
            begin,
            ..
        } = *self;
        let rate = pass.tool().rate;
        let timetable = |root: &Root| {
            let delay = root.angle / rate;
            let touches = pass
                .touches()
                .iter()
                .map(|touch| touch.map(|time| time + delay))
                .collect();
            Timetable {
                begin: delay,
                turn: pass.turn_time(),
                tail: pass.tail_time().map(|time| time + delay),
                touches,
            }
        };
        let roots = || {
            members
                .iter()
                .map(|&member| (&arrangement.roots[member], &own[member]))
        };
        let timetables: Vec<Timetable> = roots().map(|(root, _)| timetable(root)).collect();
        // Around the tool, the last columns meet those of the first ones behind them that come to
        // the workpiece before the end.
        let behind = settings.filament.length_m / settings.tool_radius_m();
        let nearest = arrangement.latest() + rate * pass.end_time() + behind;
        let stays = |root: &Root| pass.turns() != Turns::Count(1) || TAU + root.angle < nearest;
        let member = |(index, (root, own)): (usize, (&Root, &Settings))| {
            let filament = filaments::filament(own, pass, root);
            let delay = root.angle / rate;
            let last = if stays(root) {
                f64::INFINITY
            } else {
                pass.end_time() + delay
            };
            let start = match poses {
                Some(poses) => settle::coordinates(&poses[index], rate * begin),
                None => {
                    let [q, v] = filament
                        .motion
                        .tool
                        .undeformed(filament.motion.angle(begin), rate);
                    [
                        filament.chain.relaxed(q).collect(),
                        vec![v; filament.chain.segments()],
                    ]
                }
            };
            BundleMember {
                filament,
                contacts: [begin + delay, last],
                start,
            }
        };
        let filaments: Vec<BundleMember<_>> = roots().enumerate().map(member).collect();
        let radii = roots()
            .flat_map(|(_, own)| filaments::radii(&own.filament))
            .collect();
        let lengths = filaments
            .iter()
            .map(|member| member.filament.chain.length)
            .collect();
        // In its plane, a row does not meet its periodic images.
        let period = if form == Form::Planar {
            None
        } else {
            arrangement.period
        };
        let layout = Layout::new(lengths, radii, points, period);
        let sleep = self.shortcuts.sleep && roots().all(|(_, own)| filaments::rest(own));
        let shortcuts = Shortcuts {
            sleep,
            ..self.shortcuts
        };
        let (bundle, motion) = Bundle::new(
            form,
            filaments,
            PressLaw::of(settings),
            layout,
            [begin, rate],
            shortcuts,
        );
        Sector::new(bundle, motion, timetables, self.accuracy)
    }
}
