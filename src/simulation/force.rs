//! The depth at which a tool presses with a given force (MODEL, "Force instead of depth").
//!
//! It is the smallest one, which a tool that is pressed on finds, coming from no contact. The search goes up from a small depth in steps of at most a
//! factor of two, which it predicts by the power law of the last two forces, until the force is reached. It then encloses the depth by the
//! secant of the logarithms. Where forces fall again before they reach the force, the maximum between is looked at, too.

use std::error::Error;
use std::fmt;

use crate::model::settings::Settings;

/// The largest relative difference of the force that is found.
const TOLERANCE: f64 = 1e-3;
/// The first depth as a part of the free length, and the largest one.
const FIRST: f64 = 1.0 / 256.0;
const LARGEST: f64 = 0.5;
/// The largest ratio of two depths that follow each other.
const FACTOR: f64 = 2.0;
/// The relative width at which a force that jumps is enclosed.
const WIDTH: f64 = 1e-6;
/// The relative difference of the depths by which the stiffness is measured.
const OFFSET: f64 = 0.01;
/// A force is the sum of a power law of the depth with this exponent as long as there is one force only.
const EXPONENT: f64 = 0.7;

/// A depth, and the force there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    /// In m.
    depth: f64,
    /// In N.
    force: f64,
}

/// A force that no depth reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// The force in N.
    pub force: f64,
    /// The largest force in N that was found.
    pub largest: f64,
    /// Its depth in m.
    pub depth: f64,
    /// The largest depth in m that was looked at.
    pub deepest: f64,
}

impl fmt::Display for Unreachable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { force, largest, depth, deepest } = self;
        write!(
            formatter,
            "no depth up to {:.3} mm reaches process.tool_force_n = {force} N: the largest force is {largest:.4} N, at {:.3} mm",
            1e3 * deepest,
            1e3 * depth
        )
    }
}

impl Error for Unreachable {}

/// What a search has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found<R> {
    /// The depth in m.
    pub depth: f64,
    /// `dF_n,w/da_e` there in N/m.
    pub stiffness: f64,
    /// The result of the simulation at this depth.
    pub result: R,
}

/// The next thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// To go deeper.
    Scan,
    /// To look at a maximum between depths whose forces do not reach it.
    Peak,
    /// To enclose the depth.
    Enclose,
    /// To look at both sides of the depth that was found, this many times more.
    Sides(usize),
}

/// The search for a depth, by results of simulations that the caller makes.
#[derive(Clone, Debug)]
pub struct DepthSearch<R> {
    target: f64,
    deepest: f64,
    /// In ascending order of their depths.
    points: Vec<Point>,
    stage: Stage,
    /// The depth to simulate next, in m.
    next: f64,
    /// The last end of the bracket that stayed, and how often.
    stayed: (bool, u32),
    found: Option<(Point, R)>,
}

impl<R> DepthSearch<R> {
    /// The search that `settings` ask for, if they state a force. It begins at `first` (m), if there is a guess.
    #[must_use]
    pub fn of(settings: &Settings, first: Option<f64>) -> Option<Self> {
        let target = settings.process.tool_force_n?;
        let length = settings.filament.length_m;
        let deepest = (LARGEST * length).min(settings.clearance_m() * (1.0 - 1e-9));
        let next = first.unwrap_or(FIRST * length).min(deepest);
        let origin = Point { depth: 0.0, force: 0.0 };
        Some(Self { target, deepest, points: vec![origin], stage: Stage::Scan, next, stayed: (false, 0), found: None })
    }

