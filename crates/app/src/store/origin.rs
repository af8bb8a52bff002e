//! The program that a file of a stopped run belongs to, and lines of text with a check.

use bristle::equations::FINGERPRINT;
use bristle_study::text::shortened;
use serde::{Deserialize, Serialize};

use crate::store::digest::digest;

/// Digits of a check: 64 bits let one damaged line in 10¹⁹ pass.
pub(crate) const CHECK_DIGITS: usize = 16;
/// Maximum number of differences that an error lists.
const MAX_DIFFERENCES: usize = 6;

/// Returns differences as lines of an error.
pub(crate) fn listed(differences: &[String]) -> String {
    let mut text: String = differences
        .iter()
        .take(MAX_DIFFERENCES)
        .map(|line| format!("\n  {line}"))
        .collect();
    if differences.len() > MAX_DIFFERENCES {
        text += &format!("\n  and {} more", differences.len() - MAX_DIFFERENCES);
    }
    text
}

/// Returns an object as a line that ends with its check.
pub(crate) fn sealed(seed: &str, object: &impl Serialize) -> String {
    let mut line = serde_json::to_string(object).expect("all keys are texts");
    // The check becomes the last key.
    line.pop();
    let check = check(seed, &line);
    line + r#","check":""# + &check + "\"}\n"
}

/// Returns the object of a line; `None` if its check is wrong.
pub(crate) fn unsealed<'l, T: Deserialize<'l>>(seed: &str, line: &'l str) -> Option<T> {
    let (object, check_here) = line.strip_suffix("\"}\n")?.rsplit_once(r#","check":""#)?;
    if check_here != check(seed, object) {
        return None;
    }
    serde_json::from_str(line).ok()
}

fn check(seed: &str, object: &str) -> String {
    let mut digits = digest(format!("{seed}{object}").as_bytes());
    digits.truncate(CHECK_DIGITS);
    digits
}

/// The program that has written a file.
#[derive(Serialize, Deserialize)]
pub(crate) struct Program {
    /// Version of Bristle.
    version: String,
    /// SHA-256 of the kernels' expressions.
    equations: String,
    /// SHA-256 of the code that solves them.
    solver: String,
}

impl Program {
    /// Returns this program, with the hash of its `solver`.
    pub(crate) fn here(solver: &str) -> Self {
        let [version, equations, solver] =
            [env!("CARGO_PKG_VERSION"), FINGERPRINT, solver].map(str::to_owned);
        Self {
            version,
            equations,
            solver,
        }
    }

    /// Returns the differences from the program `here`, in words.
    pub(crate) fn differences(&self, here: &Self) -> Vec<String> {
        let programs = [
            ("version", &self.version, &here.version),
            ("equations (SHA-256)", &self.equations, &here.equations),
            ("solver (SHA-256)", &self.solver, &here.solver),
        ];
        let difference = |(what, there, here): (&str, &String, &String)| {
            let [there, here] =
                [there, here].map(|text| shortened(&text.chars().take(12).collect::<String>()));
            format!("{what}: {there} there, {here} here")
        };
        programs
            .into_iter()
            .filter(|(_, there, here)| there != here)
            .map(difference)
            .collect()
    }
}
