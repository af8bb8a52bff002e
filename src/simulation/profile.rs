//! Work of a pass along the profile of the workpiece, in its last turn.
//!
//! Within a step, force and place of the contact are evaluated at some instants. Impulse and work
//! between two instants are spread evenly over the arc lengths between both places. The sum over a
//! step is that of the step's integrals, so that the sum over the profile is that of the metrics.

use super::filament::{ContactSum, Filament, Touch};
use super::step::Step;
use super::system::integral;
use crate::contact::Approach;
use crate::equations::linear::{add, dot, scale};
use crate::tool::ClampMotion;
use crate::workpiece::{Cell, Edge, ProfileCells, Workpiece};

/// Smallest and largest number of intervals into which a step is divided.
const INTERVALS: [f64; 2] = [8.0, 64.0];
/// Number of parts of each edge that its evenness compares.
const PARTS_OF_EDGE: usize = 24;

crate::record! {
    /// Cell of the profile of a workpiece, and the work done in it by one filament in one pass.
    #[derive(Clone, Debug, Default, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct ProfileCell {
        arc_length_m: f64 = ["", "m", "arc length along the profile", "of the middle of the cell"],
        x_m: f64 = ["", "m", "position along x", "of that point, as the workpiece lies at time zero"],
        y_m: f64 = ["", "m", "position along y", "of that point, as the workpiece lies at time zero"],
        length_m: f64 = ["", "m", "length of the cell", ""],
        on_edge: bool = ["", "", "on an edge", "1 if the cell belongs to an edge, else 0"],
        normal_impulse_n_s_m: f64 = ["", "N s/m", "contact normal impulse per length", "times `length_m` it adds up to p_n"],
        friction_work_j_m: f64 =
            ["", "J/m", "friction work per length", "times `length_m` it adds up to the friction work"],
        sliding_work_j_m: f64 = ["w_s", "J/m", "sliding work per length", "times `length_m` it adds up to the sliding work"],
    }
}

/// Number of quantities along the profile: normal impulse in N s, friction work in J, sliding work
/// in J.
const KINDS: usize = 3;

impl ProfileCell {
    /// Returns the amounts per length, by kind.
    fn amounts_mut(&mut self) -> [&mut f64; KINDS] {
        [
            &mut self.normal_impulse_n_s_m,
            &mut self.friction_work_j_m,
            &mut self.sliding_work_j_m,
        ]
    }
}

/// Returns the weighted sum of the works of several filaments along the same profile.
pub(super) fn weighted<'a>(
    all: impl Iterator<Item = (f64, &'a [ProfileCell])>,
) -> Vec<ProfileCell> {
    let mut sum: Vec<ProfileCell> = Vec::new();
    for (weight, cells) in all {
        if sum.is_empty() {
            sum = cells.to_vec();
            sum.iter_mut().for_each(|cell| {
                cell.amounts_mut()
                    .into_iter()
                    .for_each(|amount| *amount = 0.0)
            });
        }
        debug_assert_eq!(
            sum.len(),
            cells.len(),
            "filaments of one trim have one profile"
        );
        for (sum, cell) in sum.iter_mut().zip(cells) {
            for (sum, amount) in sum
                .amounts_mut()
                .into_iter()
                .zip(cell.clone().amounts_mut())
            {
                *sum += weight * *amount;
            }
        }
    }
    sum
}

/// Amounts on a stretch of the profile within a part of a step.
#[derive(Clone, Copy, Debug)]
struct StretchShare {
    /// Places at which the stretch begins and ends.
    places: [f64; 2],
    /// Amounts by kind.
    amounts: [f64; KINDS],
}

