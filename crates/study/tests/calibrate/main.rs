//! Tests of calibrations through their public interface.

mod forces;
mod radii;

use bristle::simulation::Stop;
use bristle_study::calibrate::{Calibration, CalibrationContext, Fitted, SilentObserver};
use bristle_study::grid::Resources;

/// Returns the settings with these keys, within the bounds that they state.
fn fitted(keys: &[&str]) -> Vec<Fitted> {
    keys.iter()
        .map(|key| Fitted::parse(key).expect("a setting"))
        .collect()
}

/// Returns the largest change of a fitted point when it is simulated with more precision.
fn change_when_checked(calibration: &Calibration) -> f64 {
    let (stop, observer) = (Stop::default(), SilentObserver);
    let means = CalibrationContext {
        resources: Resources::default(),
        stop: &stop,
        observer: &observer,
        starts: 0,
    };
    calibration.change_when_checked(means).expect("a check")
}
