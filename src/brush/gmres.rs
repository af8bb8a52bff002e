//! Linear equations of the coupled brush: the filaments' own matrices, and the coupling between
//! them.

use std::iter;
use std::ops::Range;

use super::field::wide;
use super::team;
use crate::equations::{LANES, Lanes, Lanewise, Real};

/// Blocks of coordinates of filaments, in lanes, group by group.
pub type Vector = Vec<[Lanes; 2]>;

/// Blocks of one group.
pub type GroupPart = [[Lanes; 2]];

/// Equations `(M + C) x = b`, with a block-diagonal `M`: a block for each filament.
pub trait Coupled {
    /// Computes `M⁻¹ x` in place, once `prepare` has put the part of each coupled group into `x`,
    /// with that of `y`.
    fn precondition(
        &mut self,
        x: &mut Vector,
        y: &mut Vector,
        prepare: impl Fn(usize, &mut GroupPart, &mut GroupPart) + Sync,
    );

    /// Computes `C x` of the `x` that was preconditioned last. `combine` gets the part of each
    /// coupled group, and one of `sums`.
    fn couple(
        &mut self,
        image: &mut Vector,
        sums: &mut [Vec<f64>],
        combine: impl Fn(usize, &mut GroupPart, &mut Vec<f64>) + Sync,
    );
}

/// Memory of [`solve`].
#[derive(Clone, Debug, Default)]
pub struct Krylov {
    /// Vectors of the basis, and the next one, each to be multiplied by its factor.
    basis: Vec<Vector>,
    factors: Vec<f64>,
    preconditioned: Vec<Vector>,
    /// Sums over groups.
    sums: Vec<Vec<f64>>,
    /// Columns of the Hessenberg matrix, made triangular by rotations as it grows.
    triangle: Vec<Vec<f64>>,
    rotations: Vec<[f64; 2]>,
    /// Right side after the rotations.
    remaining: Vec<f64>,
    /// Projections to be subtracted from the next vector, by vector of the basis.
    projections: Vec<f64>,
}

/// Division of vectors into parts.
#[derive(Clone, Copy, Debug)]
pub struct Division<'a> {
    /// Blocks of a part.
    pub blocks: usize,
    /// `true` for groups that are solved; the parts of the others are left as they are.
    pub coupled: &'a [bool],
    /// First coordinate of a block that is not zero everywhere.
    pub first: usize,
}

impl Division<'_> {
    /// Applies `work` to the parts of the coupled groups, each with an item of `others`.
    fn for_each<T: Send>(
        self,
        vector: &mut Vector,
        others: impl Iterator<Item = T>,
        work: impl Fn(usize, &mut GroupPart, T) + Sync,
    ) {
        let parts = vector
            .chunks_mut(self.blocks)
            .zip(others)
            .enumerate()
            .filter(|(group, _)| self.coupled[*group]);
        team::for_each(parts, |(group, (part, other))| work(group, part, other));
    }

    /// Returns the sum over the coupled groups of their `index`-th sums.
    fn sum(self, sums: &[Vec<f64>], index: usize) -> f64 {
        sums.iter()
            .zip(self.coupled)
            .filter(|(_, coupled)| **coupled)
            .map(|(sums, _)| sums[index])
            .sum()
    }

    /// Returns the place of the part of a group.
    fn part(self, group: usize) -> Range<usize> {
        group * self.blocks..(group + 1) * self.blocks
    }

    /// Adds `factor` times the part of a group of `vector`.
    #[inline(always)]
    fn add_scaled(self, group: usize, part: &mut GroupPart, factor: f64, vector: &Vector) {
        for (block, other) in part.iter_mut().zip(&vector[self.part(group)]) {
            for i in self.first..2 {
                block[i] = block[i] + Lanes::from_f64(factor) * other[i];
            }
        }
    }

    /// Subtracts the projections on the vectors of the basis from the part of a group.
    #[inline(always)]
    fn subtract(
        self,
        group: usize,
        part: &mut GroupPart,
        projections: &[f64],
        factors: &[f64],
        basis: &[Vector],
    ) {
        for ((vector, factor), projection) in basis.iter().zip(factors).zip(projections) {
            self.add_scaled(group, part, -projection * factor, vector);
        }
    }

    #[inline(always)]
    fn dot(self, a: &GroupPart, b: &GroupPart) -> f64 {
        let mut sum = Lanes::ZERO;
        for (a, b) in a.iter().zip(b) {
            for i in self.first..2 {
                sum = sum + a[i] * b[i];
            }
        }
        (0..LANES).map(|lane| sum.lane(lane)).sum()
    }
}

/// Least remaining share of a vector's square for which the difference of squares is exact enough.
const MIN_REST_SHARE: f64 = 1e-2;
/// Largest number of vectors of the Krylov space.
const MAX_VECTORS: usize = 60;

