//! Measured forces on the page of a study: a table with the simulated ones, and marks on map and
//! curve.

use crate::insight::measured::{
    ComparedPoint, ForceComparison, ForceDeviation, Missing, SimulatedForce,
};
use bristle::model::parameters::Parameter;
use bristle_study::grid::{DEPTH, SPEED, Study, VELOCITY};
use bristle_study::input::measured::{Measurement, Speed};
use serde_json::{Value, json};

use super::packed::rounded;

/// Maximum numbers of comparisons on a page, and of points in each.
const MAX_SHOWN: (usize, usize) = (4, 100);

/// Returns measured and simulated forces for the script; `null` without any.
pub(super) fn measured_data(study: &Study, comparisons: &[ForceComparison]) -> Value {
    let Some(first) = comparisons
        .first()
        .and_then(|comparison| comparison.points.first())
    else {
        return Value::Null;
    };
    let speed = match first.measured.speed {
        Speed::Velocity(_) => VELOCITY,
        Speed::Rotational(_) => SPEED,
    };
    let column = |path: &str| {
        let &Parameter {
            symbol, name, unit, ..
        } = Parameter::find(path).expect("the table has speeds and depth");
        json!({ "symbol": symbol, "name": name, "unit": unit })
    };
    json!({
        "speed": column(speed),
        "depth": column(DEPTH),
        "comparisons": comparisons.iter().take(MAX_SHOWN.0).map(|each| comparison_data(study, each)).collect::<Vec<_>>(),
        "left_out": comparisons.len().saturating_sub(MAX_SHOWN.0),
    })
}

fn comparison_data(study: &Study, comparison: &ForceComparison) -> Value {
    let ForceComparison {
        fixed,
        condition,
        points,
    } = comparison;
    // The value on each axis of the study. An axis with a single value does not distinguish points.
    let on_axis = |point: &ComparedPoint, path: &str| match path {
        DEPTH => Some(point.measured.penetration_depth_m),
        _ if path == study.speed().path => Some(point.across),
        _ => fixed
            .iter()
            .find(|(other, _)| other.path() == path)
            .map(|(_, value)| *value),
    };
    let point_data = |point: &ComparedPoint| {
        let Measurement {
            speed,
            penetration_depth_m,
            force_n,
            std_n,
            ..
        } = point.measured;
        let at = study
            .sweeps()
            .iter()
            .map(|axis| on_axis(point, axis.path()))
            .collect::<Vec<_>>();
        let simulated = |value: fn(SimulatedForce) -> f64| {
            point
                .simulated
                .ok()
                .map(|simulated| rounded(value(simulated)))
        };
        json!({
            "at": at,
            "speed": speed.value(),
            "depth": penetration_depth_m,
            "force": force_n,
            "std": std_n,
            "simulated": simulated(|simulated| simulated.force_n),
            "uncertainty": simulated(|simulated| simulated.uncertainty_n),
            "within": point.is_within(),
            "missing": point.simulated.err().map(Missing::name),
            "outside": point.simulated.err() == Some(Missing::Outside),
        })
    };
    let deviation = comparison.deviation().map(|ForceDeviation { count, bias_n, rmse_n, within }| {
        json!({ "count": count, "bias": rounded(bias_n), "rmse": rounded(rmse_n), "within": within })
    });
    json!({
        "condition": condition,
        "count": points.len(),
        "points": points.iter().take(MAX_SHOWN.1).map(point_data).collect::<Vec<_>>(),
        "deviation": deviation,
    })
}
