//! Linear equations of the coupled brush: the filaments' own matrices, and the coupling between them.

use std::ops::Range;

use super::team;
use crate::equations::{LANES, Lanes, Lanewise};

/// Blocks of coordinates of filaments, in lanes, group by group.
pub type Vector = Vec<[Lanes<LANES>; 2]>;

/// Blocks of one group.
pub type Part = [[Lanes<LANES>; 2]];

/// `(M + C) x = b`, where `M` is block-diagonal, with a block for each filament.
pub trait Coupled {
    /// `M⁻¹ x`, in place, once `prepare` has put the part of each group into `x`, with that of `y`.
    fn precondition(&mut self, x: &mut Vector, y: &mut Vector, prepare: impl Fn(usize, &mut Part, &mut Part) + Sync);

    /// `C x` of the `x` that was preconditioned last. `combine` gets the part of each group, and one of `sums`.
    fn couple(
        &mut self,
        image: &mut Vector,
        sums: &mut [Vec<f64>],
        combine: impl Fn(usize, &mut Part, &mut Vec<f64>) + Sync,
    );
}

/// Memory of [`solve`].
#[derive(Clone, Debug, Default)]
pub struct Krylov {
    /// Vectors of the basis, each to be multiplied by its factor.
    basis: Vec<(Vector, f64)>,
    preconditioned: Vec<Vector>,
    /// Sums over groups.
    sums: Vec<Vec<f64>>,
}

/// How vectors are divided into parts.
#[derive(Clone, Copy, Debug)]
pub struct Division<'a> {
    /// Blocks of a part.
    pub blocks: usize,
    /// The group of each part.
    pub groups: &'a [usize],
}

/// Share of the square of a vector below which the difference of squares is too inexact.
const CANCELLED: f64 = 1e-2;
/// The most vectors of the Krylov space.
const MAX_VECTORS: usize = 60;

