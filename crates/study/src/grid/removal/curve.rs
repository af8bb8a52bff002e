//! Smooth curves through points.

/// A monotone cubic interpolant (Fritsch and Butland 1984): it has a continuous derivative and
/// overshoots nowhere. Beyond its ends it is constant.
#[derive(Clone, Debug)]
pub struct MonotoneCubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slopes: Vec<f64>,
}

impl MonotoneCubic {
    /// Returns the curve through points at `x`, which ascend, with the values `y`.
    ///
    /// # Panics
    /// If there is no point, or the lengths differ.
    pub fn through(x: Vec<f64>, y: Vec<f64>) -> Self {
        assert!(
            !x.is_empty() && x.len() == y.len(),
            "points have two coordinates"
        );
        let secants: Vec<f64> = (1..x.len())
            .map(|i| (y[i] - y[i - 1]) / (x[i] - x[i - 1]))
            .collect();
        let slope = |i: usize| match (i.checked_sub(1).map(|left| secants[left]), secants.get(i)) {
            (Some(left), Some(&right)) => {
                let (a, b) = (x[i] - x[i - 1], x[i + 1] - x[i]);
                let share = (a + 2.0 * b) / (3.0 * (a + b));
                if left * right > 0.0 {
                    left * right / (share * right + (1.0 - share) * left)
                } else {
                    0.0
                }
            }
            (Some(only), None) => only,
            (None, Some(&only)) => only,
            (None, None) => 0.0,
        };
        let slopes = (0..x.len()).map(slope).collect();
        Self { x, y, slopes }
    }

    /// Returns the value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        if x <= self.x[0] || last == 0 {
            return self.y[0];
        }
        if x >= self.x[last] {
            return self.y[last];
        }
        let right = self.x.partition_point(|point| *point <= x).min(last);
        let left = right - 1;
        let h = self.x[right] - self.x[left];
        let s = (x - self.x[left]) / h;
        let r = 1.0 - s;
        self.y[left] * r * r * (1.0 + 2.0 * s)
            + self.y[right] * s * s * (3.0 - 2.0 * s)
            + h * s * r * (self.slopes[left] * r - self.slopes[right] * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_through_its_points_and_overshoots_nowhere() {
        let (x, y) = (vec![0.0, 1.0, 3.0, 4.0, 6.0], vec![1.0, 2.0, 2.0, 5.0, 0.0]);
        let curve = MonotoneCubic::through(x.clone(), y.clone());
        for (x, y) in x.iter().zip(&y) {
            assert_eq!(curve.at(*x), *y);
        }
        for i in 0..600 {
            let x = f64::from(i) / 100.0;
            let right = curve.x.partition_point(|point| *point <= x).min(4);
            let (least, largest) = (y[right - 1].min(y[right]), y[right - 1].max(y[right]));
            assert!(
                (least - 1e-12..=largest + 1e-12).contains(&curve.at(x)),
                "{x}: {}",
                curve.at(x)
            );
        }
        assert_eq!((curve.at(-1.0), curve.at(9.0)), (1.0, 0.0));
    }

    #[test]
    fn it_converges_to_a_smooth_function() {
        let error = |count: usize| {
            let x: Vec<f64> = (0..=count).map(|i| i as f64 / count as f64).collect();
            let curve = MonotoneCubic::through(x.clone(), x.iter().map(|x| x.exp()).collect());
            (0..1000)
                .map(|i| f64::from(i) / 1000.0)
                .map(|x| (curve.at(x) - x.exp()).abs())
                .fold(0.0, f64::max)
        };
        assert!(error(16) < error(8) / 3.0 && error(16) < 1e-3);
    }
}
