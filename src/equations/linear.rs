//! Products of the small fixed-size vectors and matrices that the recursions carry.
//!
//! Plain arrays of a generic scalar: `[T; 3]` is a vector, `[[T; C]; R]` a matrix stored by rows. Plain loops too: the
//! closure of an iterator may be compiled apart, and then without the instructions of the function that it serves.

use super::Real;

/// `a + b`
#[inline(always)]
pub fn add<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> [T; N] {
    let mut result = a;
    for i in 0..N {
        result[i] = a[i] + b[i];
    }
    result
}

/// `a − b`
#[inline(always)]
pub fn sub<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> [T; N] {
    let mut result = a;
    for i in 0..N {
        result[i] = a[i] - b[i];
    }
    result
}

/// `factor × a`
#[inline(always)]
pub fn scale<T: Real, const N: usize>(factor: T, a: [T; N]) -> [T; N] {
    let mut result = a;
    for i in 0..N {
        result[i] = factor * a[i];
    }
    result
}

/// `a · b`
#[inline(always)]
pub fn dot<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> T {
    let mut sum = a[0] * b[0];
    for i in 1..N {
        sum = sum + a[i] * b[i];
    }
    sum
}

/// `M x`
#[inline(always)]
pub fn mul<T: Real, const R: usize, const C: usize>(matrix: &[[T; C]; R], x: [T; C]) -> [T; R] {
    let mut result = zero();
    for row in 0..R {
        result[row] = dot(matrix[row], x);
    }
    result
}

/// `Mᵀ x`
#[inline(always)]
pub fn mul_transposed<T: Real, const R: usize, const C: usize>(matrix: &[[T; C]; R], x: [T; R]) -> [T; C] {
    let mut result = zero();
    for column in 0..C {
        let mut sum = matrix[0][column] * x[0];
        for row in 1..R {
            sum = sum + matrix[row][column] * x[row];
        }
        result[column] = sum;
    }
    result
}

/// `A B`
#[inline(always)]
pub fn product<T: Real, const R: usize, const K: usize, const C: usize>(
    a: &[[T; K]; R],
    b: &[[T; C]; K],
) -> [[T; C]; R] {
    let mut result = zero_matrix();
    for row in 0..R {
        result[row] = mul_transposed(b, a[row]);
    }
    result
}

/// `Aᵀ B`
#[inline(always)]
pub fn transposed_product<T: Real, const R: usize, const K: usize, const C: usize>(
    a: &[[T; R]; K],
    b: &[[T; C]; K],
) -> [[T; C]; R] {
    let mut result = zero_matrix();
    for row in 0..R {
        for column in 0..C {
            let mut sum = b[0][column] * a[0][row];
            for k in 1..K {
                sum = sum + b[k][column] * a[k][row];
            }
            result[row][column] = sum;
        }
    }
    result
}

/// `A + B`
#[inline(always)]
pub fn add_matrices<T: Real, const R: usize, const C: usize>(a: &[[T; C]; R], b: &[[T; C]; R]) -> [[T; C]; R] {
    let mut result = *a;
    for row in 0..R {
        result[row] = add(a[row], b[row]);
    }
    result
}

/// `A − B`
#[inline(always)]
pub fn sub_matrices<T: Real, const R: usize, const C: usize>(a: &[[T; C]; R], b: &[[T; C]; R]) -> [[T; C]; R] {
    let mut result = *a;
    for row in 0..R {
        result[row] = sub(a[row], b[row]);
    }
    result
}

/// `M⁻¹` of a 2 × 2 matrix; not finite if it is singular.
#[inline(always)]
pub fn invert<T: Real>(matrix: &[[T; 2]; 2]) -> [[T; 2]; 2] {
    let [[a, b], [c, d]] = *matrix;
    let scale = T::from_f64(1.0) / (a * d - b * c);
    [[d * scale, -(b * scale)], [-(c * scale), a * scale]]
}

/// The zero vector.
#[inline(always)]
pub fn zero<T: Real, const N: usize>() -> [T; N] {
    [T::from_f64(0.0); N]
}

/// The zero matrix.
#[inline(always)]
pub fn zero_matrix<T: Real, const R: usize, const C: usize>() -> [[T; C]; R] {
    [zero(); R]
}
