//! The depth at which a tool presses with a given force (MODEL, "Force instead of depth").
//!
//! It is the smallest one, which a tool that is pressed on finds, coming from no contact. At first
//! the force is nearly that of rigid filaments, because they have no time to bend: the search
//! begins there. From there on forces rise and fall, by as many strikes as there is time for,
//! before they rise for good: a brush of 10 m/s presses with 166 N at 69 µm, 110 N at 0.4 mm, and
//! 163 N at 0.9 mm. The search therefore goes up in steps, the smaller the nearer the force is, and
//! looks at maxima between them, until the force is reached. It then encloses the depth by the
//! secant of the logarithms.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::fmt;

use crate::model::settings::{Settings, WorkpieceKind};
use crate::model::trim::{reach_of, reaches};
use crate::tool::{Place, Pose, Trim, places};
use crate::workpiece::unit_normal;

/// The largest relative difference of the force that is found.
const TOLERANCE: f64 = 1e-3;
/// The largest depth as a part of the free length.
const LARGEST: f64 = 0.5;
/// The largest ratio of two depths that follow each other, where the force is at least this share
/// of the one that is asked for.
const FACTORS: [(f64, f64); 4] = [(0.8, 1.6), (0.6, 2.0), (0.3, 3.0), (0.0, 5.0)];
/// The relative width at which a force that jumps is enclosed.
const WIDTH: f64 = 1e-6;
/// The relative difference of the depths by which the stiffness is measured.
const OFFSET: f64 = 0.01;
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
    /// The exponent of the force of rigid filaments.
    exponent: f64,
    /// In ascending order of their depths.
    points: Vec<Point>,
    stage: Stage,
    /// The depth to simulate next, in m.
    next: f64,
    /// Whether the stiffness is measured by simulations of its own.
    looks_aside: bool,
    /// The last end of the bracket that stayed, and how often.
    stayed: (bool, u32),
    found: Option<(Point, R)>,
}

impl<R> DepthSearch<R> {
    /// The search that `settings` ask for, if they state a force. It begins at `first` (m), if
    /// there is a guess, and then measures the stiffness by the depths that it looks at anyway.
    #[must_use]
    pub fn of(settings: &Settings, first: Option<f64>) -> Option<Self> {
        let target = settings.process.tool_force_n?;
        let length = settings.filament.length_m;
        let deepest = (LARGEST * length).min(settings.clearance_m() * (1.0 - 1e-9));
        let exponent = settings.contact.exponent + 0.5;
        let next = first
            .unwrap_or_else(|| rigid_depth(settings, target))
            .min(deepest);
        let origin = Point {
            depth: 0.0,
            force: 0.0,
        };
        Some(Self {
            target,
            deepest,
            exponent,
            looks_aside: first.is_none(),
            points: vec![origin],
            stage: Stage::Scan,
            next,
            stayed: (false, 0),
            found: None,
        })
    }

