//! Zeros and maxima of functions of one variable, on a step.

/// Finds a zero of `f` between `low`, where it is negative, and `high`, where it is positive
/// (Illinois method).
pub(super) fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut below, mut above) = (f(low), f(high));
    let mut middle = high;
    let mut last_side = 0;
    for _ in 0..60 {
        middle = (low * above - high * below) / (above - below);
        if !(middle > low && middle < high) {
            return if middle.is_finite() {
                middle.clamp(low, high)
            } else {
                high
            };
        }
        let value = f(middle);
        if value > 0.0 {
            (high, above) = (middle, value);
            if last_side == 1 {
                below /= 2.0;
            }
            last_side = 1;
        } else {
            (low, below) = (middle, value);
            if last_side == -1 {
                above /= 2.0;
            }
            last_side = -1;
        }
        if high - low < 1e-14 {
            break;
        }
    }
    middle
}

/// Finds the maximum of `f` between `low` and `high`: its place, to some 1e-6, and its value. Brent
/// (1973, chapter 5) takes parabolas through the best three points, and golden sections where
/// parabolas make no progress.
pub(super) fn maximise(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    const PLACE_TOLERANCE: f64 = 1e-6;
    const MAX_ITERATIONS: usize = 60;
    let golden = (3.0 - 5.0_f64.sqrt()) / 2.0;
    let mut best = low + golden * (high - low);
    let mut at_best = f(best);
    let (mut second, mut at_second, mut third, mut at_third) = (best, at_best, best, at_best);
    let (mut change, mut last_change) = (0.0_f64, 0.0_f64);
    for _ in 0..MAX_ITERATIONS {
        let middle = (low + high) / 2.0;
        if (best - middle).abs() <= 2.0 * PLACE_TOLERANCE - (high - low) / 2.0 {
            break;
        }
        // The vertex of the parabola, as an offset `above/below` from the best point.
        let r = (best - second) * (at_best - at_third);
        let q = (best - third) * (at_best - at_second);
        let mut above = (best - third) * q - (best - second) * r;
        let mut below = 2.0 * (q - r);
        if below > 0.0 {
            above = -above;
        }
        below = below.abs();
        let limit = last_change;
        last_change = change;
        let inside = above > below * (low - best) && above < below * (high - best);
        if inside && above.abs() < (below * limit / 2.0).abs() {
            change = above / below;
        } else {
            last_change = if best < middle {
                high - best
            } else {
                low - best
            };
            change = golden * last_change;
        }
        let point = if change.abs() >= PLACE_TOLERANCE {
            best + change
        } else {
            best + PLACE_TOLERANCE.copysign(change)
        };
        let value = f(point);
        if value >= at_best {
            if point >= best {
                low = best
            } else {
                high = best
            }
            (third, at_third) = (second, at_second);
            (second, at_second) = (best, at_best);
            (best, at_best) = (point, value);
        } else {
            if point < best {
                low = point
            } else {
                high = point
            }
            if value >= at_second || second == best {
                (third, at_third) = (second, at_second);
                (second, at_second) = (point, value);
            } else if value >= at_third || third == best || third == second {
                (third, at_third) = (point, value);
            }
        }
    }
    (best, at_best)
}

/// Returns the largest value of a smooth `f` on a step, or `least` if that is larger.
pub(super) fn maximum_in_step(f: impl Fn(f64) -> f64, least: f64) -> f64 {
    /// Distance from an end of the step, over its length, at which the slope there is checked.
    const END_DISTANCE: f64 = 1e-4;
    // Between samples a parabola rises by no more than the difference of the samples.
    let is_low = |samples: &[f64]| {
        let [smallest, largest] =
            [f64::min, f64::max].map(|pick| samples.iter().copied().reduce(pick).unwrap_or(least));
        largest + (largest - smallest) <= least
    };
    let [start, middle, end] = [0.0, 0.5, 1.0].map(&f);
    if is_low(&[start, middle, end]) {
        return least;
    }
    let samples = [start, f(0.25), middle, f(0.75), end];
    if is_low(&samples) {
        return least;
    }
    let (best, &value) = samples
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(b.1))
        .expect("there are samples");
    let nothing_higher = match best {
        0 => f(END_DISTANCE) < value,
        4 => f(1.0 - END_DISTANCE) < value,
        _ => {
            // The vertex of the parabola through the best sample and its neighbours, with a margin
            // for deviations from a parabola.
            let (before, after) = (samples[best - 1], samples[best + 1]);
            let rise = (after - before).powi(2) / (8.0 * (2.0 * value - before - after));
            value + 4.0 * rise <= least
        }
    };
    if nothing_higher {
        return least.max(value);
    }
    let centre = best as f64 / 4.0;
    let (_, peak) = maximise(&f, (centre - 0.25).max(0.0), (centre + 0.25).min(1.0));
    least.max(value).max(peak)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn zeros_are_found() {
        for (f, expected) in [
            ((|x: f64| x * x - 0.3) as fn(f64) -> f64, 0.3_f64.sqrt()),
            (|x| (x - 0.2).powi(3), 0.2),
            (|x| x.exp() - 2.0, 2.0_f64.ln()),
        ] {
            assert!((root(f, 0.0, 1.0) - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn maxima_are_found_in_few_steps() {
        for (f, expected) in [
            ((|x: f64| -(x - 0.3).powi(2)) as fn(f64) -> f64, 0.3),
            (|x| (3.0 * x).sin(), std::f64::consts::FRAC_PI_6),
            (|x| -(x - 0.7).abs(), 0.7),
            (|x| x, 1.0),
            (|x| -x, 0.0),
        ] {
            let calls = Cell::new(0);
            let counted = |x| {
                calls.set(calls.get() + 1);
                f(x)
            };
            let (x, value) = maximise(counted, 0.0, 1.0);
            assert!(
                (x - expected).abs() < 1e-5 && (value - f(expected)).abs() < 1e-5,
                "{x} {expected}"
            );
            assert!(calls.get() < 50, "{}", calls.get());
        }
        assert_eq!(
            maximum_in_step(|s| -(s - 0.6).powi(2), 1.0),
            1.0,
            "what is there already is larger"
        );
        assert!((maximum_in_step(|s| 2.0 - (s - 0.6).powi(2), 1.0) - 2.0).abs() < 1e-12);
        assert_eq!(maximum_in_step(|s| s, 0.5), 1.0);
        // A maximum next to the end.
        assert!((maximum_in_step(|s| -(s - 0.99).powi(2), -1.0)).abs() < 1e-10);
    }
}