/// Divides the action of a contact in a step by `place` on the workpiece: calls `each` with two
/// places and the integral over time of the `weigh`ed forces between them. `finest` is the largest
/// way that one part should have.
fn parts_of<M: ClampMotion, W: Workpiece, const N: usize>(
    (step, contact): (&Step<'_>, usize),
    filament: &Filament<M, W>,
    place: impl Fn(&Touch, f64) -> f64,
    weigh: impl Fn(&Touch) -> [f64; N],
    finest: f64,
    mut each: impl FnMut([f64; 2], [f64; N]),
) {
    let at = |s: f64| {
        let touch = step.touch(filament, contact, s);
        (place(&touch, step.time(s)), weigh(&touch))
    };
    let [start, middle, end] = [0.0, 0.5, 1.0].map(at);
    let way = (middle.0 - start.0).abs() + (end.0 - middle.0).abs();
    let [least, most] = INTERVALS;
    let count = (way / finest).ceil().clamp(least, most) as usize;
    let mut last = start;
    for index in 1..=count {
        let next = if index == count {
            end
        } else {
            at(index as f64 / count as f64)
        };
        let duration = step.length() / count as f64;
        let amounts = std::array::from_fn(|k| duration * (last.1[k] + next.1[k]) / 2.0);
        each([last.0, next.0], amounts);
        last = next;
    }
}

/// Returns the sliding work of a step in J, its part on edges, and the moments of that part: see
/// [`integral::SLIDING_WORK`].
///
/// They were integrated with the motion, unless a contact reverses its sliding within the step.
/// There `|v_t|` has a kink, and the interpolant is integrated on both sides of it.
pub(super) fn sliding_in<M: ClampMotion, W: Workpiece>(
    step: &Step<'_>,
    filament: &Filament<M, W>,
) -> [f64; 4] {
    /// Intervals of Simpson's rule on each side.
    const PARTS: usize = 16;
    let sliding = |contact: usize, s: f64| step.touch(filament, contact, s).approach.sliding;
    let turns_back = |contact: usize| dot(sliding(contact, 0.0), sliding(contact, 1.0)) < 0.0;
    if !step.contacts().any(turns_back) {
        return std::array::from_fn(|kind| step.integrated(integral::SLIDING_WORK + kind));
    }
    let mut sum = [0.0; 4];
    for contact in step.contacts() {
        let first = sliding(contact, 0.0);
        let (mut low, mut high) = (0.0, 1.0);
        if turns_back(contact) {
            for _ in 0..f64::MANTISSA_DIGITS {
                let middle = (low + high) / 2.0;
                if dot(first, sliding(contact, middle)) > 0.0 {
                    low = middle
                } else {
                    high = middle
                }
            }
        }
        for [from, to] in [[0.0, high], [high, 1.0]] {
            for i in 0..=PARTS {
                let weight = if i == 0 || i == PARTS {
                    1.0
                } else {
                    2.0 + 2.0 * (i % 2) as f64
                };
                let at = from + (to - from) * i as f64 / PARTS as f64;
                let part = weight * (to - from) * step.length() / (3 * PARTS) as f64;
                let ContactSum {
                    sliding_power,
                    edge_power: [on_edges, first, second],
                    ..
                } = filament.sum(&step.touch(filament, contact, at));
                for (sum, power) in sum.iter_mut().zip([sliding_power, on_edges, first, second]) {
                    *sum += part * power;
                }
            }
        }
    }
    sum
}

/// Distributes an amount that is even between two places over cells between the ascending
/// `boundaries`. Calls `add` with cells and shares, whose sum is one. Parts outside belong to the
/// first or the last cell.
fn spread(boundaries: &[f64], [from, to]: [f64; 2], mut add: impl FnMut(usize, f64)) {
    let (low, high) = (from.min(to), from.max(to));
    let last = boundaries.len() - 2;
    let cell = |place: f64| {
        boundaries
            .partition_point(|boundary| *boundary <= place)
            .saturating_sub(1)
            .min(last)
    };
    let (first, end) = (cell(low), cell(high));
    let mut left = 1.0;
    for index in first..end {
        let share =
            ((boundaries[index + 1] - low.max(boundaries[index])) / (high - low)).clamp(0.0, left);
        add(index, share);
        left -= share;
    }
    add(end, left);
}

/// Work of a pass by the cells of a profile.
#[derive(Clone, Debug)]
pub(super) struct Ledger {
    profile: ProfileCells,
    boundaries: Vec<f64>,
    finest: f64,
    /// Amounts by cell.
    amounts: Vec<[f64; KINDS]>,
    /// Parts of the current step.
    parts: Vec<StretchShare>,
    /// Amounts of earlier steps in which no contact was closed that could have them.
    owed: [f64; KINDS],
    /// Places of the last work.
    last: [f64; 2],
}

impl Ledger {
    /// Creates a ledger without work for a `profile`; `None` if the profile is empty.
    pub fn new(profile: ProfileCells) -> Option<Self> {
        let boundaries = profile.boundaries();
        let length = |cell: &Cell| cell.arc_length[1] - cell.arc_length[0];
        let finest = profile.cells.iter().map(length).reduce(f64::min)?;
        let amounts = vec![[0.0; KINDS]; profile.cells.len()];
        let parts = Vec::with_capacity(INTERVALS[1] as usize);
        let last = [boundaries[0]; 2];
        Some(Self {
            profile,
            boundaries,
            finest,
            amounts,
            parts,
            owed: [0.0; KINDS],
            last,
        })
    }

    /// Enters the work of the next step.
    pub fn observe<M: ClampMotion, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        filament: &Filament<M, W>,
    ) {
        let [impulse, friction] =
            [integral::NORMAL_IMPULSE, integral::FRICTION_WORK].map(|kind| step.integrated(kind));
        let [sliding, ..] = sliding_in(step, filament);
        for (owed, amount) in self.owed.iter_mut().zip([impulse, friction, sliding]) {
            *owed += amount;
        }
        self.parts.clear();
        let place = |touch: &Touch, time: f64| {
            filament
                .workpiece
                .arc_length(touch.position, time)
                .expect("a workpiece with a profile knows the arc length")
        };
        let weigh = |touch: &Touch| {
            let force = filament.law.pressing_force(&touch.approach);
            let Approach { sliding, .. } = touch.approach;
            [
                force.normal,
                -dot(force.tangential, sliding),
                force.normal * dot(sliding, sliding).sqrt(),
            ]
        };
        for contact in step.contacts() {
            let parts = &mut self.parts;
            parts_of(
                (step, contact),
                filament,
                place,
                weigh,
                self.finest,
                |places, amounts| {
                    parts.push(StretchShare { places, amounts });
                },
            );
        }
        let Some(part) = self.parts.last() else {
            return;
        };
        self.last = part.places;
        // A negative amount is a rounding error, which the next step makes up for.
        let due = self.owed.map(|owed| if owed <= 0.0 { 0.0 } else { owed });
        self.owed = self.owed.map(|owed| if owed <= 0.0 { owed } else { 0.0 });
        let sums = self
            .parts
            .iter()
            .fold([0.0; KINDS], |sums, part| add(sums, part.amounts));
        for index in 0..self.parts.len() {
            let StretchShare { places, amounts } = self.parts[index];
            let share = |k: usize| {
                if sums[k] > 0.0 {
                    amounts[k] / sums[k]
                } else {
                    1.0 / self.parts.len() as f64
                }
            };
            self.enter(places, std::array::from_fn(|k| share(k) * due[k]));
        }
    }

    /// Enters amounts that act evenly between two places.
    fn enter(&mut self, [from, to]: [f64; 2], amounts: [f64; KINDS]) {
        let cells = &mut self.amounts;
        let mut enter = |places, part: f64| {
            spread(&self.boundaries, places, |cell, share| {
                for (sum, amount) in cells[cell].iter_mut().zip(amounts) {
                    *sum += share * (part * amount);
                }
            });
        };
        let (first, last) = (
            self.boundaries[0],
            self.boundaries[self.boundaries.len() - 1],
        );
        match self.profile.period {
            // The shorter way round, across the end of the profile.
            Some(period) if (to - from).abs() > period / 2.0 => {
                let (low, high) = (from.min(to), from.max(to));
                let way = period - (high - low);
                let share = if way > 0.0 { (low - first) / way } else { 0.5 };
                enter([first, low], share);
                enter([high, last], 1.0 - share);
            }
            _ => enter([from, to], 1.0),
        }
    }

    /// Forgets all work.
    pub fn clear(&mut self) {
        self.amounts.fill([0.0; KINDS]);
        self.owed = [0.0; KINDS];
    }

    /// Returns the cells with their work.
    pub fn into_cells(mut self) -> Vec<ProfileCell> {
        self.enter(self.last, self.owed);
        let cells = self.profile.cells.iter().zip(&self.amounts);
        cells
            .map(
                |(
                    &Cell {
                        arc_length: [start, end],
                        ends,
                        on_edge,
                    },
                    amounts,
                )| {
                    let length_m = end - start;
                    let [x_m, y_m] = scale(0.5, add(ends[0], ends[1]));
                    let [normal_impulse_n_s_m, friction_work_j_m, sliding_work_j_m] =
                        amounts.map(|amount| amount / length_m);
                    ProfileCell {
                        arc_length_m: (start + end) / 2.0,
                        x_m,
                        y_m,
                        length_m,
                        on_edge,
                        normal_impulse_n_s_m,
                        friction_work_j_m,
                        sliding_work_j_m,
                    }
                },
            )
            .collect()
    }
}

