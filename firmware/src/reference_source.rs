//! Source of references: a trajectory of the vehicle's own, or a stream of the host.
//!
//! The choice is made on the ground. A flight that follows a stream holds the last place after the
//! timeout of the stream.

use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{AnyTrajectory, CheckedTrajectory, Trajectory};
use glam::Vec3;

/// Gives the reference of each tick; has the memory for one trajectory.
#[derive(Clone, Debug)]
pub struct ReferenceSource {
    /// Followed unless `streaming`.
    trajectory: AnyTrajectory,
    streaming: bool,
    timeout: u32,
    streamed: Option<Streamed>,
    /// The tick of flight that the trajectory was evaluated at last, and the result.
    latest: Option<(u32, Reference)>,
}

/// The latest reference of the host.
#[derive(Clone, Copy, Debug)]
struct Streamed {
    reference: Reference,
    uptime: u32,
}

impl ReferenceSource {
    /// A stream is held when no reference has come for `timeout` ticks. Follows the stream until a
    /// trajectory is selected.
    #[must_use]
    pub const fn new(timeout: u32) -> Self {
        let trajectory = AnyTrajectory::unbuilt();
        Self { trajectory, streaming: true, timeout, streamed: None, latest: None }
    }

    /// The selected trajectory; none while a stream is followed.
    #[must_use]
    pub const fn trajectory(&self) -> Option<&AnyTrajectory> {
        if self.streaming { None } else { Some(&self.trajectory) }
    }

    /// Sets the timeout of the stream (ticks).
    pub fn set_timeout(&mut self, timeout: u32) {
        self.timeout = timeout;
    }

    /// Follows a trajectory from now on; it is built in place of the one before.
    pub fn follow(&mut self, trajectory: &CheckedTrajectory) {
        trajectory.build_into(&mut self.trajectory);
        self.forget(false);
    }

    /// Follows the stream from now on.
    pub fn follow_stream(&mut self) {
        self.forget(true);
    }

    fn forget(&mut self, streaming: bool) {
        (self.streaming, self.streamed, self.latest) = (streaming, None, None);
    }

    /// Takes a reference that came at tick `uptime`.
    pub fn receive(&mut self, reference: Reference, uptime: u32) {
        self.streamed = Some(Streamed { reference, uptime });
    }

    /// The reference after `flight_tick` ticks of flight, zero on the ground, at tick `uptime`;
    /// `position_world` is the vehicle's position (m), held while nothing is streamed.
    pub fn next(&mut self, flight_tick: u32, uptime: u32, position_world: Vec3) -> Reference {
        if !self.streaming {
            // Needed several times per tick; its sine takes longer than a control step.
            return match self.latest {
                Some((tick, reference)) if tick == flight_tick => reference,
                _ => {
                    let reference = self.trajectory.reference(u64::from(flight_tick));
                    self.latest = Some((flight_tick, reference));
                    reference
                }
            };
        }
        let Some(Streamed { reference, uptime: since }) = self.streamed else {
            return Reference::hover(position_world);
        };
        if uptime.wrapping_sub(since) < self.timeout {
            reference
        } else if flight_tick > 0 {
            standstill(&reference)
        } else {
            self.streamed = None; // of an earlier flight
            Reference::hover(position_world)
        }
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
    use ctrl_core::trajectory::{CircleConfig, Heading, TrajectoryConfig};

    const TIMEOUT: u32 = 3;
    const HERE: Vec3 = Vec3::new(7.0, 8.0, 9.0);

    fn place(x: f32) -> Reference {
        Reference { velocity_world: Vec3::X, ..Reference::hover(Vec3::new(x, 0.0, 1.0)) }
    }

    fn config() -> TrajectoryConfig {
        TrajectoryConfig::Circle(CircleConfig {
            centre_world: Vec3::ZERO,
            radius: 2.0,
            angular_rate: 0.5,
            heading: Heading::Tangent,
        })
    }

    fn circle() -> AnyTrajectory {
        config().build(1e-3).unwrap()
    }

    /// A source that follows the circle.
    fn on_circle() -> ReferenceSource {
        let mut source = ReferenceSource::new(TIMEOUT);
        source.follow(&config().check(1e-3).unwrap());
        source
    }

    #[test]
    fn a_trajectory_is_asked_for_the_tick_of_flight_and_ignores_the_stream() {
        let mut source = on_circle();
        assert_eq!(source.trajectory(), Some(&circle()));
        assert_eq!(source.next(0, 5000, HERE), circle().reference(0));
        source.receive(place(1.0), 6233);
        for tick in [1234, 1234, 1235, 0] {
            assert_eq!(source.next(tick, 6234, HERE), circle().reference(tick.into()));
        }
    }

    #[test]
    fn a_stream_is_followed_and_held_when_it_ends() {
        let mut source = ReferenceSource::new(TIMEOUT);
        source.receive(place(2.0), u32::MAX);
        assert_eq!(source.next(0, u32::MAX, HERE), place(2.0));
        assert_eq!(source.next(2, 1, HERE), place(2.0), "between two messages");
        assert_eq!(source.next(3, 2, HERE), Reference::hover(Vec3::new(2.0, 0.0, 1.0)));
        source.receive(place(3.0), 3);
        assert_eq!(source.next(4, 3, HERE), place(3.0), "the host is back");
    }

    #[test]
    fn without_a_stream_the_vehicle_stays_where_it_is() {
        let mut source = ReferenceSource::new(TIMEOUT);
        assert_eq!(source.next(0, 0, HERE), Reference::hover(HERE));
        source.receive(place(2.0), 0);
        assert_eq!(source.next(0, TIMEOUT, HERE), Reference::hover(HERE));
        assert_eq!(source.next(1, TIMEOUT, HERE), Reference::hover(HERE), "the old one is gone");
    }

    #[test]
    fn a_new_choice_forgets_the_stream() {
        let mut source = ReferenceSource::new(TIMEOUT);
        source.receive(place(2.0), 0);
        source.follow(&config().check(1e-3).unwrap());
        assert_eq!(source.next(0, 0, HERE), circle().reference(0));
        source.follow_stream();
        assert_eq!(source.trajectory(), None);
        assert_eq!(source.next(0, 0, HERE), Reference::hover(HERE));
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
