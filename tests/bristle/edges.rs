//! Is it right? Passes over edges, chamfers, cylinders, bores and splines, turns, and wavy and
//! tapered filaments, compared with an independent code: `derivations/passes.py` (groups
//! `edges`, `profiles`, `sliding`) states the chain again, and integrates it with CVODES.

use bristle::model::settings::{FilamentSettings, Settings, Turns, WorkpieceSettings};
use bristle::simulation::{Pass, Simulation, simulate_with_history};
use serde::Deserialize;
use serde_json::Value;

use crate::common::{Stated, case, cases, difference, exceeding, normal_impulse, number};

/// Largest difference beyond ten times the error that the reference states: of an impulse over
/// `p_n`, of times and work relative to themselves, and of the tip over `l_f`. The solver runs at
/// 1e-9, and both agree to 4e-7. Only the share of an edge differs, by up to 4e-6 of `p_n`, where a
/// tip slides from a face onto it.
const TOLERANCE: f64 = 5e-6;

/// Largest difference of the share of an edge onto which a tip slides from a face under force: the
/// solver locates this event to its tolerance. In one case it is 1.6e-4 at 1e-6, 5.6e-5 at 1e-8 and
/// 2.1e-5 at 1e-10.
const SLIDING_TOLERANCE: f64 = 5e-5;

/// Largest imbalance of the energies of a pass, relative to them: the error of one of some hundred
/// steps.
const MAX_IMBALANCE: f64 = 1e-7;

/// A case of `reference_edges.json` or `reference_profiles.json` in `tests/data/`.
#[derive(Deserialize)]
struct EdgeReference {
    name: String,
    filament: FilamentConstants,
    workpiece: WorkpieceSettings,
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    friction_coefficient: f64,
    turns: usize,
    start_angle_rad: f64,
    end_s: f64,
    turn_contact_normal_impulses_n_s: Vec<f64>,
    final_tip_m: [f64; 2],
    largest_edge_penetration_m: f64,
    own_error: f64,
    #[serde(flatten)]
    stated: Stated,
}

#[derive(Deserialize)]
struct FilamentConstants {
    segments: usize,
    tip_diameter_m: f64,
    waviness_amplitude_m: f64,
    waviness_length_m: Option<f64>,
    #[serde(default)]
    waviness_phase_rad: f64,
}

impl EdgeReference {
    fn settings(&self) -> Settings {
        let FilamentConstants {
            segments,
            tip_diameter_m,
            waviness_amplitude_m,
            waviness_length_m,
            waviness_phase_rad,
        } = self.filament;
        let mut settings = case(
            segments,
            self.brushing_velocity_m_s,
            self.penetration_depth_m,
        );
        settings.filament = FilamentSettings {
            tip_diameter_m: Some(tip_diameter_m),
            waviness_amplitude_m,
            waviness_length_m,
            waviness_phase_rad,
            ..settings.filament
        };
        settings.contact.friction_coefficient = self.friction_coefficient;
        settings.workpiece = self.workpiece.clone();
        settings.process.turns = Some(Turns::Count(self.turns));
        settings.solver.relative_tolerance = 1e-9;
        // The reference starts and ends at the angles of a straight filament.
        let (pass, process) = (Pass::new(&settings), &mut settings.process);
        process.lead_angle_rad -= self.start_angle_rad - pass.tool().angle(0.0);
        let rate = settings.angular_velocity_rad_s();
        if self.turns == 1 {
            settings.process.tail_angle_rad -=
                rate * (Pass::new(&settings).end_time() - self.end_s);
        }
        settings
    }

