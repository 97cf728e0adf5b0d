//! Source of references: a trajectory of the vehicle's own, or a stream of the host.
//!
//! The choice is made on the ground. A flight that follows a stream holds the last place after the
//! timeout of the stream.

use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{
    CheckedTrajectory, Circle, Hover, Lemniscate, RisingCircle, Trajectory, WaypointPath,
};
use glam::Vec3;

/// Gives the reference of each tick; has the memory for one path.
#[derive(Clone, Debug)]
pub struct ReferenceSource {
    followed: Followed,
    /// Built in place and never moved: it takes kilobytes.
    path: WaypointPath,
    /// Of the selected trajectory.
    limits: TrajectoryLimits,
    timeout: u32,
    streamed: Option<Streamed>,
    /// The tick of flight that the trajectory was evaluated at last, and the result.
    latest: Option<(u32, Reference)>,
}

/// Selected source of references.
#[derive(Clone, Copy, Debug)]
enum Followed {
    Stream,
    Path,
    Hover(Hover),
    RisingCircle(RisingCircle),
    Circle(Circle),
    Lemniscate(Lemniscate),
}

/// Properties of a trajectory that a controller has to accept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryLimits {
    /// Bound of each component of the acceleration (m/s^2).
    pub acceleration_bound: f32,
    /// Time between two ticks (s).
    pub step_period: f32,
}

impl From<&CheckedTrajectory<'_>> for TrajectoryLimits {
    fn from(trajectory: &CheckedTrajectory) -> Self {
        let (acceleration_bound, step_period) =
            (trajectory.acceleration_bound(), trajectory.step_period());
        Self { acceleration_bound, step_period }
    }
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
        Self {
            followed: Followed::Stream,
            path: WaypointPath::unbuilt(),
            limits: TrajectoryLimits { acceleration_bound: 0.0, step_period: 0.0 },
            timeout,
            streamed: None,
            latest: None,
        }
    }

    /// Limits of the selected trajectory; none while a stream is followed.
    #[must_use]
    pub const fn limits(&self) -> Option<TrajectoryLimits> {
        match self.followed {
            Followed::Stream => None,
            _ => Some(self.limits),
        }
    }

    /// Sets the timeout of the stream (ticks).
    pub fn set_timeout(&mut self, timeout: u32) {
        self.timeout = timeout;
    }

    /// Follows a trajectory from now on; a path is built in place of the one before.
    pub fn follow(&mut self, trajectory: &CheckedTrajectory) {
        self.limits = trajectory.into();
        let followed = match trajectory {
            CheckedTrajectory::Hover(trajectory) => Followed::Hover(*trajectory),
            CheckedTrajectory::RisingCircle(trajectory) => Followed::RisingCircle(*trajectory),
            CheckedTrajectory::Circle(trajectory) => Followed::Circle(*trajectory),
            CheckedTrajectory::Lemniscate(trajectory) => Followed::Lemniscate(*trajectory),
            CheckedTrajectory::WaypointPath(checked) => {
                checked.build_into(&mut self.path);
                Followed::Path
            }
        };
        self.select(followed);
    }

    /// Follows the stream from now on.
    pub fn follow_stream(&mut self) {
        self.select(Followed::Stream);
    }

    fn select(&mut self, followed: Followed) {
        (self.followed, self.streamed, self.latest) = (followed, None, None);
    }

    /// The trajectory's reference at a tick of flight; none while a stream is followed.
    #[inline(never)] // once a tick, which its time's bound takes for granted
    fn on_trajectory(&self, flight_tick: u32) -> Option<Reference> {
        let tick = u64::from(flight_tick);
        match &self.followed {
            Followed::Stream => None,
            Followed::Path => Some(self.path.reference(tick)),
            Followed::Hover(trajectory) => Some(trajectory.reference(tick)),
            Followed::RisingCircle(trajectory) => Some(trajectory.reference(tick)),
            Followed::Circle(trajectory) => Some(trajectory.reference(tick)),
            Followed::Lemniscate(trajectory) => Some(trajectory.reference(tick)),
        }
    }

    /// Takes a reference that came at tick `uptime`.
    pub fn receive(&mut self, reference: Reference, uptime: u32) {
        self.streamed = Some(Streamed { reference, uptime });
    }

    /// The reference after `flight_tick` ticks of flight, zero on the ground, at tick `uptime`;
    /// `position_world` is the vehicle's position (m), held while nothing is streamed.
    pub fn next(&mut self, flight_tick: u32, uptime: u32, position_world: Vec3) -> Reference {
        // Needed several times per tick; a trajectory's sine takes longer than a control step.
        if let Some((tick, reference)) = self.latest
            && tick == flight_tick
        {
            return reference;
        }
        if let Some(reference) = self.on_trajectory(flight_tick) {
            self.latest = Some((flight_tick, reference));
            return reference;
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
    use ctrl_core::list::List;
    use ctrl_core::trajectory::{
        AnyTrajectory, CircleConfig, Heading, HoverConfig, Leg, TrajectoryConfig,
        WaypointPathConfig,
    };

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
        let limits = source.limits().unwrap();
        assert_eq!(limits.acceleration_bound, circle().acceleration_bound());
        assert_eq!(limits.step_period, circle().step_period());
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
        assert_eq!(source.limits(), None);
        assert_eq!(source.next(0, 0, HERE), Reference::hover(HERE));
    }

    #[test]
    fn memory_of_one_kind_takes_every_other() {
        let hover = TrajectoryConfig::Hover(HoverConfig { position_world: Vec3::Z, yaw: 0.5 });
        let path = |x: f32| {
            let legs = List::from_slice(&[Leg::to(Vec3::X * x, 4.0)]).unwrap();
            TrajectoryConfig::WaypointPath(WaypointPathConfig {
                start_world: Vec3::ZERO,
                yaw: 0.0,
                legs,
            })
        };
        let mut source = ReferenceSource::new(TIMEOUT);
        for config in [hover.clone(), path(1.0), path(2.0), config(), path(1.0), hover] {
            source.follow(&config.check(1e-3).unwrap());
            let expected = config.build(1e-3).unwrap();
            for tick in [0, 1500, 9000] {
                assert_eq!(source.next(tick, 0, HERE), expected.reference(tick.into()));
            }
        }
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
