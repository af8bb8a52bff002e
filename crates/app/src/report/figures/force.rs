//! Figures of the tool force and its uncertainty: bands, measured points, and the sources of
//! scatter.

use super::picture::Picture;
use super::slice_view::{Family, Sides, SliceView, axis_along, joined, selection, values_of};
use crate::insight::measured::{SimulatedForce, tool_force};
use crate::insight::slices::{Slice, Varied, spread};
use crate::report::drawing::diagram::{Curve, Diagram, Look};
use crate::report::drawing::ends;
use crate::report::drawing::pens::COLORS;
use crate::report::drawing::scale::Axis;
use bristle_study::grid::CaseSummary;
use bristle_study::grid::uncertainty::{SHARES, scatter_text, scatters};
use bristle_study::input::measured::{Measurement, same};
use bristle_study::text::number::short;

/// Maximum number of curves with measured points, each of which has a band.
const MAX_MEASURED: usize = 4;
/// Maximum number of pairs of curves with and without interaction.
const MAX_INTERACTING: usize = 3;
/// Maximum number of curves with bands of varying filaments, which are wide.
const MAX_SCATTERED: usize = 3;

/// Maximum number of markers on a curve; more would hide each other, and make a file that no viewer
/// opens.
const MAX_MARKS: usize = 100;

/// Maximum number of error bars on a curve, and the pixels between those of curves at one place.
const MAX_BARS: usize = 16;
const BESIDE: i32 = 6;

/// Simulated forces with their uncertainties: bands, or bars beside each other where bands would
/// overlap.
struct Banded {
    curves: Vec<Curve>,
    /// Marks that show the uncertainties, in words.
    shown_as: &'static str,
    /// `true` if some forces are unknown.
    has_gaps: bool,
}

