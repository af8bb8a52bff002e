//! Advice as text: tables with one sentence per row.

use bristle_study::grid::FORCE;
use bristle_study::text::layout::wrap;
use bristle_study::text::number::short;

use super::Advice;
use super::outcome::Outcome;
use super::section::{Section, Sentence, Topic, warn_of_instability};
use super::suggestion::Suggestion;
use super::table::{TableLine, write_table};
use crate::insight::quantity::Readable;
use crate::insight::slices::{Slice, Varied};

impl Advice {
    /// The advice in lines of at most `width` columns: a table with one sentence per row.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        let mut text = String::new();
        if let Some(recommendation) = &self.recommendation {
            recommendation.write(&mut text, &self.limits, width);
        }
        if let Some(best) = self.tools.first() {
            let lines: Vec<TableLine> = self
                .tools
                .iter()
                .map(|tool| self.line(&tool.slice, &tool.advice))
                .collect();
            self.write_lines(&mut text, &best.slice, &lines, width);
        }
        if !self.tools_without_case.is_empty() {
            wrap(
                width,
                &mut text,
                "",
                &format!(
                    "Tools without such a case: {}",
                    self.tools_without_case.join("; ")
                ),
            );
        }
        if !self.tools.is_empty() || !self.tools_without_case.is_empty() {
            text.push('\n');
        }
        for section in &self.sections {
            self.write_section(&mut text, section, width);
            text.push('\n');
        }
        if let Some(edges) = &self.edges {
            edges.write(&mut text, width);
        }
        let cells = || {
            self.sections
                .iter()
                .flat_map(|section| &section.advice)
                .map(|sentence| &sentence.cell)
        };
        let mut legend = "Rows of runs.csv are counted below its heading.".to_owned();
        if cells().any(|cell| cell.outcome.band().is_none() && cell.outcome.uncertainty_n > 0.0) {
            legend.push_str(" ± is the uncertainty from the number of filaments, which scales all forces alike.");
        }
        if cells().any(|cell| cell.outcome.band().is_some()) {
            legend.push_str(" Brackets give the band that contains 95 % of the sampled tools.");
        }
        if cells().any(|cell| cell.outcome.laterally_unstable) {
            legend.push_str(
                " In a laterally unstable case, an imperfection of the filament grows by the factor given and can change \
                 the force: sweep filament.lateral_tilt_rad to see how much.",
            );
        }
        if self
            .sections
            .iter()
            .any(|section| !section.interpolated.is_empty())
        {
            legend.push_str(" ≈ marks a force interpolated between the cases of two rows.");
        }
        legend.push_str(
            " * marks an end of the study, beyond which the force may be higher. A filament sweeps where ε_tc is above ½ \
             and strikes elsewhere.",
        );
        if let Some(checked) = &self.checked {
            legend.push(' ');
            legend.push_str(&checked.text());
        }
        wrap(width, &mut text, "", &legend);
        text
    }

    fn write_section(&self, text: &mut String, section: &Section, width: usize) {
        let Section {
            slice,
            advice,
            interpolated,
            notes,
            ..
        } = section;
        let condition = slice.condition();
        if !condition.is_empty() {
            wrap(width, text, "", &format!("With {condition}"));
        }
        // Suggestions follow what they are an alternative to.
        let (ranking, others) =
            advice.split_at(advice.partition_point(|sentence| sentence.topic.is_ranking()));
        let cited = |sentences: &[Sentence]| {
            sentences
                .iter()
                .map(|each| self.line(slice, each))
                .collect::<Vec<_>>()
        };
        let suggested = interpolated
            .iter()
            .map(|each| self.line_of_suggestion(slice, each))
            .collect();
        self.write_lines(
            text,
            slice,
            &[cited(ranking), suggested, cited(others)]
                .into_iter()
                .flatten()
                .collect::<Vec<_>>(),
            width,
        );
        notes.iter().for_each(|note| wrap(width, text, "", note));
    }

    /// Writes lines about cases of a slice, below the headings of their cells.
    fn write_lines(&self, text: &mut String, slice: &Slice, lines: &[TableLine], width: usize) {
        let [speed, unit] =
            [&slice.x.setting.symbol(), slice.x.setting.unit()].map(|text| format!("{text} "));
        let machine =
            |text: fn(&Readable) -> &str| self.machine.iter().map(text).collect::<Vec<_>>();
        let symbols = machine(|each| each.quantity.symbol);
        let headings = [
            [&["row", &speed, "a_e ", "F_n,w"][..], &symbols, &["ε_tc"]],
            [
                &["", &unit, "mm ", self.forces.unit()],
                &machine(Readable::unit),
                &[""],
            ],
        ]
        .map(|heading| heading.concat().into_iter().map(str::to_owned).collect());
        write_table(text, headings, lines, width);
    }

    fn line(
        &self,
        slice: &Slice,
        Sentence {
            topic,
            cell,
            sentence,
            ..
        }: &Sentence,
    ) -> TableLine {
        let sides = [&slice.x, &slice.y];
        let [velocity, depth] = [0, 1].map(|side| {
            let at = cell.position[side];
            let is_free =
                *topic != Topic::Tier && *topic != [Topic::AtVelocity, Topic::AtDepth][side];
            let is_end = at == 0 || at + 1 == sides[side].values.len();
            let Varied {
                setting, values, ..
            } = sides[side];
            let label = match setting.path() {
                // The depth that was found for it.
                FORCE => short(1e3 * cell.place.penetration_depth_m),
                _ => setting.labels(values.iter().copied()).swap_remove(at),
            };
            format!(
                "{label}{}",
                if is_free && is_end && sides[side].varies() && setting.path() != FORCE {
                    '*'
                } else {
                    ' '
                }
            )
        });
        // The study states the velocity or the rotational speed.
        let heading = match topic {
            Topic::AtVelocity => topic
                .heading()
                .replace("brushing velocity", slice.x.setting.name()),
            _ => topic.heading().to_owned(),
        };
        let place = [cell.row.to_string(), velocity, depth];
        let cells = self.cells(place, &cell.outcome, |each| each.text(cell.row - 1));
        TableLine {
            heading,
            cells,
            sentence: sentence.clone(),
        }
    }

    /// The cells of a line: place, force, what the machine feels, and contact time ratio.
    fn cells(
        &self,
        place: [String; 3],
        outcome: &Outcome,
        machine: impl Fn(&Readable) -> String,
    ) -> Vec<String> {
        let ratio = format!("{:.3}", outcome.contact_time_ratio);
        place
            .into_iter()
            .chain([self.force(outcome)])
            .chain(self.machine.iter().map(machine))
            .chain([ratio])
            .collect()
    }

    fn line_of_suggestion(&self, slice: &Slice, suggestion: &Suggestion) -> TableLine {
        let [velocity, depth] =
            [&slice.x, &slice.y].map(|side| format!("{} ", suggestion.shown(side)));
        let rows = suggestion.between_rows.map(|row| row.to_string()).join("–");
        let expected = &suggestion.interpolated;
        let mut cells = self.cells([rows, velocity, depth], expected, |each| {
            each.text_of(&suggestion.summary)
        });
        cells[3].insert_str(0, "≈ ");
        let mut sentence = format!("Not simulated; it {}.", expected.motion());
        warn_of_instability(&mut sentence, expected);
        TableLine {
            heading: "Interpolated".to_owned(),
            cells,
            sentence,
        }
    }

    /// The force with its band, or else with its uncertainty.
    fn force(&self, outcome: &Outcome) -> String {
        let force = outcome.tool_contact_normal_force_n;
        match outcome.band() {
            Some(band) => self.forces.text_with_band(force, band),
            None => self
                .forces
                .text_with_uncertainty(force, outcome.uncertainty_n),
        }
    }
}
