//! Other codes, with the same model.

use bristle::simulation::{Sample, Simulation, simulate_with_history};
use serde::Deserialize;

use super::chains::{extrapolated, paper_case, trajectory_rows, worse};
use super::group::{Extent, Failure, Group};
use super::sources::Source;
use super::tolerances::Tolerance;
use super::trial::{Axis, Curve, Figure, Look, Trial};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Other codes",
    purpose: "One pass of the paper's filament (v_b = 10 m/s, a_e = 1 mm: four contacts, some struck, some swept) in other codes. \
        Their trajectories of 1001 instants are committed with the scripts that made them. Each file states its command, versions, \
        settings and error.",
    trials: &[cvodes, mujoco, ancf],
};

/// An instant of another code's trajectory.
#[derive(Deserialize)]
pub struct Row {
    /// In s.
    pub time_s: f64,
    /// In N.
    pub contact_normal_force_n: f64,
    tip_x_m: f64,
    tip_y_m: f64,
    tip_deflection_m: f64,
}

/// A row of the metrics of other codes.
#[derive(Deserialize)]
struct PeerMetrics {
    code: String,
    contact_normal_impulse_n_s: f64,
    contact_time_s: f64,
    contact_count: usize,
    peak_contact_normal_force_n: f64,
    max_tip_deflection_m: f64,
}

/// Bristle's pass with `segments` segments, sampled at the instants of the other codes.
fn pass(segments: usize) -> Result<Simulation, Failure> {
    let mut settings = paper_case(segments, 10.0, 1e-3)?;
    settings.solver.relative_tolerance = 1e-10;
    Ok(simulate_with_history(&settings, 1001)?)
}

/// Largest distance of the tips over l_f, largest difference of the tip deflections over the
/// largest deflection, and root mean square of the force difference over that of the force.
pub fn distances(history: &[Sample], rows: &[Row]) -> [f64; 3] {
    let (mut tip, mut deflection, mut largest, mut force, mut difference) =
        (0.0, 0.0, 0.0_f64, 0.0, 0.0);
    for (sample, row) in history.iter().zip(rows) {
        tip = worse(
            (sample.tip_x_m - row.tip_x_m).hypot(sample.tip_y_m - row.tip_y_m),
            tip,
        );
        deflection = worse(
            (sample.tip_deflection_m - row.tip_deflection_m).abs(),
            deflection,
        );
        largest = largest.max(row.tip_deflection_m);
        force += row.contact_normal_force_n.powi(2);
        difference += (sample.contact_normal_force_n - row.contact_normal_force_n).powi(2);
    }
    [
        tip / 0.040,
        deflection / largest,
        (difference / force).sqrt(),
    ]
}

