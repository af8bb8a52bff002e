//! Loops compiled for several sets of instructions, of which the machine's widest is chosen when they are called.
//!
//! A compiler vectorises a loop with the instructions of the function that holds it, and those of a default build are the
//! oldest of their kind. So each [`Loop`] is inlined, with all that it calls, into one function for each set: AVX-512 and
//! AVX2 on x86-64, NEON on aarch64. The sets differ in speed only: products and sums are rounded each, whatever the set.

use pulp::{Arch, Simd, WithSimd};

/// A loop over the segments of chains.
///
/// Its `run`, and all that this calls in turn, must be marked `#[inline(always)]`: what stays a function of its own is
/// compiled for the oldest machine.
pub(crate) trait Loop {
    /// What it gives.
    type Output;

    /// Numbers that it computes side by side.
    const LANES: usize;

    /// Runs it.
    fn run(self) -> Self::Output;
}

/// Runs `operation` with the machine's widest instructions.
#[inline(always)]
pub(crate) fn dispatch<L: Loop>(operation: L) -> L::Output {
    Arch::new().dispatch(Vectorised(operation))
}

/// True if the loops are compiled for lanes that this machine has.
///
/// On x86-64 they need AVX2 (2013): for registers of two numbers they would be the largest part of what a build
/// compiles, and gain little.
pub fn lanes_are_compiled() -> bool {
    Arch::new().dispatch(HasLanes)
}

/// Whether loops over lanes are left out for the instructions `S`.
const fn lacks_lanes<S: Simd>() -> bool {
    cfg!(target_arch = "x86_64") && S::IS_SCALAR
}

struct HasLanes;

impl WithSimd for HasLanes {
    type Output = bool;

    fn with_simd<S: Simd>(self, _: S) -> bool {
        !lacks_lanes::<S>()
    }
}

struct Vectorised<L>(L);

impl<L: Loop> WithSimd for Vectorised<L> {
    type Output = L::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> L::Output {
        if const { L::LANES > 1 && lacks_lanes::<S>() } {
            unreachable!("lanes are not used without AVX2");
        }
        self.0.run()
    }
}
