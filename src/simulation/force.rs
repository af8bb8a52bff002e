//! Search for the depth at which a tool presses with a given force (MODEL, "Force instead of
//! depth").
//!
//! A tool that is pressed on reaches the smallest such depth. At small depths the force is nearly
//! that of rigid filaments, which have no time to bend: the search begins there. Deeper, forces
//! rise and fall with the number of strikes that there is time for, before they rise for good: a
//! brush of 10 m/s presses with 166 N at 69 µm, 110 N at 0.4 mm, and 163 N at 0.9 mm. The search
//! therefore goes deeper in steps, which are smaller near the force, and evaluates maxima between
//! them, until the force is reached. It then brackets the depth by the secant of the logarithms.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::fmt;

use crate::model::settings::{Settings, WorkpieceKind};
use crate::model::trim::{reach_of, reaches};
use crate::tool::{Place, Pose, Trim, places};
use crate::workpiece::unit_normal;

/// Largest relative error of the force that is found, unless its standard error is larger.
const FORCE_TOLERANCE: f64 = 1e-3;
/// Largest depth over the free length.
const MAX_DEPTH_SHARE: f64 = 0.5;
/// Largest ratio of successive depths (second) where the force has at least a share of its target
/// (first).
const MAX_DEPTH_RATIOS: [(f64, f64); 4] = [(0.8, 1.6), (0.6, 2.0), (0.3, 3.0), (0.0, 5.0)];
/// Relative width of the bracket at which a force jumps.
const MIN_BRACKET_WIDTH: f64 = 1e-6;
/// Relative difference of the depths that measure the stiffness.
const STIFFNESS_OFFSET: f64 = 0.01;
/// Depth and the force there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DepthPoint {
    /// Depth in m.
    depth: f64,
    /// Force in N.
    force: f64,
}

/// Error of a force that no depth reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// Force in N.
    pub force: f64,
    /// Largest force in N that was found.
    pub largest: f64,
    /// Depth of that force in m.
    pub depth: f64,
    /// Largest depth in m that was tried.
    pub deepest: f64,
}

impl fmt::Display for Unreachable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            force,
            largest,
            depth,
            deepest,
        } = self;
        write!(
            formatter,
            "no depth up to {:.3} mm reaches process.tool_force_n = {force} N: the largest force is {largest:.4} N, at {:.3} mm",
            1e3 * deepest,
            1e3 * depth
        )
    }
}

impl Error for Unreachable {}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Found<R> {
    /// Depth in m.
    pub depth: f64,
    /// `dF_n,w/da_e` there in N/m.
    pub stiffness: f64,
    /// Result of the simulation at this depth.
    pub result: R,
}

/// Next stage of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SearchStage {
    /// Go deeper.
    Scan,
    /// Evaluate a maximum between depths whose forces do not reach the target.
    Peak,
    /// Bracket the depth.
    Enclose,
    /// Evaluate both sides of the depth that was found, this many times more.
    Sides(usize),
}

/// Search for a depth by results of simulations that the caller makes.
#[derive(Clone, Debug)]
pub struct DepthSearch<R> {
    target: f64,
    deepest: f64,
    /// Exponent of the force of rigid filaments.
    exponent: f64,
    /// Points in ascending order of their depths.
    points: Vec<DepthPoint>,
    stage: SearchStage,
    /// Depth to simulate next, in m.
    next: f64,
    /// `true` if the stiffness has simulations of its own.
    looks_aside: bool,
    /// End of the bracket that was replaced last (`true` for the upper one), and how often in
    /// succession.
    stayed: (bool, u32),
    found: Option<(DepthPoint, R)>,
}