/// Solves for `right_side`, in place, until the residual is less than `tolerance` of it, by the generalised minimal residual method of
/// Saad and Schultz (1986), preconditioned on the right by `M`. Returns the number of vectors, or none if it did not converge.
///
/// `(M + C) M⁻¹ y = y + C M⁻¹ y`, so that a vector costs one solution with `M` and one product with `C`. Vectors are made orthogonal by
/// the classical method of Gram and Schmidt, which is as good for the few that are needed, and goes over them once: what remains of one is
/// known by Pythagoras' theorem, and is subtracted when it is needed. Sums go over groups in their order, so that they do not depend on
/// the number of threads.
pub fn solve(
    system: &mut impl Coupled,
    right_side: &mut Vector,
    tolerance: f64,
    krylov: &mut Krylov,
    division: Division<'_>,
) -> Option<usize> {
    krylov.sums.resize_with(division.groups.len(), Vec::new);
    let mut next = krylov.vector(0, right_side.len());
    next.clone_from(right_side);
    let size = norm(&mut next, &mut krylov.sums, division, |_, _| ());
    if size == 0.0 {
        return Some(0);
    }
    if !size.is_finite() {
        return None;
    }
    // The Hessenberg matrix, made triangular by rotations as it grows.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<[f64; 2]> = Vec::new();
    let mut remaining = vec![size];
    let mut rest = size;
    // What is still to be subtracted from the next vector, by vector of the basis.
    let mut projections: Vec<f64> = Vec::new();
    let at = |group: usize| group * division.blocks..(group + 1) * division.blocks;
    for step in 0..MAX_VECTORS {
        let mut image = krylov.vector(step + 1, right_side.len());
        let Krylov { basis, preconditioned, sums } = krylov;
        let factor = 1.0 / rest;
        system.precondition(&mut preconditioned[step], &mut next, |group, part, newest| {
            subtract(newest, &projections, basis, at(group));
            for (value, newest) in part.iter_mut().zip(newest) {
                *value = newest.map(|newest| newest * splat(factor));
            }
        });
        basis[step] = (next, factor);
        let basis = &basis[..=step];
        system.couple(&mut image, sums, |group, part, sums| {
            add_scaled(part, factor, &basis[step].0[at(group)]);
            sums.clear();
            sums.extend(basis.iter().map(|(vector, factor)| factor * dot(&vector[at(group)], part)));
            sums.push(dot(part, part));
        });
        let mut column: Vec<f64> = (0..step + 2).map(|k| sums.iter().map(|sums| sums[k]).sum()).collect();
        let square = column.pop().expect("the last sum");
        let left = square - column.iter().map(|projection| projection * projection).sum::<f64>();
        projections.clone_from(&column);
        rest = if left > CANCELLED * square {
            left.sqrt()
        } else {
            let projections = std::mem::take(&mut projections);
            norm(&mut image, sums, division, |group, part| subtract(part, &projections, basis, at(group)))
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
        triangle.push(column);
        let left = remaining[step + 1].abs();
        if left <= tolerance * size {
            combine(&triangle, &remaining[..=step], preconditioned, right_side, division);
            return Some(step + 1);
        }
        if rest == 0.0 {
            return None;
        }
        next = image;
    }
    None
}

/// Solves the triangle by substitution, and sums the preconditioned vectors.
fn combine(
    triangle: &[Vec<f64>],
    right_side: &[f64],
    vectors: &[Vector],
    solution: &mut Vector,
    division: Division<'_>,
) {
    let mut weights = right_side.to_vec();
    for row in (0..weights.len()).rev() {
        let known: f64 = (row + 1..weights.len()).map(|column| triangle[column][row] * weights[column]).sum();
        weights[row] = (weights[row] - known) / triangle[row][row];
    }
    let parts = solution.chunks_mut(division.blocks).enumerate();
    team::for_each(division.groups.iter().copied().zip(parts), |(group, part)| {
        part.fill([splat(0.0); 2]);
        for (weight, vector) in weights.iter().zip(vectors) {
            add_scaled(part, *weight, &vector[group * division.blocks..(group + 1) * division.blocks]);
        }
    });
}

impl Krylov {
    /// The vector at `index`, of `length` blocks to be replaced, and memory for that which is preconditioned.
    fn vector(&mut self, index: usize, length: usize) -> Vector {
        if self.basis.len() <= index {
            self.basis.resize_with(index + 1, Default::default);
            self.preconditioned.resize_with(index + 1, Vector::new);
        }
        self.preconditioned[index].resize(length, [splat(0.0); 2]);
        let (mut vector, _) = std::mem::take(&mut self.basis[index]);
        vector.resize(length, [splat(0.0); 2]);
        vector
    }
}

/// Takes the projections on the vectors of the basis off a part, which is at `blocks` in them.
fn subtract(part: &mut Part, projections: &[f64], basis: &[(Vector, f64)], blocks: Range<usize>) {
    for ((vector, factor), projection) in basis.iter().zip(projections) {
        add_scaled(part, -projection * factor, &vector[blocks.clone()]);
    }
}

/// The size of a vector, after `change` of each group's part.
fn norm(
    vector: &mut Vector,
    sums: &mut [Vec<f64>],
    division: Division<'_>,
    change: impl Fn(usize, &mut Part) + Sync,
) -> f64 {
    let parts = vector.chunks_mut(division.blocks).zip(&mut *sums).enumerate();
    team::for_each(division.groups.iter().copied().zip(parts), |(group, (part, sums))| {
        change(group, part);
        sums.clear();
        sums.push(dot(part, part));
    });
    sums.iter().map(|sums| sums[0]).sum::<f64>().sqrt()
}

fn splat(value: f64) -> Lanes<LANES> {
    Lanes::from_lanes(|_| value)
}

fn add_scaled(part: &mut Part, factor: f64, other: &Part) {
    for (block, other) in part.iter_mut().zip(other) {
        for (value, other) in block.iter_mut().zip(other) {
            *value = *value + splat(factor) * *other;
        }
    }
}

fn dot(a: &Part, b: &Part) -> f64 {
    let mut sum = splat(0.0);
    for (a, b) in a.iter().zip(b) {
        sum = sum + a[0] * b[0] + a[1] * b[1];
    }
    (0..LANES).map(|lane| sum.lane(lane)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal, and a dense coupling of which it is the larger part.
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
        values.chunks(2 * LANES).map(|block| [lanes(&block[..LANES]), lanes(&block[LANES..])]).collect()
    }

    impl Coupled for Dense {
        fn precondition(
            &mut self,
            x: &mut Vector,
            y: &mut Vector,
            prepare: impl Fn(usize, &mut Part, &mut Part) + Sync,
        ) {
            let parts = x.chunks_mut(BLOCKS).zip(y.chunks_mut(BLOCKS)).enumerate();
            parts.for_each(|(group, (x, y))| prepare(group, x, y));
            self.solved = flat(x).iter().zip(&self.diagonal).map(|(x, diagonal)| x / diagonal).collect();
            *x = folded(&self.solved);
        }

        fn couple(
            &mut self,
            image: &mut Vector,
            sums: &mut [Vec<f64>],
            combine: impl Fn(usize, &mut Part, &mut Vec<f64>) + Sync,
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
        let coupling: Vec<Vec<f64>> = (0..size).map(|i| (0..size).map(|j| 0.1 * entry(i, j)).collect()).collect();
        let diagonal: Vec<f64> = (0..size).map(|i| 1.0 + i as f64).collect();
        let expected: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
        let right_side: Vec<f64> = (0..size)
            .map(|i| diagonal[i] * expected[i] + (0..size).map(|j| coupling[i][j] * expected[j]).sum::<f64>())
            .collect();
        let groups: Vec<usize> = (0..right_side.len() / (2 * LANES * BLOCKS)).collect();
        let division = Division { blocks: BLOCKS, groups: &groups };
        let mut solution = folded(&right_side);
        let mut system = Dense { diagonal, coupling, solved: Vec::new() };
        let vectors = solve(&mut system, &mut solution, 1e-12, &mut Krylov::default(), division).expect("it converges");
        assert!(vectors > 3 && vectors <= size, "{vectors}");
        for (value, expected) in flat(&solution).iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-10, "{value} for {expected}");
        }
    }
}
