//! The journal of a directory: results as lines of text, from which a stopped command resumes.
//!
//! This module turns results into lines and lines into results. The caller stores the lines and
//! appends each when its result arrives. Nothing changes in place, so a crash can damage only the
//! end. Cases that another machine has simulated arrive as such a journal, too.
//!
//! Every line is a JSON object. The first is the header, which states the program. Each other line
//! is a result under its [`Key`], whatever command asked for it. A command finds the results that
//! it needs; a changed study keeps the results of its unchanged cases.
//!
//! ```json
//! {"key":"4c1f…","metrics":{"contact_time_s":0.001,…},"turn_contact_normal_impulses_n_s":[0.002],"statistics":{"steps":80,…},"chart_changes":0,"check":"93b1f4b01ae5e0d7"}
//! {"key":"9e02…","error":"the step fell to rounding","check":"0d1c2ff4a01be67c"}
//! {"key":"77ab…","forces":[41.2,8.1,1.2,98.0],"check":"5f3377e0c4d21b9a"}
//! ```
//!
//! Where filaments scatter, `scatter` has the distribution of the tool force, in addition to
//! `metrics`. Where filaments touch each other, `brush` has the effects of interaction. Where the
//! case was checked, `change_when_checked` has the change. `check` has the first 16 digits of the
//! SHA-256 of the header's check and of the line before `check`. It reveals a line that is damaged
//! or comes from another program. Numbers have digits that read back as the same `f64`: the results
//! of a resumed study equal those of an uninterrupted one to the bit.

use std::collections::HashMap;
use std::fmt::{self, Display, Formatter};
use std::io::{self, BufRead};
use std::str::FromStr;

use bristle::model::settings::Settings;
use bristle_study::grid::{CaseResult, CaseSummary, Study};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::store::digest::digest;
use crate::store::journal_header::{HEADER, SEED, unlike};
use crate::store::origin::{listed, sealed, unsealed};

/// The version of the format.
pub const FORMAT: u32 = 2;

/// Maximum length of a line that this program writes.
const MAX_LINE_BYTES: usize = 64 << 20;

/// Reasons why a journal cannot be read.
#[derive(Debug, Error)]
pub enum JournalError {
    /// No header.
    #[error("it is not a journal of Bristle")]
    Foreign,
    /// A header of another version of the format.
    #[error(
        "another version of Bristle wrote it, in format {0}; this version writes format {FORMAT}"
    )]
    Format(u64),
    /// Results of another build: the differences, one sentence each.
    #[error("another build of Bristle wrote it:{}", listed(.0))]
    Other(Vec<String>),
    /// A line, counted from 1, is damaged. Valid lines follow it, so its writing was not
    /// interrupted.
    #[error("line {0} is damaged")]
    Damaged(u64),
    /// A read error.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
}

/// Key of a result: digest of its kind and its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key(u128);

impl Key {
    /// Returns the key of a simulation with these settings. `kind` distinguishes results of equal
    /// settings.
    #[must_use]
    pub fn of(kind: &str, settings: &Settings) -> Self {
        let text = serde_json::to_string(settings).expect("all keys are texts");
        let digits = digest(format!("{kind}:{text}").as_bytes());
        digits[..32].parse().expect("a digest has 64 digits")
    }
}

impl Display for Key {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:032x}", self.0)
    }
}

impl FromStr for Key {
    type Err = std::num::ParseIntError;

    fn from_str(digits: &str) -> Result<Self, Self::Err> {
        u128::from_str_radix(digits, 16).map(Self)
    }
}

/// Length of a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// Length in bytes of the intact part; zero without a header. After a crash, the journal is cut
    /// to this length before lines are appended.
    pub intact: u64,
    /// Length in bytes of the rest, whose writing was interrupted.
    pub torn: u64,
}

/// Any line after the header.
#[derive(Serialize)]
struct Line<'a, T> {
    key: String,
    #[serde(flatten)]
    result: &'a T,
}

/// Key of a line with any result.
#[derive(Deserialize)]
struct Keyed<'l> {
    key: &'l str,
}

/// Returns the first line, with its newline.
#[must_use]
pub fn header() -> &'static str {
    &HEADER
}

/// Returns the line of a result, with its newline.
#[must_use]
pub fn line(key: Key, result: &impl Serialize) -> String {
    sealed(
        &SEED,
        &Line {
            key: key.to_string(),
            result,
        },
    )
}