impl<R> DepthSearch<R> {
    /// Creates the search for the force in `settings`, if there is one. It begins at the initial
    /// guess `first` (m), if given, and then takes the stiffness from the depths of the search.
    #[must_use]
    pub fn of(settings: &Settings, first: Option<f64>) -> Option<Self> {
        let target = settings.process.tool_force_n?;
        let length = settings.filament.length_m;
        let deepest = (MAX_DEPTH_SHARE * length).min(settings.clearance_m() * (1.0 - 1e-9));
        let exponent = settings.contact.exponent + 0.5;
        let next = first
            .unwrap_or_else(|| rigid_depth(settings, target))
            .min(deepest);
        let origin = DepthPoint {
            depth: 0.0,
            force: 0.0,
        };
        Some(Self {
            target,
            deepest,
            exponent,
            looks_aside: first.is_none(),
            points: vec![origin],
            stage: SearchStage::Scan,
            next,
            stayed: (false, 0),
            found: None,
        })
    }

    /// Returns the depth to simulate next, in m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.next
    }

    /// Takes the `result` of the simulation at [`DepthSearch::depth`], whose tool force is `force`
    /// (N) with a relative standard error. Returns the result of the search at its end.
    ///
    /// # Errors
    /// If no depth reaches the force.
    pub fn take(
        &mut self,
        [force, error]: [f64; 2],
        result: R,
    ) -> Result<Option<Found<R>>, Unreachable> {
        let here = DepthPoint {
            depth: self.next,
            force,
        };
        let place = self
            .points
            .partition_point(|point| point.depth < here.depth);
        if self.points.get(place) != Some(&here) {
            self.points.insert(place, here);
        }
        if let SearchStage::Sides(left) = self.stage {
            self.stage = SearchStage::Sides(left - 1);
        } else if (force / self.target - 1.0).abs() <= FORCE_TOLERANCE.max(error)
            || (self.is_narrow() && force >= self.target)
        {
            self.found = Some((here, result));
            self.stage = SearchStage::Sides(if self.looks_aside { 2 } else { 0 });
        }
        if let (SearchStage::Sides(left), Some((point, _))) = (self.stage, &self.found) {
            if left > 0 {
                let sign = if left == 2 { 1.0 } else { -1.0 };
                self.next = (point.depth * (1.0 + sign * STIFFNESS_OFFSET)).min(self.deepest);
                return Ok(None);
            }
            let stiffness = self.stiffness(*point);
            let found = self.found.take().map(|(point, result)| Found {
                depth: point.depth,
                stiffness,
                result,
            });
            return Ok(found);
        }
        self.advance(place)?;
        Ok(None)
    }

    /// Returns the points between which the force is first reached.
    fn bracket(&self) -> Option<[DepthPoint; 2]> {
        let high = self
            .points
            .iter()
            .position(|point| point.force >= self.target)?;
        Some([self.points[high - 1], self.points[high]])
    }

    /// Returns `true` if the force jumps past its target.
    fn is_narrow(&self) -> bool {
        self.bracket()
            .is_some_and(|[low, high]| high.depth - low.depth <= MIN_BRACKET_WIDTH * high.depth)
    }

    /// Chooses the depth after that of the point at `place`.
    fn advance(&mut self, place: usize) -> Result<(), Unreachable> {
        if let Some([low, high]) = self.bracket() {
            // Below a jump the force is not reached: simulate above it once more.
            self.next = if self.is_narrow() {
                high.depth
            } else {
                self.between(low, high, self.points[place])
            };
            self.stage = SearchStage::Enclose;
            return Ok(());
        }
        if self.stage == SearchStage::Scan
            && let Some(peak) = self.peak()
        {
            (self.stage, self.next) = (SearchStage::Peak, peak);
            return Ok(());
        }
        self.stage = SearchStage::Scan;
        let &[.., before, last] = &self.points[..] else {
            unreachable!("the origin is a point")
        };
        if last.depth >= self.deepest {
            let largest = self
                .points
                .iter()
                .max_by(|a, b| a.force.total_cmp(&b.force))
                .copied()
                .unwrap_or(last);
            return Err(Unreachable {
                force: self.target,
                largest: largest.force,
                depth: largest.depth,
                deepest: self.deepest,
            });
        }
        let share = last.force / self.target;
        let (_, limit) = MAX_DEPTH_RATIOS
            .into_iter()
            .find(|(least, _)| share >= *least)
            .unwrap_or(MAX_DEPTH_RATIOS[3]);
        let mut factor = limit;
        if share > 0.0 {
            let exponent = if before.depth > 0.0 {
                power(before, last).unwrap_or(0.2).max(0.2)
            } else {
                1.0
            };
            // A little beyond, to bracket the depth.
            factor = (1.02 * share.powf(-1.0 / exponent)).clamp(1.05, limit);
        }
        self.next = (factor * last.depth).min(self.deepest);
        Ok(())
    }

    /// Returns a depth between the ends of the bracket.
    fn between(&mut self, low: DepthPoint, high: DepthPoint, last: DepthPoint) -> f64 {
        let is_high = last.depth == high.depth;
        self.stayed = if self.stayed.0 == is_high {
            (is_high, self.stayed.1 + 1)
        } else {
            (is_high, 1)
        };
        if low.force <= 0.0 {
            // Bent filaments first touch in between, and may hop: their force then begins with a
            // jump.
            if low.depth > 0.0 {
                return (low.depth + high.depth) / 2.0;
            }
            // Below the first force nothing is known but a power law.
            let predicted = high.depth * (self.target / high.force).powf(1.0 / self.exponent);
            return predicted.clamp(
                low.depth + 0.1 * (high.depth - low.depth),
                low.depth + 0.9 * (high.depth - low.depth),
            );
        }
        let [mut below, mut above] = [low, high].map(|point| (point.force / self.target).ln());
        // The weight of the end that stays halves each time (Illinois method).
        let weight = 0.5_f64.powi(self.stayed.1 as i32 - 1);
        if is_high {
            below *= weight
        } else {
            above *= weight
        }
        let [start, end] = [low, high].map(|point| point.depth.ln());
        let share = (-below / (above - below)).clamp(0.02, 0.98);
        (start + share * (end - start)).exp()
    }

    /// Returns the depth of a maximum between the last three points, if it may reach the force.
    fn peak(&self) -> Option<f64> {
        let &[.., a, b, c] = &self.points[..] else {
            return None;
        };
        if a.depth <= 0.0 || b.force <= a.force || b.force <= c.force {
            return None;
        }
        let [x, y, z] = [a, b, c].map(|point| point.depth.ln());
        let (left, right) = ((b.force - a.force) / (y - x), (c.force - b.force) / (z - y));
        let bend = (right - left) / (z - x);
        let slope = left + bend * (y - x);
        let vertex = y - slope / (2.0 * bend);
        let force = b.force - slope * slope / (4.0 * bend);
        // The rise above the points counts twice, as forces are no parabolas.
        (force + (force - b.force) >= self.target && (vertex - y).abs() > 1e-3)
            .then(|| vertex.exp())
    }

    /// Returns the derivative at `point` in N/m, by the parabola through its neighbours.
    fn stiffness(&self, point: DepthPoint) -> f64 {
        let place = self
            .points
            .iter()
            .position(|other| *other == point)
            .unwrap_or(0);
        let slope = |a: DepthPoint, b: DepthPoint| (b.force - a.force) / (b.depth - a.depth);
        match (&self.points[..place], &self.points[place + 1..]) {
            ([.., before], [after, ..]) => {
                let (left, right) = (slope(*before, point), slope(point, *after));
                let (here, there) = (point.depth - before.depth, after.depth - point.depth);
                (left * there + right * here) / (here + there)
            }
            ([.., before], []) => slope(*before, point),
            _ => 0.0,
        }
    }
}

