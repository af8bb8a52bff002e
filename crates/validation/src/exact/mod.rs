//! Exact solutions from formulas. Nothing here depends on the solver.

pub mod beam;
pub mod elastica;
pub mod held;
pub mod impact;
pub mod pendulum;
pub mod pressed;
pub mod rotating_beam;
pub mod taper;

/// A zero of `f` between `low` and `high`, to rounding; NaN if `f` has the same sign at both.
fn zero(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rises = f(low) < 0.0;
    if rises == (f(high) < 0.0) {
        return f64::NAN;
    }
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return middle;
        }
        if (f(middle) < 0.0) == rises {
            low = middle;
        } else {
            high = middle;
        }
    }
}