/// Reads a journal from its beginning, and passes the key and the text of each line to `take`.
///
/// Leaves out a damaged end, which was being written when the program or the machine stopped.
/// [`Length::torn`] has its length.
///
/// # Errors
/// If it is not a journal, comes from another build, or is damaged before its end. `take` may have
/// received some lines by then.
pub fn read(
    mut input: impl BufRead,
    mut take: impl FnMut(Key, &str),
) -> Result<Length, JournalError> {
    let mut contents = Length { intact: 0, torn: 0 };
    let mut line = Vec::new();
    let length = read_line(&mut input, &mut line)?;
    if line != HEADER.as_bytes() {
        // A part of the header, or nothing, remains if the program stopped before it had written
        // the header.
        if !HEADER.as_bytes().starts_with(&line) && line.iter().any(|&byte| byte != 0) {
            return Err(unlike(&line));
        }
        contents.torn = length;
        return Ok(contents);
    }
    contents.intact = length;
    let mut damaged = None;
    for number in 2.. {
        let length = read_line(&mut input, &mut line)?;
        if length == 0 {
            break;
        }
        let intact = str::from_utf8(&line)
            .ok()
            .and_then(|text| Some((unsealed::<Keyed<'_>>(&SEED, text)?.key.parse().ok()?, text)));
        match (intact, damaged) {
            (Some((key, text)), None) => {
                take(key, text);
                contents.intact += length;
            }
            (Some(_), Some(line)) => return Err(JournalError::Damaged(line)),
            (None, _) => {
                damaged.get_or_insert(number);
                contents.torn += length;
            }
        }
    }
    Ok(contents)
}

/// Reads a line with its newline and returns its length. Keeps only the beginning of a line that is
/// too long.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<u64> {
    line.clear();
    let mut length = 0;
    loop {
        let bytes = match input.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            bytes => bytes?,
        };
        let end = bytes.iter().position(|&byte| byte == b'\n');
        let taken = end.map_or(bytes.len(), |end| end + 1);
        let room = MAX_LINE_BYTES - line.len();
        line.extend_from_slice(&bytes[..taken.min(room)]);
        input.consume(taken);
        length += taken as u64;
        if end.is_some() || taken == 0 {
            return Ok(length);
        }
    }
}

/// Keys of the cases of a study.
#[derive(Clone, Debug)]
pub struct StudyKeys {
    keys: Vec<Key>,
    /// The cases of each key: several if cases have equal settings.
    cases: HashMap<Key, Vec<usize>>,
    /// `true` if only results that were checked count.
    checks: bool,
}

/// The result of a case.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum CaseOutcome<S> {
    Simulated {
        #[serde(flatten)]
        summary: S,
        /// The only number of [`Statistics`](bristle::simulation::Statistics) that is in no other
        /// file.
        chart_changes: usize,
    },
    Failed {
        error: String,
    },
}

impl StudyKeys {
    /// Returns the keys of all cases.
    #[must_use]
    pub fn new(study: &Study) -> Self {
        let keys: Vec<Key> = (0..study.case_count())
            .map(|case| Key::of("case", &study.settings(case)))
            .collect();
        let mut cases: HashMap<Key, Vec<usize>> = HashMap::with_capacity(keys.len());
        for (case, key) in keys.iter().enumerate() {
            cases.entry(*key).or_default().push(case);
        }
        Self {
            keys,
            cases,
            checks: study.checks(),
        }
    }

    /// Returns the line of a case, counted from 0, with its newline.
    #[must_use]
    pub fn line(&self, case: usize, result: &CaseResult) -> String {
        let outcome = match result {
            Ok(summary) => CaseOutcome::Simulated {
                summary,
                chart_changes: summary.statistics.chart_changes,
            },
            Err(error) => CaseOutcome::Failed {
                error: error.clone(),
            },
        };
        line(self.keys[case], &outcome)
    }

    /// Returns the cases, counted from 0, whose result a line has, and that result; `None` if the
    /// line has no result of the study. A case that needs a check, and was not checked, is
    /// simulated again.
    #[must_use]
    pub fn result_of(&self, key: Key, line: &str) -> Option<(&[usize], CaseResult)> {
        let cases = self.cases.get(&key)?;
        let result = match serde_json::from_str(line).ok()? {
            CaseOutcome::<CaseSummary>::Simulated {
                mut summary,
                chart_changes,
            } => {
                summary.statistics.chart_changes = chart_changes;
                Ok(summary)
            }
            CaseOutcome::Failed { error } => Err(error),
        };
        let is_complete = !self.checks
            || result
                .as_ref()
                .map_or(true, |summary| summary.change_when_checked.is_some());
        is_complete.then_some((cases.as_slice(), result))
    }

    /// Reads the results of a journal. A later line of a case replaces an earlier one.
    ///
    /// # Errors
    /// As for [`read`].
    pub fn read(
        &self,
        input: impl BufRead,
    ) -> Result<(Vec<Option<CaseResult>>, Length), JournalError> {
        let mut results = vec![None; self.keys.len()];
        let length = read(input, |key, line| self.take(key, line, &mut results))?;
        Ok((results, length))
    }

