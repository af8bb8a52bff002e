//! Advice of a study on edges: the cases with most work on edges, and with the most even work
//! around them.
//!
//! Each sentence cites a case by its row in `runs.csv`, as in all advice.

use bristle::model::metrics::Metrics;
use serde::Serialize;

use super::limits::Limits;
use super::outcome::{OperatingPoint, Outcome};
use super::table::{TableLine, write_table};
use bristle_study::grid::{CaseResult, CaseSummary, Study, Sweep};
use bristle_study::text::layout::wrap;
use bristle_study::text::number::spanning;

/// Least share of the highest force on edges in cases that advice on even work considers.
const LEAST_PART: f64 = 0.5;

/// Advice on the edges of a study's workpieces.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EdgeAdvice {
    /// The advice, topic by topic.
    pub advice: Vec<EdgeSentence>,
}

/// One piece of advice on edges.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EdgeSentence {
    /// Its topic.
    pub topic: EdgeTopic,
    /// Row of `runs.csv`, counted from 1 below the heading.
    pub row: usize,
    /// The part of `F_n,w` on edges, in N.
    pub edge_force_n: f64,
    /// The part of `p_n` on edges.
    pub edge_share: f64,
    /// Mean over largest work per length around the edges; see [`Metrics`].
    pub edge_evenness: f64,
    /// The sentence itself.
    pub sentence: String,
}

/// The topic of a piece of advice on edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeTopic {
    /// The highest normal force of the tool on edges.
    Force,
    /// The largest share of the impulse on edges.
    Share,
    /// The most even work around the edges, among cases with at least half of the highest force on
    /// them.
    Even,
}

impl EdgeTopic {
    fn heading(self) -> &'static str {
        match self {
            Self::Force => "Highest normal force of the tool on the edge",
            Self::Share => "Largest share of the impulse on the edge",
            Self::Even => {
                "Most even work around the edge, of cases with at least half of the highest force on it"
            }
        }
    }
}

/// The normal force of the tool on edges in N.
fn edge_force(metrics: &Metrics) -> f64 {
    metrics.edge_share * metrics.tool_contact_normal_force_n
}

/// Advice on edges from the cases of a study within `limits`; none if no filament touches an edge
/// in them. Of equal cases the first counts.
#[must_use]
pub fn advise_on_edges(
    study: &Study,
    results: &[CaseResult],
    limits: &Limits,
) -> Option<EdgeAdvice> {
    let known = results
        .iter()
        .enumerate()
        .filter_map(|(case, result)| Some((case, result.as_ref().ok()?)));
    let within = |(case, summary): &(usize, &CaseSummary)| {
        let settings = study.settings(*case);
        limits.allow(
            &OperatingPoint::of(&settings),
            &Outcome::new(&settings, summary),
        )
    };
    let on_edges = known
        .filter(|(_, summary)| summary.metrics.edge_share > 0.0)
        .filter(within);
    let cases: Vec<(usize, &Metrics)> = on_edges
        .map(|(case, summary)| (case, &summary.metrics))
        .collect();
    let best = |value: &dyn Fn(&Metrics) -> f64| {
        cases
            .iter()
            .rev()
            .max_by(|a, b| value(a.1).total_cmp(&value(b.1)))
            .copied()
    };
    let force = best(&edge_force)?;
    let enough = |metrics: &Metrics| edge_force(metrics) >= LEAST_PART * edge_force(force.1);
    let even = |metrics: &Metrics| {
        if enough(metrics) {
            metrics.edge_evenness
        } else {
            f64::NEG_INFINITY
        }
    };
    let topics = [
        (EdgeTopic::Force, force),
        (EdgeTopic::Share, best(&|metrics| metrics.edge_share)?),
        (EdgeTopic::Even, best(&even)?),
    ];
    let sentence = |(topic, (case, metrics)): (EdgeTopic, (usize, &Metrics))| EdgeSentence {
        topic,
        row: case + 1,
        edge_force_n: edge_force(metrics),
        edge_share: metrics.edge_share,
        edge_evenness: metrics.edge_evenness,
        sentence: place(study, case),
    };
    Some(EdgeAdvice {
        advice: topics.into_iter().map(sentence).collect(),
    })
}

