//! Loops compiled for several instruction sets. A call takes the widest set of the machine.
//!
//! A compiler vectorises a loop with the instructions allowed in the function that contains it. A
//! default build allows only the oldest instructions. On x86-64 each [`Loop`] is therefore inlined,
//! with everything that it calls, into one function with AVX-512 and one with AVX2. Every aarch64
//! has NEON. The sets differ only in speed: each product and each sum is rounded in every set.

/// Loop over the segments of chains.
///
/// Its `run`, and every function called from it, must be marked `#[inline(always)]`: a function
/// that is not inlined is compiled for the oldest machine.
pub(crate) trait Loop {
    /// Result of the loop.
    type Output;

    /// Number of values computed side by side.
    const LANES: usize;

    /// Runs the loop.
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

    /// Returns `true` if the loops are compiled for lanes that this machine has.
    ///
    /// On x86-64 this requires AVX2 (2013). For registers of two numbers the loops would dominate
    /// the build and gain little.
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

/// Returns `true`: on this architecture the loops are always compiled for the machine's lanes.
#[cfg(not(target_arch = "x86_64"))]
pub fn lanes_are_compiled() -> bool {
    true
}
