//! Maps and curves of a metric over the settings of a slice.

use bristle::model::metrics::Metrics;
use bristle::model::record::{self, Column, Level, Record, Scope};
use bristle::model::settings::Settings;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::number::{short, significant};

use super::metric::{Drawn, axis_of, title};
use super::picture::{Picture, brush_line};
use super::study::{MAX_CELLS, MAX_CURVES};
use crate::insight::measured::relative_uncertainty;
use crate::insight::slices::{Slice, Varied, spread};
use crate::report::drawing::diagram::{Curve, Diagram, Look};
use crate::report::drawing::ends;
use crate::report::drawing::format::Format;
use crate::report::drawing::map::{self, Contour, Map};
use crate::report::drawing::scale::Axis;

/// A family of curves that goes with a map.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    OverX,
    OverY,
}

/// The side along which a figure runs, and the side with one curve per value.
pub(super) struct Sides<'a> {
    pub(super) family: Family,
    pub(super) over: &'a Varied,
    pub(super) of: &'a Varied,
}

/// A slice and the results in it.
pub(super) struct SliceView<'a> {
    pub(super) study: &'a Study,
    pub(super) results: &'a [CaseResult],
    pub(super) slice: &'a Slice,
    pub(super) format: &'a Format,
}

impl SliceView<'_> {
    /// Returns a metric in its unit at positions on the sides of the slice; `None` if the case
    /// failed.
    pub(super) fn value<R: Drawn>(&self, metric: &Column<R>, x: usize, y: usize) -> Option<f64> {
        let summary = self.results[self.slice.case(x, y)].as_ref().ok()?;
        Some(metric.display.factor * metric.get(R::of(summary)?))
    }

    /// Returns the sides of the slice as a family of curves uses them.
    pub(super) fn sides(&self, family: Family) -> Sides<'_> {
        let Slice { x, y, .. } = self.slice;
        match family {
            Family::OverX => Sides {
                family,
                over: x,
                of: y,
            },
            Family::OverY => Sides {
                family,
                over: y,
                of: x,
            },
        }
    }

    /// Joins the parts of a subtitle after those that all figures of the slice share. Adds a line
    /// with friction and brush.
    pub(super) fn subtitle(&self, parts: impl IntoIterator<Item = String>) -> String {
        let all = std::iter::once(self.slice.condition()).chain(parts);
        let parts = all.filter(|part| !part.is_empty()).collect::<Vec<_>>();
        let Slice { x, y, fixed, .. } = self.slice;
        // Each setting depends on one side at most.
        let along_x = (0..x.values.len()).map(|at| self.slice.case(at, 0));
        let along_y = (0..y.values.len()).map(|at| self.slice.case(0, at));
        let cases: Vec<Settings> = along_x
            .chain(along_y)
            .map(|case| self.study.settings(case))
            .collect();
        let is_in_condition = |path: &str| fixed.iter().any(|(setting, _)| setting.path() == path);
        let lines = [parts.join("; "), brush_line(&cases, is_in_condition)];
        lines.join("\n")
    }

    /// Returns `N_f` with its uncertainty, if it applies to all values.
    pub(super) fn uncertainty<R>(&self, metric: &Column<R>) -> String {
        let case = self.slice.case(0, 0);
        let relative = relative_uncertainty(&self.study.settings(case));
        let varies = [&self.slice.x, &self.slice.y]
            .iter()
            .any(|side| side.setting.section() == "tool");
        if metric.display.scope != Scope::Tool || relative == 0.0 || varies {
            return String::new();
        }
        let tool = self.study.settings(case).tool;
        let spread = short(tool.filament_count_uncertainty);
        format!("N_f ± {spread}: all values ± {:.1} %", 100.0 * relative)
    }

    /// Returns `true` if the case at positions on the sides of the slice is laterally unstable.
    pub(super) fn is_unstable(&self, x: usize, y: usize) -> bool {
        self.results[self.slice.case(x, y)]
            .as_ref()
            .is_ok_and(|summary| summary.metrics.laterally_unstable)
    }

    /// Returns a note if some of the `shown` values are missing.
    pub(super) fn failures(&self, shown: impl Iterator<Item = Option<f64>>, mark: &str) -> String {
        match shown.filter(Option::is_none).count() {
            0 => String::new(),
            1 => format!("{mark}: one simulation failed"),
            failed => format!("{mark}: {failed} simulations failed"),
        }
    }

    /// Draws a map of a metric; `kind` is part of its name.
    pub(super) fn map<R: Drawn>(&self, metric: &Column<R>, kind: &str) -> Picture {
        let Slice { x, y, .. } = self.slice;
        let [columns, rows] = [x, y].map(|side| spread(side.values.len(), MAX_CELLS));
        let side = |side: &Varied, shown: &[usize]| {
            let all = side.shown();
            let values: Vec<f64> = shown.iter().map(|&position| all[position]).collect();
            let labels = side
                .setting
                .labels(shown.iter().map(|&position| side.values[position]));
            map::CellAxis {
                label: side.setting.label(),
                labels,
                values,
            }
        };
        let shown = || {
            rows.iter()
                .flat_map(|&row| columns.iter().map(move |&column| (column, row)))
        };
        let values: Vec<Option<f64>> = shown()
            .map(|(column, row)| self.value(metric, column, row))
            .collect();
        let marked: Vec<bool> = shown()
            .map(|(column, row)| self.is_unstable(column, row))
            .collect();
        let all = x.values.len() * y.values.len();
        let selection = selection(values.len(), all, "cases");
        let crosses = |level: &Level, values: &[Option<f64>]| {
            let is_below = |value: &f64| *value < level.value;
            values.iter().flatten().any(is_below) && !values.iter().flatten().all(is_below)
        };
        let of_another = |level: &Level| {
            let other = Metrics::COLUMNS
                .iter()
                .find(|column| column.key == level.of && level.of != metric.key)?;
            Some(
                shown()
                    .map(|(column, row)| self.value(other, column, row))
                    .collect::<Vec<Option<f64>>>(),
            )
        };
        let line = metric
            .display
            .level
            .map(|level| (level, of_another(&level)));
        let line = line.filter(|(level, other)| crosses(level, other.as_ref().unwrap_or(&values)));
        let meaning = line
            .as_ref()
            .map_or_else(String::new, |(level, _)| level.meaning.to_owned());
        let failures = self.failures(values.iter().copied(), "hatched");
        let instabilities = if marked.contains(&true) {
            "corner: laterally unstable"
        } else {
            ""
        };
        let parts = [
            meaning,
            instabilities.to_owned(),
            self.uncertainty(metric),
            selection,
            failures,
        ];
        let subtitle = self.subtitle(parts);
        let map = Map {
            title: title(metric),
            subtitle,
            x: side(x, &columns),
            y: side(y, &rows),
            colours: axis_of(metric, values.iter(), Axis::linear),
            values,
            marked,
            range: metric.display.range,
            line: line.map(|(level, other)| Contour {
                level: level.value,
                other,
            }),
        };
        Picture {
            name: format!("{}_{kind}{}", metric.display.file_name, self.slice.suffix()),
            canvas: map.draw_in(self.format),
        }
    }

    pub(super) fn curves<R: Drawn>(&self, metric: &Column<R>, family: Family) -> Picture {
        let Sides { over, of, .. } = self.sides(family);
        let value = |along: usize, member: usize| match family {
            Family::OverX => self.value(metric, along, member),
            Family::OverY => self.value(metric, member, along),
        };
        let members = spread(of.values.len(), MAX_CURVES);
        let shown = over.shown();
        let family: Vec<Vec<Option<f64>>> = members
            .iter()
            .map(|&member| (0..shown.len()).map(|along| value(along, member)).collect())
            .collect();
        // Tools are compared by their levels.
        let are_numbers = [over, of].iter().all(|side| side.setting.names().is_none());
        let is_linear = metric.display.scale != record::Scale::Logarithmic;
        let means = means_of_flat(&family).filter(|_| is_linear && are_numbers);
        let curve = |(position, values): (usize, &Vec<Option<f64>>)| {
            let name = of.setting.legend(of.values[members[position]]);
            let (name, on_axis): (_, Box<dyn Fn(f64) -> f64>) = match &means {
                Some(means) => {
                    let mean = means[position];
                    let name =
                        format!("{name}: mean {} {}", significant(mean), metric.display.unit);
                    (
                        name.trim_end().to_owned(),
                        Box::new(move |value| 100.0 * (value / mean - 1.0)),
                    )
                }
                None => (name, Box::new(|value| value)),
            };
            let points = shown
                .iter()
                .zip(values)
                .map(|(&at, value)| (at, value.map_or(f64::NAN, &on_axis)));
            Curve::new(name, joined(over), points)
        };
        let mut curves: Vec<Curve> = family.iter().enumerate().map(curve).collect();
        if let Some(Level {
            value,
            in_curves: name,
            ..
        }) = metric.display.level
            && !name.is_empty()
            && curves
                .iter()
                .flat_map(|curve| &curve.points)
                .any(|(_, shown)| *shown > value)
        {
            let ends = [shown[0], shown[shown.len() - 1]];
            curves.push(Curve::new(
                name,
                Look::Reference,
                ends.map(|end| (end, value)),
            ));
        }
        let selection = selection(members.len(), of.values.len(), &values_of(of));
        let axis = axis_of(metric, family.iter().flatten(), Axis::amount);
        let failures = self.failures(family.into_iter().flatten(), "gaps");
        let diagram = Diagram::new(
            title(metric),
            self.subtitle([self.uncertainty(metric), selection, failures]),
            [
                axis_along(over),
                match means {
                    Some(_) => Axis::linear("deviation from the mean in %"),
                    None => axis,
                },
            ],
            curves,
        );
        let by = if of.setting.names().is_some() {
            "_by_tool"
        } else {
            ""
        };
        let name = format!(
            "{}_over_{}{by}{}",
            metric.display.file_name,
            over.setting.word(),
            self.slice.suffix()
        );
        Picture::of(name, self.format, &diagram)
    }
}

