//! The tolerances and their reasons, in one table.

/// Measure of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Relative to the reference.
    Relative,
    /// In the unit of the number.
    Absolute,
    /// There is no reference, but the number must lie between these bounds. The tolerance is zero.
    Between(f64, f64),
}

/// The allowed error of a number.
#[derive(Debug)]
pub struct Tolerance {
    /// Its name in the record.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Measure of the error.
    pub measure: Measure,
    /// Reason why it is not smaller.
    pub reason: &'static str,
}

/// No limit.
const ANY: f64 = f64::INFINITY;

/// Declares the tolerances.
macro_rules! tolerances {
    ($(
        $constant:ident = $measure:ident $([$low:expr, $high:expr])? $value:literal: $reason:literal;
    )*) => {
        $(
            #[doc = $reason]
            pub const $constant: &Tolerance = &Tolerance {
                name: stringify!($constant),
                value: $value,
                measure: Measure::$measure $(($low, $high))?,
                reason: $reason,
            };
        )*
    };
}

tolerances! {
    SAME = Absolute 0.0: "Numbers that must be the same to the bit, and counts.";
    SOUTHWELL = Absolute 0.0: "Bounds stated in the case.";
    ROUNDING = Absolute 1e-12: "Exact for every n, except for rounding. The ratio of the joint \
        stiffness to that of the whole filament, n² = 10⁴, amplifies it.";
    DIFFERENCES = Absolute 1e-10: "Exact for every n, but the stiffness is a difference of \
        residuals: its formula is accurate to (0.02)⁶/140 = 5e-13 and divides rounding errors by \
        0.02.";
    STATICS = Relative 2e-7: "Extrapolation from n = 100 and 200 leaves the next term, of order \
        n⁻⁴: up to 7e-8 for a filament that bends within a few segments.";
    SHAPE = Relative 2e-6: "Extrapolation from n = 100 and 200 leaves terms of order n⁻³ of the \
        clamp joint of a tapered filament, and of order n⁻⁴ of the waves, of which one takes 60 \
        segments or more.";
    QUASI_STATICS = Relative 5e-6: "Extrapolated in n and in the velocity from four passes, each \
        accurate to some 3e-7 at a tolerance of 1e-7. Extrapolation amplifies this five times and \
        leaves a term of order v_b².";
    ORDER = Absolute 0.1: "At the n of the case the next term of the error still shows.";
    PEAK_ORDER = Absolute 0.2: "In an impact only a few segments near the tip move, so the next \
        term shows more.";
    PEAK_GROWTH = Absolute 0.02: "An asymptotic law, over one decade.";
    FREQUENCY = Relative 1e-6: "Extrapolating twice, from n, 2n and 4n, leaves a term of order \
        n⁻⁶ for beams that bend within a few segments at the clamp.";
    QUOTED = Absolute 5e-6: "The reference is quoted with this many digits.";
    DAMPING = Relative 2e-6: "Extrapolation from n = 25 and 50 leaves a term of order n⁻⁴; and 1 \
        mrad is not infinitely small: (10⁻³)².";
    DAMPING_25 = Relative 1e-3: "The chain's frequency is off by 0.073 % at n = 25, and so is \
        its damping ratio.";
    DRIFT = Absolute 4e-3: "The tolerance is that of the embedded solution of order 4. The \
        solution of order 5 loses a few thousandths of it, in each of up to two million steps.";
    DRIFT_MOMENTUM = Absolute 4e-4: "The same steps, whose errors in L_z have either sign.";
    TRAJECTORY = Absolute 5e-9: "Thousands of steps at a tolerance of 1e-11, whose errors add up \
        in the azimuth.";
    IMPACT = Relative 2e-7: "At a tolerance of 1e-10. With penetrations of up to 0.6 mm of 1 m, \
        the tip deviates from the straight line by their square; and p = 1.5 has no second \
        derivative at δ = 0.";
    SLIDING = Relative 1e-8: "At a tolerance of 1e-9, to which friction is solved too.";
    REGULARISATION = Relative 1e-5: "The reference leaves the regularisation out: (v_reg/v)² \
        times a logarithm.";
    ENERGY = Absolute 5e-6: "Each of some 400 steps has an error of the tolerance, 1e-6; the \
        dampers remove most of it before it adds up. Friction varies sharply with the sliding \
        velocity.";
    MOMENTUM = Absolute 1e-6: "The default tolerance of 1e-6, as forces are evaluated at \
        interpolated states.";
    SLOPE = Between [0.6, 1.6] 0.0: "Controlling the error per step gives slopes of 0.8 to 1 \
        with a method of order 5. From three to five points, whose errors are sums of either \
        sign, a slope is known to some 0.2. A steeper slope is not a fault.";
    RIGID_LIMIT = Between [0.5, 1.0] 0.0: "Between the order of impacts, ½, and that of a steady \
        depth, 1.";
    PROPORTIONAL = Absolute 3.0: "Errors over the tolerance. The tolerance applies to one step; \
        contact times add up the errors of the events.";
    REFERENCES = Absolute 2e-9: "The error of CVODES at a tolerance of 1e-11.";
    EDGE = Relative 1e-6: "Extrapolation from three n leaves a term of order n⁻⁴, and what the \
        mean over four edges leaves of the terms that depend on where nodes lie.";
    EDGE_ANGLE = Relative 1e-5: "The angle is that of the segment in contact, which touches \
        anywhere between its ends: its error of order n⁻² depends on where.";
    EDGE_SHIFT = Absolute 2e-5: "A term of order n⁻³ depends on where nodes lie: up to 1.2e-5 at \
        n = 100.";
    EDGE_FRICTION = Relative 1e-5: "Extrapolated in n, with one edge, and in the speed.";
    RELEASE = Absolute 1e-7: "Extrapolated in n and in the speed.";
    SLIPPED = Absolute 0.0: "Bounds stated in the case.";
    CURVES = Relative 2e-5: "As for quasi-statics on a plane. On a cylinder the force changes by \
        a quarter in 0.01 rad, so that small errors of the tip show.";
    PARALLEL = Relative 1e-10: "Exact for every N_q. The overlap of 1e-5 m is a difference of \
        lengths a hundred times as large.";
    PRESSED = Relative 1e-2: "Hertz's law is the limit for δ ≪ d: at δ = 1e-5 m its error is 0.5 \
        %. The lever arms of bent filaments change by d times their slope.";
    PRESSED_INTEGRAL = Relative 3e-3: "At N_q = 128 a part is 12 µm long, and the filaments \
        touch on 0.3 mm: the error depends on where points lie.";
    PLACE_IN_MEMORY = Absolute 1e-6: "Newton's method stops where velocities change by less than \
        1e-7 m/s.";
    HELD_BY_FILAMENT = Relative 2e-4: "The contact is resolved by parts of 25 µm, and touches \
        between nodes, so that an error of order n⁻² depends on where.";
    ROW = Relative 1e-3: "At a tolerance of 1e-5. Steps are fixed and not cut at impacts, of \
        which each filament has several.";
    BOUNCES = Relative 2e-2: "With Hertz's stiffness the impulses of two of the six filaments \
        depend on each bounce: MuJoCo's change by 0.5 % with its step, and Bristle's by 1 % from \
        a tolerance of 3e-6 to 1e-6. Their mean does not.";
    CAPSULES = Relative 0.1: "Capsules touch at one point, where lines press on each other along \
        a length.";
    CAPSULES_MEAN = Relative 2e-2: "The same in the mean over the row.";
    ROW_MOMENTUM = Absolute 1e-4: "The moment of the workpiece is integrated in fixed steps that \
        are not cut at impacts; vibrations remain at the end, e⁻¹⁰ of those before.";
    KNOWN_ROW = Relative 1e-2: "The forces are stated with three digits, one of them as \"about\".";
    STEADY = Absolute 5e-3: "A stretch is steady if its parts differ from its mean by less than \
        0.3 %.";
    STIFFER_ROW = Absolute 1e-2: "Stiffer filaments keep farther apart by what they overlapped \
        before, some µm of gaps of a few tenths of a millimetre.";
    STEADY_COARSE = Absolute 3e-2: "The chain converges as n⁻², from an error of some 2 % at n = \
        4. The impulses of tilted filaments scatter by 40 %, and the stretch of two rows has 50 \
        of them: where one carries more, its neighbours carry less.";
    STEADY_TOLERANCE = Absolute 3.0: "The tolerance applies to the mean of a long stretch.";
    MINIMUM = Absolute 1e-10: "Twelve digits of the other code, whose minimum is as flat as \
        rounding.";
    SPLAY = Relative 1e-6: "The beam bends by up to 3e-4 of its length. The linear theory leaves \
        the square of that out, which shows more near the natural frequency.";
    FLAT = Relative 1e-8: "At a tolerance of 1e-9; the turn in which the workpiece comes up has \
        damped out.";
    CVODES_TIP = Absolute 1e-8: "The error of CVODES is 4e-11 m, which is 5e-9 of s_n,max.";
    CVODES_FORCE = Absolute 2e-8: "The error of CVODES is 1e-7 N of 6 N.";
    CVODES_METRICS = Relative 3e-9: "The error of CVODES is 1e-9 in the contact time.";
    ANCF_TIP = Absolute 2e-4: "The beam still stretches, by a ninth of the 6e-6 m by which ten \
        times the axial stiffness moves the tip, which is 8e-5 of s_n,max. The error of the chain \
        at n = 200 is 1e-5.";
    ANCF_FORCE = Absolute 3e-3: "The same: a ninth of 0.09 N of 6 N.";
    ANCF_METRICS = Relative 5e-5: "The same in the impulse, 1e-5; the extrapolation leaves as \
        much.";
    ANCF_PEAK = Relative 2e-3: "The same in the largest force: 0.01 N of 6 N.";
    GROWS = Between [1.0 + 1e-9, ANY] 0.0: "An increase of any size.";
    FALLS = Between [0.0, 1.0 - 1e-9] 0.0: "A decrease of any size.";
    HARDLY_FALLS = Between [0.99, ANY] 0.0: "A saturating increase may reverse by 1 %.";
    DEGRESSIVE = Between [0.0, 0.5] 0.0: "The curve has lost at least half of its slope.";
    STEEP = Between [0.0, 0.1] 0.0: "At twelve times the velocity less than a tenth remains: \
        more than proportional.";
    MOST_LOST = Between [0.0, 0.4] 0.0: "More than half of it is lost everywhere.";
    SWEEPS = Between [0.9, 1.0] 0.0: "Near one: in contact nearly all the time.";
    STRIKES = Between [0.0, 0.4] 0.0: "Well below one half.";
    STRAIGHT = Between [0.0, 0.1] 0.0: "Within a tenth of its range of a straight line.";
    BENT = Between [0.12, ANY] 0.0: "Farther from a straight line than the bound for \"straight\".";
    NEARLY_PROPORTIONAL = Between [0.5, 2.0] 0.0: "Within a factor of two of proportional.";
    DISTINCT = Between [1.25, ANY] 0.0: "A quarter more is visible in a diagram.";
    ALONG_TIER = Between [0.3, 0.6] 0.0: "Between the levels of striking and of sweeping passes.";
    ONE_MORE = Between [1.0, ANY] 0.0: "At least one contact.";
    LATE = Between [0.5, 1.2] 0.0: "In the second half of the nominal contact, or after it.";
    NONE = Between [0.0, 0.0] 0.0: "Not a single one.";
    UNNOTICEABLE = Between [0.0, 5e-3] 0.0: "Half a percent is not visible in a diagram.";
    UNNOTICEABLE_RATIO = Between [0.0, 0.01] 0.0: "A hundredth of the range.";
    MAGNITUDE = Between [10.0, 1000.0] 0.0: "Tens to hundreds of newtons.";
}
