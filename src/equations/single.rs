//! One number as a [`Real`].

use super::real::larger;
use super::{LaneSet, Lanes, Lanewise, Real, elementary};

impl Real for f64 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn sin(self) -> Self {
        elementary::sin_cos(self).0
    }

    #[inline(always)]
    fn cos(self) -> Self {
        elementary::sin_cos(self).1
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }

    /// Computes four segments at a time, in vectors.
    #[inline(always)]
    fn sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 4]]) {
        for (q, angles) in q.chunks(4).zip(angles.chunks_mut(4)) {
            let mut block = [0.0; 8];
            block[..2 * q.len()].copy_from_slice(q.as_flattened());
            let (Lanes(sines), Lanes(cosines)) = Lanes(block).sin_cos();
            for (k, angles) in angles.iter_mut().enumerate() {
                *angles = [
                    sines[2 * k],
                    cosines[2 * k],
                    sines[2 * k + 1],
                    cosines[2 * k + 1],
                ];
            }
        }
    }

    /// Computes eight segments at a time.
    #[inline(always)]
    fn azimuthal_sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 2]]) {
        for (q, angles) in q.chunks(8).zip(angles.chunks_mut(8)) {
            let mut block = [0.0; 8];
            for (entry, [_, azimuth]) in block.iter_mut().zip(q) {
                *entry = *azimuth;
            }
            let (Lanes(sines), Lanes(cosines)) = Lanes(block).sin_cos();
            for (k, angles) in angles.iter_mut().enumerate() {
                *angles = [sines[k], cosines[k]];
            }
        }
    }

    #[inline(always)]
    fn asin(self) -> Self {
        self.asin()
    }

    #[inline(always)]
    fn exp(self) -> Self {
        self.exp()
    }

    #[inline(always)]
    fn ln(self) -> Self {
        self.ln()
    }

    #[inline(always)]
    fn tanh(self) -> Self {
        self.tanh()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        self.atan2(x)
    }

    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        self.powf(exponent)
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> Self {
        Self::from(u8::from(self < other))
    }

    #[inline(always)]
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self {
        elementary::half_angle_squared::<ORDER>(u)
    }
}

impl Lanewise for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn set_lane(&mut self, _: usize, value: f64) {
        *self = value;
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        larger(self, other)
    }

    #[inline(always)]
    fn select(self, lanes: LaneSet, other: Self) -> Self {
        if lanes.contains(0) { self } else { other }
    }
}