impl SliceView<'_> {
    /// Draws the tool force where filaments scatter; `None` if this side has one value only.
    pub(super) fn scatter(&self, family: Family) -> Option<Picture> {
        let sides @ Sides { over, of, .. } = &self.sides(family);
        if !over.varies() {
            return None;
        }
        let levels: Vec<f64> = spread(of.values.len(), MAX_SCATTERED)
            .into_iter()
            .map(|index| of.values[index])
            .collect();
        let Banded {
            curves,
            shown_as,
            has_gaps,
        } = self.banded(sides, &levels, "");
        if curves
            .iter()
            .all(|curve| ![Look::Band, Look::Bars].contains(&curve.look) || curve.points.is_empty())
        {
            return None;
        }
        let selection = selection(levels.len(), of.values.len(), &values_of(of));
        let title = "Contact normal force of the tool with varying filaments";
        let parts = [self.band_text(shown_as), selection, gaps(has_gaps)];
        Some(self.over(
            over,
            "scatter",
            title,
            parts,
            Axis::amount("F_n,w in N"),
            curves,
        ))
    }

    /// Draws first-order Sobol indices along the first side, at the middle value of the other.
    pub(super) fn sobol(&self) -> Option<Picture> {
        let Slice { x, y, .. } = self.slice;
        if !x.varies() {
            return None;
        }
        let row = (y.values.len() - 1) / 2;
        let indices = |column: usize| {
            let summary = self.results[self.slice.case(column, row)].as_ref().ok()?;
            let scatter = summary.scatter.as_ref()?;
            (scatter.tool_force_std_n > 0.0).then(|| scatter.sobol_indices())
        };
        let known: Vec<Option<[f64; SHARES.len()]>> = (0..x.values.len()).map(indices).collect();
        let mut curves = Vec::new();
        let mut add = |name: &str, index: &dyn Fn(&[f64; SHARES.len()]) -> f64| {
            let points = x.shown().into_iter().zip(&known);
            let points: Vec<(f64, f64)> = points
                .map(|(at, known)| (at, known.as_ref().map_or(f64::NAN, index)))
                .collect();
            curves.push(Curve::new(name, joined(x), points));
        };
        for (position, [symbol, name]) in SHARES.iter().enumerate() {
            if known
                .iter()
                .flatten()
                .any(|indices| indices[position] > 0.0)
            {
                add(format!("{name} {symbol}").trim_end(), &|indices| {
                    indices[position]
                });
            }
        }
        add("not attributed", &|indices| {
            (1.0 - indices.iter().sum::<f64>()).max(0.0)
        });
        if known.iter().all(Option::is_none) {
            return None;
        }
        let at = y.setting.equation(y.values[row]);
        let mut all =
            (0..x.values.len()).map(|column| self.study.settings(self.slice.case(column, row)));
        let deviations = all
            .find(scatters)
            .map_or_else(String::new, |settings| scatter_text(&settings));
        let title = "Sources of the scatter in the tool force";
        Some(self.over(
            x,
            "sobol",
            title,
            [at, deviations],
            Axis::from_zero("first-order Sobol index"),
            curves,
        ))
    }

    /// Draws the tool force with and without interaction; `None` if this side has one value only.
    pub(super) fn interaction(&self, family: Family) -> Option<Picture> {
        let Sides { over, of, .. } = self.sides(family);
        if !over.varies() {
            return None;
        }
        let members = spread(of.values.len(), MAX_INTERACTING);
        let mut curves = Vec::new();
        for (index, &member) in members.iter().enumerate() {
            let summary = |along: usize| {
                let [x, y] = if family == Family::OverX {
                    [along, member]
                } else {
                    [member, along]
                };
                self.results[self.slice.case(x, y)].as_ref().ok()
            };
            let curve = |force: &dyn Fn(&CaseSummary) -> Option<f64>| {
                let force = |along| summary(along).and_then(force).unwrap_or(f64::NAN);
                over.shown()
                    .into_iter()
                    .enumerate()
                    .map(|(along, at)| (at, force(along)))
                    .collect::<Vec<_>>()
            };
            let name = of.setting.legend(of.values[member]);
            // Pens of one colour.
            let brush = curve(&|summary| Some(summary.metrics.tool_contact_normal_force_n));
            let alone =
                curve(&|summary| Some(summary.brush.as_ref()?.tool_contact_normal_force_alone_n));
            curves.push(Curve::new(format!("brush, {name}"), joined(over), brush).with_pen(index));
            let line = if over.setting.names().is_some() {
                Look::Markers
            } else {
                Look::Line
            };
            curves.push(
                Curve::new(format!("alone, {name}"), line, alone).with_pen(index + COLORS.len()),
            );
        }
        let has_gaps = curves
            .iter()
            .flat_map(|curve| &curve.points)
            .any(|(_, force)| force.is_nan());
        let selection = selection(members.len(), of.values.len(), &values_of(of));
        let title = "Contact normal force of the tool with and without interaction";
        Some(self.over(
            over,
            "interaction",
            title,
            [selection, gaps(has_gaps)],
            Axis::amount("F_n,w in N"),
            curves,
        ))
    }

    /// Returns the place of a measured point along the horizontal side of the slice.
    fn across(&self, point: &Measurement) -> f64 {
        self.slice.at_speed(self.study, point.speed)
    }

    /// Draws the simulated tool force with measured points; `None` if the study has no curve for
    /// them.
    pub(super) fn measured(&self, measured: &[Measurement], family: Family) -> Option<Picture> {
        let sides @ Sides { over, of, .. } = &self.sides(family);
        if !over.varies() {
            return None;
        }
        let place = |point: &Measurement| match family {
            Family::OverX => (self.across(point), point.penetration_depth_m),
            Family::OverY => (point.penetration_depth_m, self.across(point)),
        };
        // The values with measured points that the study covers.
        let (least, largest) = (of.values[0], of.values[of.values.len() - 1]);
        let within = |value: f64| {
            (least <= value && value <= largest) || same(value, least) || same(value, largest)
        };
        let mut levels: Vec<f64> = measured
            .iter()
            .map(|point| place(point).1)
            .filter(|&value| within(value))
            .collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|next, first| same(*next, *first));
        if levels.is_empty() {
            return None;
        }
        let total = levels.len();
        let levels: Vec<f64> = spread(total, MAX_MEASURED)
            .into_iter()
            .map(|index| levels[index])
            .collect();
        let Banded {
            mut curves,
            shown_as,
            has_gaps,
        } = self.banded(sides, &levels, "simulated, ");
        let mut has_means = false;
        for (index, &level) in levels.iter().enumerate() {
            let name = of.setting.legend(level);
            let points = measured.iter().filter(|point| same(place(point).1, level));
            let points = points.map(|point| {
                let (force_n, std_n) = (point.force_n, point.std_n.unwrap_or(0.0));
                Marked {
                    at: place(point).0 * over.setting.factor(),
                    force_n,
                    bar: [force_n - std_n, force_n + std_n],
                }
            });
            let (marks, are_means) = marks(points.collect());
            has_means |= are_means;
            let ends = marks
                .iter()
                .flat_map(|mark| mark.bar.map(|end| (mark.at, end)));
            curves.push(Curve::new("", Look::Bars, ends).with_pen(index));
            let points = marks.iter().map(|mark| (mark.at, mark.force_n));
            curves.push(
                Curve::new(format!("measured, {name}"), Look::Filled, points).with_pen(index),
            );
        }
        let has_bars = measured.iter().any(|point| point.std_n.is_some());
        let bars = match (has_means, has_bars) {
            (true, true) => {
                format!(
                    "markers: means of {MAX_MARKS} intervals; their error bars: all points ± standard deviation"
                )
            }
            (true, false) => {
                format!("markers: means of {MAX_MARKS} intervals; their error bars: all points")
            }
            (false, true) => "error bars: ± standard deviation".to_owned(),
            (false, false) => "measured without standard deviations".to_owned(),
        };
        let selection = selection(levels.len(), total, &format!("measured {}", values_of(of)));
        let title = "Contact normal force of the tool, simulated and measured";
        let parts = [
            format!("{}; {bars}", self.band_text(shown_as)),
            selection,
            gaps(has_gaps),
        ];
        Some(self.over(
            over,
            "measured",
            title,
            parts,
            Axis::amount("F_n,w in N"),
            curves,
        ))
    }

    /// Draws curves along a side. The name of the figure begins with `what`; its subtitle has
    /// `parts`.
    fn over<const N: usize>(
        &self,
        side: &Varied,
        what: &str,
        title: &str,
        parts: [String; N],
        y: Axis,
        curves: Vec<Curve>,
    ) -> Picture {
        let subtitle = self.subtitle(parts);
        let diagram = Diagram::new(title, subtitle, [axis_along(side), y], curves);
        let name = format!("{what}_over_{}{}", side.setting.word(), self.slice.suffix());
        Picture::of(name, self.format, &diagram)
    }

    /// Explains the bands, or the bars in their place.
    fn band_text(&self, shown_as: &str) -> String {
        let Slice { x, y, .. } = self.slice;
        let cases = (0..y.values.len())
            .flat_map(|row| (0..x.values.len()).map(move |column| (column, row)));
        let mut all = cases.map(|(column, row)| self.study.settings(self.slice.case(column, row)));
        // Swept deviations may include zero.
        if let Some(settings) = all.find(scatters) {
            return format!(
                "{shown_as}: 95 % of the tools with {}",
                scatter_text(&settings)
            );
        }
        let settings = self.study.settings(self.slice.case(0, 0));
        let tool = &settings.tool;
        if tool.filament_count_uncertainty == 0.0 {
            return "no band: the number of filaments is exact".to_owned();
        }
        let [count, spread] = [tool.filament_count, tool.filament_count_uncertainty].map(short);
        format!("{shown_as}: N_f = {count} ± {spread} (standard deviation)")
    }

    /// Returns curves with their uncertainties for some values of a side.
    fn banded(
        &self,
        &Sides { family, over, of }: &Sides<'_>,
        levels: &[f64],
        prefix: &str,
    ) -> Banded {
        let force = |at: f64, level: f64| {
            let [x, y] = if family == Family::OverX {
                [at, level]
            } else {
                [level, at]
            };
            tool_force(self.study, self.results, self.slice, x, y).ok()
        };
        let simulated: Vec<Vec<Option<SimulatedForce>>> = levels
            .iter()
            .map(|&level| over.values.iter().map(|&at| force(at, level)).collect())
            .collect();
        let bands: Vec<Vec<Option<[f64; 2]>>> = simulated
            .iter()
            .map(|along| {
                along
                    .iter()
                    .map(|simulated| simulated.and_then(|simulated| self.band(simulated)))
                    .collect()
            })
            .collect();
        // Nothing lies between tools.
        let is_named = over.setting.names().is_some();
        // Next to measured points, bars are theirs alone.
        let are_apart = !is_named && (!prefix.is_empty() || !overlap(&bands));
        let shift = |index: usize| BESIDE * (2 * index as i32 + 1 - levels.len() as i32) / 2;
        let places = over.shown();
        let mut curves = Vec::new();
        for (index, (along, bands)) in simulated.iter().zip(&bands).enumerate() {
            let banded: Vec<(f64, Option<[f64; 2]>)> =
                places.iter().copied().zip(bands.iter().copied()).collect();
            if are_apart {
                curves.extend(areas(&banded).map(|area| area.with_pen(index)));
            } else {
                curves.push(bars(&banded).with_pen(index).shifted(shift(index)));
            }
            let line = places.iter().zip(along);
            let line = line.map(|(&at, simulated)| {
                (
                    at,
                    simulated.map_or(f64::NAN, |simulated| simulated.force_n),
                )
            });
            let name = format!("{prefix}{}", of.setting.legend(levels[index]));
            let curve = if is_named {
                Curve::new(name, Look::Markers, line).shifted(shift(index))
            } else {
                Curve::new(name, Look::Line, line)
            };
            curves.push(curve.with_pen(index));
        }
        let shown_as = if are_apart {
            "band"
        } else {
            "error bars, offset for clarity"
        };
        Banded {
            curves,
            shown_as,
            has_gaps: simulated.iter().flatten().any(Option::is_none),
        }
    }

    /// Returns the band of a force: from the sampled tools where filaments scatter, otherwise from
    /// the number of filaments.
    fn band(&self, simulated: SimulatedForce) -> Option<[f64; 2]> {
        let SimulatedForce {
            force_n,
            uncertainty_n,
            band_n,
        } = simulated;
        if self.study.scatters() {
            band_n
        } else {
            Some([force_n - uncertainty_n, force_n + uncertainty_n])
        }
    }
}

