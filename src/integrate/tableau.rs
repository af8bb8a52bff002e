//! Coefficients of the implicit Runge–Kutta methods.

use std::f64::consts::SQRT_2;

/// An ESDIRK method: explicit first stage, one diagonal coefficient, stiffly accurate (`b` is the
/// last row of `A`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Order of the step.
    pub order: u32,
    /// Order of the embedded method.
    pub embedded_order: u32,
    /// Diagonal coefficient `γ`.
    pub gamma: f64,
    /// Rows of `A` below the first, without the diagonal.
    pub a: &'static [&'static [f64]],
    /// Weights of the embedded method.
    pub embedded: &'static [f64],
}

impl Tableau {
    /// Returns the number of stages, the explicit one included.
    pub fn stages(&self) -> usize {
        self.a.len() + 1
    }

    /// Returns `A_ij`.
    pub fn coefficient(&self, i: usize, j: usize) -> f64 {
        match (i, j) {
            (0, _) => 0.0,
            (i, j) if i == j => self.gamma,
            (i, j) => self.a[i - 1].get(j).copied().unwrap_or(0.0),
        }
    }

    /// Returns the weight `b_j` of the step.
    pub fn weight(&self, j: usize) -> f64 {
        self.coefficient(self.stages() - 1, j)
    }

    /// Returns the weight `b̂_j − b_j` of the embedded error estimate.
    pub fn error_weight(&self, j: usize) -> f64 {
        self.embedded[j] - self.weight(j)
    }

    /// Returns the node `c_i = Σ_j A_ij`.
    pub fn node(&self, i: usize) -> f64 {
        (0..=i).map(|j| self.coefficient(i, j)).sum()
    }
}

/// TR-BDF2 (Bank et al., IEEE Transactions on Electron Devices 32, 1985) with embedded weights of
/// Hosea and Shampine (Applied Numerical Mathematics 20, 1996): order 2, L-stable, stage order 2.
///
/// The embedded method is of order 3. It is not stable by itself, but gives an error estimate of
/// integrals over the step.
pub const TR_BDF2: Tableau = {
    const OWN: f64 = 0.5 * (2.0 - SQRT_2);
    const OTHERS: f64 = 0.25 * SQRT_2;
    Tableau {
        order: 2,
        embedded_order: 3,
        gamma: OWN,
        a: &[&[OWN], &[OTHERS, OTHERS]],
        embedded: &[(1.0 - OTHERS) / 3.0, (1.0 + 3.0 * OTHERS) / 3.0, OWN / 3.0],
    }
};

/// `ESDIRK5(4)7L[2]SA2` of Kennedy and Carpenter (Applied Numerical Mathematics 146, 2019): order
/// 5, L-stable, stage order 2.
pub const ESDIRK54: Tableau = {
    const A2: f64 = 791_020_047_304.0 / 3_561_426_431_547.0;
    const A3: f64 = -158_159_076_358.0 / 11_257_294_102_345.0;
    const A4: f64 = -1_653_327_111_580.0 / 4_048_416_487_981.0;
    const A5: f64 = -4_540_011_970_825.0 / 8_418_487_046_959.0;
    const A6: f64 = -188_593_204_321.0 / 4_778_616_380_481.0;
    const E0: f64 = -582_099_335_757.0 / 7_214_068_459_310.0;
    Tableau {
        order: 5,
        embedded_order: 4,
        gamma: 23.0 / 125.0,
        a: &[
            &[23.0 / 125.0],
            &[A2, A2],
            &[A3, A3, -85_517_644_447.0 / 5_003_708_988_389.0],
            &[
                A4,
                A4,
                1_514_767_744_496.0 / 9_099_671_765_375.0,
                14_283_835_447_591.0 / 12_247_432_691_556.0,
            ],
            &[
                A5,
                A5,
                -1_790_937_573_418.0 / 7_393_406_387_169.0,
                10_819_093_665_085.0 / 7_266_595_846_747.0,
                4_109_463_131_231.0 / 7_386_972_500_302.0,
            ],
            &[
                A6,
                A6,
                2_809_310_203_510.0 / 10_304_234_040_467.0,
                1_021_729_336_898.0 / 2_364_210_264_653.0,
                870_612_361_811.0 / 2_470_410_392_208.0,
                -1_307_970_675_534.0 / 8_059_683_598_661.0,
            ],
        ],
        embedded: &[
            E0,
            E0,
            615_023_338_567.0 / 3_362_626_566_945.0,
            3_192_122_436_311.0 / 6_174_152_374_399.0,
            6_156_034_052_041.0 / 14_430_468_657_929.0,
            -1_011_318_518_279.0 / 9_693_750_372_484.0,
            1_914_490_192_573.0 / 13_754_262_428_401.0,
        ],
    }
};

