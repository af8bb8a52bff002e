//! Linear equations of the coupled brush: the filaments' own matrices, and the coupling between them.

use crate::equations::{LANES, Lanes, Lanewise};

/// Blocks of coordinates of all filaments, in lanes.
pub type Vector = Vec<[Lanes<LANES>; 2]>;

/// `(M + C) x = b`, where `M` is block-diagonal, with a block for each filament.
pub trait Coupled {
    /// `M⁻¹ x`, in place.
    fn precondition(&mut self, x: &mut Vector);

    /// `C x`, into `result`.
    fn couple(&mut self, x: &Vector, result: &mut Vector);
}

/// Memory of [`solve`].
#[derive(Clone, Debug, Default)]
pub struct Krylov {
    basis: Vec<Vector>,
    preconditioned: Vec<Vector>,
}

/// The most vectors of the Krylov space.
const MAX_VECTORS: usize = 60;

/// Solves for `right_side`, in place, until the residual is less than `tolerance` of it, by the generalised minimal residual method of
/// Saad and Schultz (1986), preconditioned on the right by `M`. Returns the number of vectors, or none if it did not converge.
///
/// `(M + C) M⁻¹ y = y + C M⁻¹ y`, so that a vector costs one solution with `M` and one product with `C`.
pub fn solve(system: &mut impl Coupled, right_side: &mut Vector, tolerance: f64, krylov: &mut Krylov) -> Option<usize> {
    let size = norm(right_side);
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
    let mut next = krylov.vector(0, right_side.len());
    next.clone_from(right_side);
    scale(&mut next, 1.0 / size);
    for step in 0..MAX_VECTORS {
        let mut z = std::mem::take(&mut krylov.preconditioned[step]);
        z.clone_from(&next);
        krylov.basis[step] = next;
        system.precondition(&mut z);
        let mut image = krylov.vector(step + 1, z.len());
        system.couple(&z, &mut image);
        krylov.preconditioned[step] = z;
        add_scaled(&mut image, 1.0, &krylov.basis[step]);
        let mut column: Vec<f64> = Vec::with_capacity(step + 2);
        for vector in &krylov.basis[..=step] {
            let projection = dot(vector, &image);
            add_scaled(&mut image, -projection, vector);
            column.push(projection);
        }
        let rest = norm(&image);
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
            combine(&triangle, &remaining[..=step], krylov, right_side);
            return Some(step + 1);
        }
        if rest == 0.0 {
            return None;
        }
        next = image;
        scale(&mut next, 1.0 / rest);
    }
    None
}

/// Solves the triangle by substitution, and sums the preconditioned vectors.
fn combine(triangle: &[Vec<f64>], right_side: &[f64], krylov: &Krylov, solution: &mut Vector) {
    let mut weights = right_side.to_vec();
    for row in (0..weights.len()).rev() {
        let known: f64 = (row + 1..weights.len()).map(|column| triangle[column][row] * weights[column]).sum();
        weights[row] = (weights[row] - known) / triangle[row][row];
    }
    scale(solution, 0.0);
    for (weight, vector) in weights.into_iter().zip(&krylov.preconditioned) {
        add_scaled(solution, weight, vector);
    }
}

impl Krylov {
    /// A vector with memory for `length` blocks, and that at `index` ready to be replaced.
    fn vector(&mut self, index: usize, length: usize) -> Vector {
        if self.basis.len() <= index {
            self.basis.resize_with(index + 1, Vector::new);
            self.preconditioned.resize_with(index + 1, Vector::new);
        }
        let mut vector = std::mem::take(&mut self.basis[index]);
        vector.clear();
        vector.resize(length, [Lanes::from_lanes(|_| 0.0); 2]);
        vector
    }
}

fn splat(value: f64) -> Lanes<LANES> {
    Lanes::from_lanes(|_| value)
}

fn scale(vector: &mut Vector, factor: f64) {
    for block in vector {
        *block = block.map(|value| value * splat(factor));
    }
}

fn add_scaled(vector: &mut Vector, factor: f64, other: &Vector) {
    for (block, other) in vector.iter_mut().zip(other) {
        for (value, other) in block.iter_mut().zip(other) {
            *value = *value + splat(factor) * *other;
        }
    }
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    let mut sum = splat(0.0);
    for (a, b) in a.iter().zip(b) {
        sum = sum + a[0] * b[0] + a[1] * b[1];
    }
    (0..LANES).map(|lane| sum.lane(lane)).sum()
}

fn norm(vector: &Vector) -> f64 {
    dot(vector, vector).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal, and a dense coupling of which it is the larger part.
    struct Dense {
        diagonal: Vec<f64>,
        coupling: Vec<Vec<f64>>,
    }

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

        fn couple(&mut self, x: &Vector, result: &mut Vector) {
            let x = flat(x);
            let product = |row: &Vec<f64>| row.iter().zip(&x).map(|(a, b)| a * b).sum();
            *result = folded(&self.coupling.iter().map(product).collect::<Vec<f64>>());
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
        let mut solution = folded(&right_side);
        let mut system = Dense { diagonal, coupling };
        let vectors = solve(&mut system, &mut solution, 1e-12, &mut Krylov::default()).expect("it converges");
        assert!(vectors > 3 && vectors <= size, "{vectors}");
        for (value, expected) in flat(&solution).iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-10, "{value} for {expected}");
        }
    }
}
