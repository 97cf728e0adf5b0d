//! Observers of a flight.

use crate::tick::Tick;

/// Receives every tick of a flight.
pub trait Observer {
    /// Called once per tick, in order, before the plant moves on.
    fn observe(&mut self, tick: &Tick);

    /// Receives several ticks in a row, of a flight whose observers need not see each before the plant moves on
    /// ([`Flight::observe_in_blocks`](crate::closed_loop::Flight::observe_in_blocks)).
    #[inline]
    fn observe_ticks(&mut self, ticks: &[Tick]) {
        ticks.iter().for_each(|tick| self.observe(tick));
    }
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

    #[inline]
    fn observe_ticks(&mut self, ticks: &[Tick]) {
        (**self).observe_ticks(ticks);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        self.0.observe(tick);
        self.1.observe(tick);
    }

    #[inline]
    fn observe_ticks(&mut self, ticks: &[Tick]) {
        self.0.observe_ticks(ticks);
        self.1.observe_ticks(ticks);
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
