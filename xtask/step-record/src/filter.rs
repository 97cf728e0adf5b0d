//! The samples through which the filters of the body rate are measured: the same on host and target, from a seed.

use ctrl_core::filter::{LowPassConfig, NotchConfig, RateFilterConfig};
use ctrl_core::list::List;
use glam::Vec3;

use super::Record;

/// Time between two samples (s).
pub const STEP_PERIOD: f32 = 1e-3;
/// Samples through each filter.
pub const SAMPLES: usize = 400;

const LOW_PASS: LowPassConfig = LowPassConfig { frequency: 80.0, quality: 0.707 };

/// The measured filters, each with its number of sections: a low-pass, and that with all notches.
#[must_use]
pub fn filters() -> [(usize, RateFilterConfig); 2] {
    let notch = |frequency| NotchConfig { frequency, quality: 4.0 };
    let notches = List::taking([90.0, 180.0, 270.0].map(notch).into_iter());
    let alone = RateFilterConfig { low_pass: Some(LOW_PASS), ..RateFilterConfig::default() };
    [(1, alone), (4, RateFilterConfig { notches, ..alone })]
}

/// Rates of a vehicle that shakes: uniform noise.
pub fn rates() -> impl Iterator<Item = Vec3> {
    let mut bits = 0x9E37_79B9_7F4A_7C15u64;
    let mut number = move || {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
    };
    (0..SAMPLES).map(move |_| Vec3::new(number(), number(), number()))
}

/// Bits of a filtered rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilterAnswer(pub [u32; 3]);

impl FilterAnswer {
    /// Those of `rate`.
    #[must_use]
    pub fn new(rate: Vec3) -> Self {
        Self(rate.to_array().map(f32::to_bits))
    }
}

impl Record for FilterAnswer {
    fn zero() -> Self {
        Self([0; 3])
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        self.0.iter_mut().for_each(word);
    }
}
