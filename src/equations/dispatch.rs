//! Loops compiled for several sets of instructions, of which the machine's widest is chosen when they are called.
//!
//! A compiler vectorises a loop with the instructions of the function that holds it, and those of a default build are the
//! oldest of their kind. On x86-64 each [`Loop`] is therefore inlined, with all that it calls, into one function with
//! AVX-512 and one with AVX2; NEON belongs to every aarch64. The sets differ in speed only: products and sums are rounded
//! each, whatever the set.

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

#[cfg(target_arch = "x86_64")]
pub(crate) use x86_64::dispatch;
#[cfg(target_arch = "x86_64")]
pub use x86_64::lanes_are_compiled;

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use pulp::{NullaryFnOnce, simd_type};

    use super::Loop;

    simd_type!({
        struct Avx512 {
            avx512f: feature!("avx512f"),
            avx512dq: feature!("avx512dq"),
            avx512vl: feature!("avx512vl"),
        }

        struct Avx2 {
            avx2: feature!("avx2"),
        }
    });

    struct Inlined<L>(L);

    impl<L: Loop> NullaryFnOnce for Inlined<L> {
        type Output = L::Output;

        #[inline(always)]
        fn call(self) -> L::Output {
            self.0.run()
        }
    }

    /// Runs `operation` with the machine's widest instructions.
    #[inline(always)]
    pub(crate) fn dispatch<L: Loop>(operation: L) -> L::Output {
        if let Some(set) = Avx512::try_new() {
            set.vectorize(Inlined(operation))
        } else if let Some(set) = Avx2::try_new() {
            set.vectorize(Inlined(operation))
        } else if const { L::LANES > 1 } {
            unreachable!("lanes are not used without AVX2")
        } else {
            operation.run()
        }
    }

    /// True if the loops are compiled for lanes that this machine has.
    ///
    /// On x86-64 they need AVX2 (2013): for registers of two numbers they would be the largest part of what a build
    /// compiles, and gain little.
    pub fn lanes_are_compiled() -> bool {
        Avx2::is_available()
    }
}

/// Runs `operation`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub(crate) fn dispatch<L: Loop>(operation: L) -> L::Output {
    operation.run()
}

/// True if the loops are compiled for lanes that this machine has: on this architecture, always.
#[cfg(not(target_arch = "x86_64"))]
pub fn lanes_are_compiled() -> bool {
    true
}
