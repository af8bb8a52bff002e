//! Small motions about a straight chain, at rest or turning: natural frequencies and modes.

use std::f64::consts::FRAC_PI_2;

use bristle::equations::{Chain, ChainDynamics, Clamp, Dynamics, NoLoads};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The coordinate of a segment that moves, in the order of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The polar angle, out of the plane perpendicular to `z`, the plane of rotation (flap).
    OutOfPlane,
    /// The azimuth, in that plane (lag).
    InPlane,
}

/// A natural vibration.
#[derive(Clone, Debug)]
pub struct Mode {
    /// Angular frequency.
    pub frequency: f64,
    /// Angles of the segments, arbitrarily scaled.
    pub shape: Vec<f64>,
}

/// Size of the angles for finite differences of the residual, of one segment or along a whole mode.
/// With the formula of sixth order the truncation error is below rounding.
const DIFFERENCE: f64 = 2e-2;

/// `f′(0)` of a vector, from three central differences.
fn slope(mut f: impl FnMut(f64) -> DVector<f64>) -> DVector<f64> {
    let mut difference =
        |steps: f64| (f(steps * DIFFERENCE) - f(-steps * DIFFERENCE)) / (2.0 * DIFFERENCE);
    difference(1.0) * 1.5 - difference(2.0) * 0.3 + difference(3.0) / 30.0
}

/// The equations of motion about a straight shape, in one direction.
struct Linearised<'a> {
    dynamics: Dynamics<f64>,
    clamp: &'a Clamp<f64>,
    straight: [f64; 2],
    turning: [f64; 2],
    coordinate: usize,
}

impl Linearised<'_> {
    fn residual(&mut self, angles: &DVector<f64>, accelerations: &DVector<f64>) -> DVector<f64> {
        let n = angles.len();
        let (mut q, mut a, mut result) =
            (vec![self.straight; n], vec![[0.0; 2]; n], vec![[0.0; 2]; n]);
        for k in 0..n {
            q[k][self.coordinate] += angles[k];
            a[k][self.coordinate] = accelerations[k];
        }
        self.dynamics.residual(
            self.clamp.holding(&q, &vec![self.turning; n]),
            &a,
            &NoLoads,
            &mut result,
        );
        DVector::from_iterator(n, result.iter().map(|pair| pair[self.coordinate]))
    }

    /// `M a`.
    fn inertia(&mut self, accelerations: &DVector<f64>) -> DVector<f64> {
        let rest = DVector::zeros(accelerations.len());
        self.residual(&rest, accelerations) - self.residual(&rest, &rest)
    }

    /// `K q`.
    fn stiffness(&mut self, angles: &DVector<f64>) -> DVector<f64> {
        let rest = DVector::zeros(angles.len());
        slope(|size| self.residual(&(angles * size), &rest))
    }
}

/// The natural vibrations of `chain` about its straight shape along the clamp, which turns at
/// `rate` (rad/s), by ascending frequency. The damping is left out.
///
/// `M` is the derivative of the residual with respect to the accelerations, `K` that with respect
/// to the coordinates. Each frequency is finally computed as Rayleigh's quotient of its mode,
/// because rounding affects differences along a smooth shape less than those of single angles.
pub fn modes(
    mut chain: Chain<f64>,
    clamp: &Clamp<f64>,
    rate: f64,
    direction: Direction,
) -> Vec<Mode> {
    let n = chain.segments();
    for link in &mut chain.links {
        link.damping = 0.0;
    }
    let mut equations = Linearised {
        dynamics: Dynamics::new(chain),
        clamp,
        straight: [FRAC_PI_2, clamp.direction[1].atan2(clamp.direction[0])],
        turning: [0.0, rate],
        coordinate: direction as usize,
    };
    let unit = |segment: usize| DVector::from_fn(n, |k, _| f64::from(u8::from(k == segment)));
    let mass: Vec<_> = (0..n)
        .map(|segment| equations.inertia(&unit(segment)))
        .collect();
    let stiffness: Vec<_> = (0..n)
        .map(|segment| equations.stiffness(&unit(segment)))
        .collect();
    let factor = DMatrix::from_columns(&mass)
        .cholesky()
        .expect("the mass matrix is positive definite")
        .l();
    let inverse = factor.try_inverse().expect("its factor is regular");
    let reduced = &inverse * DMatrix::from_columns(&stiffness) * inverse.transpose();
    let eigen = SymmetricEigen::new((&reduced + reduced.transpose()) / 2.0);
    let mut modes: Vec<Mode> = (0..n)
        .map(|i| {
            let shape = inverse.transpose() * eigen.eigenvectors.column(i);
            let shape = &shape / shape.amax();
            let squared =
                shape.dot(&equations.stiffness(&shape)) / shape.dot(&equations.inertia(&shape));
            Mode {
                frequency: squared.sqrt(),
                shape: shape.iter().copied().collect(),
            }
        })
        .collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    modes
}