/// Returns `true` if the bands of two curves overlap at some place.
fn overlap(curves: &[Vec<Option<[f64; 2]>>]) -> bool {
    let meet = |[lower, upper]: [f64; 2], [other_lower, other_upper]: [f64; 2]| {
        upper > lower && other_upper > other_lower && lower < other_upper && other_lower < upper
    };
    curves.iter().enumerate().any(|(index, bands)| {
        let places = curves[..index]
            .iter()
            .flat_map(|other| other.iter().zip(bands));
        places
            .into_iter()
            .any(|pair| matches!(pair, (Some(band), Some(other)) if meet(*band, *other)))
    })
}

/// Returns bands as areas between gaps.
fn areas(banded: &[(f64, Option<[f64; 2]>)]) -> impl Iterator<Item = Curve> {
    banded.split(|(_, band)| band.is_none()).map(|part| {
        // The upper edge forwards, then the lower edge backwards.
        let edge = |end: usize| {
            part.iter()
                .filter_map(move |&(at, band)| Some((at, band?[end])))
        };
        Curve::new("", Look::Band, edge(1).chain(edge(0).rev()))
    })
}

/// Returns bands as bars, at some of the places if there are many.
fn bars(banded: &[(f64, Option<[f64; 2]>)]) -> Curve {
    let places = spread(banded.len(), MAX_BARS)
        .into_iter()
        .filter_map(|index| Some((banded[index].0, banded[index].1?)));
    Curve::new(
        "",
        Look::Bars,
        places.flat_map(|(at, band)| band.map(|end| (at, end))),
    )
}

