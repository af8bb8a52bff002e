//! Pairs of simulations that must have the same metrics.

use std::fmt::{self, Display, Formatter};

use bristle::model::parameters::PARAMETERS;
use bristle::model::settings::{
    BrushSettings, ChamferSettings, ContactSettings, EdgeSettings, FilamentSettings,
    ProcessSettings, Settings, SolverSettings, ToolSettings, Turns, WorkpieceKind,
};

/// A simulation of a pair.
#[derive(Clone, Debug)]
pub enum Run {
    /// One filament.
    Alone(Settings),
    /// One filament whose planar motion is integrated in space.
    InSpace(Settings),
    /// The brush of the settings.
    Brush(Settings),
    /// The brush without any shortcut: all filaments are solved, and all pairs of points and
    /// segments searched.
    Exhaustive(Settings),
    /// One filament, for the energy that its joints dissipate before the contact.
    Settled(Settings),
    /// A filament at rest relative to the tool, which dissipates nothing: the other half of the
    /// pair.
    AtRest,
}

/// Two simulations.
#[derive(Clone, Debug)]
pub struct Pair {
    pub runs: [Run; 2],
    /// Angle by which the second set-up is turned about `z`, in rad.
    pub turned_by: f64,
    /// `true` if the second set-up is the mirror image of the first one along `z`.
    pub is_mirrored: bool,
    /// Allowed difference of the numbers where the motion is not sensitive.
    pub tolerance: f64,
}

impl Run {
    /// The settings that are simulated.
    pub fn settings(&self) -> Option<&Settings> {
        match self {
            Self::Alone(settings)
            | Self::InSpace(settings)
            | Self::Brush(settings)
            | Self::Exhaustive(settings)
            | Self::Settled(settings) => Some(settings),
            Self::AtRest => None,
        }
    }

    /// Returns the run with other settings.
    pub fn with(&self, change: impl FnOnce(&mut Settings)) -> Self {
        let mut run = self.clone();
        match &mut run {
            Self::Alone(settings)
            | Self::InSpace(settings)
            | Self::Brush(settings)
            | Self::Exhaustive(settings)
            | Self::Settled(settings) => {
                change(settings);
            }
            Self::AtRest => {}
        }
        run
    }
}

/// Writes an input file with the settings that are not their defaults.
impl Display for Run {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let Some(settings) = self.settings() else {
            return Ok(());
        };
        let kind = &settings.workpiece.kind;
        let mut defaults = settings.clone();
        let ToolSettings {
            body_radius_m,
            width_m,
            filament_count,
            ..
        } = settings.tool;
        defaults.tool = ToolSettings::new(body_radius_m, width_m, filament_count);
        defaults.brush = settings.brush.as_ref().map(|_| BrushSettings::default());
        (defaults.contact, defaults.solver) =
            (ContactSettings::default(), SolverSettings::default());
        defaults.workpiece =
            serde_json::from_value(serde_json::json!({ "kind": kind.name() })).expect("a kind");
        defaults.filament =
            FilamentSettings::new(settings.filament.length_m, settings.filament.diameter_m);
        defaults.process = ProcessSettings::new(0.0, 0.0);
        match self {
            Self::InSpace(_) => writeln!(formatter, "# integrated in space")?,
            Self::Exhaustive(_) => writeln!(formatter, "# without shortcuts")?,
            _ => {}
        }
        for parameter in PARAMETERS
            .iter()
            .filter(|parameter| parameter.instead_of.is_empty())
        {
            let Some(value) = parameter.read(settings) else {
                continue;
            };
            if parameter.required || value != parameter.get(&defaults) {
                writeln!(
                    formatter,
                    "{} = {}",
                    parameter.path,
                    parameter.format(value)
                )?;
            }
        }
        writeln!(
            formatter,
            "tool.kind = {:?}",
            format!("{:?}", settings.tool.kind).to_lowercase()
        )?;
        writeln!(
            formatter,
            "process.gravity_m_s2 = {:?}",
            settings.process.gravity_m_s2
        )?;
        writeln!(formatter, "workpiece.kind = {:?}", kind.name())?;
        match kind {
            WorkpieceKind::Plane(plane) => {
                writeln!(formatter, "workpiece.normal = {:?}", plane.normal)?
            }
            WorkpieceKind::Edge(EdgeSettings { side, .. })
            | WorkpieceKind::Chamfer(ChamferSettings { side, .. }) => {
                writeln!(
                    formatter,
                    "workpiece.side = {:?}",
                    format!("{side:?}").to_lowercase()
                )?;
            }
            WorkpieceKind::Profile(profile) => {
                writeln!(
                    formatter,
                    "workpiece.control_points_m = {:?}",
                    profile.control_points_m
                )?;
            }
            WorkpieceKind::Cylinder(_) | WorkpieceKind::Bore(_) => {}
        }
        if settings.process.turns() == Turns::Steady {
            writeln!(
                formatter,
                "# and process.turns = {:?} instead",
                Turns::STEADY
            )?;
        }
        if let Some(brush) = &settings.brush {
            writeln!(formatter, "brush.steady = {}", brush.steady)?;
        }
        Ok(())
    }
}

/// Writes the input file of the first run, and the lines that differ in the other.
impl Display for Pair {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let [one, other] = self.runs.each_ref().map(Run::to_string);
        formatter.write_str(&one)?;
        let is_other = |line: &&str| !one.lines().any(|other| other == *line);
        other
            .lines()
            .filter(is_other)
            .try_for_each(|line| writeln!(formatter, "# and: {line}"))
    }
}

impl Pair {
    /// The settings of the first run.
    pub fn settings(&self) -> &Settings {
        self.runs[0].settings().expect("the first one is simulated")
    }

    /// `true` if a brush is simulated.
    pub fn is_of_brush(&self) -> bool {
        self.runs
            .iter()
            .any(|run| matches!(run, Run::Brush(_) | Run::Exhaustive(_)))
    }

    pub fn new(runs: [Run; 2], tolerance: f64) -> Self {
        Self {
            runs,
            turned_by: 0.0,
            is_mirrored: false,
            tolerance,
        }
    }

    /// Creates two passes of one filament at the relative tolerance `relative`.
    pub fn alone(one: &Settings, other: &Settings, relative: f64) -> Self {
        let runs = [one, other].map(|settings| Run::Alone(at(settings, relative)));
        Self::new(runs, MAX_ERROR_RATIO * relative)
    }
}

/// Error of a pass over the tolerance, which holds for each of its some hundred steps: their errors
/// add up to at most this. It also holds for passes that differ by rounding, which changes the
/// steps.
pub const MAX_ERROR_RATIO: f64 = 300.0;

/// Returns the settings with another relative tolerance.
pub fn at(settings: &Settings, relative_tolerance: f64) -> Settings {
    let mut settings = settings.clone();
    settings.solver.relative_tolerance = relative_tolerance;
    settings
}
