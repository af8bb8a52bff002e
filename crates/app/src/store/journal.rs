//! The journal of a study: its results so far as lines of text, from which a stopped study resumes.
//!
//! This module turns results into lines and lines into results. The caller stores the lines and
//! appends each when its case is done. Nothing is ever changed in place, so a crash can damage only
//! the end. Cases that another machine has simulated come from it as such a journal, too.
//!
//! Every line is a JSON object. The first is the header, which states the program and the settings
//! of the results. Each of the others is a case, numbered from 1:
//!
//! ```json
//! {"case":7,"metrics":{"contact_time_s":0.001,…},"turn_contact_normal_impulses_n_s":[0.002],"statistics":{"steps":80,…},"chart_changes":0,"check":"93b1f4b01ae5e0d7"}
//! {"case":8,"error":"the step fell to rounding","check":"0d1c2ff4a01be67c"}
//! ```
//!
//! Where filaments scatter, `scatter` has the distribution of the tool force, in addition to
//! `metrics`; where they touch each other, `brush` has what interaction changes; where the case was
//! checked, `change_when_checked` has what that changed. `check` has the first 16 digits of the
//! SHA-256 of the header's check and of the line before `check`. It reveals a line that is damaged
//! or belongs to another journal. Numbers are written with digits that read back as the same `f64`:
//! the results of a resumed study equal those of an uninterrupted one to the bit.

use std::collections::BTreeMap;
use std::io::{self, BufRead};
use std::sync::LazyLock;

use bristle_study::text::shown;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::store::digest::digest;
use crate::store::origin::{
    CHECK_DIGITS, LONGEST_PATH, Program, each_difference, listed, sealed, settings, unsealed,
};
use bristle::simulation::SOLVER_FINGERPRINT;
use bristle_study::grid::{CaseResult, CaseSummary, Study, SweepText, Tool, ToolText};

/// The version of the format.
pub const FORMAT: u32 = 1;

/// SHA-256 of all code that affects results: the core's and that of `bristle_study::grid`.
pub(crate) static SOLVER: LazyLock<String> = LazyLock::new(|| {
    digest(
        [SOLVER_FINGERPRINT, bristle_study::grid::SOURCES]
            .concat()
            .as_bytes(),
    )
});

/// How every header begins, whatever its format.
const BEGINNING: &str = r#"{"journal":"bristle study","format":"#;
/// A longer line was not written by this program.
const MAX_LINE_BYTES: usize = 64 << 20;

/// What can be wrong with a journal.
#[derive(Debug, Error)]
pub enum JournalError {
    /// It has no header.
    #[error("it is not the journal of a study")]
    Foreign,
    /// Its header has another version of the format.
    #[error(
        "it comes from another version of Bristle and has format {0}; this version writes format {FORMAT}"
    )]
    Format(u64),
    /// Its results do not belong to this study: the differences, one sentence each.
    #[error("it holds results of another study or program:{}", listed(.0))]
    Other(Vec<String>),
    /// A line, counted from 1, is damaged, and not because its writing was interrupted: valid lines
    /// follow it.
    #[error("line {0} is damaged")]
    Damaged(u64),
    /// It cannot be read.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
}

/// The contents of a journal.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// The result of each case; `None` if it is not in the journal.
    pub results: Vec<Option<CaseResult>>,
    /// As in [`Length`].
    pub intact: u64,
    /// As in [`Length`].
    pub torn: u64,
}

/// Length of a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// Length in bytes of the intact part. After a crash, the journal is cut to this length before
    /// lines are appended.
    ///
    /// Zero if there is no header yet.
    pub intact: u64,
    /// Length in bytes of the rest. Its writing was interrupted.
    pub torn: u64,
}

