//! Quantities in all cases of a study, in units that make their numbers readable.

use bristle::model::metrics::{Metrics, RemovalLaw};
use bristle::model::record::{Column, Prominence, Record, Scale, Scope};

use crate::insight::advice::Limits;
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{CaseResult, CaseSummary, Interaction, Study};
use bristle_study::input::statement::Statement;
use bristle_study::text::number::spanning;

/// Metric that advice and comparisons use.
pub const TOOL_FORCE: &str = "tool_contact_normal_force_n";
/// Depth of a case, a result where the file states a force.
const FOUND_DEPTH: &str = "penetration_depth_m";

/// Returns the key of the metric that matters most in a study: that of its goal, else the tool
/// force, or the depth of a force that is stated.
#[must_use]
pub fn main_metric(study: &Study, statement: &Statement) -> &'static str {
    let limits = statement.goal.as_ref().map(Limits::of);
    let limits = limits.and_then(Result::ok).unwrap_or_default();
    let asked = if limits.target_force_n.is_some() {
        TOOL_FORCE
    } else {
        limits.most().key()
    };
    if asked == TOOL_FORCE && study.is_pressed_on() {
        FOUND_DEPTH
    } else {
        asked
    }
}

/// A quantity of a case.
#[derive(Clone, Debug)]
pub struct CaseQuantity {
    /// Symbol, with an underscore before a subscript.
    pub symbol: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Text after the symbol in a list.
    pub qualifier: &'static str,
    /// SI unit without prefix, empty for a pure number.
    unit: &'static str,
    scale: Scale,
    parts: QuantityParts,
}

