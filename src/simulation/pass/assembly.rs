//! A pass from settings, tool and workpiece.

use std::f64::consts::TAU;

use super::super::equilibrium::RigidShape;
use super::super::error::NoContactArc;
use super::super::filament::Filament;
use super::super::form::Form;
use super::rigid::{ANGLE_TOLERANCE_RAD, Rigid, reach_around};
use super::{Pass, PassConditions};
use crate::contact::ContactLaw;
use crate::equations::linear::{add, scale};
use crate::integrate::Tolerances;
use crate::model::filament;
use crate::model::metrics::{NominalContact, RemovalLaw};
use crate::model::pose::Pose;
use crate::model::settings::{Settings, Turns, unit_normal};
use crate::model::trim::{self, Trim};
use crate::tool::{RotaryTool, Tool, Turning};
use crate::workpiece::{ContactArc, Part, Passage, Ramp, Way, Workpiece};

impl Pass {
    /// Creates the pass of the tool and the workpiece that `settings` state, for the filament in
    /// the middle of the trim.
    ///
    /// # Panics
    /// If the settings fail [`Settings::check`] because of their workpiece.
    pub fn new(settings: &Settings) -> Self {
        Self::at(settings, 0.0)
    }

    /// Creates the pass of the deepest filament.
    pub(crate) fn deepest(settings: &Settings) -> Self {
        Self::at(settings, trim::deepest(settings))
    }

    /// Creates the pass of the filament at the place `s` (m) of the trim.
    ///
    /// # Panics
    /// As [`Pass::new`].
    pub fn at(settings: &Settings, s: f64) -> Self {
        let (part, passage) =
            Part::at(settings, s).unwrap_or_else(|violation| panic!("{violation}"));
        let (tool, rate) = (
            RotaryTool::at(settings, s),
            settings.angular_velocity_rad_s(),
        );
        let trim = Trim::of(settings);
        let shape = (!trim.is_radial()).then(|| {
            RigidShape::equilibrium(&filament::chain(&settings.filament, [0.0; 3]), &tool, rate)
        });
        let reach = match trim::differ(settings) {
            true => {
                trim.ends()
                    .into_iter()
                    .fold(0.0, |reach: f64, s| reach.max(trim.root(s)[0]))
                    + trim.length
            }
            false => 0.0,
        };
        let (pose, depth) = (
            Pose::of(&settings.tool),
            settings.process.penetration_depth_m,
        );
        let setting = PassConditions {
            pose,
            shape,
            is_rotary: true,
            reach,
            depth,
            removal: RemovalLaw::of(settings),
        };
        let pass = Self::assemble(
            settings,
            tool,
            part,
            settings.tool_radius_m(),
            passage,
            setting,
        );
        if pass.all_round {
            pass.on_ramp(settings)
        } else {
            pass
        }
    }

    /// Lets the workpiece rise to its place in the turn before the first.
    fn on_ramp(mut self, settings: &Settings) -> Self {
        /// Clearance at the start, over the free length.
        const START_CLEARANCE_SHARE: f64 = 1e-6;
        let rigid = Rigid {
            filament: &self.filament,
            shape: self.setting.shape.as_ref(),
        };
        let deepest = rigid.depth() * (1.0 + 1e-3) + START_CLEARANCE_SHARE * self.filament_length;
        let way = match settings.tube() {
            Some(_) => Way::Inwards(deepest),
            None => Way::Along(scale(
                settings.process.penetration_depth_m.max(deepest),
                unit_normal(&settings.workpiece),
            )),
        };
        let ramp = Ramp {
            way,
            duration: TAU / self.filament.motion.rate,
        };
        self.filament.workpiece = self.filament.workpiece.on_ramp(ramp);
        if !self.filament.workpiece.is_planar() {
            self.form = Form::Spatial;
        }
        if settings.starts_leaning() {
            self.filament.motion.tool.leans_from = Some(self.filament.motion.initial_angle);
        }
        self
    }
}

impl<T: Tool + Clone, W: Workpiece + Clone> Pass<T, W> {
    /// Creates the pass of `tool` over `workpiece`. `settings` state everything else.
    ///
    /// The tool turns at `ω = v_b/R`, with `v_b` from the settings and the tool's own radius. The
    /// settings of the body's radius, of the kind and pose of the tool, the workpiece and the
    /// penetration depth are not used.
    ///
    /// # Errors
    /// If the undeformed tips have no [contact arc](Workpiece::contact_arc) on the workpiece.
    pub fn with(settings: &Settings, tool: T, workpiece: W) -> Result<Self, NoContactArc> {
        let length = settings.filament.length_m;
        let tip = |angle: f64| {
            let clamp = tool.clamp(angle, 0.0);
            add(clamp.position, scale(length, clamp.direction))
        };
        let arc = workpiece.contact_arc(&tip).ok_or(NoContactArc)?;
        let radius = tool.radius(length);
        let depth = settings.process.penetration_depth_m;
        let removal = RemovalLaw::of(settings);
        let setting = PassConditions {
            pose: Pose::UPRIGHT,
            shape: None,
            is_rotary: false,
            reach: 0.0,
            depth,
            removal,
        };
        Ok(Self::assemble(
            settings,
            tool,
            workpiece,
            radius,
            arc.into(),
            setting,
        ))
    }

