//! Observers of a flight.

use crate::tick::Tick;

/// Receives every tick of a flight.
pub trait Observer {
    /// Called once per tick, in order, before the plant moves on.
    fn observe(&mut self, tick: &Tick);
}

/// No observer.
impl Observer for () {
    #[inline]
    fn observe(&mut self, _: &Tick) {}
}

impl<O: Observer + ?Sized> Observer for &mut O {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        (**self).observe(tick);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        self.0.observe(tick);
        self.1.observe(tick);
    }
}

impl<O: Observer> Observer for Option<O> {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        if let Some(observer) = self {
            observer.observe(tick);
        }
    }
}