/// A marker with its error bar.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Marked {
    /// Place on the horizontal axis.
    at: f64,
    /// Place on the vertical axis, in N.
    force_n: f64,
    /// Ends of the bar, in N.
    bar: [f64; 2],
}

/// Returns the markers of a curve, and `true` if each stands for several points. More than
/// [`MAX_MARKS`] points would cover each other. Then each interval of the axis has one marker, at
/// the mean of its points, with a bar around their bars.
fn marks(mut points: Vec<Marked>) -> (Vec<Marked>, bool) {
    if points.len() <= MAX_MARKS {
        return (points, false);
    }
    points.sort_by(|a, b| a.at.total_cmp(&b.at));
    let (least, largest) = (points[0].at, points[points.len() - 1].at);
    // The last point, and all if they lie at one place, belong to the last interval.
    let interval = |point: &Marked| {
        let part = (point.at - least) / (largest - least);
        ((part * MAX_MARKS as f64) as usize).min(MAX_MARKS - 1)
    };
    let together = points.chunk_by(|a, b| interval(a) == interval(b));
    let marks = together.map(|points| {
        let mean =
            |value: fn(&Marked) -> f64| points.iter().map(value).sum::<f64>() / points.len() as f64;
        Marked {
            at: mean(|point| point.at),
            force_n: mean(|point| point.force_n),
            bar: ends(points.iter().flat_map(|point| point.bar)),
        }
    });
    (marks.collect(), true)
}

