//! The accelerations of [`bristle::equations::Dynamics`] with the number of segments known to the compiler.
//!
//! Of a straight chain. The same kernels in the same order on arrays of size `N`: no memory but the stack, and every loop count is a constant. It
//! exists to measure how much a build for one number of segments could gain at most.

use bristle::equations::linear::{
    add, add_matrices, dot, invert, mul, mul_transposed, product, sub, transposed_product, zero, zero_matrix,
};
use bristle::equations::{Chain, Clamp, kernels, sin_cos};

/// `sin φ, cos φ, sin θ, cos θ`
type Angles = [f64; 4];

fn azimuth_step(previous: Angles, next: Angles) -> [f64; 2] {
    let ([_, _, sin, cos], [_, _, next_sin, next_cos]) = (previous, next);
    [sin * next_cos - cos * next_sin, cos * next_cos + sin * next_sin]
}

/// `q̈` of an unloaded chain at `(q, q̇)`, into `accelerations`.
pub fn accelerations<const N: usize>(
    chain: &Chain<f64>,
    clamp: &Clamp<f64>,
    q: &[[f64; 2]; N],
    v: &[[f64; 2]; N],
    accelerations: &mut [[f64; 2]; N],
) {
    let angles: [Angles; N] = std::array::from_fn(|k| {
        let [phi, theta] = q[k];
        let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (sin_cos(phi), sin_cos(theta));
        [sin_phi, cos_phi, sin_theta, cos_theta]
    });
    let segments: [kernels::Segment<f64>; N] = std::array::from_fn(|k| {
        let link = &chain.links[k];
        kernels::segment(angles[k], v[k], chain.length, link.mass, link.inertia)
    });
    // The body turns about z.
    let in_body = |[phi, theta]: [f64; 2]| [phi, theta - clamp.angular_velocity[2]];
    let mut torques = [[0.0; 2]; N];
    torques[0] =
        kernels::clamp(clamp.direction, angles[0], in_body(v[0]), chain.links[0].stiffness, chain.links[0].damping)
            .next;
    for k in 1..N {
        let (previous, next) = (angles[k - 1], angles[k]);
        let step = azimuth_step(previous, next);
        let joint = kernels::joint(
            [previous[0], previous[1]],
            [next[0], next[1]],
            step,
            step,
            in_body(v[k - 1]),
            in_body(v[k]),
            chain.links[k].stiffness,
            chain.links[k].damping,
        );
        torques[k - 1] = add(torques[k - 1], joint.previous);
        torques[k] = joint.next;
    }

    let mut partial = [[0.0; 2]; N];
    let mut from_node = [[[0.0; 3]; 2]; N];
    let (mut a, mut b) = (zero_matrix::<f64, 3, 3>(), zero::<f64, 3>());
    for k in (0..N).rev() {
        let segment = &segments[k];
        let jacobian = &segment.reach_jacobian;
        let outer = add(mul(&a, segment.reach_bias), b);
        let spread = product(&a, jacobian);
        let coupling = add_matrices(&segment.coupling, &spread);
        let pivot = invert(&add_matrices(&segment.inertia, &transposed_product(jacobian, &spread)));
        let torque = sub(sub(torques[k], segment.bias), mul_transposed(jacobian, outer));
        let response: [[f64; 3]; 2] =
            std::array::from_fn(|row| std::array::from_fn(|column| dot(pivot[row], coupling[column])));
        let own = mul(&pivot, torque);
        let correction = product(&coupling, &response);
        a = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let (low, high) = (row.min(column), row.max(column));
                let entry = a[low][high] - correction[low][high];
                if row == column { chain.links[k].mass + entry } else { entry }
            })
        });
        b = add(add(segment.base_bias, outer), mul(&coupling, own));
        partial[k] = own;
        from_node[k] = response;
    }

    let mut base = sub(clamp.acceleration, chain.gravity);
    for k in 0..N {
        let segment = &segments[k];
        let own = sub(partial[k], mul(&from_node[k], base));
        base = add(base, add(mul(&segment.reach_jacobian, own), segment.reach_bias));
        accelerations[k] = own;
    }
}