/// Solves for `right_side`, in place, until the residual is less than `tolerance` of it, by the
/// generalised minimal residual method of Saad and Schultz (1986), preconditioned on the right by
/// `M`. Returns the number of vectors; `None` without convergence.
///
/// As `(M + C) M⁻¹ y = y + C M⁻¹ y`, a vector costs one solution with `M` and one product with `C`.
/// Vectors are made orthogonal by the classical method of Gram and Schmidt, which passes over them
/// once and is exact enough for few. The norm of a remainder follows from Pythagoras' theorem;
/// projections are subtracted when it is needed. Sums go over groups in order, whatever the number
/// of threads.
pub fn solve(
    system: &mut impl Coupled,
    right_side: &mut Vector,
    tolerance: f64,
    krylov: &mut Krylov,
    division: Division<'_>,
) -> Option<usize> {
    krylov.begin(right_side, division);
    let size = norm(
        &mut krylov.basis[0],
        &mut krylov.sums,
        division,
        |group, part| {
            part.copy_from_slice(&right_side[division.part(group)]);
        },
    );
    if size == 0.0 {
        return Some(0);
    }
    if !size.is_finite() {
        return None;
    }
    krylov.remaining.push(size);
    let mut rest = size;
    for step in 0..MAX_VECTORS {
        krylov.reserve(step);
        let Krylov {
            basis,
            factors,
            preconditioned,
            sums,
            triangle,
            rotations,
            remaining,
            projections,
        } = krylov;
        let factor = 1.0 / rest;
        let (earlier, newest) = basis.split_at_mut(step);
        system.precondition(
            &mut preconditioned[step],
            &mut newest[0],
            |group, part, newest| {
                wide(
                    #[inline(always)]
                    || {
                        division.subtract(group, newest, projections, factors, earlier);
                        for (value, newest) in part.iter_mut().zip(newest) {
                            *value = [
                                newest[0] * Lanes::from_f64(factor),
                                newest[1] * Lanes::from_f64(factor),
                            ];
                        }
                    },
                );
            },
        );
        factors.push(factor);
        let (basis, image) = basis.split_at_mut(step + 1);
        let image = &mut image[0];
        system.couple(image, sums, |group, part, sums| {
            wide(
                #[inline(always)]
                || {
                    division.add_scaled(group, part, factor, &basis[step]);
                    sums.clear();
                    let vectors = basis.iter().zip(&*factors);
                    sums.extend(vectors.map(|(vector, factor)| {
                        factor * division.dot(&vector[division.part(group)], part)
                    }));
                    sums.push(division.dot(part, part));
                },
            );
        });
        projections.clear();
        projections.extend((0..=step).map(|index| division.sum(sums, index)));
        let square = division.sum(sums, step + 1);
        let left = square
            - projections
                .iter()
                .map(|projection| projection * projection)
                .sum::<f64>();
        let column = &mut triangle[step];
        column.clone_from(projections);
        rest = if left > MIN_REST_SHARE * square {
            left.sqrt()
        } else {
            let rest = norm(image, sums, division, |group, part| {
                wide(
                    #[inline(always)]
                    || division.subtract(group, part, projections, factors, basis),
                );
            });
            projections.clear();
            rest
        };
        for (k, [cos, sin]) in rotations.iter().enumerate() {
            let (upper, lower) = (column[k], column[k + 1]);
            column[k] = cos * upper + sin * lower;
            column[k + 1] = cos * lower - sin * upper;
        }
        let length = column[step].hypot(rest);
        if length == 0.0 || !length.is_finite() {
            return None;
        }
        let rotation = [column[step] / length, rest / length];
        column[step] = length;
        remaining.push(-rotation[1] * remaining[step]);
        remaining[step] *= rotation[0];
        rotations.push(rotation);
        let left = remaining[step + 1].abs();
        if left <= tolerance * size {
            remaining.pop();
            combine(triangle, remaining, preconditioned, right_side, division);
            return Some(step + 1);
        }
        if rest == 0.0 {
            return None;
        }
    }
    None
}

/// Solves the triangle by substitution, in place, and sums the preconditioned vectors.
fn combine(
    triangle: &[Vec<f64>],
    weights: &mut [f64],
    vectors: &[Vector],
    solution: &mut Vector,
    division: Division<'_>,
) {
    for row in (0..weights.len()).rev() {
        let known: f64 = (row + 1..weights.len())
            .map(|column| triangle[column][row] * weights[column])
            .sum();
        weights[row] = (weights[row] - known) / triangle[row][row];
    }
    division.for_each(solution, iter::repeat(()), |group, part, ()| {
        wide(
            #[inline(always)]
            || {
                part.fill([Lanes::ZERO; 2]);
                for (weight, vector) in weights.iter().zip(vectors) {
                    division.add_scaled(group, part, *weight, vector);
                }
            },
        );
    });
}