    /// Stores the result of a line in `results`.
    pub fn take(&self, key: Key, line: &str, results: &mut [Option<CaseResult>]) {
        if let Some((cases, result)) = self.result_of(key, line) {
            for &case in cases {
                results[case] = Some(result.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::journal_header::{BEGINNING, FORMAT_KEY, JournalHeader};
    use crate::testing::brush;
    use bristle_study::grid::run_study;
    use bristle_study::input::document::Document;
    use serde_json::Value;

    /// Six cases, of which the last three fail.
    const FILE: &str = concat!(
        brush!(3),
        "
        [solver]
        relative_tolerance = 1e-3
        [study]
        brushing_velocity_m_s = [5.0, 10.0, 20.0]
        penetration_depth_m = [1.0e-3]
        \"contact.stiffness_n_m\" = [1e5, 1e300]
        "
    );

    fn study(file: &str) -> Study {
        Document::parse(file, "study")
            .and_then(|document| document.study())
            .expect("the file is right")
    }

    fn results(study: &Study) -> Vec<CaseResult> {
        run_study(study, None, || ()).expect("the threads start")
    }

    fn text(keys: &StudyKeys, results: &[CaseResult]) -> String {
        let lines = results
            .iter()
            .enumerate()
            .map(|(case, result)| keys.line(case, result));
        header().to_owned() + &lines.collect::<String>()
    }

    /// Returns the keys of the study of [`FILE`], and the text of its journal with all results.
    fn whole() -> (StudyKeys, String) {
        let study = study(FILE);
        let keys = StudyKeys::new(&study);
        let text = text(&keys, &results(&study));
        (keys, text)
    }

    /// Returns the header with a `change` and a new check.
    fn resealed(change: impl FnOnce(&mut Value)) -> String {
        let line = header().split_once(",\"check\"").expect("a check").0;
        let mut header: Value = serde_json::from_str(&format!("{line}}}")).expect("JSON");
        change(&mut header);
        // Through the structure, so that the keys are in the order of a header.
        let typed: JournalHeader = serde_json::from_value(header).expect("a header");
        sealed("", &typed)
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let study = study(FILE);
        let keys = StudyKeys::new(&study);
        let mut results = results(&study);
        // Numbers that are easily lost in conversion.
        if let Ok(summary) = &mut results[0] {
            summary.statistics.chart_changes = 7;
            summary.metrics.contact_time_s = 0.1 + 0.2;
            summary.metrics.contact_length_m = f64::MIN_POSITIVE / 3.0;
            summary.metrics.contact_time_ratio = -0.0;
            summary.metrics.peak_contact_normal_force_n = f64::MAX;
            summary.metrics.tool_contact_normal_force_n = 1.0;
        }
        assert!(results[2].is_ok() && results[3].is_err());
        results[4] = Err("two\nlines, \"quotes\", µ and \",\"check\":\"".to_owned());
        let text = text(&keys, &results);
        assert_eq!(text.lines().count(), 7);
        assert!(text.lines().all(|line| {
            serde_json::from_str::<Value>(line).is_ok_and(|line| line["check"].is_string())
        }));
        let (read, length) = keys.read(text.as_bytes()).expect("the journal is whole");
        assert_eq!((length.intact, length.torn), (text.len() as u64, 0));
        let read: Vec<CaseResult> = read.into_iter().flatten().collect();
        assert_eq!(read, results);
        let bits = |result: &CaseResult| {
            result
                .as_ref()
                .ok()
                .map(|summary| summary.metrics.contact_time_ratio.to_bits())
        };
        assert_eq!(bits(&read[0]), bits(&results[0]));
    }

    #[test]
    fn an_end_that_is_cut_off_anywhere_is_left_out() {
        let (keys, text) = whole();
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        for length in 0..text.len() {
            let (results, found) = keys
                .read(&text.as_bytes()[..length])
                .expect("the rest is whole");
            let mut whole = 0;
            let mut intact = 0;
            while intact + lines[whole].len() <= length {
                intact += lines[whole].len();
                whole += 1;
            }
            let expected = (intact as u64, (length - intact) as u64);
            assert_eq!((found.intact, found.torn), expected, "{length}");
            let done = results.iter().flatten().count();
            assert_eq!(done, whole.saturating_sub(1), "{length}");
        }
    }

    #[test]
    fn an_end_that_never_came_to_the_disk_is_left_out() {
        let (keys, text) = whole();
        let begin = text.len() - 700;
        let mut bytes = text.clone().into_bytes();
        bytes[begin..].fill(0);
        let (results, length) = keys.read(bytes.as_slice()).expect("the rest is whole");
        assert_eq!(length.intact + length.torn, text.len() as u64);
        assert!(length.intact <= begin as u64);
        assert!(results.iter().flatten().count() > 0);
        let zeros = vec![0; 5000];
        let (_, length) = keys
            .read(zeros.as_slice())
            .expect("nothing has come to the disk");
        assert_eq!((length.intact, length.torn), (0, 5000));
    }

    /// Damage before the last line is an error with the line's number. Damage to the last line
    /// loses only that line.
    #[test]
    fn every_changed_byte_is_noticed() {
        let study = study(FILE);
        let keys = StudyKeys::new(&study);
        let whole = text(&keys, &results(&study)[..4]);
        let last = whole.trim_end().rfind('\n').expect("several lines") + 1;
        for at in 0..whole.len() {
            let mut bytes = whole.clone().into_bytes();
            bytes[at] ^= 1;
            let line = whole[..at].matches('\n').count() as u64 + 1;
            match keys.read(bytes.as_slice()) {
                Ok((results, _)) => {
                    // Without the newline before it, the last line merges with the one before.
                    let lost = if at == last - 1 { 2 } else { 1 };
                    assert!(at >= last - 1, "{at}");
                    assert_eq!(results.iter().flatten().count(), 4 - lost);
                }
                Err(JournalError::Damaged(found)) => assert_eq!(found, line, "{at}"),
                Err(JournalError::Foreign) => assert!(at < BEGINNING.len(), "{at}"),
                Err(JournalError::Format(_)) => {
                    assert_eq!(at, BEGINNING.len() + FORMAT_KEY.len());
                }
                Err(error) => panic!("{at}: {error}"),
            }
        }
    }

    #[test]
    fn what_is_no_journal_is_told_from_one() {
        let keys = StudyKeys::new(&study(FILE));
        let read = |text: &str| keys.read(text.as_bytes());
        for text in [
            "hello",
            "\n",
            "{}\n",
            "\u{feff}",
            "brushing_velocity_m_s,penetration_depth_m\n10.0,0.001\n",
        ] {
            assert!(matches!(read(text), Err(JournalError::Foreign)), "{text:?}");
        }
        // Version 0.2, too.
        for (from, to, format) in [
            ("\"format\":2", "\"format\":27", 27),
            (
                "\"bristle\",\"format\":2",
                "\"bristle study\",\"format\":1",
                1,
            ),
        ] {
            let other = header().replacen(from, to, 1);
            assert!(matches!(read(&other), Err(JournalError::Format(found)) if found == format));
        }
    }

    /// A study that changes keeps the results of the cases that stay.
    #[test]
    fn results_are_found_by_their_settings() {
        let (_, text) = whole();
        let found = |file: &str| {
            let (results, length) = StudyKeys::new(&study(file))
                .read(text.as_bytes())
                .expect("a journal");
            assert_eq!(length.torn, 0);
            results.iter().map(Option::is_some).collect::<Vec<_>>()
        };
        assert_eq!(found(&FILE.replace("0.040", "0.041")), [false; 6]);
        let more = FILE.replace("[5.0, 10.0, 20.0]", "[10.0, 15.0]");
        assert_eq!(found(&more), [true, false, true, false]);
        let twice = FILE.replace("[1.0e-3]", "[1.0e-3, 1.0e-3]");
        assert_eq!(found(&twice), [true; 12]);
        let checked = StudyKeys::new(&study(FILE).checked());
        let (results, _) = checked.read(text.as_bytes()).expect("a journal");
        assert!(
            results[..3].iter().all(Option::is_none),
            "those that were not checked are simulated again"
        );
    }

    #[test]
    fn another_build_is_named() {
        let keys = StudyKeys::new(&study(FILE));
        for (what, value) in [
            ("version", "9.9.9"),
            ("equations", "abc"),
            ("solver", "µµµµµµµµ"),
        ] {
            let header = resealed(|header| header[what] = Value::from(value));
            let error = keys.read(header.as_bytes()).expect_err("another build");
            assert!(error.to_string().contains(what), "{error}");
        }
    }

    #[test]
    fn a_hostile_header_cannot_drive_the_terminal() {
        let keys = StudyKeys::new(&study(FILE));
        let hostile = "\u{1b}[2J\n\u{9b}\u{202e}".to_owned() + &"x".repeat(10_000);
        let header = resealed(|header| header["version"] = Value::from(hostile));
        let error = keys
            .read(header.as_bytes())
            .expect_err("another build")
            .to_string();
        assert!(
            error.contains(r"\u{1b}[2J\u{a}\u{9b}\u{202e}") && error.len() < 1500,
            "{error}"
        );
        assert!(
            !error.contains(
                |letter: char| letter != '\n' && bristle_study::text::is_invisible(letter)
            ),
            "{error:?}"
        );
        assert!(
            error.lines().skip(1).all(|line| line.starts_with("  ")),
            "{error}"
        );
    }
}
