//! Parts shared by several test files: the paper's filament, random states, and tolerances with
//! their reasons.
#![allow(dead_code, reason = "each test file uses a part")]

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use bristle::equations::linear::{add, scale};
use bristle::equations::{Chain, ChainDynamics, Clamp, Dynamics, NoLoads, PolarAxis, RelaxedAngle};
use bristle::model::filament;
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{
    BrushSettings, EdgeSettings, FilamentSettings, Settings, Side, WorkpieceKind,
};
use bristle::simulation::{
    Job, Kind, NoContactArc, Pass, Sampling, Simulation, SimulationError, sample_any_side_by_side,
    simulate,
};
use bristle::tool::{Tool, radial_clamp};
use bristle::workpiece::{ContactArc, Edge, ProfileCells, Surface, Workpiece};
use fastrand::Rng;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Tolerances, each with its reason.
pub mod tolerance {
    /// Two ways to compute the same numbers in double precision, over recursions of up to 30
    /// segments.
    pub const AGREEMENT: f64 = 1e-12;
    /// Central differences: truncation `ε²` and cancellation `1e-16/ε` balance near 1e-10 for `ε =
    /// 1e-5`. The tangents mix terms whose sizes differ by up to 1e3.
    pub const DIFFERENCES: f64 = 1e-6;
}