/// Least ratio of the values of a setting that are drawn on a logarithmic axis.
const DECADES: f64 = 100.0;
/// Largest change along a flat curve next to curves at other levels, as a share of its mean.
const FLAT: f64 = 0.1;

/// Returns `true` if values from the least to the largest span decades.
pub(super) fn span_decades([least, largest]: [f64; 2]) -> bool {
    least > 0.0 && largest >= DECADES * least
}

/// Returns the axis along a side: logarithmic if its values span decades.
pub(super) fn axis_along(side: &Varied) -> Axis {
    let label = side.setting.label();
    let (least, largest) = (side.values[0], side.values[side.values.len() - 1]);
    match side.setting.names() {
        Some(names) => Axis::named(label, names.to_vec()),
        None if span_decades([least, largest]) => Axis::logarithmic(label),
        None => Axis::linear(label),
    }
}

/// Returns the means of several curves that each look flat, because their levels differ by more
/// than each of them changes. `None` for other curves.
pub(super) fn means_of_flat(curves: &[Vec<Option<f64>>]) -> Option<Vec<f64>> {
    let range = |values: &[f64]| ends(values.iter().copied());
    let known: Vec<Vec<f64>> = curves
        .iter()
        .map(|values| values.iter().copied().flatten().collect())
        .collect();
    let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let means: Vec<f64> = known.iter().map(mean).collect();
    let changes = |values: &Vec<f64>| {
        let [least, largest] = range(values);
        largest - least
    };
    let [lowest, highest] = range(&means);
    let is_flat = |values: &Vec<f64>| {
        values.len() > 1
            && changes(values) < FLAT * mean(values).abs()
            && changes(values) < FLAT * (highest - lowest)
    };
    (known.len() > 1 && known.iter().all(is_flat) && lowest > 0.0).then_some(means)
}

/// Returns the style of points along a side. Tools are not joined, as nothing lies between them.
pub(super) fn joined(side: &Varied) -> Look {
    if side.setting.names().is_some() {
        Look::Markers
    } else {
        Look::Joined
    }
}

/// Returns the name of the values of a side.
pub(super) fn values_of(side: &Varied) -> String {
    if side.setting.names().is_some() {
        "tools".to_owned()
    } else {
        format!("values of {}", side.setting.symbol())
    }
}

/// Returns the number of shown values in words; empty if all are shown.
pub(super) fn selection(shown: usize, total: usize, what: &str) -> String {
    if shown < total {
        format!("{shown} of {total} {what}")
    } else {
        String::new()
    }
}