/// Explains gaps, if there are any.
fn gaps(has_gaps: bool) -> String {
    if has_gaps {
        "gaps: simulations failed".to_owned()
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_points_are_drawn_as_means_of_intervals() {
        let point = |index: usize| {
            let force_n = if index.is_multiple_of(2) { 1.0 } else { 3.0 };
            Marked {
                at: index as f64,
                force_n,
                bar: [force_n - 0.5, force_n + 0.5],
            }
        };
        let few: Vec<Marked> = (0..MAX_MARKS).map(point).collect();
        assert_eq!(marks(few.clone()), (few, false));
        // In any order, four to an interval.
        let (means, are_means) = marks((0..=4 * MAX_MARKS).rev().map(point).collect());
        assert_eq!((means.len(), are_means), (MAX_MARKS, true));
        for mark in &means {
            assert!(
                mark.bar == [0.5, 3.5] && (mark.force_n - 2.0).abs() <= 0.4,
                "{mark:?}"
            );
        }
        assert!(means.is_sorted_by(|a, b| b.at - a.at > 3.0));
        // At one place, as repeated measurements that differ by rounding are.
        assert_eq!(marks(vec![point(1); 2 * MAX_MARKS]).0, [point(1)]);
    }

    #[test]
    fn bands_that_overlap_are_told_from_others() {
        let curve = |ends: [[f64; 2]; 2]| ends.map(Some).to_vec();
        let first = || curve([[1.0, 2.0], [3.0, 4.0]]);
        assert!(!overlap(&[first(), curve([[2.0, 3.0], [4.5, 5.0]])]));
        assert!(overlap(&[
            first(),
            curve([[5.0, 6.0], [7.0, 8.0]]),
            curve([[2.5, 3.0], [3.9, 5.0]])
        ]));
        // Curves that cross have no bands if nothing is uncertain, and failed cases have none.
        assert!(!overlap(&[first(), curve([[1.5, 1.5], [3.5, 3.5]])]));
        assert!(!overlap(&[first(), vec![None, None]]) && !overlap(&[first()]) && !overlap(&[]));
    }

    #[test]
    fn bars_and_areas_leave_gaps() {
        let banded = [
            (1.0, Some([0.0, 1.0])),
            (2.0, None),
            (3.0, Some([2.0, 3.0])),
            (4.0, Some([3.0, 4.0])),
        ];
        let points: Vec<_> = areas(&banded).map(|area| area.points).collect();
        assert_eq!(
            points,
            [
                vec![(1.0, 1.0), (1.0, 0.0)],
                vec![(3.0, 3.0), (4.0, 4.0), (4.0, 3.0), (3.0, 2.0)]
            ]
        );
        assert_eq!(
            bars(&banded).points,
            [
                (1.0, 0.0),
                (1.0, 1.0),
                (3.0, 2.0),
                (3.0, 3.0),
                (4.0, 3.0),
                (4.0, 4.0)
            ]
        );
        let many: Vec<_> = (0..1000)
            .map(|at| (f64::from(at), Some([0.0, 1.0])))
            .collect();
        assert_eq!(bars(&many).points.len(), 2 * MAX_BARS);
    }
}
