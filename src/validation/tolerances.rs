//! How far a number may be off, and why not less: one table.

/// What a tolerance is relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The reference.
    Relative,
    /// Nothing: it has the unit of the number.
    Absolute,
}

/// How far a number may be off.
#[derive(Debug)]
pub struct Tolerance {
    /// What it is called on the page.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// What it is relative to.
    pub measure: Measure,
    /// Why so much.
    pub reason: &'static str,
}

/// Declares tolerances, and the table of them.
macro_rules! tolerances {
    ($($constant:ident = $measure:ident $value:expr, $name:literal: $reason:literal;)*) => {
        $(
            #[doc = $reason]
            pub const $constant: &Tolerance =
                &Tolerance { name: $name, value: $value, measure: Measure::$measure, reason: $reason };
        )*

        /// All of them, in the order of the page.
        pub const TABLE: &[&Tolerance] = &[$($constant),*];
    };
}

tolerances! {
    BOUNDS = Absolute 0.0, "bounds": "A number that only has to lie between bounds, or has to be the same to the bit.";
    ROUNDING = Absolute 1e-12, "rounding": "Exact for every n: what is left is rounding, which the stiffness of the joints \
        over that of the whole, n² = 10⁴, enlarges.";
    DIFFERENCES = Absolute 1e-9, "differences": "Exact for every n, but the stiffness is a difference of residuals: its \
        formula is good to (0.05)⁶/140 = 1e-10, and divides roundings by 0.02.";
    STATICS = Relative 2e-7, "statics": "Extrapolated from n = 100 and 200, which leaves the next term, of n⁻⁴: up to 7e-8 \
        for a filament that bends within a few segments.";
    QUASI_STATICS = Relative 2e-5, "quasi-statics": "Extrapolated in n and in the velocity, which leaves its square: 1e-5 from \
        0.1 m/s (quick), 1e-6 from 0.02 m/s (full).";
    ORDER = Absolute 0.1, "order": "At the n of the case the next term of the error still shows.";
    PEAK_ORDER = Absolute 0.2, "order of peaks": "In an impact only a few segments next to the tip move: the next term shows \
        more.";
    PEAK_GROWTH = Absolute 0.02, "growth of peaks": "An asymptotic law, over one decade.";
    FREQUENCY = Relative 1e-6, "frequency": "Extrapolated twice from n, 2n and 4n, which leaves the term of n⁻⁶ of beams that \
        bend within a few segments where they are clamped.";
    QUOTED = Absolute 5e-6, "quoted": "The reference is quoted with as many digits.";
    DAMPING = Relative 2e-6, "damping": "Extrapolated from n = 25 and 50, which leaves the term of n⁻⁴; and 1 mrad is not \
        infinitely small: (10⁻³)².";
    DAMPING_25 = Relative 1e-3, "damping, n = 25": "The chain's frequency is off by 0.073 % at n = 25, and its damping ratio with \
        it.";
    SPIN_UP = Absolute 2e-6, "spin-up": "The reference's own error, 5e-6 m of 10 m, and as much that the extrapolation from n = 25 and \
        50 leaves.";
    DRIFT = Absolute 2e3, "drift": "A million steps that all lose energy, each a thousandth of its tolerance.";
    TRAJECTORY = Absolute 5e-9, "trajectory": "Thousands of steps at a tolerance of 1e-11, whose errors the azimuth adds up.";
    CHAOS = Absolute 1e-5, "chaos": "Errors of 1e-12 a step grow up to 1.2 million times.";
    REVERSAL = Absolute 1e-7, "reversal": "Thousands of steps at a tolerance of 1e-10, there and back; each impact parts what \
        was near.";
    IMPACT = Relative 2e-7, "impact": "At a tolerance of 1e-10; the penetrations of up to 4 mm let the tip leave the straight \
        line by their square, and p = 1.5 has no third derivative at δ = 0.";
    SLIDING = Relative 1e-8, "sliding": "At a tolerance of 1e-9, and friction that is solved to it.";
    REGULARISATION = Relative 1e-5, "regularisation": "The regularisation is left out of the reference: (v_reg/v)² times a \
        logarithm.";
    ENERGY = Absolute 5e-6, "energy": "Some 400 steps at the default tolerance of 1e-6, relative to the work done.";
    MOMENTUM = Absolute 1e-6, "momentum": "As above; the clamp's reaction is taken from interpolated states.";
    SAMPLES = Absolute 1e-10, "samples": "With samples the force is evaluated at each stage instead of corrected to first order, \
        which differs by the square of the correction.";
    PROPORTIONAL = Absolute 3.0, "proportional": "Errors over the tolerance, which is meant for one step: contact times add up \
        those of the events.";
    REFERENCES = Absolute 2e-9, "references": "CVODES at a tolerance of 1e-11 and Radau at 1e-9.";
    CVODES_TRAJECTORY = Absolute 1e-8, "CVODES, trajectory": "CVODES' own error is 1e-7 N of 6 N in the force.";
    CVODES_METRICS = Relative 3e-9, "CVODES, metrics": "CVODES' own error is 1e-9 in the contact time.";
    MUJOCO_TRAJECTORY = Absolute 1e-4, "MuJoCo, trajectory": "MuJoCo's own error at its step is 3e-4 N of 6 N in the force.";
    MUJOCO_METRICS = Relative 2e-5, "MuJoCo, metrics": "MuJoCo's own error at its step: 8e-7 in the impulse, 4e-5 N in the peak \
        force, a few steps in the contact times.";
    ANCF_TRAJECTORY = Absolute 3e-3, "ANCF, trajectory": "The beam still stretches: a ninth of the 0.09 N by which ten times the \
        axial stiffness changes the force.";
    ANCF_METRICS = Relative 5e-5, "ANCF, metrics": "The same in the impulse, 1e-5; the extrapolation leaves as much.";
    ANCF_PEAK = Relative 2e-3, "ANCF, peak": "The same in the largest force: 0.01 N of 6 N.";
}