#[cfg(test)]
mod tests {
    use super::*;

    const METHODS: [(&str, Tableau); 2] = [("TR-BDF2", TR_BDF2), ("ESDIRK5(4)", ESDIRK54)];

    /// Returns the order conditions of trees up to order 5, as (order, left side, right side).
    fn order_conditions(tableau: &Tableau, b: &dyn Fn(usize) -> f64) -> Vec<(u32, f64, f64)> {
        let stages = tableau.stages();
        let a = |x: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..stages)
                .map(|i| (0..=i).map(|j| tableau.coefficient(i, j) * x(j)).sum())
                .collect()
        };
        let c = |power: i32| move |i: usize| tableau.node(i).powi(power);
        let (ac, ac2, ac3) = (a(&c(1)), a(&c(2)), a(&c(3)));
        let (aac, aac2) = (a(&|i| ac[i]), a(&|i| ac2[i]));
        let (aaac, acac) = (a(&|i| aac[i]), a(&|i| c(1)(i) * ac[i]));
        let sum = |x: &dyn Fn(usize) -> f64| (0..stages).map(|i| b(i) * x(i)).sum::<f64>();
        vec![
            (1, sum(&|_| 1.0), 1.0),
            (2, sum(&c(1)), 1.0 / 2.0),
            (3, sum(&c(2)), 1.0 / 3.0),
            (3, sum(&|i| ac[i]), 1.0 / 6.0),
            (4, sum(&c(3)), 1.0 / 4.0),
            (4, sum(&|i| c(1)(i) * ac[i]), 1.0 / 8.0),
            (4, sum(&|i| ac2[i]), 1.0 / 12.0),
            (4, sum(&|i| aac[i]), 1.0 / 24.0),
            (5, sum(&c(4)), 1.0 / 5.0),
            (5, sum(&|i| c(2)(i) * ac[i]), 1.0 / 10.0),
            (5, sum(&|i| ac[i] * ac[i]), 1.0 / 20.0),
            (5, sum(&|i| c(1)(i) * ac2[i]), 1.0 / 15.0),
            (5, sum(&|i| c(1)(i) * aac[i]), 1.0 / 30.0),
            (5, sum(&|i| ac3[i]), 1.0 / 20.0),
            (5, sum(&|i| acac[i]), 1.0 / 40.0),
            (5, sum(&|i| aac2[i]), 1.0 / 60.0),
            (5, sum(&|i| aaac[i]), 1.0 / 120.0),
        ]
    }

    #[test]
    fn order_conditions_hold() {
        for (name, tableau) in METHODS {
            let step: Vec<f64> = (0..tableau.stages()).map(|i| tableau.weight(i)).collect();
            for (order, weights) in [
                (tableau.order, &step[..]),
                (tableau.embedded_order, tableau.embedded),
            ] {
                for (tree, left, right) in order_conditions(&tableau, &|i| weights[i]) {
                    let holds = (left - right).abs() < 1e-12;
                    assert!(
                        holds || tree > order,
                        "{}: order {tree}: {left} {right}",
                        name
                    );
                }
            }
        }
    }

    #[test]
    fn stages_are_consistent_to_second_order() {
        for (name, tableau) in METHODS {
            for i in 1..tableau.stages() {
                let sum: f64 = (0..=i)
                    .map(|j| tableau.coefficient(i, j) * tableau.node(j))
                    .sum();
                assert!(
                    (sum - tableau.node(i).powi(2) / 2.0).abs() < 1e-13,
                    "{} stage {i}",
                    name
                );
            }
            assert!((tableau.node(tableau.stages() - 1) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn stiff_components_vanish_in_one_step() {
        // R(z) = b-row of (I − zA)⁻¹ 1 for z → −∞, by forward substitution.
        for (name, tableau) in METHODS {
            let z = -1e9;
            let mut stages: Vec<f64> = vec![1.0];
            for i in 1..tableau.stages() {
                let sum: f64 = stages
                    .iter()
                    .enumerate()
                    .map(|(j, y)| tableau.coefficient(i, j) * y)
                    .sum();
                stages.push((1.0 + z * sum) / (1.0 - z * tableau.gamma));
            }
            assert!(stages.last().unwrap().abs() < 1e-7, "{}: {stages:?}", name);
        }
    }
}