    /// The differences of a pass from the reference, each over its scale.
    fn differences(&self, pass: &Simulation) -> Vec<(&'static str, f64)> {
        let stated = |key: &str| self.stated.get(key).and_then(Value::as_f64);
        let normal = normal_impulse(&self.stated);
        let whole = stated("sliding_work_j").unwrap_or(1.0);
        // The uncertainty of an angle is that of its part of the work.
        let by_work =
            stated("edge_sliding_work_j").map_or(1.0, |work| whole / work.max(f64::MIN_POSITIVE));
        let always = [
            ("contact_time_s", number(&self.stated, "contact_time_s")),
            ("contact_normal_impulse_n_s", normal),
            ("contact_impulse_x_n_s", normal),
            ("contact_impulse_y_n_s", normal),
            ("edge_contact_normal_impulse_n_s", normal),
            (
                "friction_work_j",
                number(&self.stated, "friction_work_j").max(1e-6),
            ),
            ("contact_angular_impulse_n_m_s", normal * 0.18),
        ];
        let peak = stated("peak_contact_normal_force_n").unwrap_or(1.0);
        let sometimes = [
            ("peak_contact_normal_force_n", peak),
            ("sliding_work_j", whole),
            // The work on an edge is as uncertain as its share of the impulse.
            ("edge_sliding_work_j", whole),
            ("edge_work_angle_rad", by_work),
            ("edge_work_angle_std_rad", by_work),
        ];
        let sometimes = sometimes
            .into_iter()
            .filter(|(key, _)| stated(key).is_some());
        let metrics = &pass.metrics;
        let mut found: Vec<_> = always
            .into_iter()
            .chain(sometimes)
            .map(|(key, scale)| difference(metrics, &self.stated, key, scale))
            .collect();
        let end = pass.history.last().expect("there are two samples");
        let [x, y] = self.final_tip_m;
        found.extend([
            ("end_s", (end.time_s / self.end_s - 1.0).abs()),
            ("tip_x_m", (end.tip_x_m - x).abs() / 0.04),
            ("tip_y_m", (end.tip_y_m - y).abs() / 0.04),
        ]);
        if self.largest_edge_penetration_m > 0.0 {
            // The reference samples it every microsecond, in which an impact changes by some per
            // cent.
            let ratio = metrics.max_edge_penetration_m / self.largest_edge_penetration_m;
            found.push((
                "max_edge_penetration_m",
                TOLERANCE / 0.03 * (ratio - 1.0).abs(),
            ));
        }
        let impulses = &pass.turn_contact_normal_impulses_n_s;
        assert_eq!(impulses.len(), self.turns);
        let turns = impulses.iter().zip(&self.turn_contact_normal_impulses_n_s);
        found.extend(turns.map(|(impulse, expected)| {
            (
                "turn_contact_normal_impulses_n_s",
                (impulse / expected - 1.0).abs(),
            )
        }));
        found
    }
}

#[test]
fn passes_agree_with_casadi_and_cvodes() {
    for (file, count, of_edges) in [
        ("reference_edges.json", 80, TOLERANCE),
        ("reference_profiles.json", 27, SLIDING_TOLERANCE),
        ("reference_sliding.json", 14, SLIDING_TOLERANCE),
    ] {
        agree(file, count, of_edges);
    }
}

/// Compares the `count` cases of a file. The shares of edges agree to `of_edges`.
fn agree(file: &str, count: usize, of_edges: f64) {
    let cases: Vec<EdgeReference> = cases(file);
    assert_eq!(cases.len(), count);
    let mut failures = Vec::new();
    for case in cases {
        let pass = simulate_with_history(&case.settings(), 2).expect("the settings are valid");
        let subject = format!(
            "{}, {} m/s, {} m, µ = {}",
            case.name,
            case.brushing_velocity_m_s,
            case.penetration_depth_m,
            case.friction_coefficient
        );
        let is_of_edge = |(name, _): &(&str, f64)| name.starts_with("edge_");
        let (edges, others) = case.differences(&pass).into_iter().partition(is_of_edge);
        let limits: [(Vec<_>, f64); 2] = [(edges, of_edges), (others, TOLERANCE)];
        for (differences, limit) in limits {
            let limit = limit + 10.0 * case.own_error;
            failures.extend(exceeding(&subject, &differences, limit));
        }
        let balance = [("energy_residual", pass.metrics.energy_residual)];
        failures.extend(exceeding(&subject, &balance, MAX_IMBALANCE));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
