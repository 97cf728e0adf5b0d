//! Controller and plant in closed loop, one control tick after the other.

use crate::sample::Sample;

/// Sees every tick of a flight.
pub trait Observer {
    /// Whether [`observe`](Self::observe) wants samples at all; without, none is put together.
    const ACTIVE: bool = true;

    /// Called once a tick, in order, before the plant moves on.
    fn observe(&mut self, sample: &Sample);
}

/// Sees nothing: the flight runs at full speed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    const ACTIVE: bool = false;

    #[inline]
    fn observe(&mut self, _: &Sample) {}
}

impl<O: Observer> Observer for &mut O {
    const ACTIVE: bool = O::ACTIVE;

    #[inline]
    fn observe(&mut self, sample: &Sample) {
        (**self).observe(sample);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    const ACTIVE: bool = A::ACTIVE || B::ACTIVE;

    #[inline]
    fn observe(&mut self, sample: &Sample) {
        self.0.observe(sample);
        self.1.observe(sample);
    }
}
