//! Tests of calibrations through their public interface.

mod forces;
mod radii;

use bristle_study::calibrate::Fitted;

/// The settings with these keys, within the bounds that they state.
fn fitted(keys: &[&str]) -> Vec<Fitted> {
    keys.iter()
        .map(|key| Fitted::parse(key).expect("a setting"))
        .collect()
}
