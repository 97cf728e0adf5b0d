//! Which reference is flown: the host's while it sends one, else the built-in trajectory.
//!
//! The choice is made on the ground. A flight that follows the host never falls back to the
//! built-in trajectory, which may be far away: when the host falls silent, it holds the last place.

use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::Trajectory;
use glam::Vec3;

/// Where the reference comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The trajectory of the image.
    BuiltIn,
    /// The host.
    Host,
    /// The place that the host sent last.
    Hold,
}

/// Chooses the reference of each tick.
#[derive(Clone, Debug)]
pub struct ReferenceSource<T> {
    trajectory: T,
    timeout: u32,
    latest: Option<Reference>,
    age: u32,
    origin: Origin,
}

impl<T: Trajectory> ReferenceSource<T> {
    /// Begins with `trajectory`; the host is silent when it sends nothing for `timeout` ticks.
    pub const fn new(trajectory: T, timeout: u32) -> Self {
        Self { trajectory, timeout, latest: None, age: 0, origin: Origin::BuiltIn }
    }

    /// The reference for the tick after `flight_tick` ticks of flight (zero on the ground), with
    /// what the host has sent since the last call.
    pub fn next(&mut self, flight_tick: u32, received: Option<Reference>) -> Reference {
        self.age = if received.is_some() { 0 } else { self.age.saturating_add(1) };
        self.latest = received.or(self.latest);
        let silent = self.latest.is_none() || self.age >= self.timeout;
        self.origin = match (flight_tick, self.origin, silent) {
            (0, _, true) => Origin::BuiltIn,
            (0, _, false) | (_, Origin::Host | Origin::Hold, false) => Origin::Host,
            (_, Origin::BuiltIn, _) => Origin::BuiltIn,
            (_, Origin::Host | Origin::Hold, true) => Origin::Hold,
        };
        match (self.origin, self.latest) {
            (Origin::Host, Some(reference)) => reference,
            (Origin::Hold, Some(reference)) => standstill(&reference),
            _ => self.trajectory.reference(u64::from(flight_tick)),
        }
    }

    /// Where the latest reference came from.
    #[must_use]
    pub const fn origin(&self) -> Origin {
        self.origin
    }
}

/// At rest where `reference` is, facing as it does.
fn standstill(reference: &Reference) -> Reference {
    let hover = Reference::hover(reference.position_world);
    let forward = reference.left_world.cross(Vec3::Z);
    // Left straight up or down, or no direction at all: keep the default heading.
    if forward.length_squared() > 1e-6 { hover.facing(Jet::constant(forward)) } else { hover }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::trajectory::{Circle, Hover, HoverConfig};

    const TIMEOUT: u32 = 3;

    fn place(x: f32) -> Reference {
        Reference { velocity_world: Vec3::X, ..Reference::hover(Vec3::new(x, 0.0, 1.0)) }
    }

    fn source() -> ReferenceSource<Hover> {
        let config = HoverConfig { position_world: Vec3::new(7.0, 8.0, 9.0), yaw: 0.0 };
        ReferenceSource::new(Hover::new(&config, 1e-3).unwrap(), TIMEOUT)
    }

    #[test]
    fn without_a_host_the_built_in_trajectory_flies() {
        let mut source = source();
        for tick in 0..10 {
            let reference = source.next(tick, None);
            assert_eq!(reference.position_world, Vec3::new(7.0, 8.0, 9.0));
            assert_eq!(source.origin(), Origin::BuiltIn);
        }
    }

    #[test]
    fn the_trajectory_is_asked_for_the_tick_of_flight() {
        let config = ctrl_core::trajectory::CircleConfig {
            centre_world: Vec3::ZERO,
            radius: 2.0,
            angular_rate: 0.5,
            heading: ctrl_core::trajectory::Heading::Tangent,
        };
        let circle = Circle::new(&config, 1e-3).unwrap();
        let mut source = ReferenceSource::new(circle, TIMEOUT);
        assert_eq!(source.next(0, None), circle.reference(0));
        assert_eq!(source.next(1234, None), circle.reference(1234));
    }

    #[test]
    fn a_host_on_the_ground_is_followed_and_a_silent_one_is_held() {
        let mut source = source();
        assert_eq!(source.next(0, Some(place(1.0))), place(1.0));
        assert_eq!(source.next(1, Some(place(2.0))), place(2.0));
        assert_eq!(source.next(2, None), place(2.0), "between two messages");
        source.next(3, None);
        let held = source.next(4, None);
        assert_eq!(held, Reference::hover(Vec3::new(2.0, 0.0, 1.0)));
        assert_eq!(source.origin(), Origin::Hold);
        assert_eq!(source.next(5, Some(place(3.0))), place(3.0), "the host is back");
    }

    #[test]
    fn a_host_that_speaks_up_in_flight_is_not_followed_until_the_next_flight() {
        let mut source = source();
        source.next(0, None);
        source.next(1, Some(place(1.0)));
        assert_eq!(source.origin(), Origin::BuiltIn);
        assert_eq!(source.next(0, Some(place(1.0))), place(1.0));
    }

    #[test]
    fn a_silent_host_on_the_ground_is_forgotten() {
        let mut source = source();
        source.next(0, Some(place(1.0)));
        for _ in 0..TIMEOUT {
            source.next(0, None);
        }
        assert_eq!(source.origin(), Origin::BuiltIn);
    }

    #[test]
    fn a_standstill_keeps_the_heading_and_needs_no_valid_one() {
        let west = Reference { left_world: Vec3::new(0.0, -1.0, 0.3), ..place(0.0) };
        let held = standstill(&west);
        assert!((held.left_world - Vec3::NEG_Y).length() < 1e-6, "{held:?}");
        assert_eq!(held.left_rate_world, Vec3::ZERO);
        let upright = Reference { left_world: Vec3::Z, ..place(0.0) };
        assert_eq!(standstill(&upright).left_world, Vec3::Y);
    }
}