/// The numbers that make up a quantity of a case.
#[derive(Clone, Debug)]
enum QuantityParts {
    Metric(&'static Column<Metrics>),
    /// Upper and lower end of the interval of the tool force.
    Band,
    /// Effect of interaction in a brush.
    Interaction(&'static Column<Interaction>),
}

impl QuantityParts {
    fn count(&self) -> usize {
        match self {
            Self::Metric(_) | Self::Interaction(_) => 1,
            Self::Band => 2,
        }
    }

    /// Returns one part, if it is known.
    fn get(&self, summary: &CaseSummary, part: usize) -> Option<f64> {
        match self {
            Self::Metric(column) => Some(column.get(&summary.metrics)),
            Self::Interaction(column) => summary
                .brush
                .as_ref()
                .map(|interaction| column.get(interaction)),
            Self::Band => summary.scatter.as_ref().map(|scatter: &ForceScatter| {
                let [lower, upper] = scatter.band();
                if part == 0 { upper } else { lower }
            }),
        }
    }
}

impl CaseQuantity {
    /// Returns `true` for the metric with a key.
    #[must_use]
    pub fn is(&self, key: &str) -> bool {
        matches!(self.parts, QuantityParts::Metric(column) if column.key == key)
    }

    /// Returns the metrics that tables of these results show, in the order used in files.
    pub fn headlines(results: &[CaseResult]) -> impl Iterator<Item = Self> {
        shown_metrics(Prominence::Headline, results).map(Self::metric)
    }

    /// Returns the headline metrics of the tool besides its force: the load on drive and workpiece.
    pub fn machine(results: &[CaseResult]) -> impl Iterator<Item = Self> {
        let of_tool = |column: &&Column<Metrics>| {
            column.display.scope == Scope::Tool && column.key != TOOL_FORCE
        };
        shown_metrics(Prominence::Headline, results)
            .filter(of_tool)
            .map(Self::metric)
    }

    /// Returns the interval of the tool force, where filaments scatter.
    #[must_use]
    pub fn band() -> Self {
        let name = "upper and lower end of the band that contains 95 % of the tools";
        Self {
            name,
            qualifier: " of 95 %",
            parts: QuantityParts::Band,
            ..Self::tool_force()
        }
    }

    /// Returns the effects of interaction, where the cases are brushes.
    pub fn interaction() -> impl Iterator<Item = Self> {
        let shown = Interaction::COLUMNS
            .iter()
            .filter(|column| column.display.prominence == Prominence::Headline);
        shown.map(|column| Self::of(column, QuantityParts::Interaction(column)))
    }

    fn tool_force() -> Self {
        let column = Metrics::COLUMNS
            .iter()
            .find(|column| column.key == TOOL_FORCE);
        Self::metric(column.expect("the force of the tool is a metric"))
    }

    fn metric(column: &'static Column<Metrics>) -> Self {
        Self::of(column, QuantityParts::Metric(column))
    }

    fn of<R>(column: &'static Column<R>, parts: QuantityParts) -> Self {
        let &Column {
            symbol,
            name,
            unit,
            display,
            ..
        } = column;
        Self {
            symbol,
            name,
            qualifier: "",
            unit,
            scale: display.scale,
            parts,
        }
    }
}

/// Maximum share of F_n,w at which a force counts as zero.
const MAX_NOISE_SHARE: f64 = 1e-4;

/// Returns the metrics of at least this prominence, in the order used in files. Optional metrics
/// that are zero in all results are left out, and lateral amplifications if all passes are stable.
/// A depth that was found for a force is always among them.
pub fn shown_metrics(
    least: Prominence,
    results: &[CaseResult],
) -> impl Iterator<Item = &'static Column<Metrics>> {
    let varies = |column: &Column<Metrics>| {
        // Forces that cancel, as all around a cup, leave the tolerance of their parts.
        let noise = |metrics: &Metrics| {
            if column.unit == "N" {
                MAX_NOISE_SHARE * metrics.tool_contact_normal_force_n
            } else {
                0.0
            }
        };
        results
            .iter()
            .flatten()
            .any(|case| column.get(&case.metrics).abs() > noise(&case.metrics))
    };
    let shown = move |column: &&Column<Metrics>| {
        column.display.prominence <= least || column.key == "penetration_depth_m"
    };
    let force = results
        .iter()
        .flatten()
        .any(|case| case.metrics.force_stiffness_n_m != 0.0);
    // Unknown metrics of removal, and metrics of an absent edge, are zero in all of them, and
    // optional.
    let anything = RemovalLaw {
        preston: Some(0.0),
        wear: Some(0.0),
        area_rate: Some(0.0),
    };
    let columns = metric_columns(Having {
        brush: false,
        force,
        edge: true,
        removal: anything,
    })
    .filter(shown);
    let unstable = results
        .iter()
        .flatten()
        .any(|case| case.metrics.laterally_unstable);
    columns.filter(move |column| match column.key {
        "lateral_amplification" => unstable,
        _ => !column.display.optional || varies(column),
    })
}

/// A quantity in all cases, scaled to a readable unit.
#[derive(Clone, Debug)]
pub struct Readable {
    /// The quantity.
    pub quantity: CaseQuantity,
    /// Unit with its prefix, empty for a pure number.
    unit: String,
    /// Factor from SI to this unit.
    factor: f64,
    /// Numbers of each part in this unit. Unknown numbers are `None`.
    parts: Vec<Vec<Option<f64>>>,
    /// Text in place of an unknown number, for each case.
    unknown: Vec<&'static str>,
    decimals: usize,
}

impl Readable {
    /// Scales the quantity in the results of a study.
    #[must_use]
    pub fn new(quantity: CaseQuantity, results: &[CaseResult]) -> Self {
        const PREFIXES: [(&str, f64); 6] = [
            ("M", 1e-6),
            ("k", 1e-3),
            ("", 1.0),
            ("m", 1e3),
            ("µ", 1e6),
            ("n", 1e9),
        ];
        let value = |result: &CaseResult, part| quantity.parts.get(result.as_ref().ok()?, part);
        let values = |part| results.iter().map(|result| value(result, part)).collect();
        let mut parts: Vec<Vec<Option<f64>>> = (0..quantity.parts.count()).map(values).collect();
        let largest = parts
            .iter()
            .flatten()
            .flatten()
            .copied()
            .fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let (prefix, factor) = PREFIXES
            .into_iter()
            .filter(|(prefix, _)| prefix.is_empty() || !quantity.unit.is_empty())
            .find(|(_, factor)| largest * factor >= 1.0)
            .unwrap_or(("", 1.0));
        parts
            .iter_mut()
            .flatten()
            .flatten()
            .for_each(|value| *value *= factor);
        let unknown = results
            .iter()
            .map(|result| if result.is_err() { "failed" } else { "–" })
            .collect();
        let decimals = match largest * factor {
            100.0.. => 1,
            10.0.. => 2,
            _ => 3,
        };
        Self {
            unit: format!("{prefix}{}", quantity.unit),
            quantity,
            factor,
            parts,
            unknown,
            decimals,
        }
    }