impl Krylov {
    /// Forgets the last solution. Vectors have the length of `right_side`.
    fn begin(&mut self, right_side: &Vector, division: Division<'_>) {
        self.sums.resize_with(division.coupled.len(), Vec::new);
        self.factors.clear();
        self.rotations.clear();
        self.remaining.clear();
        self.projections.clear();
        if self.basis.is_empty() {
            self.basis.push(right_side.clone());
        }
    }

    /// Allocates memory for step `step`.
    fn reserve(&mut self, step: usize) {
        if self.basis.len() < step + 2 {
            let vector = self.basis[0].clone();
            self.basis.push(vector.clone());
            self.preconditioned.push(vector);
            self.triangle.push(Vec::new());
        }
    }
}

/// Returns the norm of a vector, after `change` of each group's part.
fn norm(
    vector: &mut Vector,
    sums: &mut [Vec<f64>],
    division: Division<'_>,
    change: impl Fn(usize, &mut GroupPart) + Sync,
) -> f64 {
    division.for_each(vector, sums.iter_mut(), |group, part, sums| {
        change(group, part);
        sums.clear();
        sums.push(wide(
            #[inline(always)]
            || division.dot(part, part),
        ));
    });
    division.sum(sums, 0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Diagonal matrix with a smaller dense coupling.
    struct Dense {
        diagonal: Vec<f64>,
        coupling: Vec<Vec<f64>>,
        solved: Vec<f64>,
    }

    const BLOCKS: usize = 2;

    fn flat(vector: &Vector) -> Vec<f64> {
        vector
            .iter()
            .flat_map(|block| block.map(|value| (0..LANES).map(move |lane| value.lane(lane))))
            .flatten()
            .collect()
    }

    fn folded(values: &[f64]) -> Vector {
        let lanes = |values: &[f64]| Lanes::from_lanes(|lane| values[lane]);
        values
            .chunks(2 * LANES)
            .map(|block| [lanes(&block[..LANES]), lanes(&block[LANES..])])
            .collect()
    }

    impl Coupled for Dense {
        fn precondition(
            &mut self,
            x: &mut Vector,
            y: &mut Vector,
            prepare: impl Fn(usize, &mut GroupPart, &mut GroupPart) + Sync,
        ) {
            let parts = x.chunks_mut(BLOCKS).zip(y.chunks_mut(BLOCKS)).enumerate();
            parts.for_each(|(group, (x, y))| prepare(group, x, y));
            self.solved = flat(x)
                .iter()
                .zip(&self.diagonal)
                .map(|(x, diagonal)| x / diagonal)
                .collect();
            *x = folded(&self.solved);
        }

        fn couple(
            &mut self,
            image: &mut Vector,
            sums: &mut [Vec<f64>],
            combine: impl Fn(usize, &mut GroupPart, &mut Vec<f64>) + Sync,
        ) {
            let product = |row: &Vec<f64>| row.iter().zip(&self.solved).map(|(a, b)| a * b).sum();
            *image = folded(&self.coupling.iter().map(product).collect::<Vec<f64>>());
            let parts = image.chunks_mut(BLOCKS).zip(sums).enumerate();
            parts.for_each(|(group, (part, sums))| combine(group, part, sums));
        }
    }

    #[test]
    fn a_system_without_symmetry_is_solved() {
        let size = 4 * LANES;
        let entry = |row: usize, column: usize| ((7 * row + 13 * column) % 11) as f64 / 11.0 - 0.4;
        let coupling: Vec<Vec<f64>> = (0..size)
            .map(|i| (0..size).map(|j| 0.1 * entry(i, j)).collect())
            .collect();
        let diagonal: Vec<f64> = (0..size).map(|i| 1.0 + i as f64).collect();
        let expected: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
        let right_side: Vec<f64> = (0..size)
            .map(|i| {
                diagonal[i] * expected[i]
                    + (0..size).map(|j| coupling[i][j] * expected[j]).sum::<f64>()
            })
            .collect();
        let coupled = vec![true; right_side.len() / (2 * LANES * BLOCKS)];
        let division = Division {
            blocks: BLOCKS,
            coupled: &coupled,
            first: 0,
        };
        let mut solution = folded(&right_side);
        let mut system = Dense {
            diagonal,
            coupling,
            solved: Vec::new(),
        };
        let vectors = solve(
            &mut system,
            &mut solution,
            1e-12,
            &mut Krylov::default(),
            division,
        )
        .expect("it converges");
        assert!(vectors > 3 && vectors <= size, "{vectors}");
        for (value, expected) in flat(&solution).iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-10, "{value} for {expected}");
        }
    }
}
