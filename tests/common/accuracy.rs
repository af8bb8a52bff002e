//! Errors of the metrics of a contact, against those of an independent code. (`examples/accuracy.rs` uses it too.)

use bristle::metrics::Metrics;
use serde::Deserialize;

/// The metrics whose errors are measured: symbols of `docs/MODEL.md`.
pub const SYMBOLS: [&str; 6] = ["p_n", "F_n,w", "s_n,max", "max F_n", "t_c", "ε_tc"];

/// A row of `tests/data/reference_contacts*.csv`.
#[derive(Clone, Debug, Deserialize)]
pub struct ReferenceContact {
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    contact_time_s: f64,
    contact_time_ratio: f64,
    pub contact_count: usize,
    contact_normal_impulse_n_s: f64,
    peak_contact_normal_force_n: f64,
    max_tip_deflection_m: f64,
    tool_contact_normal_force_n: f64,
}

impl ReferenceContact {
    /// The rows of a file.
    pub fn read(text: &str) -> Vec<Self> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        reader.deserialize().collect::<Result<_, _>>().expect("the file has the metric columns")
    }

    /// Brushing velocity in m/s and penetration depth in m.
    pub fn case(&self) -> (f64, f64) {
        (self.brushing_velocity_m_s, self.penetration_depth_m)
    }

    /// The metrics in the order of [`SYMBOLS`].
    fn values(&self) -> [f64; 6] {
        [
            self.contact_normal_impulse_n_s,
            self.tool_contact_normal_force_n,
            self.max_tip_deflection_m,
            self.peak_contact_normal_force_n,
            self.contact_time_s,
            self.contact_time_ratio,
        ]
    }

    /// How far `metrics` are off, relative, in the order of [`SYMBOLS`].
    pub fn errors(&self, metrics: &Metrics) -> [f64; 6] {
        self.deviations([
            metrics.contact_normal_impulse_n_s,
            metrics.tool_contact_normal_force_n,
            metrics.max_tip_deflection_m,
            metrics.peak_contact_normal_force_n,
            metrics.contact_time_s,
            metrics.contact_time_ratio,
        ])
    }

    /// How far `other` is off, relative, in the order of [`SYMBOLS`].
    pub fn distances(&self, other: &Self) -> [f64; 6] {
        self.deviations(other.values())
    }

    fn deviations(&self, values: [f64; 6]) -> [f64; 6] {
        let expected = self.values();
        std::array::from_fn(|i| (values[i] / expected[i] - 1.0).abs())
    }
}

/// The larger of both, metric by metric.
pub fn worse(first: [f64; 6], second: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| first[i].max(second[i]))
}
