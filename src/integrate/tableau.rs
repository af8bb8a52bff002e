//! Coefficients of the implicit Runge–Kutta methods.

/// An ESDIRK method: explicit first stage, one diagonal coefficient, stiffly accurate (`b` is the
/// last row of `A`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Name in its source.
    pub name: &'static str,
    /// Order of the step; that of the embedded method is one less.
    pub order: u32,
    /// The diagonal coefficient `γ`.
    pub gamma: f64,
    /// Rows of `A` below the first, without the diagonal.
    pub a: &'static [&'static [f64]],
    /// Weights of the embedded method.
    pub embedded: &'static [f64],
}

impl Tableau {
    /// Number of stages, the explicit one included.
    pub fn stages(&self) -> usize {
        self.a.len() + 1
    }

    /// `A_ij`
    pub fn coefficient(&self, i: usize, j: usize) -> f64 {
        match (i, j) {
            (0, _) => 0.0,
            (i, j) if i == j => self.gamma,
            (i, j) => self.a[i - 1].get(j).copied().unwrap_or(0.0),
        }
    }

    /// Weight `b_j` of the step.
    pub fn weight(&self, j: usize) -> f64 {
        self.coefficient(self.stages() - 1, j)
    }

    /// Node `c_i = Σ_j A_ij`.
    pub fn node(&self, i: usize) -> f64 {
        (0..=i).map(|j| self.coefficient(i, j)).sum()
    }
}

/// `ESDIRK4(3)6L[2]SA_2` of Kennedy and Carpenter (Applied Numerical Mathematics 146, 2019, Table
/// 9): order 4, L-stable, stage order 2.
pub const ESDIRK43: Tableau = {
    const A2: f64 = -360_286_518_617.0 / 7_014_585_480_527.0;
    const A3: f64 = -506_388_693_497.0 / 5_937_754_990_171.0;
    const A4: f64 = -7_628_305_438_933.0 / 11_061_539_393_788.0;
    const A5: f64 = -12_917_657_251.0 / 5_222_094_901_039.0;
    const E0: f64 = -1_007_911_106_287.0 / 12_117_826_057_527.0;
    Tableau {
        name: "ESDIRK4(3)6L[2]SA_2",
        order: 4,
        gamma: 31.0 / 125.0,
        a: &[
            &[31.0 / 125.0],
            &[A2, A2],
            &[A3, A3, 7_149_918_333_491.0 / 13_390_931_526_268.0],
            &[
                A4,
                A4,
                21_592_626_537_567.0 / 14_352_247_503_901.0,
                11_630_056_083_252.0 / 17_263_101_053_231.0,
            ],
            &[
                A5,
                A5,
                5_602_338_284_630.0 / 15_643_096_342_197.0,
                9_002_339_615_474.0 / 18_125_249_312_447.0,
                -2_420_307_481_369.0 / 24_731_958_684_496.0,
            ],
        ],
        embedded: &[
            E0,
            E0,
            17_694_008_993_113.0 / 35_931_961_998_873.0,
            5_816_803_040_497.0 / 11_256_217_655_929.0,
            -538_664_890_905.0 / 7_490_061_179_786.0,
            2_032_560_730_450.0 / 8_872_919_773_257.0,
        ],
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
        name: "ESDIRK5(4)7L[2]SA2",
        order: 5,
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

    /// The order conditions of trees up to order 5, as (order, left side, right side).
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
        for tableau in [ESDIRK43, ESDIRK54] {
            let step: Vec<f64> = (0..tableau.stages()).map(|i| tableau.weight(i)).collect();
            for (order, weights) in [
                (tableau.order, &step[..]),
                (tableau.order - 1, tableau.embedded),
            ] {
                for (tree, left, right) in order_conditions(&tableau, &|i| weights[i]) {
                    let holds = (left - right).abs() < 1e-12;
                    assert!(
                        holds || tree > order,
                        "{}: order {tree}: {left} {right}",
                        tableau.name
                    );
                }
            }
        }
    }

    #[test]
    fn stages_are_consistent_to_second_order() {
        for tableau in [ESDIRK43, ESDIRK54] {
            for i in 1..tableau.stages() {
                let sum: f64 = (0..=i)
                    .map(|j| tableau.coefficient(i, j) * tableau.node(j))
                    .sum();
                assert!(
                    (sum - tableau.node(i).powi(2) / 2.0).abs() < 1e-13,
                    "{} stage {i}",
                    tableau.name
                );
            }
            assert!((tableau.node(tableau.stages() - 1) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn stiff_components_vanish_in_one_step() {
        // R(z) = b-row of (I − zA)⁻¹ 1 for z → −∞, by forward substitution.
        for tableau in [ESDIRK43, ESDIRK54] {
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
            assert!(
                stages.last().unwrap().abs() < 1e-7,
                "{}: {stages:?}",
                tableau.name
            );
        }
    }
}
