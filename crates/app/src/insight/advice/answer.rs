//! The answer to what an input file asks for.

use std::io;
use std::num::NonZeroUsize;

use bristle::simulation::Stop;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::wrap;
use serde::Serialize;
use serde_json::{Map, Value};

use super::limits::{AdviceError, Limits};
use super::recommendation::write_lines;
use super::{Advice, advise};

/// A question to a study, with its answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// The question, as a sentence.
    pub question: String,
    /// The recommendation and its properties, line by line, or the reason why there is none.
    pub lines: Vec<String>,
    /// Rows of `runs.csv` that the answer comes from.
    pub rows: Vec<usize>,
    /// Caveats.
    pub notes: Vec<String>,
}

impl Answer {
    /// Answers the question of `[goal]` and simulates the recommendation. `tell` is called when
    /// that simulation begins. After a stop, the recommendation stays as the study has it.
    ///
    /// # Errors
    /// If threads cannot be started.
    pub fn of(
        goal: &Map<String, Value>,
        study: &Study,
        results: &[CaseResult],
        threads: Option<NonZeroUsize>,
        stop: &Stop,
        tell: impl FnOnce(),
    ) -> io::Result<Self> {
        let without = |question: &str, error: AdviceError| Self {
            question: question.to_owned(),
            lines: vec![error.to_string()],
            rows: Vec::new(),
            notes: Vec::new(),
        };
        let limits = match Limits::of(goal) {
            Ok(limits) => limits,
            Err(error) => return Ok(without("", error)),
        };
        let question = limits.question();
        let mut advice = match advise(study, results, limits) {
            Ok(advice) => advice,
            Err(error) => return Ok(without(&question, error)),
        };
        if advice.recommendation.is_some() {
            tell();
            advice.verify(threads, stop)?;
        }
        let mut notes: Vec<String> = Vec::new();
        for note in advice.sections.iter().flat_map(|section| &section.notes) {
            if !notes.contains(note) {
                notes.push(note.clone());
            }
        }
        let Advice {
            recommendation,
            limits,
            ..
        } = &advice;
        let (lines, rows) = recommendation.as_ref().map_or_else(
            || {
                (
                    vec!["No case of the study is within these limits.".to_owned()],
                    Vec::new(),
                )
            },
            |recommendation| (recommendation.lines(limits), recommendation.rows.clone()),
        );
        Ok(Self {
            question,
            lines,
            rows,
            notes,
        })
    }

    /// Returns the answer in lines of at most `width` columns.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        let mut text = String::new();
        wrap(width, &mut text, "", &self.question);
        write_lines(&mut text, &self.lines, width);
        text
    }
}
