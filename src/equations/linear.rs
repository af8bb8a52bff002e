//! Products of the small fixed-size vectors and matrices that the recursions carry.
//!
//! Plain arrays of a generic scalar: `[T; 3]` is a vector, `[[T; C]; R]` a matrix stored by rows.
//! No dimension exceeds 3.

use super::{LaneSet, Lanewise, Real};

/// Writes out `body` for `index` = 0, 1, 2 below `end`.
///
/// A loop would be unrolled too late, if at all. With a scalar of many lanes the body is long. The
/// compiler would then vectorise over rows, with gathers, instead of over lanes.
macro_rules! unrolled {
    ($index:ident < $end:expr, $body:block) => {
        if 0 < $end {
            let $index = 0;
            $body
        }
        if 1 < $end {
            let $index = 1;
            $body
        }
        if 2 < $end {
            let $index = 2;
            $body
        }
    };
}
pub(crate) use unrolled;

/// Returns `a + b`.
#[inline(always)]
pub fn add<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> [T; N] {
    let mut result = a;
    unrolled!(i < N, {
        result[i] = a[i] + b[i];
    });
    result
}

/// Returns `a − b`.
#[inline(always)]
pub fn sub<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> [T; N] {
    let mut result = a;
    unrolled!(i < N, {
        result[i] = a[i] - b[i];
    });
    result
}

/// Returns `factor × a`.
#[inline(always)]
pub fn scale<T: Real, const N: usize>(factor: T, a: [T; N]) -> [T; N] {
    let mut result = a;
    unrolled!(i < N, {
        result[i] = factor * a[i];
    });
    result
}

/// Returns `a · b`.
#[inline(always)]
pub fn dot<T: Real, const N: usize>(a: [T; N], b: [T; N]) -> T {
    let mut sum = a[0] * b[0];
    unrolled!(i < N, {
        if i > 0 {
            sum = sum + a[i] * b[i];
        }
    });
    sum
}

/// Returns `a × b`.
#[inline(always)]
pub fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns `M x`.
#[inline(always)]
pub fn mul<T: Real, const R: usize, const C: usize>(matrix: &[[T; C]; R], x: [T; C]) -> [T; R] {
    let mut result = zero();
    unrolled!(row < R, {
        result[row] = dot(matrix[row], x);
    });
    result
}

/// Returns `Mᵀ x`.
#[inline(always)]
pub fn mul_transposed<T: Real, const R: usize, const C: usize>(
    matrix: &[[T; C]; R],
    x: [T; R],
) -> [T; C] {
    let mut result = zero();
    unrolled!(column < C, {
        let mut sum = matrix[0][column] * x[0];
        unrolled!(row < R, {
            if row > 0 {
                sum = sum + matrix[row][column] * x[row];
            }
        });
        result[column] = sum;
    });
    result
}

/// Returns `A B`.
#[inline(always)]
pub fn product<T: Real, const R: usize, const K: usize, const C: usize>(
    a: &[[T; K]; R],
    b: &[[T; C]; K],
) -> [[T; C]; R] {
    let mut result = zero_matrix();
    unrolled!(row < R, {
        result[row] = mul_transposed(b, a[row]);
    });
    result
}

/// Returns `Aᵀ B`.
#[inline(always)]
pub fn transposed_product<T: Real, const R: usize, const K: usize, const C: usize>(
    a: &[[T; R]; K],
    b: &[[T; C]; K],
) -> [[T; C]; R] {
    let mut result = zero_matrix();
    unrolled!(row < R, {
        unrolled!(column < C, {
            let mut sum = b[0][column] * a[0][row];
            unrolled!(k < K, {
                if k > 0 {
                    sum = sum + b[k][column] * a[k][row];
                }
            });
            result[row][column] = sum;
        });
    });
    result
}

/// Returns `A + B`.
#[inline(always)]
pub fn add_matrices<T: Real, const R: usize, const C: usize>(
    a: &[[T; C]; R],
    b: &[[T; C]; R],
) -> [[T; C]; R] {
    let mut result = *a;
    unrolled!(row < R, {
        result[row] = add(a[row], b[row]);
    });
    result
}

/// Returns `A − B`.
#[inline(always)]
pub fn sub_matrices<T: Real, const R: usize, const C: usize>(
    a: &[[T; C]; R],
    b: &[[T; C]; R],
) -> [[T; C]; R] {
    let mut result = *a;
    unrolled!(row < R, {
        result[row] = sub(a[row], b[row]);
    });
    result
}

/// Returns `−A`.
#[inline(always)]
pub fn negative<T: Real, const R: usize, const C: usize>(a: &[[T; C]; R]) -> [[T; C]; R] {
    let mut result = *a;
    unrolled!(row < R, {
        unrolled!(column < C, {
            result[row][column] = -a[row][column];
        });
    });
    result
}

/// Returns `a` in `lanes`, `b` elsewhere.
#[inline(always)]
pub fn select<T: Lanewise, const R: usize, const C: usize>(
    lanes: LaneSet,
    a: &[[T; C]; R],
    b: &[[T; C]; R],
) -> [[T; C]; R] {
    let mut result = *b;
    unrolled!(row < R, {
        unrolled!(column < C, {
            result[row][column] = a[row][column].select(lanes, b[row][column]);
        });
    });
    result
}

/// Returns the vector in one lane.
///
/// It takes a reference: the compiler would first copy all lanes of a value.
#[inline(always)]
pub fn in_lane<T: Lanewise, const N: usize>(vector: &[T; N], lane: usize) -> [f64; N] {
    let mut result = [0.0; N];
    unrolled!(i < N, {
        result[i] = vector[i].lane(lane);
    });
    result
}

/// Returns `M⁻¹` of a matrix of one or two rows; not finite if `M` is singular.
#[inline(always)]
pub fn invert<T: Real, const N: usize>(matrix: &[[T; N]; N]) -> [[T; N]; N] {
    let one = T::from_f64(1.0);
    let mut inverse = *matrix;
    if N == 1 {
        inverse[0][0] = one / matrix[0][0];
        return inverse;
    }
    let (a, b, c, d) = (matrix[0][0], matrix[0][1], matrix[1][0], matrix[1][1]);
    let scale = one / (a * d - b * c);
    (inverse[0][0], inverse[0][1]) = (d * scale, -(b * scale));
    (inverse[1][0], inverse[1][1]) = (-(c * scale), a * scale);
    inverse
}

/// Returns the zero vector.
#[inline(always)]
pub fn zero<T: Real, const N: usize>() -> [T; N] {
    const { [T::ZERO; N] }
}

/// Returns the zero matrix.
#[inline(always)]
pub fn zero_matrix<T: Real, const R: usize, const C: usize>() -> [[T; C]; R] {
    const { [[T::ZERO; C]; R] }
}