/// Finds the depth at which a tool presses with the force that `settings` state; `None` if they
/// state none. `simulate` returns the force (N), its relative standard error, and the result at a depth. The search begins at the
/// initial guess `first` (m), if given ([`DepthSearch::of`]).
///
/// # Errors
/// If no depth reaches the force, or the first one of `simulate`.
pub fn press_on<R, E: From<Unreachable>>(
    settings: &Settings,
    first: Option<f64>,
    mut simulate: impl FnMut(&Settings) -> Result<([f64; 2], R), E>,
) -> Result<Option<Found<R>>, E> {
    let Some(mut search) = DepthSearch::of(settings, first) else {
        return Ok(None);
    };
    loop {
        let (force, result) = simulate(&settings.at_depth(search.depth()))?;
        if let Some(found) = search.take(force, result)? {
            return Ok(Some(found));
        }
    }
}

/// Returns the depth in m at which rigid filaments press with `force` (N) on a plane, or all round
/// if the workpiece may be hollow. It is a little less than the smallest depth of filaments that
/// bend.
fn rigid_depth(settings: &Settings, force: f64) -> f64 {
    /// Factor on the depth, because bent filaments come deeper.
    const DEPTH_FACTOR: f64 = 0.98;
    const POINTS: usize = 64;
    let normal @ [x, y, _] = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let hollow = matches!(
        settings.workpiece.kind,
        WorkpieceKind::Bore(_) | WorkpieceKind::Profile(_)
    );
    let (trim, [reach, _]) = (Trim::of(settings), reaches(settings));
    // Along the trim: weight of a filament, radius of its tip, and height above the deepest tip.
    let filament = |Place { s, weight }: Place| {
        let tip = trim.tip(s);
        [
            weight,
            if hollow { 0.0 } else { tip[0] * x.hypot(y) },
            reach - reach_of(tip, normal),
        ]
    };
    let filaments: Vec<[f64; 3]> = places(settings).into_iter().map(filament).collect();
    let (law, count) = (&settings.contact, settings.tool.filament_count);
    let of_filament = |radius: f64, depth: f64| {
        // Half of the angle for which a tip is below the plane.
        let half = if depth < 2.0 * radius {
            2.0 * (depth / (2.0 * radius)).sqrt().asin()
        } else {
            PI
        };
        let at = |i: usize| {
            let angle = half * (i as f64 + 0.5) / POINTS as f64;
            (depth - 2.0 * radius * (angle / 2.0).sin().powi(2))
                .max(0.0)
                .powf(law.exponent)
        };
        let mean = (0..POINTS).map(at).sum::<f64>() / POINTS as f64;
        count * law.stiffness_n_m * mean * 2.0 * half / TAU
    };
    let rigid = |depth: f64| {
        let forces = filaments
            .iter()
            .map(|[weight, radius, above]| weight * of_filament(*radius, (depth - above).max(0.0)));
        forces.sum::<f64>()
    };
    let (mut low, mut high) = (f64::MIN_POSITIVE.ln(), settings.filament.length_m.ln());
    while high - low > 1e-6 {
        let middle = (low + high) / 2.0;
        if rigid(middle.exp()) < force {
            low = middle
        } else {
            high = middle
        }
    }
    DEPTH_FACTOR * low.exp()
}

