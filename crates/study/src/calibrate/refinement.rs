//! The minimum of a coarse search, refined: with precise derivatives, past kinks of forces, and with
//! filaments that touch.

use nalgebra::DVector;

use crate::calibrate::model::Model;
use crate::calibrate::search::{self, Minimum};
use crate::calibrate::simulator::{Interrupted, Precision};
use crate::calibrate::{FINE, MIDDLE};

/// Precision with interaction. Brushes keep their own tolerance, by default 1e-3 of the impulse.
const OF_BRUSHES: Precision = Precision {
    step: 0.05,
    interacts: true,
    arrival: 1e-2,
    ..FINE
};
/// Largest number of rounds in which the effect of interaction follows the settings.
const MAX_INTERACTION_ROUNDS: usize = 4;
/// Change of a coordinate below which these rounds end.
const SETTLED_CHANGE: f64 = 2e-3;
/// Relative error of derivatives from which on a kink of a force is nearby, and the step of
/// derivatives that look past kinks.
const MIN_KINK_ERROR: f64 = 5e-3;
const STEP_PAST_KINKS: f64 = 0.03;
/// Distance of the minimum from the point of the derivatives, over the standard error, beyond which
/// they are computed anew. The second number limits how often.
const MAX_JACOBIAN_DISTANCE: f64 = 0.5;
const MAX_JACOBIAN_ROUNDS: usize = 5;

/// Refines the minimum of filaments alone, and returns it with its Jacobian and the error of this.
/// Where the error shows that a contact begins or ends nearby, a lower minimum beyond takes its
/// place, if there is one.
pub(super) fn precise(
    model: &Model<'_>,
    mut best: Minimum,
) -> Result<Option<(Minimum, f64)>, Interrupted> {
    let mut found = None;
    for _ in 0..MAX_JACOBIAN_ROUNDS {
        let Some(at) = search::evaluated(model, vec![best.x], FINE)?
            .pop()
            .filter(|at| at.squares.is_finite())
        else {
            return Ok(found);
        };
        if found
            .as_ref()
            .is_some_and(|(lowest, _): &(Minimum, f64)| at.squares >= lowest.squares)
        {
            break;
        }
        let Some((end, error, moved)) = exact(model, at, FINE)? else {
            break;
        };
        found = Some((end.clone(), error));
        best = end;
        if moved > MAX_JACOBIAN_DISTANCE {
            continue;
        }
        if error < MIN_KINK_ERROR {
            break;
        }
        let wide = model.jacobians(
            &[(&best.x, &best.forces)],
            Precision {
                step: STEP_PAST_KINKS,
                central: true,
                ..MIDDLE
            },
        )?;
        let Some(lower) = search::lower(model, &best, &wide[0], MIDDLE)? else {
            break;
        };
        best = lower;
    }
    Ok(found)
}

/// Computes a precise Jacobian at a point near a minimum, and descends with it. Returns the
/// minimum, the error of the Jacobian, and the distance over the standard error in its direction.
/// `None` if points around this one cannot be simulated.
fn exact(
    model: &Model<'_>,
    at: Minimum,
    precision: Precision,
) -> Result<Option<(Minimum, f64, f64)>, Interrupted> {
    let (jacobian, error) = model.precise_jacobian(&at.x, &at.forces, precision)?;
    if !jacobian.iter().all(|derivative| derivative.is_finite()) {
        return Ok(None);
    }
    let end = search::descended(
        model,
        vec![Minimum {
            jacobian,
            ..at.clone()
        }],
        precision,
    )?
    .pop();
    let end = end.expect("it begins where it can be simulated");
    let step = DVector::from_iterator(
        at.x.len(),
        end.x.iter().zip(&at.x).map(|(end, at)| end - at),
    );
    let moved = (&end.jacobian * step).norm() / model.unit(end.squares).sqrt();
    Ok(Some((end, error, moved)))
}

/// Finds the minimum with filaments that touch from that of filaments alone, with the Jacobian
/// there and its error. Forces of filaments alone, times the effect of interaction at the last
/// estimate, lead near it. Descents with interaction follow.
pub(super) fn interacting(
    model: &mut Model<'_>,
    mut minimum: Minimum,
) -> Result<(Minimum, f64), Interrupted> {
    for _ in 0..MAX_INTERACTION_ROUNDS {
        follow_interaction(model, &minimum.x)?;
        let Some(next) = search::refined(model, vec![minimum.clone()], MIDDLE)?.pop() else {
            break;
        };
        let moved = next
            .x
            .iter()
            .zip(&minimum.x)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        minimum = next;
        if moved < SETTLED_CHANGE {
            break;
        }
    }
    let near = search::refined(model, vec![minimum], OF_BRUSHES)?
        .pop()
        .ok_or_else(|| model.simulator.failure())?;
    let (minimum, error, _) =
        exact(model, near, OF_BRUSHES)?.ok_or_else(|| model.simulator.failure())?;
    follow_interaction(model, &minimum.x)?;
    Ok((minimum, error))
}

/// Updates the effect of interaction at `x`.
fn follow_interaction(model: &mut Model<'_>, x: &[f64]) -> Result<(), Interrupted> {
    model.factors.fill(1.0);
    let points = [x.to_vec()];
    let with = model.forces(&points, OF_BRUSHES)?;
    if with[0].iter().any(|force| !force.is_finite()) {
        return Err(model.simulator.failure());
    }
    let without = model.forces(&points, MIDDLE)?;
    for ((factor, with), without) in model.factors.iter_mut().zip(&with[0]).zip(&without[0]) {
        *factor = if *without != 0.0 && (with / without).is_finite() {
            with / without
        } else {
            1.0
        };
    }
    Ok(())
}
