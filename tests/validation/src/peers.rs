//! Other codes, with the same model.

use bristle::simulation::{Sample, Simulation, simulate_with_history};
use serde::Deserialize;

use super::chains::{extrapolated, paper_case, trajectory_rows, worse};
use super::sources::ReferenceSource;
use super::tolerances::Tolerance;
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// An instant of another code's trajectory.
#[derive(Deserialize)]
struct PeerInstant {
    time_s: f64,
    contact_normal_force_n: f64,
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
///
/// # Errors
/// If the instants differ.
fn distances(history: &[Sample], rows: &[PeerInstant]) -> Result<[f64; 3], Failure> {
    let differ =
        |(row, sample): (&PeerInstant, &Sample)| (row.time_s - sample.time_s).abs() > 1e-12;
    if rows.len() != history.len() || rows.iter().zip(history).any(differ) {
        return Err("the reference has other instants than the pass".into());
    }
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
    Ok([
        tip / 0.040,
        deflection / largest,
        (difference / force).sqrt(),
    ])
}

/// The data of another code, and the tolerances for it.
struct Peer {
    code: &'static str,
    rows: &'static str,
    source: &'static ReferenceSource,
    /// Tolerances of the trajectory of the tip, the force over time, the metrics, and the peak
    /// force.
    tolerances: [&'static Tolerance; 4],
}

impl Peer {
    /// Compares a pass and its metrics, in the order of [`metrics`], in a trial.
    fn compare(
        &self,
        trial: &mut Trial,
        history: &[Sample],
        subject: &str,
        metrics: [f64; 5],
    ) -> TrialResult {
        const METRICS: &str = include_str!("../../../benches/peers/trajectories/pass_metrics.csv");
        let rows: Vec<PeerInstant> = trajectory_rows(self.rows)?;
        let expected = trajectory_rows::<PeerMetrics>(METRICS)?
            .into_iter()
            .find(|metrics| metrics.code == self.code)
            .ok_or("no metrics of this code")?;
        let [tip, force, of_metrics, of_peak] = self.tolerances;
        let [of_tip, of_deflection, of_force] = distances(history, &rows)?;
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
        Ok(())
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

/// The chain of 25 segments, stated again for the plane, by CasADi and CVODES at 1e-11.
pub fn cvodes(trial: &mut Trial) -> TrialResult {
    let pass = pass(25)?;
    CVODES.compare(trial, &pass.history, "n = 25", metrics(&pass))
}

/// The continuous beam that the chain approximates: 64 cable elements in absolute nodal
/// coordinates.
///
/// Its axial stiffness is a thousand times that of the filament, as the chain does not stretch. The
/// trajectory is for n = 200.
pub fn ancf(trial: &mut Trial) -> TrialResult {
    let (coarse, fine) = (pass(100)?, pass(200)?);
    let (of_coarse, of_fine) = (metrics(&coarse), metrics(&fine));
    let limits: [f64; 5] = std::array::from_fn(|i| extrapolated(of_coarse[i], of_fine[i]));
    ANCF.compare(trial, &fine.history, "n = 200; metrics n → ∞", limits)
}
