//! The results of trials as lines of a terminal and as a table in Markdown.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use crate::tolerances::Measure;
use crate::trial::{Check, Expected, Trial, TrialResult};

/// The result of a trial.
pub struct Report {
    /// Name of the trial.
    pub name: &'static str,
    /// Comparisons, or the reason why there are none.
    pub checks: Result<Vec<Check>, String>,
}

impl Report {
    /// Computes a trial. A panic, which a defective solver can cause, fails only this trial.
    pub fn new(name: &'static str, compute: fn(&mut Trial) -> TrialResult) -> Self {
        let computed = catch_unwind(|| {
            let mut trial = Trial::default();
            compute(&mut trial).map(|()| trial.checks)
        });
        let checks = match computed {
            Ok(Ok(checks)) if checks.is_empty() => Err("compares nothing".to_owned()),
            Ok(result) => result.map_err(|failure| failure.to_string()),
            Err(_) => Err("panicked".to_owned()),
        };
        Self { name, checks }
    }

    /// `true` if there are comparisons and all are within their tolerances.
    pub fn passes(&self) -> bool {
        matches!(&self.checks, Ok(checks) if checks.iter().all(Check::passes))
    }
}

impl Display for Report {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let checks = match &self.checks {
            Ok(checks) => checks,
            Err(reason) => return write!(formatter, "FAILED {}: {reason},", self.name),
        };
        for check in checks.iter().filter(|check| !check.passes()) {
            writeln!(
                formatter,
                "{}: {}: {} is {:e} instead of {}, tolerance {}. {} {}",
                self.name,
                check.subject,
                check.quantity,
                check.computed,
                check.expected,
                check.tolerance,
                check.tolerance.reason,
                check.source.citation
            )?;
        }
        let share = |check: &Check| check.error() / check.tolerance.value.max(f64::MIN_POSITIVE);
        let largest = checks.iter().map(share).fold(0.0, f64::max);
        write!(
            formatter,
            "{:6} {}: {} comparisons, {largest:.2} of the tolerance,",
            if self.passes() { "ok" } else { "FAILED" },
            self.name,
            checks.len()
        )
    }
}

/// Directory of the record.
pub fn directory() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("../validation")
}

/// Writes all comparisons to `record.md`, with the tolerances and sources that they use.
pub fn write(reports: &[Report]) {
    let mut text = "# Validation\n\n| trial | for | quantity | reference | computed | error | \
        tolerance | source |\n|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let (mut tolerances, mut sources) = (BTreeMap::new(), BTreeMap::new());
    for Report { name, checks } in reports {
        for check in checks.iter().flatten() {
            let Check {
                subject,
                quantity,
                expected,
                computed,
                tolerance,
                source,
            } = check;
            text.push_str(&format!(
                "| {name} | {subject} | {quantity} | {expected} | {computed:e} | {:.1e} |",
                check.error()
            ));
            text.push_str(&format!(" {} | {} |\n", tolerance.name, source.name));
            tolerances.insert(tolerance.name, tolerance);
            sources.insert(source.name, source.citation);
        }
    }
    text.push_str("\n| tolerance | value | reason |\n|---|---|---|\n");
    for (name, tolerance) in tolerances {
        text.push_str(&format!(
            "| {name} | {tolerance} | {} |\n",
            tolerance.reason
        ));
    }
    text.push_str("\n| source | citation |\n|---|---|\n");
    for (name, citation) in sources {
        text.push_str(&format!("| {name} | {citation} |\n"));
    }
    fs::create_dir_all(directory()).expect("the directory can be created");
    fs::write(directory().join("record.md"), text).expect("the record can be written");
}

impl Display for crate::tolerances::Tolerance {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self.measure {
            Measure::Relative => write!(formatter, "{:e} relative", self.value),
            Measure::Absolute => write!(formatter, "{:e} absolute", self.value),
            Measure::Between(low, high) => Expected::Between(low, high).fmt(formatter),
        }
    }
}

impl Display for Expected {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(value) => write!(formatter, "{value:e}"),
            Self::Between(low, high) => write!(formatter, "{low} … {high}"),
        }
    }
}
