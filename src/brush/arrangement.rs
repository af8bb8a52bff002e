//! Positions of the roots of a brush (docs/MODEL.md, "Filaments that touch").

use std::f64::consts::TAU;

use spec_math::cephes64::ndtri;

use crate::model::settings::{BrushSettings, Ends, Pattern, Settings};

use super::error::BrushError;

/// Returns standard normal numbers for the filament `[column, row]`, whatever the number of
/// filaments.
pub fn random_of(seed: u32, [column, row]: [usize; 2]) -> impl FnMut() -> f64 {
    // Seeds of neighbours differ in a few bits: each drawn number spreads them further.
    let mut random = [column, row].into_iter().fold(
        fastrand::Rng::with_seed(u64::from(seed)),
        |mut random, place| fastrand::Rng::with_seed(random.u64(..).wrapping_add(place as u64)),
    );
    move || ndtri(random.f64().max(f64::MIN_POSITIVE))
}

/// Root of a filament on the cylinder of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// Column; 0 meets the workpiece first.
    pub column: usize,
    /// Row; 0 has the least `z`.
    pub row: usize,
    /// Angle behind an unshifted root of column 0, in rad.
    pub angle: f64,
    /// `z` in m.
    pub z: f64,
}

impl Root {
    /// Returns column and row.
    pub fn place(&self) -> [usize; 2] {
        [self.column, self.row]
    }
}

/// Roots of a sector.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrangement {
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of filaments around, `N_f/rows`.
    pub around: f64,
    /// Roots, column by column.
    pub roots: Vec<Root>,
    /// Period of the rows along `z` in m, if they repeat.
    pub period: Option<f64>,
}

/// Returns `true` if filaments in their planes cannot touch those in others: all rows are regular,
/// and farther apart than `reach` (m).
pub fn has_separate_rows(settings: &Settings, reach: f64) -> bool {
    let (pattern, rows) = (settings.brush_or_default().pattern, settings.brush_rows());
    rows == 1 || (pattern != Pattern::Random && settings.tool.width_m / rows as f64 > reach)
}

/// Angles of the roots from 0 to 2π, ascending, with the numbers of the roots.
struct Ring(Vec<(f64, usize)>);

impl Ring {
    fn new(roots: &[Root]) -> Self {
        let mut order: Vec<_> = roots
            .iter()
            .map(|root| root.angle.rem_euclid(TAU))
            .zip(0..)
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self(order)
    }

    /// Returns the numbers of the roots from the angle `from` on, over the angle `width`, in rad.
    fn within(&self, from: f64, width: f64) -> impl Iterator<Item = usize> {
        let from = from.rem_euclid(TAU);
        let (before, behind) = self.0.split_at(self.place(from));
        let order = behind.iter().chain(before);
        order
            .take_while(move |(angle, _)| (angle - from).rem_euclid(TAU) <= width)
            .map(|(_, index)| *index)
    }

    /// Returns the place of the first root from `angle` (rad) on.
    fn place(&self, angle: f64) -> usize {
        self.0.partition_point(|(other, _)| *other < angle)
    }

    /// Moves the root `index` from one angle to another (rad).
    fn turn(&mut self, index: usize, angles: [f64; 2]) {
        let [from, to] = angles.map(|angle| angle.rem_euclid(TAU));
        let [first, new] = [from, to].map(|angle| self.place(angle));
        let old = first
            + self.0[first..]
                .iter()
                .take_while(|(_, other)| *other != index)
                .count();
        self.0[old].0 = to;
        if old < new {
            self.0[old..new].rotate_left(1);
        } else {
            self.0[new..=old].rotate_right(1);
        }
    }
}

/// Returns the angle in rad beyond which no two roots are closer than `reach` (m).
fn window(radius: f64, reach: f64) -> f64 {
    /// Factor that covers rounding errors.
    const ROUNDING_FACTOR: f64 = 1.0 + 1e-9;
    if reach < 2.0 * radius {
        ROUNDING_FACTOR * 2.0 * (0.5 * reach / radius).asin()
    } else {
        TAU
    }
}