/// The swept values of a case. As in other advice, `*` marks an end of the study.
fn place(study: &Study, case: usize) -> String {
    let value = |(sweep, value): (&Sweep, f64)| {
        let text = sweep.setting().equation(value);
        let [low, high] = [f64::min, f64::max]
            .map(|of| sweep.values().iter().copied().reduce(of).unwrap_or(value));
        let is_number = sweep.setting().parameter().is_some();
        if is_number && low < high && (value == low || value == high) {
            format!("{text}*")
        } else {
            text
        }
    };
    let values: Vec<String> = study
        .sweeps()
        .iter()
        .zip(study.values(case))
        .map(value)
        .collect();
    if values.is_empty() {
        "The only case.".to_owned()
    } else {
        format!("At {}.", values.join(", "))
    }
}

impl EdgeAdvice {
    /// Adds the advice to a text, in lines of at most `width` columns.
    pub fn write(&self, text: &mut String, width: usize) {
        let headings = [
            ["row", "F_n,w", "share of", "evenness"],
            ["", "on edge", "p_n", ""],
        ]
        .map(|heading| heading.map(str::to_owned).to_vec());
        let line = |about: &EdgeSentence| TableLine {
            heading: about.topic.heading().to_owned(),
            cells: vec![
                about.row.to_string(),
                format!("{} N", spanning(about.edge_force_n)),
                format!("{:.3}", about.edge_share),
                format!("{:.3}", about.edge_evenness),
            ],
            sentence: about.sentence.clone(),
        };
        let lines: Vec<TableLine> = self.advice.iter().map(line).collect();
        text.push_str("Work on the edge\n");
        write_table(text, headings, &lines, width);
        wrap(
            width,
            text,
            "",
            "Evenness is the mean of the work per length around the edge over its largest value: 1 if the filament works \
             everywhere alike, near 0 if in one place.",
        );
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{self, brush, result};

    #[test]
    fn the_right_cases_are_cited() {
        let sweeps = "[workpiece]\nkind = \"edge\"\nedge_radius_m = 0.5e-3\n[process]\nbrushing_velocity_m_s = 10.0\n\
                      [study]\n\"workpiece.offset_m\" = [-0.01, 0.0, 0.01]\npenetration_depth_m = [1e-3, 2e-3]\n";
        let study = testing::study(&(brush!(25).to_owned() + sweeps));
        let case = |tool_contact_normal_force_n, edge_share, edge_evenness| {
            result(Metrics {
                tool_contact_normal_force_n,
                contact_time_ratio: 0.9,
                edge_share,
                edge_evenness,
                ..Metrics::default()
            })
        };
        let results = [
            case(100.0, 0.1, 0.9),
            case(100.0, 0.4, 0.7),
            Err("failed".to_owned()),
            case(200.0, 0.3, 0.5),
            case(10.0, 0.8, 0.8),
            case(300.0, 0.0, 0.0),
        ];
        let all = Limits::default();
        let advice = advise_on_edges(&study, &results, &all)
            .expect("advice")
            .advice;
        let rows: Vec<usize> = advice.iter().map(|about| about.row).collect();
        assert_eq!(rows, [4, 5, 2]);
        assert_eq!(advice[0].edge_force_n, 60.0);
        assert_eq!(advice[0].sentence, "At offset = 0 mm, a_e = 2 mm*.");
        let slow = Limits {
            max_velocity_m_s: Some(5.0),
            ..all
        };
        assert_eq!(advise_on_edges(&study, &results, &slow), None);
        let without = vec![case(100.0, 0.0, 0.0); 6];
        assert_eq!(advise_on_edges(&study, &without, &all), None);
    }
}