    /// The depth to simulate next, in m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.next
    }

    /// Takes the `result` of the simulation at [`DepthSearch::depth`], whose tool force is `force` (N). Returns what was found at the end.
    ///
    /// # Errors
    /// If no depth reaches the force.
    pub fn take(&mut self, force: f64, result: R) -> Result<Option<Found<R>>, Unreachable> {
        let here = Point { depth: self.next, force };
        let place = self.points.partition_point(|point| point.depth < here.depth);
        self.points.insert(place, here);
        if let Stage::Sides(left) = self.stage {
            self.stage = Stage::Sides(left - 1);
        } else if (force / self.target - 1.0).abs() <= TOLERANCE || self.is_narrow() {
            self.found = Some((here, result));
            self.stage = Stage::Sides(2);
        }
        if let (Stage::Sides(left), Some((point, _))) = (self.stage, &self.found) {
            if left > 0 {
                let sign = if left == 2 { 1.0 } else { -1.0 };
                self.next = (point.depth * (1.0 + sign * OFFSET)).min(self.deepest);
                return Ok(None);
            }
            let stiffness = self.stiffness(*point);
            let found = self.found.take().map(|(point, result)| Found { depth: point.depth, stiffness, result });
            return Ok(found);
        }
        self.advance(place)?;
        Ok(None)
    }

    /// The points between which the force is first reached.
    fn bracket(&self) -> Option<[Point; 2]> {
        let high = self.points.iter().position(|point| point.force >= self.target)?;
        Some([self.points[high - 1], self.points[high]])
    }

    /// Whether the force jumps past the one that is asked for.
    fn is_narrow(&self) -> bool {
        self.bracket().is_some_and(|[low, high]| high.depth - low.depth <= WIDTH * high.depth)
    }

    /// Decides on the depth after that of the point at `place`.
    fn advance(&mut self, place: usize) -> Result<(), Unreachable> {
        if let Some([low, high]) = self.bracket() {
            self.next = self.between(low, high, self.points[place]);
            self.stage = Stage::Enclose;
            return Ok(());
        }
        if self.stage == Stage::Scan
            && let Some(peak) = self.peak()
        {
            (self.stage, self.next) = (Stage::Peak, peak);
            return Ok(());
        }
        self.stage = Stage::Scan;
        let &[.., before, last] = &self.points[..] else { unreachable!("the origin is a point") };
        if last.depth >= self.deepest {
            let largest = self.points.iter().max_by(|a, b| a.force.total_cmp(&b.force)).copied().unwrap_or(last);
            return Err(Unreachable {
                force: self.target,
                largest: largest.force,
                depth: largest.depth,
                deepest: self.deepest,
            });
        }
        let mut factor = FACTOR;
        if last.force > 0.0 {
            let exponent = power(before, last).unwrap_or(EXPONENT).max(0.2);
            // A little beyond, so that the depth is enclosed.
            factor = (1.02 * (self.target / last.force).powf(1.0 / exponent)).clamp(1.05, FACTOR);
        }
        self.next = (factor * last.depth).min(self.deepest);
        Ok(())
    }

    /// A depth between the ends of the bracket.
    fn between(&mut self, low: Point, high: Point, last: Point) -> f64 {
        let is_high = last.depth == high.depth;
        self.stayed = if self.stayed.0 == is_high { (is_high, self.stayed.1 + 1) } else { (is_high, 1) };
        if low.force <= 0.0 {
            // Below the first force nothing is known but a power law.
            let predicted = high.depth * (self.target / high.force).powf(1.0 / EXPONENT);
            return predicted
                .clamp(low.depth + 0.1 * (high.depth - low.depth), low.depth + 0.9 * (high.depth - low.depth));
        }
        let [mut below, mut above] = [low, high].map(|point| (point.force / self.target).ln());
        // The end that stays counts for less each time (Illinois).
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

    /// The depth of a maximum between the last three points, if it may reach the force.
    fn peak(&self) -> Option<f64> {
        let &[.., a, b, c] = &self.points[..] else { return None };
        if a.depth <= 0.0 || b.force <= a.force || b.force <= c.force {
            return None;
        }
        let [x, y, z] = [a, b, c].map(|point| point.depth.ln());
        let (left, right) = ((b.force - a.force) / (y - x), (c.force - b.force) / (z - y));
        let bend = (right - left) / (z - x);
        let slope = left + bend * (y - x);
        let vertex = y - slope / (2.0 * bend);
        let force = b.force - slope * slope / (4.0 * bend);
        // Twice the rise above the points: forces are no parabolas.
        (force + (force - b.force) >= self.target && (vertex - y).abs() > 1e-3).then(|| vertex.exp())
    }

    /// The derivative at `point` in N/m, by the parabola through its neighbours.
    fn stiffness(&self, point: Point) -> f64 {
        let place = self.points.iter().position(|other| *other == point).unwrap_or(0);
        let slope = |a: Point, b: Point| (b.force - a.force) / (b.depth - a.depth);
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

/// The exponent of the power law through two points, if both have a force.
fn power(a: Point, b: Point) -> Option<f64> {
    (a.force > 0.0 && b.force > a.force).then(|| (b.force / a.force).ln() / (b.depth / a.depth).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The depth, the stiffness and the number of simulations until `force` (N by m) is `target`.
    fn search(target: f64, force: impl Fn(f64) -> f64) -> Result<(f64, f64, usize), Unreachable> {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.set_tool_force_n(target);
        let mut search = DepthSearch::of(&settings, None).expect("there is a force");
        for count in 1..100 {
            let depth = search.depth();
            if let Some(Found { depth, stiffness, .. }) = search.take(force(depth), ())? {
                return Ok((depth, stiffness, count));
            }
        }
        panic!("the search ends");
    }

    #[test]
    fn forces_are_found_in_few_simulations() {
        let root = |depth: f64| 165.0 * (depth / 1e-3).sqrt();
        let late = |depth: f64| (depth - 0.4e-3).max(0.0) * 2e5;
        let mut total = 0;
        for target in [5.0, 20.0, 80.0, 165.0, 300.0] {
            for (force, slope) in [
                (
                    &root as &dyn Fn(f64) -> f64,
                    &(|depth: f64| 165.0 / 2.0 / (depth * 1e-3).sqrt()) as &dyn Fn(f64) -> f64,
                ),
                (&late, &|_| 2e5),
            ] {
                let (depth, stiffness, count) = search(target, force).expect("a depth");
                assert!((force(depth) / target - 1.0).abs() <= 1e-3, "{target}: {depth}");
                assert!((stiffness / slope(depth) - 1.0).abs() < 2e-3, "{target}: {stiffness}");
                total += count;
            }
        }
        assert!(total <= 85, "{total} simulations for 10 depths");
    }

    #[test]
    fn the_smallest_depth_is_found() {
        // A maximum of 120 N at 0.9 mm, a minimum, and a rise.
        let force = |depth: f64| {
            let x = depth / 1e-3;
            120.0 * x / 0.9 * (1.0 - x / 0.9).exp() + 2.0 * x * x
        };
        let (depth, ..) = search(115.0, force).expect("a depth");
        assert!(depth < 0.9e-3, "{depth}");
        let (depth, ..) = search(140.0, force).expect("a depth");
        assert!(depth > 3e-3 && (force(depth) - 140.0).abs() < 0.2, "{depth}");
    }

    #[test]
    fn a_force_that_is_too_large_says_so() {
        let error = search(1000.0, |depth| 165.0 * (depth / 1e-3).sqrt()).expect_err("too large");
        assert!((error.depth - 0.02).abs() < 1e-9 && (error.largest - 165.0 * 20.0_f64.sqrt()).abs() < 1e-6);
        assert!(error.to_string().contains("20.000 mm"), "{error}");
    }
}