impl Arrangement {
    /// Arranges the roots of a sector of `columns` columns of the brush that `settings` state.
    ///
    /// # Errors
    /// If there are more columns than the brush has, or if two roots are closer than `reach` (m),
    /// the least distance of filaments that do not overlap.
    pub fn new(settings: &Settings, columns: usize, reach: f64) -> Result<Self, BrushError> {
        let BrushSettings {
            pattern,
            ends,
            seed,
            root_std_m,
            ..
        } = settings.brush_or_default();
        let rows = settings.brush_rows();
        let around = settings.tool.filament_count / rows as f64;
        if columns as f64 > around.floor() {
            return Err(BrushError::TooManyColumns {
                columns,
                around: around.floor() as usize,
            });
        }
        let (angle, height) = (TAU / around, settings.tool.width_m / rows as f64);
        let regular = (0..columns).flat_map(|column| {
            (0..rows).map(move |row| {
                let shift = if pattern == Pattern::Aligned || row % 2 == 0 {
                    0.0
                } else {
                    0.5
                };
                let z = if rows == 1 {
                    0.0
                } else {
                    (row as f64 + 0.5 - 0.5 * rows as f64) * height
                };
                Root {
                    column,
                    row,
                    angle: (column as f64 + shift) * angle,
                    z,
                }
            })
        });
        let period = (ends == Ends::Periodic).then_some(settings.tool.width_m);
        let mut arrangement = Self {
            columns,
            rows,
            around,
            roots: regular.collect(),
            period,
        };
        let radius = settings.tool.body_radius_m;
        if pattern == Pattern::Random {
            arrangement.shake(
                radius,
                columns as f64 * angle,
                settings.tool.width_m,
                reach,
                u64::from(seed),
            );
        }
        arrangement.check(radius, reach)?;
        if root_std_m > 0.0 {
            arrangement.scatter(root_std_m, radius, reach, seed);
        }
        Ok(arrangement)
    }

    /// Returns the distance of two roots in m, with `b` moved by `shift` (m) along `z`.
    fn distance(a: &Root, b: &Root, radius: f64, shift: f64) -> f64 {
        let chord = 2.0 * radius * (0.5 * (a.angle - b.angle)).sin();
        chord.hypot(b.z + shift - a.z)
    }

    /// Returns the shifts of the periodic images along `z` in m.
    fn shifts(&self) -> Vec<f64> {
        self.period
            .map_or_else(|| vec![0.0], |period| vec![-period, 0.0, period])
    }

    /// Checks that no two roots are closer than `reach` (m).
    fn check(&self, radius: f64, reach: f64) -> Result<(), BrushError> {
        let (ring, shifts, window) = (Ring::new(&self.roots), self.shifts(), window(radius, reach));
        // A filament also meets its own periodic images.
        if self.period.is_some_and(|period| period < reach) {
            return Err(BrushError::Overlap {
                distance: self.period.unwrap_or_default(),
                reach,
                pair: [[0, 0], [0, 0]],
            });
        }
        for &(angle, index) in &ring.0 {
            let a = &self.roots[index];
            for b in ring
                .within(angle, window)
                .filter(|other| *other != index)
                .map(|other| &self.roots[other])
            {
                let nearest = shifts
                    .iter()
                    .map(|shift| Self::distance(a, b, radius, *shift))
                    .fold(f64::INFINITY, f64::min);
                // A brush whose filaments just touch can be built.
                if nearest < reach * (1.0 - 1e-9) {
                    let pair = [a.place(), b.place()];
                    return Err(BrushError::Overlap {
                        distance: nearest,
                        reach,
                        pair,
                    });
                }
            }
        }
        Ok(())
    }

    /// Shifts each root by normally distributed distances (standard deviation `std`, m), drawn
    /// again while it would be closer than `reach` (m) to another.
    fn scatter(&mut self, std: f64, radius: f64, reach: f64, seed: u32) {
        /// Draws before a root stays where it is.
        const MAX_DRAWS: usize = 100;
        /// Tilts and constants of filaments are drawn from other seeds.
        const ROOT_SEED_MASK: u32 = 0x726f_6f74;
        let (shifts, is_in_plane) = (self.shifts(), self.rows == 1);
        let (mut ring, window) = (Ring::new(&self.roots), window(radius, reach));
        for index in 0..self.roots.len() {
            let root = self.roots[index];
            let mut normal = random_of(seed ^ ROOT_SEED_MASK, root.place());
            let is_free = |new: &Root| {
                let mut others = ring
                    .within(new.angle - window, 2.0 * window)
                    .filter(|other| *other != index);
                let near = |other: &Root| {
                    shifts
                        .iter()
                        .any(|shift| Self::distance(new, other, radius, *shift) < reach)
                };
                others.all(|other| !near(&self.roots[other]))
            };
            let drawn = std::iter::repeat_with(|| {
                let [around, along] = [std * normal(), std * normal()];
                let z = if is_in_plane { root.z } else { root.z + along };
                Root {
                    angle: root.angle + around / radius,
                    z,
                    ..root
                }
            });
            if let Some(new) = drawn.take(MAX_DRAWS).find(is_free) {
                self.roots[index] = new;
                ring.turn(index, [root.angle, new.angle]);
            }
        }
    }

