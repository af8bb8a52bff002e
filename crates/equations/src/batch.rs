//! Accelerations of many filaments side by side, in the lanes of the machine's vector units.
//!
//! Input: states of chains with the same number of segments, each with its own constants and clamp.
//! Output: their `q̈`. The code is that of [`Dynamics`], run on [`Lanes`], [`LANES`] states at a
//! time, with the widest instructions of the machine (AVX-512 or AVX2 on x86-64, NEON on aarch64).
//!
//! A state's result equals that of `Dynamics<f64>` to the bit, regardless of its position in a
//! batch, its neighbours, and the instructions that compute it.
//!
//! All coordinates are about `z`, and nodes carry no loads.

use bristle::equations::linear::zero;
use bristle::equations::{
    Chain, ChainDynamics, Clamp, Dynamics, LANES, Lanes, NoLoads, PolarAxis, PoleError, find_pole,
    lanes_are_compiled,
};
use thiserror::Error;

/// One filament of a batch: its constants, its clamp and its state about `z`.
#[derive(Clone, Copy, Debug)]
pub struct Member<'a> {
    /// The constants.
    pub chain: &'a Chain<f64>,
    /// The clamp's motion.
    pub clamp: &'a Clamp<f64>,
    /// `[φ, θ]` of each segment in rad, about `z`.
    pub q: &'a [[f64; 2]],
    /// Their rates in rad/s.
    pub v: &'a [[f64; 2]],
}

/// A member of a batch whose accelerations are meaningless.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("state {member} of the batch: {pole}")]
pub struct BatchError {
    /// Number of the state, counted from 1.
    pub member: usize,
    /// The segment at a pole of its coordinates about `z`.
    #[source]
    pub pole: PoleError,
}

/// Memory for computing batches of chains with the same number of segments.
///
/// ```
/// use bristle::equations::{Chain, UniformChain};
/// use bristle::tool::{ClampMotion, FixedClamp};
/// use bristle_equations::batch::{Batch, Member};
///
/// let chain = Chain::from(UniformChain {
///     segments: 2,
///     length: 0.02,
///     mass: 2.4e-5,
///     inertia: 8.1e-10,
///     root_stiffness: 0.03,
///     joint_stiffness: 0.015,
///     root_damping: 3e-5,
///     joint_damping: 1.5e-5,
///     gravity: [0.0, 0.0, -9.81],
/// });
/// let clamp = FixedClamp { direction: [1.0, 0.0, 0.0] }.at(0.0);
/// let (bends, rates) = ([0.1, 0.2, 0.3].map(|bend| [[1.5, 0.0], [1.5, bend]]), [[0.0; 2]; 2]);
/// let members = bends.each_ref().map(|q| Member { chain: &chain, clamp: &clamp, q, v: &rates });
/// let mut accelerations = [[0.0; 2]; 3 * 2];
/// Batch::new(2).accelerations(&members, &mut accelerations)?;
/// // The outer segment springs back; the larger the bend, the faster.
/// assert!(accelerations[1][1] < 0.0 && accelerations[5][1] < accelerations[3][1]);
/// # Ok::<(), bristle_equations::batch::BatchError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Batch {
    segments: usize,
    /// Equations of motion with the constants of the latest group of states.
    dynamics: Option<Dynamics<Lanes>>,
    q: Vec<[Lanes; 2]>,
    v: Vec<[Lanes; 2]>,
    accelerations: Vec<[Lanes; 2]>,
}

impl Batch {
    /// Memory for chains of `segments` segments.
    ///
    /// # Panics
    /// If `segments` is 0.
    pub fn new(segments: usize) -> Self {
        assert!(segments > 0, "a chain has at least one segment");
        let none = vec![zero(); segments];
        Self {
            segments,
            dynamics: None,
            q: none.clone(),
            v: none.clone(),
            accelerations: none,
        }
    }

    /// Computes `q̈` in rad/s² of all `members` into `accelerations`: those of the first, then
    /// those of the second, and so on.
    ///
    /// # Errors
    /// If a segment is at a pole of its coordinates; see [`Dynamics::check_poles`]. In this case
    /// nothing is computed.
    ///
    /// # Panics
    /// If the number of segments of a chain differs from that of the batch, or if a slice is too
    /// short.
    pub fn accelerations(
        &mut self,
        members: &[Member<'_>],
        accelerations: &mut [[f64; 2]],
    ) -> Result<(), BatchError> {
        let n = self.segments;
        assert!(
            accelerations.len() >= n * members.len(),
            "the result has room for every segment of every member"
        );
        for (i, member) in members.iter().enumerate() {
            assert_eq!(
                member.chain.segments(),
                n,
                "all chains of a batch have its number of segments"
            );
            if let Some(k) = find_pole(&member.q[..n]) {
                let pole = PoleError {
                    segment: k + 1,
                    polar_angle: member.q[k][0],
                    axis: PolarAxis::Z,
                };
                return Err(BatchError {
                    member: i + 1,
                    pole,
                });
            }
        }
        if !lanes_are_compiled() {
            for (member, results) in members.iter().zip(accelerations.chunks_mut(n)) {
                let at = member.clamp.holding(member.q, member.v);
                Dynamics::new(member.chain.clone()).accelerations(at, &NoLoads, results);
            }
            return Ok(());
        }
        for (group, results) in members
            .chunks(LANES)
            .zip(accelerations.chunks_mut(LANES * n))
        {
            self.compute(group, results);
        }
        Ok(())
    }

    /// Computes up to [`LANES`] states at once. Lanes without a state repeat the last one, so that
    /// they take the same branches.
    fn compute(&mut self, group: &[Member<'_>], results: &mut [[f64; 2]]) {
        let n = self.segments;
        let members: [&Member<'_>; LANES] =
            std::array::from_fn(|lane| &group[lane.min(group.len() - 1)]);
        let clamp = Clamp::from_lanes(|lane| *members[lane].clamp);
        for (lane, member) in members.into_iter().enumerate() {
            gather(lane, &member.q[..n], &mut self.q);
            gather(lane, &member.v[..n], &mut self.v);
        }
        let chain = |lane: usize| members[lane].chain;
        let dynamics = self
            .dynamics
            .get_or_insert_with(|| Dynamics::new(Chain::from_lanes(chain)));
        dynamics.chain_mut().set_lanes(chain);
        let at = clamp.holding(&self.q, &self.v);
        dynamics.accelerations(at, &NoLoads, &mut self.accelerations);
        for (lane, results) in results.chunks_exact_mut(n).take(group.len()).enumerate() {
            for (result, accelerations) in results.iter_mut().zip(&self.accelerations) {
                *result = [accelerations[0].0[lane], accelerations[1].0[lane]];
            }
        }
    }
}

fn gather(lane: usize, values: &[[f64; 2]], lanes: &mut [[Lanes; 2]]) {
    for (lanes, values) in lanes.iter_mut().zip(values) {
        lanes[0].0[lane] = values[0];
        lanes[1].0[lane] = values[1];
    }
}