/// Sliding work on edges, for its evenness: `∫ F_n |v_t| dt` by parts of each edge, which is the
/// friction work over `µ`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct EdgeWork {
    /// Work by edge and part.
    parts: Vec<[f64; PARTS_OF_EDGE]>,
}

impl EdgeWork {
    /// Creates a record without work on `edges` edges.
    pub fn new(edges: usize) -> Self {
        Self {
            parts: vec![[0.0; PARTS_OF_EDGE]; edges],
        }
    }

    /// Forgets all work.
    pub fn clear(&mut self) {
        self.parts.fill([0.0; PARTS_OF_EDGE]);
    }

    /// Enters the work of the next step on edges.
    pub fn observe<M: ClampMotion, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        filament: &Filament<M, W>,
    ) {
        let nodes = step.start_nodes.len();
        for (index, edge) in filament.workpiece.edges().iter().enumerate() {
            if !step.closed[nodes + index] {
                continue;
            }
            let place = |touch: &Touch, time: f64| edge.part_before(touch.position, time);
            let weigh =
                |touch: &Touch| {
                    let Approach { sliding, .. } = touch.approach;
                    [filament.law.normal_force(&touch.approach).max(0.0)
                        * dot(sliding, sliding).sqrt()]
                };
            parts_of(
                (step, nodes + index),
                filament,
                place,
                weigh,
                1.0 / PARTS_OF_EDGE as f64,
                |places, [amount]| {
                    self.add(index, places, amount);
                },
            );
        }
    }

    /// Enters work on one edge, between two places on it, from 0 to 1.
    pub fn add(&mut self, edge: usize, places: [f64; 2], work: f64) {
        let boundaries: [f64; PARTS_OF_EDGE + 1] =
            std::array::from_fn(|index| index as f64 / PARTS_OF_EDGE as f64);
        spread(&boundaries, places, |part, share| {
            self.parts[edge][part] += share * work
        });
    }

    /// Returns the number of edges.
    pub fn edges(&self) -> usize {
        self.parts.len()
    }

    /// Returns the mean of the work per length of all edges over its largest value among their
    /// parts; zero without work.
    pub fn evenness(&self, edges: &[Edge]) -> f64 {
        let lengths = edges
            .iter()
            .map(|edge| edge.length() / PARTS_OF_EDGE as f64);
        let (mut work, mut length, mut largest) = (0.0, 0.0, 0.0_f64);
        for (parts, part_length) in self.parts.iter().zip(lengths) {
            work += parts.iter().sum::<f64>();
            length += part_length * PARTS_OF_EDGE as f64;
            largest = parts
                .iter()
                .fold(largest, |largest, part| largest.max(part / part_length));
        }
        if largest > 0.0 {
            work / (length * largest)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(boundaries: &[f64], places: [f64; 2]) -> Vec<f64> {
        let mut shares = vec![0.0; boundaries.len() - 1];
        spread(boundaries, places, |cell, share| shares[cell] += share);
        shares
    }

    #[test]
    fn what_acts_evenly_goes_to_the_cells_by_their_lengths() {
        let boundaries = [0.0, 1.0, 3.0, 4.0];
        assert_eq!(
            shares(&boundaries, [0.5, 3.5]),
            shares(&boundaries, [3.5, 0.5])
        );
        assert_eq!(shares(&boundaries, [0.0, 4.0]), [0.25, 0.5, 0.25]);
        assert_eq!(shares(&boundaries, [1.5, 1.5]), [0.0, 1.0, 0.0]);
        // Outside, and at an end.
        assert_eq!(shares(&boundaries, [-2.0, -1.0]), [1.0, 0.0, 0.0]);
        assert_eq!(shares(&boundaries, [4.0, 4.0]), [0.0, 0.0, 1.0]);
        assert_eq!(shares(&boundaries, [3.0, 5.0]), [0.0, 0.0, 1.0]);
    }
}