/// Returns the exponent of the power law through two points, if both have rising forces.
fn power(a: DepthPoint, b: DepthPoint) -> Option<f64> {
    (a.force > 0.0 && b.force > a.force)
        .then(|| (b.force / a.force).ln() / (b.depth / a.depth).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns depth, stiffness and number of simulations until `force` (N by m) is `target`.
    fn search(target: f64, force: impl Fn(f64) -> f64) -> Result<(f64, f64, usize), Unreachable> {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.set_tool_force_n(target);
        let mut search = DepthSearch::of(&settings, None).expect("there is a force");
        for count in 1..100 {
            let depth = search.depth();
            if let Some(Found {
                depth, stiffness, ..
            }) = search.take([force(depth), 0.0], ())?
            {
                return Ok((depth, stiffness, count));
            }
        }
        panic!("the search ends");
    }

    /// Forces of turns that do not become steady scatter about their mean.
    #[test]
    fn a_force_is_found_to_its_standard_error() {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.set_tool_force_n(100.0);
        let counts = [0.0, 0.05].map(|error| {
            let mut search = DepthSearch::of(&settings, None).expect("there is a force");
            for count in 1..100 {
                let force = 5e4 * search.depth();
                if let Some(found) = search.take([force, error], ()).expect("it is reached") {
                    assert!((5e4 * found.depth / 100.0 - 1.0).abs() <= error.max(FORCE_TOLERANCE));
                    return count;
                }
            }
            panic!("the search ends");
        });
        assert!(counts[1] < counts[0], "{counts:?}");
    }

    /// The bracket of such a force would have no lower end.
    #[test]
    fn forces_that_are_not_positive_are_refused() {
        for target in [0.0, -1.0, f64::NAN] {
            let mut settings = Settings::paper(10.0, 1e-3);
            settings.set_tool_force_n(target);
            assert!(settings.check().is_err(), "{target}");
        }
    }

    /// Returns the force in N at a depth in m: first that of rigid filaments, then less, with a
    /// maximum of 166 N at 69 µm.
    fn of_the_papers_brush(depth: f64) -> f64 {
        let points = [
            (1e-6, 0.74),
            (10.1e-6, 23.8),
            (21.7e-6, 76.4),
            (34.5e-6, 145.5),
            (43.4e-6, 158.8),
            (50.7e-6, 156.4),
            (68.9e-6, 165.6),
            (118e-6, 150.3),
            (202e-6, 131.4),
            (405e-6, 110.2),
            (550e-6, 142.9),
            (694e-6, 158.6),
            (943e-6, 163.7),
            (2e-3, 234.0),
            (20e-3, 900.0),
        ];
        let after = points
            .iter()
            .position(|(d, _)| *d >= depth)
            .unwrap_or(points.len() - 1)
            .max(1);
        let ([d, f], [e, g]) = (
            [points[after - 1].0, points[after - 1].1],
            [points[after].0, points[after].1],
        );
        f * (g / f).powf((depth / d).ln() / (e / d).ln())
    }

    #[test]
    fn forces_are_found_at_the_smallest_depth_in_few_simulations() {
        let (mut total, targets) = (
            0,
            [
                20.0, 50.0, 100.0, 150.0, 157.0, 164.0, 170.0, 200.0, 300.0, 500.0,
            ],
        );
        for target in targets {
            let (depth, stiffness, count) = search(target, of_the_papers_brush).expect("a depth");
            assert!(
                (of_the_papers_brush(depth) / target - 1.0).abs() <= 1e-3,
                "{target}: {depth}"
            );
            assert!(stiffness > 0.0);
            let smaller = (1..1000).map(|i| depth * 0.999 * f64::from(i) / 1000.0);
            let highest = smaller.map(of_the_papers_brush).fold(0.0, f64::max);
            assert!(
                highest < target * 1.001,
                "{target}: {highest} before {depth}"
            );
            total += count - 2;
        }
        assert!(
            total <= 8 * targets.len(),
            "{total} simulations for {} depths, but for their stiffness",
            targets.len()
        );
    }

    /// Cups have such forces: their filaments hop as soon as they touch.
    #[test]
    fn a_force_that_jumps_is_reached() {
        for onset in [2.4e-4, 2.5e-4, 3.1e-4] {
            let force = |depth: f64| {
                if depth < onset {
                    0.0
                } else {
                    720.0 - 1e5 * (depth - onset)
                }
            };
            let (depth, _, count) = search(500.0, force).expect("a depth");
            assert!(
                depth >= onset && depth < onset * (1.0 + 2.0 * MIN_BRACKET_WIDTH) && count < 32,
                "{onset}: {depth}, {count}"
            );
        }
    }

    #[test]
    fn the_stiffness_is_the_derivative() {
        let (depth, stiffness, _) =
            search(80.0, |depth| 165.0 * (depth / 1e-3).sqrt()).expect("a depth");
        assert!(
            (stiffness * 2.0 * depth / 80.0 - 1.0).abs() < 2e-3,
            "{stiffness}"
        );
    }

    #[test]
    fn a_force_that_is_too_large_says_so() {
        let error = search(1000.0, |depth| 165.0 * (depth / 1e-3).sqrt()).expect_err("too large");
        assert!(
            (error.depth - 0.02).abs() < 1e-9
                && (error.largest - 165.0 * 20.0_f64.sqrt()).abs() < 1e-6
        );
        assert!(error.to_string().contains("20.000 mm"), "{error}");
    }
}