    /// Returns the forces of the tool.
    #[must_use]
    pub fn tool_forces(results: &[CaseResult]) -> Self {
        Self::new(CaseQuantity::tool_force(), results)
    }

    /// Returns the unit of the numbers.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Returns the factor from SI to the unit of the numbers.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns the number of parts of a case.
    #[must_use]
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Returns the symbol, or else the last word of the name, and the qualifier.
    #[must_use]
    pub fn symbol(&self, qualifier: &str) -> String {
        let CaseQuantity { symbol, name, .. } = self.quantity;
        let symbol = if symbol.is_empty() {
            name.rsplit(' ').next().unwrap_or(name)
        } else {
            symbol
        };
        format!("{symbol}{qualifier}")
    }

    /// Returns [`Readable::symbol`], and the unit if there is one.
    #[must_use]
    pub fn heading(&self, qualifier: &str) -> String {
        let symbol = self.symbol(qualifier);
        if self.unit.is_empty() {
            symbol
        } else {
            format!("{symbol} in {}", self.unit)
        }
    }

    /// Returns the parts of a case as texts.
    pub fn texts(&self, case: usize) -> impl Iterator<Item = String> {
        let text = move |values: &Vec<Option<f64>>| {
            values[case].map_or_else(|| self.unknown[case].to_owned(), |value| self.scaled(value))
        };
        self.parts.iter().map(text)
    }

    /// Returns a number in the unit of this quantity.
    fn scaled(&self, value: f64) -> String {
        match self.quantity.scale {
            Scale::Logarithmic => spanning(value),
            // Avoids a negative zero.
            _ if value.abs() < 0.5 * 0.1_f64.powi(self.decimals as i32) => {
                format!("{:.*}", self.decimals, 0.0)
            }
            _ => format!("{value:.*}", self.decimals),
        }
    }

    /// Returns the number of a case that is not among the results; the first if there are several.
    #[must_use]
    pub fn text_of(&self, summary: &CaseSummary) -> String {
        self.quantity
            .parts
            .get(summary, 0)
            .map_or_else(|| "–".to_owned(), |value| self.scaled(value * self.factor))
    }

    /// Returns the parts of a case on one line, in ascending order.
    #[must_use]
    pub fn in_one_line(&self, case: usize) -> String {
        if self.parts.iter().any(|values| values[case].is_none()) {
            return self.unknown[case].to_owned();
        }
        let parts: Vec<String> = self.texts(case).collect();
        parts.into_iter().rev().collect::<Vec<_>>().join(" … ")
    }

    /// Returns the number of a case; the first if there are several.
    #[must_use]
    pub fn text(&self, case: usize) -> String {
        self.texts(case).next().unwrap_or_default()
    }

    /// Returns a number and an interval around it, both in SI units.
    #[must_use]
    pub fn text_with_band(&self, value: f64, band: [f64; 2]) -> String {
        let [lower, upper] =
            band.map(|end| format!("{:.*}", self.decimals.saturating_sub(1), end * self.factor));
        format!("{} [{lower} … {upper}]", self.scaled(value * self.factor))
    }

    /// Returns a number and its uncertainty, if any, both in SI units.
    #[must_use]
    pub fn text_with_uncertainty(&self, value: f64, uncertainty: f64) -> String {
        let text = self.scaled(value * self.factor);
        if uncertainty == 0.0 {
            text
        } else {
            format!("{text} ± {:.*}", self.decimals, uncertainty * self.factor)
        }
    }
}
