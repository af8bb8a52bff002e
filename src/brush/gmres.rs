//! Linear equations of the coupled brush: the filaments' own matrices, and the coupling between them.

use rayon::prelude::*;

use crate::equations::{LANES, Lanes, Lanewise};

/// Blocks of coordinates of filaments, in lanes, group by group.
pub type Vector = Vec<[Lanes<LANES>; 2]>;

/// `(M + C) x = b`, where `M` is block-diagonal, with a block for each filament.
pub trait Coupled {
    /// `M⁻¹ x`, in place.
    fn precondition(&mut self, x: &mut Vector);

    /// `C x`, where `x` was preconditioned last, for each group: `combine` gets its number and what is `C x` there, in place.
    fn couple(&mut self, image: &mut Vector, combine: impl Fn(usize, &mut [[Lanes<LANES>; 2]]) + Sync);
}

/// Memory of [`solve`].
#[derive(Clone, Debug, Default)]
pub struct Krylov {
    basis: Vec<Vector>,
    preconditioned: Vec<Vector>,
    partial: Vec<Vec<f64>>,
}

/// How vectors are divided: into groups of so many blocks, and into parts of at least so many groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    /// Blocks of a group.
    pub blocks: usize,
    /// The least number of groups that a thread takes.
    pub share: usize,
}

/// The most vectors of the Krylov space.
pub const MAX_VECTORS: usize = 60;

/// Solves for `right_side`, in place, until the residual is less than `tolerance` of it, by the generalised minimal residual method of
/// Saad and Schultz (1986), preconditioned on the right by `M`. Returns the number of vectors, or none if it did not converge.
///
/// `(M + C) M⁻¹ y = y + C M⁻¹ y`, so that a vector costs one solution with `M` and one product with `C`. Sums go over groups in their
/// order, so that they do not depend on the number of threads.
pub fn solve(
    system: &mut impl Coupled,
    right_side: &mut Vector,
    tolerance: f64,
    krylov: &mut Krylov,
    division: Division,
) -> Option<usize> {
    let size = krylov.norm(right_side, division);
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
    let mut next = krylov.vector(0);
    next.clone_from(right_side);
    division.each(&mut next, |_, part| scale(part, 1.0 / size));
    for step in 0..MAX_VECTORS {
        let mut z = std::mem::take(&mut krylov.preconditioned[step]);
        z.clone_from(&next);
        krylov.basis[step] = next;
        system.precondition(&mut z);
        let mut image = krylov.vector(step + 1);
        image.clone_from(&z);
        krylov.preconditioned[step] = z;
        let basis = &krylov.basis[..=step];
        let at = |group: usize| group * division.blocks..(group + 1) * division.blocks;
        system.couple(&mut image, |group, part| add_scaled(part, 1.0, &basis[step][at(group)]));
        let mut column = projections(basis, &image, &mut krylov.partial, division);
        division.each(&mut image, |group, part| {
            for (vector, projection) in basis.iter().zip(&column) {
                add_scaled(part, -projection, &vector[at(group)]);
            }
        });
        let rest = krylov.norm(&image, division);
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
            combine(&triangle, &remaining[..=step], &krylov.preconditioned, right_side, division);
            return Some(step + 1);
        }
        if rest == 0.0 {
            return None;
        }
        next = image;
        division.each(&mut next, |_, part| scale(part, 1.0 / rest));
    }
    None
}

/// Solves the triangle by substitution, and sums the preconditioned vectors.
fn combine(triangle: &[Vec<f64>], right_side: &[f64], vectors: &[Vector], solution: &mut Vector, division: Division) {
    let mut weights = right_side.to_vec();
    for row in (0..weights.len()).rev() {
        let known: f64 = (row + 1..weights.len()).map(|column| triangle[column][row] * weights[column]).sum();
        weights[row] = (weights[row] - known) / triangle[row][row];
    }
    division.each(solution, |group, part| {
        part.fill([splat(0.0); 2]);
        for (weight, vector) in weights.iter().zip(vectors) {
            add_scaled(part, *weight, &vector[group * division.blocks..(group + 1) * division.blocks]);
        }
    });
}

impl Krylov {
    /// The vector at `index`, to be replaced.
    fn vector(&mut self, index: usize) -> Vector {
        if self.basis.len() <= index {
            self.basis.resize_with(index + 1, Vector::new);
            self.preconditioned.resize_with(index + 1, Vector::new);
        }
        std::mem::take(&mut self.basis[index])
    }

    fn norm(&mut self, vector: &Vector, division: Division) -> f64 {
        projections(std::slice::from_ref(vector), vector, &mut self.partial, division)[0].sqrt()
    }
}

/// The products of a vector with each of a basis.
fn projections(basis: &[Vector], vector: &Vector, partial: &mut Vec<Vec<f64>>, division: Division) -> Vec<f64> {
    partial.resize_with(vector.len() / division.blocks, Vec::new);
    let parts = partial.par_iter_mut().zip(vector.par_chunks(division.blocks)).enumerate();
    parts.with_min_len(division.share).for_each(|(group, (sums, part))| {
        sums.clear();
        let at = group * division.blocks..(group + 1) * division.blocks;
        sums.extend(basis.iter().map(|other| dot(&other[at.clone()], part)));
    });
    (0..basis.len()).map(|k| partial.iter().map(|sums| sums[k]).sum()).collect()
}

impl Division {
    /// Calls `change` for each group.
    fn each(self, vector: &mut Vector, change: impl Fn(usize, &mut [[Lanes<LANES>; 2]]) + Sync) {
        let parts = vector.par_chunks_mut(self.blocks).enumerate();
        parts.with_min_len(self.share).for_each(|(group, part)| change(group, part));
    }
}

fn splat(value: f64) -> Lanes<LANES> {
    Lanes::from_lanes(|_| value)
}

fn scale(part: &mut [[Lanes<LANES>; 2]], factor: f64) {
    for block in part {
        *block = block.map(|value| value * splat(factor));
    }
}

fn add_scaled(part: &mut [[Lanes<LANES>; 2]], factor: f64, other: &[[Lanes<LANES>; 2]]) {
    for (block, other) in part.iter_mut().zip(other) {
        for (value, other) in block.iter_mut().zip(other) {
            *value = *value + splat(factor) * *other;
        }
    }
}

fn dot(a: &[[Lanes<LANES>; 2]], b: &[[Lanes<LANES>; 2]]) -> f64 {
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
        fn precondition(&mut self, x: &mut Vector) {
            let solved: Vec<f64> = flat(x).iter().zip(&self.diagonal).map(|(x, diagonal)| x / diagonal).collect();
            *x = folded(&solved);
        }

        fn couple(&mut self, image: &mut Vector, combine: impl Fn(usize, &mut [[Lanes<LANES>; 2]]) + Sync) {
            let x = flat(image);
            let product = |row: &Vec<f64>| row.iter().zip(&x).map(|(a, b)| a * b).sum();
            *image = folded(&self.coupling.iter().map(product).collect::<Vec<f64>>());
            image.chunks_mut(BLOCKS).enumerate().for_each(|(group, part)| combine(group, part));
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
        let division = Division { blocks: BLOCKS, share: 1 };
        let mut solution = folded(&right_side);
        let mut system = Dense { diagonal, coupling };
        let vectors = solve(&mut system, &mut solution, 1e-12, &mut Krylov::default(), division).expect("it converges");
        assert!(vectors > 3 && vectors <= size, "{vectors}");
        for (value, expected) in flat(&solution).iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-10, "{value} for {expected}");
        }
    }
}
