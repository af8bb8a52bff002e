//! Tables of measured forces, read and compared in this process.

use bristle_grid::{CaseResult, Study};
use bristle_input::measured::{Format, Measurement, Quantity, measured_text, read_measured};
use bristle_insight::measured::{compare, comparison_table, unusual_points, write_comparison};
use bristle_text::layout::WIDTH;
use fastrand::Rng;

use super::{STUDY, change_table, simulated};
use crate::runner::{Mutant, Target, Verdict};

/// Measured forces within the study and outside of it.
pub const FORCES: &str = "\
brushing_velocity_m_s,penetration_depth_m,force_n,std_n,note
5.0,0.001,110.5,4.0,first
7.5,0.001,95.25,3.5,between
20.0,0.001,60.0,0.0,last
25.0,0.002,1e2,5.0,outside
";

const ROWS: u32 = 60_000;

/// Tables of measured forces.
pub struct Measured {
    study: Study,
    results: Vec<CaseResult>,
}

impl Measured {
    pub fn new() -> Self {
        let (study, results) = simulated(STUDY);
        Self { study, results }
    }

    /// Compares the forces with the study: a bounded table for people, and one row per point in a
    /// file.
    fn compare(&self, points: &[Measurement]) {
        let comparisons = compare(&self.study, &self.results, points);
        let mut written = Vec::new();
        write_comparison(&mut written, &comparisons).expect("memory takes what is written to it");
        let table = comparison_table(&comparisons, WIDTH);
        assert!(table.len() < 20_000, "a table of {} bytes", table.len());
        let rows = String::from_utf8(written).expect("a table is text");
        assert!(unusual_points(&self.study, points).len() <= 3);
        assert_eq!(rows.lines().count(), 1 + comparisons.len() * points.len());
        for report in [table, rows] {
            assert!(
                !report.contains("NaN") && !report.contains("inf"),
                "not finite: {report:.1000}"
            );
        }
    }
}

/// A table so long that it must be read in linear time.
fn many_rows() -> String {
    let row = |index: u32| format!("{:?},0.001,100.0,4.0\n", 5.0 + f64::from(index) * 1e-4);
    [
        Quantity::Velocity,
        Quantity::Depth,
        Quantity::Force,
        Quantity::Std,
    ]
    .map(Quantity::key)
    .join(",")
        + "\n"
        + &(0..ROWS).map(row).collect::<String>()
}

impl Target for Measured {
    fn name(&self) -> &'static str {
        "measured"
    }

    fn count(&self) -> usize {
        2_000
    }

    fn originals(&self) -> Vec<Mutant> {
        vec![
            Mutant::file("", "forces.csv", FORCES),
            Mutant::file("", "forces.csv", many_rows()),
        ]
    }

    fn refusals(&self) -> Vec<(Mutant, &'static str)> {
        let twice = FORCES.replace(",note", ",force_n").replace("first", "1.0");
        vec![(
            Mutant::file("a heading twice", "forces.csv", twice),
            "force_n",
        )]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        let (change, bytes) = change_table(FORCES, random);
        Mutant::file(change, "forces.csv", bytes)
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let points = read_measured(&mutant.text(0), "forces.csv", &Format::default())?;
        assert_eq!(
            read_measured(
                &measured_text(&points, &[]),
                "again.csv",
                &Format::default()
            )
            .as_ref(),
            Ok(&points)
        );
        self.compare(&points);
        Ok(())
    }
}