/// Writes and reads the lines of one study's journal.
#[derive(Clone, Debug)]
pub struct Journal {
    header: String,
    /// The header's check, which enters the check of every line.
    seed: String,
    case_count: usize,
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct Header<S> {
    journal: String,
    format: u32,
    #[serde(flatten)]
    program: Program,
    /// The settings, of the first tool if tools are compared. Those that are swept have their first
    /// value.
    settings: S,
    /// The tools that are compared.
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    tools: Vec<ToolText<S>>,
    sweeps: Vec<SweepText>,
}

/// Any other line.
#[derive(Serialize, Deserialize)]
struct Entry<S> {
    /// Counted from 1.
    case: usize,
    #[serde(flatten)]
    outcome: Outcome<S>,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Outcome<S> {
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

impl Journal {
    /// The journal of `study`, simulated by this build of Bristle.
    #[must_use]
    pub fn new(study: &Study) -> Self {
        let header = Header {
            journal: "bristle study".to_owned(),
            format: FORMAT,
            program: Program::here(&SOLVER),
            settings: study.base().clone(),
            tools: study.tool_texts(),
            sweeps: study.sweep_texts(),
        };
        let header = sealed("", &header);
        let seed = check_of(&header).to_owned();
        Self {
            header,
            seed,
            case_count: study.case_count(),
        }
    }

    /// The first line, with its newline.
    #[must_use]
    pub fn header(&self) -> &str {
        &self.header
    }

    /// The line of a case, counted from 0, with its newline.
    #[must_use]
    pub fn entry(&self, case: usize, result: &CaseResult) -> String {
        let outcome = match result {
            Ok(summary) => Outcome::Simulated {
                summary,
                chart_changes: summary.statistics.chart_changes,
            },
            Err(error) => Outcome::Failed {
                error: error.clone(),
            },
        };
        sealed(
            &self.seed,
            &Entry {
                case: case + 1,
                outcome,
            },
        )
    }

    /// Reads a journal of the study from its beginning.
    ///
    /// A damaged end was being written when the program or the machine stopped. It is left out, and
    /// [`Contents::torn`] has its length.
    ///
    /// # Errors
    /// If it is not a journal, belongs to another study or another build, or is damaged before its
    /// end.
    pub fn read(&self, study: &Study, input: impl BufRead) -> Result<Contents, JournalError> {
        let mut results = vec![None; self.case_count];
        let Length { intact, torn } =
            self.read_each(study, input, |case, result| results[case] = Some(result))?;
        Ok(Contents {
            results,
            intact,
            torn,
        })
    }

    /// [`Journal::read`], which passes each case, counted from 0, and its result to `take`.
    ///
    /// # Errors
    /// As for [`Journal::read`]. Some cases may have been passed on by then.
    pub fn read_each(
        &self,
        study: &Study,
        mut input: impl BufRead,
        mut take: impl FnMut(usize, CaseResult),
    ) -> Result<Length, JournalError> {
        let mut contents = Length { intact: 0, torn: 0 };
        let mut line = Vec::new();
        let length = read_line(&mut input, &mut line)?;
        if line != self.header.as_bytes() {
            // A part of the header, or nothing, remains if the program stopped before it had
            // written the header.
            if !self.header.as_bytes().starts_with(&line) && line.iter().any(|&byte| byte != 0) {
                return Err(unlike(study, &line));
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
            match (self.decode(&line), damaged) {
                (Some((case, result)), None) => {
                    // A case that has to be checked is simulated again. Its later line replaces
                    // this one.
                    let is_complete = result
                        .as_ref()
                        .map_or(true, |summary| summary.change_when_checked.is_some());
                    if is_complete || !study.checks() {
                        take(case, result);
                    }
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

    /// The case of a line and its result; `None` if the line is damaged.
    fn decode(&self, line: &[u8]) -> Option<(usize, CaseResult)> {
        let line = str::from_utf8(line).ok()?;
        let Entry { case, outcome } = unsealed::<Entry<CaseSummary>>(&self.seed, line)?;
        let case = case.checked_sub(1).filter(|&case| case < self.case_count)?;
        let result = match outcome {
            Outcome::Simulated {
                mut summary,
                chart_changes,
            } => {
                summary.statistics.chart_changes = chart_changes;
                Ok(summary)
            }
            Outcome::Failed { error } => Err(error),
        };
        Some((case, result))
    }
}

fn check_of(line: &str) -> &str {
    let end = line.len() - "\"}\n".len();
    &line[end - CHECK_DIGITS..end]
}

/// Reads a line with its newline and returns its length. If the line is too long, only its
/// beginning is kept.
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

/// The reason why a first line is not the header of `study`.
fn unlike(study: &Study, line: &[u8]) -> JournalError {
    let Some(rest) = str::from_utf8(line)
        .ok()
        .and_then(|line| line.strip_prefix(BEGINNING))
    else {
        return JournalError::Foreign;
    };
    // The format comes first, because another format may have another check.
    let digits = rest
        .find(|character: char| !character.is_ascii_digit())
        .unwrap_or(rest.len());
    match rest[..digits].parse() {
        Ok(found) if found != u64::from(FORMAT) => return JournalError::Format(found),
        _ => {}
    }
    let line = format!("{BEGINNING}{rest}");
    match unsealed::<Header<Value>>("", &line) {
        Some(header) => JournalError::Other(differences(study, &header)),
        None => JournalError::Damaged(1),
    }
}

/// The differences of the tools of a journal from those here, as sentences.
fn tool_differences(
    there: &[ToolText<Value>],
    here: &[Tool],
    is_swept: impl Fn(&str) -> bool,
) -> Vec<String> {
    let names = |names: Vec<&str>| match names[..] {
        [] => "none".to_owned(),
        _ => names
            .iter()
            .map(|name| shown(name, LONGEST_PATH))
            .collect::<Vec<_>>()
            .join(", "),
    };
    let names_there = names(there.iter().map(|tool| tool.name.as_str()).collect());
    let names_here = names(here.iter().map(|tool| tool.name.as_str()).collect());
    if names_there != names_here {
        return vec![format!("tools: {names_there} there, {names_here} here")];
    }
    let of_tool = |(there, here): (&ToolText<Value>, &Tool)| {
        let mut differences = settings(&there.settings, &here.settings, &is_swept);
        each_difference(&there.held, &here.text().held, |path, there, here| {
            let text = |value: Option<&f64>| {
                value.map_or("not stated".to_owned(), |value| format!("{value:?}"))
            };
            differences.push(format!(
                "{}: {} there, {} here",
                shown(path, LONGEST_PATH),
                text(there),
                text(here)
            ));
        });
        let with_name = |difference| format!("tool {}, {difference}", here.name);
        differences.into_iter().map(with_name).collect::<Vec<_>>()
    };
    there.iter().zip(here).flat_map(of_tool).collect()
}

/// The differences of a journal's header from that of `study`, as sentences.
fn differences(study: &Study, there: &Header<Value>) -> Vec<String> {
    let mut differences = there.program.differences(&Program::here(&SOLVER));
    let here = study.sweep_texts();
    let named = |sweeps: &[SweepText]| -> BTreeMap<String, Vec<f64>> {
        sweeps
            .iter()
            .map(|sweep| (sweep.setting.clone(), sweep.values.clone()))
            .collect()
    };
    let (sweeps_there, sweeps_here) = (named(&there.sweeps), named(&here));
    // The base has only the first value of a setting that is swept on both sides.
    let is_swept = |path: &str| sweeps_there.contains_key(path) && sweeps_here.contains_key(path);
    let (tools_there, tools_here) = (&there.tools, study.tools());
    if tools_there.is_empty() || tools_here.is_empty() {
        differences.extend(settings(&there.settings, study.base(), is_swept));
    }
    differences.extend(tool_differences(tools_there, tools_here, is_swept));
    each_difference(&sweeps_there, &sweeps_here, |path, there, here| {
        let [there, here] = [there, here].map(|values| match values.map(Vec::as_slice) {
            None => "not swept".to_owned(),
            Some([]) => "no value".to_owned(),
            Some([only]) => format!("{only:?}"),
            Some([first, .., last]) => {
                format!(
                    "{} values from {first:?} to {last:?}",
                    values.map_or(0, Vec::len)
                )
            }
        });
        let among = if there == here {
            ", with others in between"
        } else {
            ""
        };
        let path = shown(path, LONGEST_PATH);
        differences.push(format!(
            "sweep of {path}: {there} there, {here} here{among}"
        ));
    });
    if differences.is_empty() {
        differences.push("the sweeps are in another order".to_owned());
    }
    differences
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::brush;
    use bristle_study::grid::run_study;
    use bristle_study::input::document::Document;

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

    fn text(journal: &Journal, results: &[CaseResult]) -> String {
        let entries = results
            .iter()
            .enumerate()
            .map(|(case, result)| journal.entry(case, result));
        journal.header().to_owned() + &entries.collect::<String>()
    }

    /// The study of [`FILE`], its journal, and the text of that with all results.
    fn whole() -> (Study, Journal, String) {
        let study = study(FILE);
        let journal = Journal::new(&study);
        let text = text(&journal, &results(&study));
        (study, journal, text)
    }

    /// The header of a journal with a `change`, sealed anew.
    fn resealed(journal: &Journal, change: impl FnOnce(&mut Value)) -> String {
        let line = journal
            .header()
            .split_once(",\"check\"")
            .expect("a check")
            .0;
        let mut header: Value = serde_json::from_str(&format!("{line}}}")).expect("JSON");
        change(&mut header);
        // Through the structure, so that the keys are in the order of a header.
        let typed: Header<Value> = serde_json::from_value(header).expect("a header");
        sealed("", &typed)
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let study = study(FILE);
        let journal = Journal::new(&study);
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
        let text = text(&journal, &results);
        assert_eq!(text.lines().count(), 7);
        assert!(text.lines().all(|line| {
            serde_json::from_str::<Value>(line).is_ok_and(|line| line["check"].is_string())
        }));
        let contents = journal
            .read(&study, text.as_bytes())
            .expect("the journal is whole");
        assert_eq!((contents.intact, contents.torn), (text.len() as u64, 0));
        let read: Vec<CaseResult> = contents.results.into_iter().flatten().collect();
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
        let (study, journal, text) = whole();
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        for length in 0..text.len() {
            let contents = journal
                .read(&study, &text.as_bytes()[..length])
                .expect("the rest is whole");
            let mut whole = 0;
            let mut intact = 0;
            while intact + lines[whole].len() <= length {
                intact += lines[whole].len();
                whole += 1;
            }
            assert_eq!(
                (contents.intact, contents.torn),
                (intact as u64, (length - intact) as u64),
                "{length}"
            );
            let done = contents.results.iter().flatten().count();
            assert_eq!(done, whole.saturating_sub(1), "{length}");
        }
    }

    #[test]
    fn an_end_that_never_came_to_the_disk_is_left_out() {
        let (study, journal, text) = whole();
        let begin = text.len() - 700;
        let mut bytes = text.clone().into_bytes();
        bytes[begin..].fill(0);
        let contents = journal
            .read(&study, bytes.as_slice())
            .expect("the rest is whole");
        assert_eq!(contents.intact + contents.torn, text.len() as u64);
        assert!(contents.intact <= begin as u64);
        assert!(contents.results.iter().flatten().count() > 0);
        let zeros = vec![0; 5000];
        let contents = journal
            .read(&study, zeros.as_slice())
            .expect("nothing has come to the disk");
        assert_eq!((contents.intact, contents.torn), (0, 5000));
    }

    /// Damage before the last line is an error with the line's number. Damage to the last line
    /// loses only that line.
    #[test]
    fn every_changed_byte_is_noticed() {
        let study = study(FILE);
        let journal = Journal::new(&study);
        let whole = text(&journal, &results(&study)[..4]);
        let last = whole.trim_end().rfind('\n').expect("several lines") + 1;
        for at in 0..whole.len() {
            let mut bytes = whole.clone().into_bytes();
            bytes[at] ^= 1;
            let line = whole[..at].matches('\n').count() as u64 + 1;
            match journal.read(&study, bytes.as_slice()) {
                Ok(contents) => {
                    // Without the newline before it, the last line merges with the one before.
                    let lost = if at == last - 1 { 2 } else { 1 };
                    assert!(at >= last - 1, "{at}");
                    assert_eq!(contents.results.iter().flatten().count(), 4 - lost);
                }
                Err(JournalError::Damaged(found)) => assert_eq!(found, line, "{at}"),
                Err(JournalError::Foreign) => assert!(at < BEGINNING.len(), "{at}"),
                Err(JournalError::Format(_)) => assert_eq!(at, BEGINNING.len()),
                Err(error) => panic!("{at}: {error}"),
            }
        }
    }

    #[test]
    fn what_is_no_journal_is_told_from_one() {
        let study = study(FILE);
        let journal = Journal::new(&study);
        let read = |text: &str| journal.read(&study, text.as_bytes());
        for text in [
            "hello",
            "\n",
            "{}\n",
            "\u{feff}",
            "brushing_velocity_m_s,penetration_depth_m\n10.0,0.001\n",
        ] {
            assert!(matches!(read(text), Err(JournalError::Foreign)), "{text:?}");
        }
        let newer = journal
            .header()
            .replacen("\"format\":1", "\"format\":27", 1);
        assert!(matches!(read(&newer), Err(JournalError::Format(27))));
    }

    #[test]
    fn lines_of_another_journal_are_not_taken() {
        let (here, there) = (study(FILE), study(&FILE.replace("0.040", "0.041")));
        let (journal, other) = (Journal::new(&here), Journal::new(&there));
        let entry = other.entry(0, &Err("there".to_owned()));
        let mixed = journal.header().to_owned() + &entry;
        let contents = journal
            .read(&here, mixed.as_bytes())
            .expect("the end is left out");
        assert_eq!(contents.torn, entry.len() as u64);
        // The number of a case that the study does not have, with a correct check.
        let beyond = journal.header().to_owned()
            + &journal.entry(6, &Err("there is no seventh case".to_owned()));
        let contents = journal
            .read(&here, beyond.as_bytes())
            .expect("the end is left out");
        assert!(contents.torn > 0 && contents.results.iter().all(Option::is_none));
    }

    #[test]
    fn other_settings_are_named() {
        let here = study(FILE);
        let differences = |file: &str| {
            let there = Journal::new(&study(file));
            match Journal::new(&here).read(&here, there.header().as_bytes()) {
                Err(JournalError::Other(differences)) => differences.join("; "),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(
            differences(&FILE.replace("0.040", "0.041")),
            "filament.length_m: 0.041 there, 0.04 here"
        );
        assert_eq!(
            differences(&FILE.replace("[5.0, 10.0, 20.0]", "[5.0, 11.0, 20.0]")),
            "sweep of process.brushing_velocity_m_s: 3 values from 5.0 to 20.0 there, 3 values from 5.0 to 20.0 here, \
             with others in between"
        );
        assert_eq!(
            differences(&FILE.replace("[1.0e-3]", "[1.0e-3, 2.0e-3]")),
            "sweep of process.penetration_depth_m: 2 values from 0.001 to 0.002 there, 0.001 here"
        );
        assert_eq!(
            differences(&FILE.replace("\"contact.stiffness_n_m\"", "\"contact.damping_s_m\"")),
            "contact.damping_s_m: 100000.0 there, 0.0 here; \
             sweep of contact.damping_s_m: 2 values from 100000.0 to 1e300 there, not swept here; \
             sweep of contact.stiffness_n_m: not swept there, 2 values from 100000.0 to 1e300 here"
        );
        let two = "\"filament.damping_ratio\" = [0.05]\n\"contact.exponent\" = [1.0]\n";
        let other_way = "\"contact.exponent\" = [1.0]\n\"filament.damping_ratio\" = [0.05]\n";
        let here = study(&format!("{FILE}\n{two}"));
        let there = Journal::new(&study(&format!("{FILE}\n{other_way}")));
        let error = Journal::new(&here)
            .read(&here, there.header().as_bytes())
            .expect_err("the order is another");
        assert!(error.to_string().contains("another order"), "{error}");
    }

    #[test]
    fn another_build_is_named() {
        let here = study(FILE);
        let journal = Journal::new(&here);
        for (what, value) in [
            ("version", "9.9.9"),
            ("equations", "abc"),
            ("solver", "µµµµµµµµ"),
        ] {
            let header = resealed(&journal, |header| header[what] = Value::from(value));
            let error = journal
                .read(&here, header.as_bytes())
                .expect_err("another build");
            assert!(error.to_string().contains(what), "{error}");
        }
    }

    #[test]
    fn a_hostile_header_cannot_drive_the_terminal() {
        let here = study(FILE);
        let journal = Journal::new(&here);
        let hostile = "\u{1b}[2J\n\u{9b}\u{202e}".to_owned() + &"x".repeat(10_000);
        let header = resealed(&journal, |header| {
            header["version"] = Value::from(hostile.clone());
            header["settings"]["tool"][hostile.as_str()] = Value::from(hostile.clone());
            header["sweeps"][0]["setting"] = Value::from(hostile);
        });
        let error = journal
            .read(&here, header.as_bytes())
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