    fn assemble(
        settings: &Settings,
        tool: T,
        workpiece: W,
        tool_radius: f64,
        passage: Passage,
        setting: PassConditions,
    ) -> Self {
        let Settings {
            tool: brush,
            filament,
            contact,
            process,
            solver,
            ..
        } = settings;
        let nominal = NominalContact::new(tool_radius, process.brushing_velocity_m_s, &passage);
        let ContactArc { middle, angle } = passage.window;
        // A rate that is small for a vibrating filament: slow tools need no finer scale.
        let slow_rate = 0.01 * filament::first_natural_frequency(filament);
        let gravity = setting.pose.to_tool(process.gravity_m_s2);
        let planar = tool.is_planar() && workpiece.is_planar() && gravity[2] == 0.0;
        let chain = filament::chain(filament, gravity);
        // A straight, thin filament of a tool from the settings is the undeformed one, and touches
        // no earlier.
        let is_nominal = setting.is_rotary
            && setting.shape.is_none()
            && contact.radius_m == 0.0
            && filament.lateral_tilt_rad == 0.0
            && filament.waviness_amplitude_m == 0.0;
        let [ahead, behind] = match &setting.shape {
            None => reach_around(&tool.clamp(middle, 0.0), &chain),
            Some(_) => [0.0; 2],
        };
        let mut tail_angle = process.tail_angle_rad + behind;
        let entry = middle - angle / 2.0;
        let initial_angle = entry - (process.lead_angle_rad + ahead);
        let law = ContactLaw::from(contact);
        let filament_length = filament.length_m;
        let mass: f64 = chain.links.iter().map(|link| link.mass).sum();
        let mut filament = Filament {
            chain,
            motion: Turning {
                tool,
                rate: nominal.rate(),
                initial_angle,
            },
            law,
            workpiece,
        };
        let mut all_round = passage.all_round;
        let mut lead_angle = process.lead_angle_rad + ahead;
        if !is_nominal && !all_round {
            let farthest = TAU - angle - tail_angle - process.lead_angle_rad;
            let rigid = Rigid {
                filament: &filament,
                shape: setting.shape.as_ref(),
            };
            let early = rigid.early_touch(entry, process.lead_angle_rad, farthest);
            // Bent filaments may touch during the whole turn where straight ones do not.
            all_round = early.is_none() && setting.shape.is_some();
            let early = early.unwrap_or(0.0);
            if early > ahead + ANGLE_TOLERANCE_RAD {
                lead_angle = process.lead_angle_rad + early;
                // Filaments are bent in the plane of the axis, and leave as late as they come
                // early.
                tail_angle += if setting.shape.is_some() { early } else { 0.0 };
            }
        }
        if all_round {
            (lead_angle, tail_angle) = (0.0, 0.0);
        }
        filament.motion.initial_angle = entry - lead_angle;
        let time = |angle: f64| (lead_angle + angle) / nominal.rate();
        let rate_scale = (nominal.brushing_velocity / filament_length).max(slow_rate);
        // Where a node comes off, its force ceases while contact damping still takes the stored
        // energy. The motion does not show this.
        let damps = filament.law.damping > 0.0;
        let touching: f64 = passage.touches.iter().map(|[from, to]| to - from).sum();
        let soft = filament.law.force_at_rest(setting.depth) * touching / nominal.rate();
        let energy = if damps {
            mass * (rate_scale * filament_length).powi(2)
        } else {
            f64::INFINITY
        };
        Self {
            form: if planar { Form::Planar } else { Form::Spatial },
            filament,
            nominal,
            touches: match all_round {
                true => vec![[0.0, TAU / nominal.rate()]],
                false => passage
                    .touches
                    .iter()
                    .map(|touch| touch.map(time))
                    .collect(),
            },
            all_round,
            setting,
            filament_length,
            filament_count: brush.filament_count,
            tolerances: Tolerances {
                relative: solver.relative_tolerance,
                coordinate_scale: 1.0,
                rate_scale,
                // A tenth of the momentum of the filament: the whole momentum did not resolve
                // reversals of friction. A very soft contact has less: its impulse on an undeformed
                // filament.
                integral_scales: [(mass * nominal.brushing_velocity).min(soft), energy]
                    .map(|size| 0.1 * size),
            },
            lead_angle,
            tail_angle,
            turns: process.turns.unwrap_or(if all_round {
                Turns::Steady
            } else {
                Turns::default()
            }),
            stop: None,
            is_refined: false,
        }
    }
}
