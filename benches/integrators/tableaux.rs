//! ESDIRK methods that the library does not have.

use bristle::integrate::tableau::Tableau;

/// TR-BDF2 with the embedded method of order 3 (Hosea and Shampine, Applied Numerical Mathematics 20, 1996).
pub const TR_BDF2: Tableau = {
    const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
    const W: f64 = std::f64::consts::SQRT_2 / 4.0;
    Tableau {
        name: "TR-BDF2",
        order: 2,
        gamma: GAMMA,
        a: &[&[GAMMA], &[W, W]],
        embedded: &[(1.0 - W) / 3.0, (3.0 * W + 1.0) / 3.0, GAMMA / 3.0],
    }
};

/// The implicit part of ARK3(2)4L[2]SA (Kennedy and Carpenter, Applied Numerical Mathematics 44, 2003).
pub const ESDIRK32: Tableau = Tableau {
    name: "ESDIRK3(2)4L[2]SA",
    order: 3,
    gamma: 1_767_732_205_903.0 / 4_055_673_282_236.0,
    a: &[
        &[1_767_732_205_903.0 / 4_055_673_282_236.0],
        &[2_746_238_789_719.0 / 10_658_868_560_708.0, -640_167_445_237.0 / 6_845_629_431_997.0],
        &[
            1_471_266_399_579.0 / 7_840_856_788_654.0,
            -4_482_444_167_858.0 / 7_529_755_066_697.0,
            11_266_239_266_428.0 / 11_593_286_722_821.0,
        ],
    ],
    embedded: &[
        2_756_255_671_327.0 / 12_835_298_489_170.0,
        -10_771_552_573_575.0 / 22_201_958_757_719.0,
        9_247_589_265_047.0 / 10_645_013_368_117.0,
        2_193_209_047_091.0 / 5_459_859_503_100.0,
    ],
};
