//! Means of correlated values, and their standard error by batch means (Flegal and Jones, Annals of
//! Statistics 38, 2010): columns of a brush, and turns of a filament.

use spec_math::cephes64::fdtrc;

/// Batch means are equal if they differ from the mean by less than this share of the tolerance.
const EQUAL_SHARE: f64 = 1.0 / 3.0;
/// Significance level above which batch means differ by chance.
const SIGNIFICANCE: f64 = 0.01;

/// Values in batches of equal size. Values left over by division, at the front, are in none.
pub(crate) struct Batches {
    mean: f64,
    /// Mean of each batch.
    means: Vec<f64>,
    /// Number of values of a batch.
    size: usize,
    /// Sum of the squared deviations of values from the means of their batches.
    within: f64,
}

impl Batches {
    /// Divides `values` into batches.
    pub fn new(values: &[f64]) -> Self {
        let size = values.len().isqrt().max(1);
        let batches = values.rchunks_exact(size);
        let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let means: Vec<f64> = batches.clone().map(mean_of).collect();
        let within = batches
            .zip(&means)
            .flat_map(|(batch, mean)| batch.iter().map(move |value| (value - mean).powi(2)))
            .sum();
        Self {
            mean: mean_of(values),
            means,
            size,
            within,
        }
    }

    /// Returns `true` if all batch means equal the mean, to a share of the `tolerance`.
    pub fn are_equal(&self, tolerance: f64) -> bool {
        let allowed = EQUAL_SHARE * tolerance * self.mean;
        self.means
            .iter()
            .all(|mean| (mean - self.mean).abs() <= allowed)
    }

    /// Returns the sum of the squared deviations of the batch means.
    fn between(&self) -> f64 {
        let mean = self.means.iter().sum::<f64>() / self.means.len() as f64;
        self.means.iter().map(|of| (of - mean).powi(2)).sum()
    }

    /// Returns `true` if the means differ by chance only: a one-way analysis of variance.
    pub fn have_no_trend(&self) -> bool {
        let count = self.means.len() as f64;
        let [between, within] = [count - 1.0, count * (self.size as f64 - 1.0)];
        let ratio = self.size as f64 * self.between() / between / (self.within / within);
        ratio.is_finite() && fdtrc(between, within, ratio) > SIGNIFICANCE
    }

    /// Returns the relative standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        let count = self.means.len() as f64;
        if count < 2.0 || self.mean <= 0.0 {
            return 0.0;
        }
        (self.between() / (count - 1.0) / count).sqrt() / self.mean
    }

    /// Returns the largest difference of two means, over the mean.
    pub fn largest_difference(&self) -> f64 {
        let [least, most] = self
            .means
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mean| {
                [mean.min(least), mean.max(most)]
            });
        if self.mean > 0.0 {
            (most - least) / self.mean
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns values that decay to a mean of one, and alternate about it.
    fn values(decay: f64, alternation: f64) -> Vec<f64> {
        let value =
            |k: i32| 1.0 + decay * 0.9_f64.powi(k) + alternation * f64::from(1 - 2 * (k % 2));
        (0..64).map(value).collect()
    }

    #[test]
    fn a_decay_is_a_trend_and_an_alternation_is_none() {
        let batches = |decay, alternation| Batches::new(&values(decay, alternation));
        assert!(!batches(0.1, 0.0).have_no_trend() && !batches(0.1, 0.0).are_equal(1e-3));
        assert!(batches(0.0, 0.1).have_no_trend() && batches(0.0, 0.1).are_equal(1e-3));
        assert!(batches(1e-4, 0.0).are_equal(1e-3) && !batches(1e-4, 0.0).have_no_trend());
    }

    /// Independent values: `σ/√n`.
    #[test]
    fn the_standard_error_of_independent_values_follows_from_their_deviation() {
        let mut random = fastrand::Rng::with_seed(1);
        let values: Vec<f64> = (0..10_000)
            .map(|_| 1.0 + 0.1 * (random.f64() - 0.5))
            .collect();
        let expected = 0.1 / 12.0_f64.sqrt() / 100.0;
        let error = Batches::new(&values).standard_error();
        assert!((error / expected - 1.0).abs() < 0.2, "{error} {expected}");
    }
}