/// The text of a file of reference data.
pub fn data(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The paper's filament with `segments` segments.
pub fn filament(segments: usize) -> FilamentSettings {
    case(segments, 0.0, 0.0).filament
}

/// A case of the paper at the brushing velocity `velocity` (m/s) and the penetration depth `depth`
/// (m).
pub fn case(segments: usize, velocity: f64, depth: f64) -> Settings {
    let mut settings = Settings::paper(velocity, depth);
    settings.filament.segments = segments;
    settings
}

/// An edge of a right angle.
pub fn edge(side: Side, offset_m: f64, edge_radius_m: f64) -> WorkpieceKind {
    WorkpieceKind::Edge(EdgeSettings {
        side,
        offset_m,
        edge_radius_m,
        ..EdgeSettings::default()
    })
}

/// The cases of a file of reference data.
pub fn cases<T: DeserializeOwned>(name: &str) -> Vec<T> {
    #[derive(Deserialize)]
    struct CaseList<T> {
        cases: Vec<T>,
    }

    let CaseList { cases } = serde_json::from_str(&data(name)).expect(name);
    cases
}

/// Returns the settings with a changed brush.
pub fn with(settings: &Settings, change: impl FnOnce(&mut BrushSettings)) -> Settings {
    let mut brush = settings.brush.clone().expect("a brush");
    change(&mut brush);
    Settings {
        brush: Some(brush),
        ..settings.clone()
    }
}

/// The metrics of a pass.
pub fn metrics(settings: &Settings) -> Metrics {
    simulate(settings)
        .unwrap_or_else(|error| panic!("{error}: {settings:?}"))
        .metrics
}

/// A metric by its key.
pub fn metric(metrics: &Metrics, key: &str) -> f64 {
    Metrics::COLUMNS
        .iter()
        .find(|column| column.key == key)
        .expect(key)
        .get(metrics)
}

/// Numbers that an independent code states of a contact, mostly by the keys of metrics.
pub type Stated = serde_json::Map<String, serde_json::Value>;

/// The stated number of a key.
pub fn number(stated: &Stated, key: &str) -> f64 {
    stated[key].as_f64().expect(key)
}

/// Difference of a metric from the stated one, over a scale.
pub fn difference(
    found: &Metrics,
    stated: &Stated,
    key: &'static str,
    scale: f64,
) -> (&'static str, f64) {
    (
        key,
        ((metric(found, key) - number(stated, key)) / scale).abs(),
    )
}

/// The stated impulse along the normal.
pub fn normal_impulse(stated: &Stated) -> f64 {
    number(stated, "contact_normal_impulse_n_s")
}

/// The differences of the impulses along all axes from the stated ones, over the one along the
/// normal.
pub fn impulse_differences(found: &Metrics, stated: &Stated) -> [(&'static str, f64); 4] {
    [
        "contact_normal_impulse_n_s",
        "contact_impulse_x_n_s",
        "contact_impulse_y_n_s",
        "contact_impulse_z_n_s",
    ]
    .map(|key| difference(found, stated, key, normal_impulse(stated)))
}

/// The differences that exceed a tolerance, in words.
pub fn exceeding(
    subject: &str,
    differences: &[(&'static str, f64)],
    tolerance: f64,
) -> Vec<String> {
    differences
        .iter()
        .filter(|(_, difference)| difference.is_nan() || *difference > tolerance)
        .map(|(name, difference)| format!("{subject}: {name} {difference:.1e} > {tolerance:.1e}"))
        .collect()
}

/// Simulates passes side by side, in lanes of equal kinds, and returns their results.
pub fn side_by_side<T: Tool + Clone, W: Workpiece + Clone>(
    sampling: Sampling,
    passes: impl IntoIterator<Item = Pass<T, W>>,
) -> Vec<Result<Simulation, SimulationError>> {
    let mut jobs: Vec<Job<T, W>> = passes
        .into_iter()
        .enumerate()
        .map(|(number, pass)| Job { number, pass })
        .collect();
    let mut results = vec![None; jobs.len()];
    let take = |kind: Option<Kind>| {
        let position = jobs
            .iter()
            .rposition(|job| kind.is_none_or(|kind| job.pass.kind() == kind))?;
        Some(jobs.swap_remove(position))
    };
    sample_any_side_by_side(sampling, take, |number, result| {
        assert!(
            results[number].replace(result).is_none(),
            "a pass is reported once"
        );
    });
    results
        .into_iter()
        .map(|result| result.expect("every pass is reported"))
        .collect()
}

/// A spatial state: a randomly bent, wavy filament of random segments away from the poles, with
/// rates as in a fast brush.
pub struct RandomState {
    pub chain: Chain<f64>,
    pub clamp: Clamp<f64>,
    pub q: Vec<[f64; 2]>,
    pub v: Vec<[f64; 2]>,
}

impl RandomState {
    /// The accelerations by the recursion, without loads, with the segments about the axes of
    /// `axis`.
    pub fn accelerations(&self, axis: PolarAxis) -> Vec<[f64; 2]> {
        let mut accelerations = vec![[0.0; 2]; self.q.len()];
        let mut dynamics = Dynamics::new(self.chain.clone());
        dynamics.set_chart(axis);
        dynamics.accelerations(
            self.clamp.holding(&self.q, &self.v),
            &NoLoads,
            &mut accelerations,
        );
        accelerations
    }
}

pub fn random_state(rng: &mut Rng, segments: usize) -> RandomState {
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    let gravity = [0; 3].map(|_| between(-20.0, 20.0));
    let mut chain = filament::chain(&filament(segments), gravity);
    for link in &mut chain.links {
        // It is neither straight nor uniform.
        for constant in [
            &mut link.mass,
            &mut link.inertia,
            &mut link.stiffness,
            &mut link.damping,
        ] {
            *constant *= between(0.5, 1.5);
        }
        link.relaxed_angle = RelaxedAngle::new(between(-0.3, 0.3));
    }
    let mut clamp = radial_clamp(
        0.14,
        between(-PI, PI),
        between(-200.0, 200.0),
        between(-1e4, 1e4),
    );
    let bend = 2.0 / (segments as f64).sqrt();
    let (mut phi, mut theta) = (FRAC_PI_2, clamp.direction[1].atan2(clamp.direction[0]));
    let mut q = Vec::new();
    for _ in 0..segments {
        phi = (phi + bend * between(-0.5, 0.5)).clamp(0.4, PI - 0.4);
        theta += bend * between(-0.5, 0.5);
        q.push([phi, theta]);
    }
    let v = (0..segments)
        .map(|_| [between(-200.0, 200.0), between(-200.0, 200.0)])
        .collect();
    // The clamp is at rest in a body that also turns about the filament.
    clamp.angular_velocity = add(
        clamp.angular_velocity,
        scale(between(-200.0, 200.0), clamp.direction),
    );
    RandomState { chain, clamp, q, v }
}

/// A random vector of pairs with components of size `size`.
pub fn random_pairs(rng: &mut Rng, segments: usize, size: f64) -> Vec<[f64; 2]> {
    (0..segments)
        .map(|_| [0; 2].map(|_| size * (2.0 * rng.f64() - 1.0)))
        .collect()
}

/// `M q̈ − f` by the recursion, without loads.
pub fn residual(state: &RandomState, accelerations: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut residual = vec![[0.0; 2]; state.q.len()];
    Dynamics::new(state.chain.clone()).residual(
        state.clamp.holding(&state.q, &state.v),
        accelerations,
        &NoLoads,
        &mut residual,
    );
    residual
}

pub fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |largest, value| value.abs().max(largest))
}

/// A tool of any type. Tests erase the types of their tools, so that the simulator is compiled for
/// one pair of types instead of six.
#[derive(Clone)]
pub struct AnyTool(Arc<dyn Tool>);

impl Tool for AnyTool {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        self.0.clamp(angle, rate)
    }

    fn radius(&self, filament_length: f64) -> f64 {
        self.0.radius(filament_length)
    }

    fn is_planar(&self) -> bool {
        self.0.is_planar()
    }

    fn undeformed(&self, angle: f64, rate: f64) -> [[f64; 2]; 2] {
        self.0.undeformed(angle, rate)
    }
}

/// A workpiece of any type.
#[derive(Clone)]
pub struct AnyWorkpiece(Arc<dyn Workpiece>);

impl Workpiece for AnyWorkpiece {
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        self.0.surface(position, time)
    }

    fn edges(&self) -> &[Edge] {
        self.0.edges()
    }

    fn is_planar(&self) -> bool {
        self.0.is_planar()
    }

    fn translates(&self) -> bool {
        self.0.translates()
    }

    fn largest_curvatures(&self) -> [f64; 2] {
        self.0.largest_curvatures()
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        self.0.profile(reach, longest)
    }

    fn arc_length(&self, position: [f64; 3], time: f64) -> Option<f64> {
        self.0.arc_length(position, time)
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.0.contact_arc(tip)
    }
}

/// Creates the pass of a tool and a workpiece of any types.
pub fn pass_with(
    settings: &Settings,
    tool: impl Tool + 'static,
    workpiece: impl Workpiece + 'static,
) -> Result<Pass<AnyTool, AnyWorkpiece>, NoContactArc> {
    Pass::with(
        settings,
        AnyTool(Arc::new(tool)),
        AnyWorkpiece(Arc::new(workpiece)),
    )
}