    /// The depth to simulate next, in m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.next
    }

    /// Takes the `result` of the simulation at [`DepthSearch::depth`], whose tool force is `force`
    /// (N). Returns what was found at the end.
    ///
    /// # Errors
    /// If no depth reaches the force.
    pub fn take(&mut self, force: f64, result: R) -> Result<Option<Found<R>>, Unreachable> {
        let here = Point {
            depth: self.next,
            force,
        };
        let place = self
            .points
            .partition_point(|point| point.depth < here.depth);
        if self.points.get(place) != Some(&here) {
            self.points.insert(place, here);
        }
        if let Stage::Sides(left) = self.stage {
            self.stage = Stage::Sides(left - 1);
        } else if (force / self.target - 1.0).abs() <= TOLERANCE
            || (self.is_narrow() && force >= self.target)
        {
            self.found = Some((here, result));
            self.stage = Stage::Sides(if self.looks_aside { 2 } else { 0 });
        }
        if let (Stage::Sides(left), Some((point, _))) = (self.stage, &self.found) {
            if left > 0 {
                let sign = if left == 2 { 1.0 } else { -1.0 };
                self.next = (point.depth * (1.0 + sign * OFFSET)).min(self.deepest);
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

    /// The points between which the force is first reached.
    fn bracket(&self) -> Option<[Point; 2]> {
        let high = self
            .points
            .iter()
            .position(|point| point.force >= self.target)?;
        Some([self.points[high - 1], self.points[high]])
    }

    /// Whether the force jumps past the one that is asked for.
    fn is_narrow(&self) -> bool {
        self.bracket()
            .is_some_and(|[low, high]| high.depth - low.depth <= WIDTH * high.depth)
    }

    /// Decides on the depth after that of the point at `place`.
    fn advance(&mut self, place: usize) -> Result<(), Unreachable> {
        if let Some([low, high]) = self.bracket() {
            // Below a jump the force is not reached: once more above it.
            self.next = if self.is_narrow() {
                high.depth
            } else {
                self.between(low, high, self.points[place])
            };
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
        let (_, limit) = FACTORS
            .into_iter()
            .find(|(least, _)| share >= *least)
            .unwrap_or(FACTORS[3]);
        let mut factor = limit;
        if share > 0.0 {
            let exponent = if before.depth > 0.0 {
                power(before, last).unwrap_or(0.2).max(0.2)
            } else {
                1.0
            };
            // A little beyond, so that the depth is enclosed.
            factor = (1.02 * share.powf(-1.0 / exponent)).clamp(1.05, limit);
        }
        self.next = (factor * last.depth).min(self.deepest);
        Ok(())
    }

    /// A depth between the ends of the bracket.
    fn between(&mut self, low: Point, high: Point, last: Point) -> f64 {
        let is_high = last.depth == high.depth;
        self.stayed = if self.stayed.0 == is_high {
            (is_high, self.stayed.1 + 1)
        } else {
            (is_high, 1)
        };
        if low.force <= 0.0 {
            // Bent filaments touch somewhere in between, and may hop: their force then begins with
            // a jump.
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
        // Twice the rise above the points: forces are no parabolas.
        (force + (force - b.force) >= self.target && (vertex - y).abs() > 1e-3)
            .then(|| vertex.exp())
    }

    /// The derivative at `point` in N/m, by the parabola through its neighbours.
    fn stiffness(&self, point: Point) -> f64 {
        let place = self
            .points
            .iter()
            .position(|other| *other == point)
            .unwrap_or(0);
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

/// Finds the depth at which a tool presses with the force that `settings` state, by the force (N)
/// and the result that `simulate` returns at a depth. `None` if they state none. The search begins
/// at `first` (m), if there is a guess ([`DepthSearch::of`]).
///
/// # Errors
/// If no depth reaches the force, or the first one of `simulate`.
pub fn press_on<R, E: From<Unreachable>>(
    settings: &Settings,
    first: Option<f64>,
    mut simulate: impl FnMut(&Settings) -> Result<(f64, R), E>,
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

/// The depth in m at which rigid filaments would press with `force` (N) on a plane, or all the time
/// where the workpiece may be hollow: a little less than the smallest depth of those that bend.
fn rigid_depth(settings: &Settings, force: f64) -> f64 {
    /// A little less, because filaments that are bent also come deeper.
    const LESS: f64 = 0.98;
    const POINTS: usize = 64;
    let normal @ [x, y, _] = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let hollow = matches!(
        settings.workpiece.kind,
        WorkpieceKind::Bore(_) | WorkpieceKind::Profile(_)
    );
    let (trim, [reach, _]) = (Trim::of(settings), reaches(settings));
    // Along the trim: the weight of a filament, the radius on which its tip turns, and how far it
    // is above the deepest one.
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
    LESS * low.exp()
}

/// The exponent of the power law through two points, if both have a force.
fn power(a: Point, b: Point) -> Option<f64> {
    (a.force > 0.0 && b.force > a.force)
        .then(|| (b.force / a.force).ln() / (b.depth / a.depth).ln())
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
            if let Some(Found {
                depth, stiffness, ..
            }) = search.take(force(depth), ())?
            {
                return Ok((depth, stiffness, count));
            }
        }
        panic!("the search ends");
    }

    /// The search has no point below the depth at which no force is reached.
    #[test]
    fn forces_that_are_not_positive_are_refused() {
        for target in [0.0, -1.0, f64::NAN] {
            let mut settings = Settings::paper(10.0, 1e-3);
            settings.set_tool_force_n(target);
            assert!(settings.check().is_err(), "{target}");
        }
    }

    /// That of rigid filaments, as far as they have no time to bend, and what is left of it, with a
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

    /// As of cups whose filaments hop as soon as they touch.
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
                depth >= onset && depth < onset * (1.0 + 2.0 * WIDTH) && count < 32,
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