/// The data of another code, and the tolerances for it.
struct Peer {
    code: &'static str,
    rows: &'static str,
    source: &'static Source,
    /// For the trajectory of the tip, the force over time, the metrics, and the peak force.
    tolerances: [&'static Tolerance; 4],
}

impl Peer {
    /// Compares a pass and its metrics, in the order of [`metrics`], in a trial. Returns the
    /// trajectory of the other code.
    fn compare(
        &self,
        trial: &mut Trial,
        history: &[Sample],
        subject: &str,
        metrics: [f64; 5],
    ) -> Result<Vec<Row>, Failure> {
        const METRICS: &str = include_str!("../../../benches/peers/trajectories/pass_metrics.csv");
        let rows: Vec<Row> = trajectory_rows(self.rows)?;
        if rows.len() != history.len()
            || rows
                .iter()
                .zip(history)
                .any(|(a, b)| (a.time_s - b.time_s).abs() > 1e-12)
        {
            return Err(Failure::Reference(format!(
                "{}: its instants differ from those of the pass",
                self.code
            )));
        }
        let expected = trajectory_rows::<PeerMetrics>(METRICS)?
            .into_iter()
            .find(|metrics| metrics.code == self.code);
        let expected =
            expected.ok_or_else(|| Failure::Reference(format!("no metrics of {}", self.code)))?;
        let [tip, force, of_metrics, of_peak] = self.tolerances;
        let [of_tip, of_deflection, of_force] = distances(history, &rows);
        let [impulse, deflection, peak, time, count] = metrics;
        for (quantity, expected, computed, tolerance) in [
            ("tip, over l_f", 0.0, of_tip, tip),
            ("s_n, over s_n,max", 0.0, of_deflection, tip),
            ("F_n, rms over rms", 0.0, of_force, force),
            (
                "p_n in N s",
                expected.contact_normal_impulse_n_s,
                impulse,
                of_metrics,
            ),
            (
                "s_n,max in m",
                expected.max_tip_deflection_m,
                deflection,
                of_metrics,
            ),
            (
                "max F_n in N",
                expected.peak_contact_normal_force_n,
                peak,
                of_peak,
            ),
            ("t_c in s", expected.contact_time_s, time, of_metrics),
            (
                "number of contacts",
                expected.contact_count as f64,
                count,
                tolerances::SAME,
            ),
        ] {
            trial.check(
                subject,
                quantity,
                expected,
                self.source,
                computed,
                tolerance,
            );
        }
        Ok(rows)
    }
}

/// The metrics to compare.
fn metrics(pass: &Simulation) -> [f64; 5] {
    let metrics = &pass.metrics;
    [
        metrics.contact_normal_impulse_n_s,
        metrics.max_tip_deflection_m,
        metrics.peak_contact_normal_force_n,
        metrics.contact_time_s,
        metrics.contact_count as f64,
    ]
}

const CVODES: Peer = Peer {
    code: "CasADi and CVODES",
    rows: include_str!("../../../derivations/trajectories/pass_casadi_cvodes.csv"),
    source: sources::CVODES_PASS,
    tolerances: [
        tolerances::CVODES_TIP,
        tolerances::CVODES_FORCE,
        tolerances::CVODES_METRICS,
        tolerances::CVODES_METRICS,
    ],
};

const MUJOCO: Peer = Peer {
    code: "MuJoCo",
    rows: include_str!("../../../benches/peers/trajectories/pass_mujoco.csv"),
    source: sources::MUJOCO,
    tolerances: [
        tolerances::MUJOCO_TIP,
        tolerances::MUJOCO_FORCE,
        tolerances::MUJOCO_METRICS,
        tolerances::MUJOCO_METRICS,
    ],
};

const ANCF: Peer = Peer {
    code: "Exudyn ANCF",
    rows: include_str!("../../../benches/peers/trajectories/pass_exudyn_ancf.csv"),
    source: sources::EXUDYN,
    tolerances: [
        tolerances::ANCF_TIP,
        tolerances::ANCF_FORCE,
        tolerances::ANCF_METRICS,
        tolerances::ANCF_PEAK,
    ],
};

/// A diagram of the force over time from Bristle and from another code.
fn force_figure(name: &'static str, code: &str, history: &[Sample], rows: &[Row]) -> Figure {
    Figure {
        name,
        title: format!("Contact normal force of one pass, Bristle and {code}"),
        description: "Force over time: short impacts of up to 6 N, and longer contacts of about 1 N; the curves of both codes coincide.",
        axes: [Axis::linear("time t in ms"), Axis::linear("F_n in N")],
        curves: vec![
            Curve::new(
                "Bristle",
                Look::Line,
                history
                    .iter()
                    .map(|sample| (1e3 * sample.time_s, sample.contact_normal_force_n)),
            ),
            Curve::new(
                code,
                Look::Markers,
                rows.iter()
                    .step_by(8)
                    .map(|row| (1e3 * row.time_s, row.contact_normal_force_n)),
            ),
        ],
    }
}

fn cvodes(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "CasADi and CVODES: the chain in the plane",
        "The same chain of 25 segments, stated again for the plane alone, differentiated by CasADi and integrated by CVODES \
            at 1e-11. Agreement is limited by the error of CVODES, 1e-9 of l_f in the tip.",
    );
    let pass = pass(25)?;
    let rows = CVODES.compare(&mut trial, &pass.history, "n = 25", metrics(&pass))?;
    trial.figures.push(force_figure(
        "validation_cvodes",
        CVODES.code,
        &pass.history,
        &rows,
    ));
    Ok(trial)
}

fn mujoco(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "MuJoCo: rigid bodies on hinges",
        "A general multibody code with its own kinematics, joint springs, contact detection and soft contacts, applied to the \
            same chain. Its method is of first order. Agreement is limited by its step of 5 ns, which leaves an error of 8e-7 in the \
            impulse.",
    );
    let pass = pass(25)?;
    let rows = MUJOCO.compare(&mut trial, &pass.history, "n = 25", metrics(&pass))?;
    trial.figures.push(Figure {
        name: "validation_mujoco",
        title: "Tip deflection of one pass, Bristle and MuJoCo".to_owned(),
        description: "Tip deflection over time: it rises to 8.7 mm in bounces and a sweep, then swings back through zero to 7 mm; the \
            curves of both codes coincide.",
        axes: [Axis::linear("time t in ms"), Axis::linear("s_n in mm")],
        curves: vec![
            Curve::new(
                "Bristle",
                Look::Line,
                pass.history.iter().map(|sample| (1e3 * sample.time_s, 1e3 * sample.tip_deflection_m)),
            ),
            Curve::new(
                "MuJoCo",
                Look::Markers,
                rows.iter().step_by(16).map(|row| (1e3 * row.time_s, 1e3 * row.tip_deflection_m)),
            ),
        ],
    });
    Ok(trial)
}

fn ancf(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Exudyn: a beam in absolute nodal coordinates",
        "Not a chain, but the beam that the chain approximates: 64 cable elements of the absolute nodal coordinate \
            formulation, with the damping `2ζ/Ω_1 · E I`. Its axial stiffness is a thousand times that of the filament, as the \
            chain does not stretch. This checks the limit to which the chain converges. The metrics are extrapolated from n = 100 and \
            200; the trajectory is for n = 200. Agreement is limited by the remaining stretch of the beam: 2e-5 of l_f in the tip, \
            1e-5 in the impulse. (With the filament's own axial stiffness, which the model leaves out, the same pass has 1.8 % more \
            impulse, a peak force of 4.6 N instead of 6.1 N, and six contacts instead of four.)",
    );
    let (coarse, fine) = (pass(100)?, pass(200)?);
    let (of_coarse, of_fine) = (metrics(&coarse), metrics(&fine));
    let limits: [f64; 5] = std::array::from_fn(|i| extrapolated(of_coarse[i], of_fine[i]));
    let rows = ANCF.compare(&mut trial, &fine.history, "n = 200; metrics n → ∞", limits)?;
    trial.figures.push(force_figure(
        "validation_ancf",
        ANCF.code,
        &fine.history,
        &rows,
    ));
    Ok(trial)
}