    /// Makes regular roots random by a Markov chain for hard discs (Metropolis et al. 1953), on the
    /// developed cylinder over the angle `sector` (rad) and the `width` (m). The angle is periodic,
    /// the width if the rows are. The steady distribution is uniform over all arrangements in which
    /// no two roots are closer than `reach` (m).
    fn shake(&mut self, radius: f64, sector: f64, width: f64, reach: f64, seed: u64) {
        /// Trials per root. Some ten remove the initial order.
        const SWEEPS: usize = 400;
        let mut random = fastrand::Rng::with_seed(seed);
        let count = self.roots.len();
        // Discs in cells not smaller than the reach meet those of neighbouring cells only. Smaller
        // ones than for four cells a root would take memory in vain.
        let size = reach.max(0.5 * (sector * radius * width / count as f64).sqrt());
        let cells =
            [sector * radius, width].map(|length| (length / size).floor().max(1.0) as usize);
        let cell = |angle: f64, z: f64| {
            let share = [
                (angle / sector).rem_euclid(1.0),
                (z / width + 0.5).rem_euclid(1.0),
            ];
            [0, 1].map(|i| ((share[i] * cells[i] as f64) as usize).min(cells[i] - 1))
        };
        let number = |[i, j]: [usize; 2]| i * cells[1] + j;
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); cells[0] * cells[1]];
        for (index, root) in self.roots.iter().enumerate() {
            members[number(cell(root.angle, root.z))].push(index);
        }
        let (shifts, is_periodic) = (self.shifts(), self.period.is_some());
        let step = 0.5 * (self.roots.len() as f64).recip() * sector * radius * width / reach;
        let step = step.min(reach);
        for _ in 0..SWEEPS * count {
            let index = random.usize(0..count);
            let old = self.roots[index];
            let mut new = old;
            new.angle = (old.angle + step / radius * (random.f64() - 0.5)).rem_euclid(sector);
            new.z = old.z + step * (random.f64() - 0.5);
            if is_periodic {
                new.z = (new.z + 0.5 * width).rem_euclid(width) - 0.5 * width;
            } else if new.z.abs() > 0.5 * width {
                continue;
            }
            let [i, j] = cell(new.angle, new.z);
            let around = |at: usize, count: usize| -> Vec<usize> {
                let mut all = vec![(at + count - 1) % count, at, (at + 1) % count];
                all.sort_unstable();
                all.dedup();
                all
            };
            let is_free = around(i, cells[0]).into_iter().all(|i| {
                around(j, cells[1]).into_iter().all(|j| {
                    members[number([i, j])]
                        .iter()
                        .filter(|&&other| other != index)
                        .all(|&other| {
                            let other = &self.roots[other];
                            // The sector is periodic, so that its density is even up to its ends.
                            [-sector, 0.0, sector].iter().all(|turn| {
                                let other = Root {
                                    angle: other.angle + turn,
                                    ..*other
                                };
                                shifts.iter().all(|shift| {
                                    Self::distance(&new, &other, radius, *shift) >= reach
                                })
                            })
                        })
                })
            });
            if is_free {
                let (from, to) = (number(cell(old.angle, old.z)), number([i, j]));
                if from != to {
                    members[from].retain(|&member| member != index);
                    members[to].push(index);
                }
                self.roots[index] = new;
            }
        }
        // Columns and rows only number the roots: in the order in which they meet the workpiece,
        // and along the axis.
        self.roots.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        for (column, roots) in self.roots.chunks_mut(self.rows).enumerate() {
            roots.sort_by(|a, b| a.z.total_cmp(&b.z));
            for (row, root) in roots.iter_mut().enumerate() {
                (root.column, root.row) = (column, row);
            }
        }
    }

    /// Returns the largest angle of a root in rad.
    pub fn latest(&self) -> f64 {
        self.latest_of(self.columns)
    }

    /// Returns the largest angle of a root of the first `columns` columns in rad.
    pub fn latest_of(&self, columns: usize) -> f64 {
        let roots = self.roots.iter().filter(|root| root.column < columns);
        roots.fold(0.0_f64, |latest, root| latest.max(root.angle))
    }

    /// Returns `true` if the columns close the ring.
    pub fn is_closed(&self) -> bool {
        self.columns == self.around.floor() as usize && self.around.fract() == 0.0
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    /// Columns and rows of the sector. It is so small that rejection sampling of all roots works,
    /// too.
    const COLUMNS: usize = 3;
    const ROWS: usize = 2;
    /// Least distance of two roots in m.
    const REACH: f64 = 1e-3;
    /// Share of the sector that discs of this diameter cover: most of that of a wire brush.
    const COVERED_SHARE: f64 = 0.3;

    /// Returns a brush of the radius 0.14 m with a square sector, and the side of the sector in m.
    fn settings(ends: Ends, seed: u32) -> (Settings, f64) {
        let mut settings = Settings::paper(10.0, 1e-3);
        let side = REACH * ((COLUMNS * ROWS) as f64 * 0.125 * TAU / COVERED_SHARE).sqrt();
        settings.tool.width_m = side;
        settings.tool.filament_count =
            (COLUMNS * ROWS) as f64 * TAU * settings.tool.body_radius_m / side;
        let brush = BrushSettings {
            rows: Some(ROWS),
            pattern: Pattern::Random,
            ends,
            seed,
            ..BrushSettings::default()
        };
        settings.brush = Some(brush);
        (settings, side)
    }

    /// Returns statistics of `places` (m) on the developed sector: mean distance to the nearest
    /// neighbour over the reach, numbers of pairs within three distances, and mean distance from
    /// the middle of the rows over the side.
    fn statistics(places: &[[f64; 2]], side: f64, is_periodic: bool) -> [f64; 5] {
        let distance = |a: &[f64; 2], b: &[f64; 2]| {
            let [x, z] = [a[0] - b[0], a[1] - b[1]];
            let nearest = |d: f64| d - side * (d / side).round();
            nearest(x).hypot(if is_periodic { nearest(z) } else { z }) / REACH
        };
        let mut result = [0.0; 5];
        for (index, a) in places.iter().enumerate() {
            let others = places
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index);
            let distances: Vec<f64> = others.map(|(_, b)| distance(a, b)).collect();
            let share = 1.0 / places.len() as f64;
            result[0] += share * distances.iter().copied().fold(f64::INFINITY, f64::min);
            for (within, limit) in result[1..4].iter_mut().zip([1.1, 1.3, 1.6]) {
                *within += 0.5
                    * distances
                        .iter()
                        .filter(|&&distance| distance < limit)
                        .count() as f64;
            }
            result[4] += share * a[1].abs() / side;
        }
        result
    }

    /// Returns a mean and its squared standard error.
    fn mean(values: &[[f64; 5]], of: usize) -> [f64; 2] {
        let count = values.len() as f64;
        let mean = values.iter().map(|value| value[of]).sum::<f64>() / count;
        let variance = values
            .iter()
            .map(|value| (value[of] - mean).powi(2))
            .sum::<f64>()
            / (count - 1.0);
        [mean, variance / count]
    }

    /// Random roots are uniform over all arrangements without overlap. Rejection sampling has the
    /// same distribution, and needs no chain, no start and no cells.
    #[test]
    fn random_roots_have_the_statistics_of_hard_discs() {
        const CHAINS: u32 = 600;
        const DRAWN: usize = 20_000;
        for ends in [Ends::Periodic, Ends::Free] {
            let is_periodic = ends == Ends::Periodic;
            let shaken: Vec<[f64; 5]> = (0..CHAINS)
                .map(|seed| {
                    let (settings, side) = settings(ends, seed);
                    let roots = Arrangement::new(&settings, COLUMNS, REACH)
                        .expect("there is room")
                        .roots;
                    let radius = settings.tool.body_radius_m;
                    let places: Vec<[f64; 2]> = roots
                        .iter()
                        .map(|root| [root.angle * radius, root.z])
                        .collect();
                    statistics(&places, side, is_periodic)
                })
                .collect();
            let (_, side) = settings(ends, 0);
            let mut random = Rng::with_seed(1);
            let mut drawn = Vec::new();
            while drawn.len() < DRAWN {
                let places: Vec<[f64; 2]> = (0..COLUMNS * ROWS)
                    .map(|_| [random.f64() * side, (random.f64() - 0.5) * side])
                    .collect();
                let nearest = |a: usize, b: usize| {
                    let [x, z] = [0, 1].map(|i| places[a][i] - places[b][i]);
                    let [x, image] = [x, z].map(|d| d - side * (d / side).round());
                    x.hypot(if is_periodic { image } else { z })
                };
                if (0..places.len()).all(|a| (0..a).all(|b| nearest(a, b) >= REACH)) {
                    drawn.push(statistics(&places, side, is_periodic));
                }
            }
            for (of, name) in [
                "nearest neighbour",
                "within 1.1",
                "within 1.3",
                "within 1.6",
                "height",
            ]
            .iter()
            .enumerate()
            {
                let [[own, own_error], [exact, exact_error]] =
                    [mean(&shaken, of), mean(&drawn, of)];
                // Seeds are fixed; of ten means one is farther than 3.5 standard errors off by
                // chance in one of 200 tries.
                let error = (own_error + exact_error).sqrt();
                assert!(
                    (own - exact).abs() < 3.5 * error,
                    "{ends:?}, {name}: {own} and {exact} ± {error}"
                );
                assert!(
                    error < 0.05 * exact,
                    "{ends:?}, {name}: {exact} ± {error} tells nothing"
                );
            }
        }
    }
}
