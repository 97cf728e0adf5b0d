//! Modes of a flight under commands: which set-point the vehicle is led to.
//!
//! ```text
//!            TakeOff --- altitude reached ---> Hold <--- set-points silent --- Offboard
//!              ^                              ^ |  \
//!   Armed ---- | ---- Start, from every ------+ |   +--> Mission --- after the last item ---> Hold
//!              |      mode but Hold             v
//!                                  Return ---> Land --- at rest on the ground ---> Disarm
//! ```
//!
//! The modes live below the [`Supervisor`](super::Supervisor)'s Flying: they choose references, never a
//! wrench, and ask for its commands ([`Command::Start`], [`Command::Disarm`]) like any operator. Every
//! mode gives a [`Setpoint`], which [`Shaper`] turns into a reference inside `M_p`. There is no manual
//! mode. Pure and total; [`Navigator::step`] is called once a control period.

mod interface;

pub use interface::{
    Airborne, MissionItem, MissionKind, Navigation, NavigationConfig, NavigationEvent,
    NavigationMode, NavigationRefusal, Request,
};

use glam::Vec3;

use super::safety::Reaction;
use super::{Command, Mode};
use crate::error::{Bound, ConfigError, require};
use crate::list::List;
use crate::reference::Reference;
use crate::rotation::rotate;
use crate::setpoint::{Setpoint, Shaper, ShaperConfig, ShaperState};
use crate::trajectory::REACH;
use crate::vehicle::VehicleState;

/// Most items of a mission.
pub const MISSION_MAX: usize = 64;

/// The vehicle stands when the reference has sunk this far below it (m) ...
const LANDED_GAP: f32 = 0.25;
/// ... while its vertical speed is below this (m/s) ...
const LANDED_SPEED: f32 = 0.08;
/// ... for this long (s).
const LANDED_TIME: f32 = 0.5;
/// Height above the place of the start from which the vehicle counts as airborne (m).
const AIRBORNE: f32 = 0.15;
/// The vehicle does not lift when it stays at the height of the start, at rest, with the reference so far above it
/// (m) ...
const STUCK_GAP: f32 = 0.5;
/// ... for this long (s).
const STUCK_TIME: f32 = 3.0;
/// Speed of the reference below which a waypoint can be reached (m/s).
const REACHED_SPEED: f32 = 0.3;

/// The modes with their memory.
#[derive(Clone, Debug)]
pub struct Navigator {
    config: NavigationConfig,
    shaper: Shaper,
    state: ShaperState,
    mode: NavigationMode,
    setpoint: Setpoint,
    /// Latest streamed set-point with its age (ticks).
    streamed: Option<(Setpoint, u32)>,
    mission: List<MissionItem, MISSION_MAX>,
    current: usize,
    home_world: Option<Vec3>,
    start_world: Vec3,
    /// Reference of the ground until the flight starts.
    flying: bool,
    starting: bool,
    airborne: Airborne,
    /// Ticks in a row that a condition has held: at rest on the ground, or at a waypoint.
    held: u32,
    /// Ticks in a row that the vehicle has not lifted.
    stuck: u32,
    stage: Stage,
    /// An event that another one of the same tick has put off.
    put_off: Option<NavigationEvent>,
    /// Reaction to a hazard that is present.
    reaction: Option<Reaction>,
}

/// Part of a Return or of an item that lands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Climb,
    Way,
    Descent,
}

impl Navigator {
    /// Checks the configuration; on the ground at the origin until the first state comes.
    ///
    /// # Errors
    /// Names a field that is out of its range.
    pub fn new(config: &NavigationConfig) -> Result<Self, ConfigError> {
        Ok(Self::of(&config.check()?))
    }

    /// As [`new`](Self::new), with a configuration that has been checked.
    #[must_use]
    #[inline(always)]
    pub fn of(checked: &CheckedNavigation) -> Self {
        Self {
            config: checked.config,
            shaper: checked.shaper,
            state: ShaperState::at_rest(Vec3::ZERO, 0.0),
            mode: NavigationMode::Hold,
            setpoint: Setpoint::at(Vec3::ZERO),
            streamed: None,
            mission: List::empty(MissionItem::default()),
            current: 0,
            home_world: None,
            start_world: Vec3::ZERO,
            flying: false,
            starting: false,
            airborne: Airborne::Ground,
            held: 0,
            stuck: 0,
            stage: Stage::Climb,
            put_off: None,
            reaction: None,
        }
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &NavigationConfig {
        &self.config
    }

    /// Takes another configuration; the reference goes on where it is.
    ///
    /// # Errors
    /// As [`new`](Self::new); nothing is then changed.
    pub fn reconfigure(&mut self, config: &NavigationConfig) -> Result<(), ConfigError> {
        let CheckedNavigation { config, shaper } = config.check()?;
        (self.shaper, self.config) = (shaper, config);
        Ok(())
    }

    /// The mode.
    #[must_use]
    pub fn mode(&self) -> NavigationMode {
        self.mode
    }

    /// Contact with the ground.
    #[must_use]
    pub fn airborne(&self) -> Airborne {
        self.airborne
    }

    /// Place of the latest start of a flight, or of the first state (m).
    #[must_use]
    pub fn home_world(&self) -> Vec3 {
        self.home_world.unwrap_or(Vec3::ZERO)
    }

    /// Sets home (m).
    ///
    /// # Errors
    /// Names a coordinate beyond [`REACH`].
    pub fn set_home(&mut self, position_world: Vec3) -> Result<(), ConfigError> {
        self.shaper.check(&Setpoint::at(position_world))?;
        self.home_world = Some(position_world);
        Ok(())
    }

    /// Index of the mission's current item.
    #[must_use]
    pub fn current_item(&self) -> usize {
        self.current
    }

    /// The mission.
    #[must_use]
    pub fn mission(&self) -> &[MissionItem] {
        &self.mission
    }

    /// Replaces the mission; its first item is the current one. A mission that is flown ends.
    ///
    /// # Errors
    /// Names a number of an item that is out of its range, or the number of items; the mission is then
    /// unchanged.
    pub fn set_mission(
        &mut self,
        items: impl Iterator<Item = MissionItem> + Clone,
    ) -> Result<(), ConfigError> {
        let mut count = 0usize;
        // wcet: at most MISSION_MAX iterations
        for item in items.clone() {
            self.check_item(&item)?;
            count += 1;
            let most = Bound::Inside(0.0, MISSION_MAX as f32);
            require("mission (count)", count as f32, most, "number of items")?;
        }
        self.mission.truncate(0);
        // wcet: at most MISSION_MAX iterations
        for item in items.take(MISSION_MAX) {
            // Counted above: there is room.
            let _ = self.mission.push(item);
        }
        self.current = 0;
        if self.mode == NavigationMode::Mission {
            self.hold();
        }
        Ok(())
    }

    /// Checks an item.
    ///
    /// # Errors
    /// Names the number that is out of its range.
    pub fn check_item(&self, item: &MissionItem) -> Result<(), ConfigError> {
        let setpoint = Setpoint { yaw: item.yaw, ..Setpoint::at(item.position_world) };
        self.shaper.check(&setpoint)?;
        let patience = Bound::Inside(0.0, 86_400.0);
        require("mission.hold_time", item.hold_time, patience, "at most a day, s")?;
        if let MissionKind::Speed(speed) = item.kind {
            self.check_speed(speed)?;
        }
        Ok(())
    }

    fn check_speed(&self, speed: f32) -> Result<(), ConfigError> {
        let speeds = Bound::Inside(0.05, self.config.shaper.speed_max);
        require("speed", speed, speeds, "horizontal speed, m/s")
    }

    /// Flies at most at this horizontal speed (m/s) from now on.
    ///
    /// # Errors
    /// When the speed exceeds the configured one.
    pub fn set_speed(&mut self, speed: f32) -> Result<(), ConfigError> {
        self.check_speed(speed)?;
        let shaper = ShaperConfig { speed_max: speed, ..self.config.shaper };
        self.shaper = Shaper::new(&shaper)?;
        Ok(())
    }

    /// Makes the item at `index` the current one.
    ///
    /// # Errors
    /// When there is no such item.
    pub fn set_current_item(&mut self, index: usize) -> Result<(), NavigationRefusal> {
        if index >= self.mission.len() {
            return Err(NavigationRefusal::NoItem);
        }
        self.current = index;
        if self.mode == NavigationMode::Mission {
            self.enter(NavigationMode::Mission);
        }
        Ok(())
    }

    /// Takes a streamed set-point; it is followed in Offboard.
    ///
    /// # Errors
    /// Names a number that is out of its range; the set-point is then dropped.
    pub fn stream(&mut self, setpoint: Setpoint) -> Result<(), ConfigError> {
        self.shaper.check(&setpoint)?;
        self.streamed = Some((setpoint, 0));
        Ok(())
    }

    /// Takes up a request, `supervised` being the supervisor's mode.
    ///
    /// # Errors
    /// Returns the reason for a refusal; nothing is then changed.
    pub fn request(&mut self, supervised: Mode, request: Request) -> Result<(), NavigationRefusal> {
        use NavigationRefusal as Refusal;
        match supervised {
            Mode::Flying => {}
            Mode::Armed => match request {
                Request::TakeOff(_) | Request::Mission | Request::Offboard | Request::Hold => {}
                _ => return Err(Refusal::NotFlying),
            },
            _ if matches!(request, Request::Hold) => {}
            _ => return Err(Refusal::NotArmed),
        }
        let down = matches!(request, Request::Return | Request::Land(_));
        let forced = supervised == Mode::Flying && self.reaction >= Some(Reaction::Return);
        let up = self.reaction >= Some(Reaction::Land) && matches!(request, Request::Return);
        if forced && (!down || up) {
            return Err(Refusal::Hazard);
        }
        match request {
            Request::Hold => self.hold(),
            Request::TakeOff(height) => self.take_off(height)?,
            Request::GoTo(setpoint) => {
                self.shaper.check(&setpoint)?;
                self.enter(NavigationMode::Hold);
                self.setpoint = setpoint;
            }
            Request::Mission if self.mission.is_empty() => return Err(Refusal::NoMission),
            Request::Mission => {
                self.current = if self.current < self.mission.len() { self.current } else { 0 };
                self.enter(NavigationMode::Mission);
            }
            Request::Offboard if self.fresh_setpoint().is_none() => {
                return Err(Refusal::NoSetpoint);
            }
            Request::Offboard => self.enter(NavigationMode::Offboard),
            Request::Return => self.enter(NavigationMode::Return),
            Request::Land(place) => {
                let here = self.reference_position();
                let place = place.unwrap_or(here);
                self.shaper.check(&Setpoint::at(place))?;
                self.enter(NavigationMode::Land);
                self.setpoint = Setpoint::at(Vec3::new(place.x, place.y, here.z));
                let near = (place - here).truncate().length() <= self.config.acceptance_radius;
                self.stage = if near { Stage::Descent } else { Stage::Way };
            }
        }
        self.starting = supervised == Mode::Armed && !matches!(request, Request::Hold);
        Ok(())
    }

    /// Follows the reaction to hazards, at every control period before [`step`](Self::step): home or down, and
    /// nothing else while it lasts. What it began goes on when the hazard is over, until something else is
    /// requested.
    pub fn react(&mut self, supervised: Mode, reaction: Option<Reaction>) {
        self.reaction = reaction;
        if supervised != Mode::Flying {
            return;
        }
        let coming_down = self.mode == NavigationMode::Land
            || self.mode == NavigationMode::Return && self.stage == Stage::Descent;
        match reaction {
            Some(Reaction::Return)
                if !matches!(self.mode, NavigationMode::Return | NavigationMode::Land) =>
            {
                self.enter(NavigationMode::Return);
            }
            Some(Reaction::Land) if !coming_down => {
                let here = self.reference_position();
                self.enter(NavigationMode::Land);
                (self.setpoint, self.stage) = (Setpoint::at(here), Stage::Descent);
            }
            _ => {}
        }
    }

    fn take_off(&mut self, height: Option<f32>) -> Result<(), ConfigError> {
        let here = self.reference_position();
        let target = height.unwrap_or(here.z + self.config.take_off_altitude);
        let above = Bound::Inside(here.z + AIRBORNE, REACH);
        require("take_off.altitude", target, above, "above the vehicle, m")?;
        self.enter(NavigationMode::TakeOff);
        self.setpoint = Setpoint::at(Vec3::new(here.x, here.y, target));
        Ok(())
    }

    fn enter(&mut self, mode: NavigationMode) {
        (self.mode, self.stage, self.held) = (mode, Stage::Climb, 0);
    }

    /// At rest where the reference can stop.
    fn hold(&mut self) {
        self.enter(NavigationMode::Hold);
        self.setpoint = Setpoint { velocity_world: [Some(0.0); 3], ..Setpoint::default() };
    }

    /// The latest reference.
    #[must_use]
    pub fn reference(&self) -> Reference {
        self.shaper.reference(&self.state)
    }

    fn reference_position(&self) -> Vec3 {
        self.reference().position_world
    }

    fn fresh_setpoint(&self) -> Option<Setpoint> {
        let (setpoint, age) = self.streamed?;
        let age = age as f32 * self.config.shaper.step_period;
        (age < self.config.setpoint_timeout).then_some(setpoint)
    }

    /// One control period: `supervised` is the supervisor's mode, `vehicle` the latest good state.
    pub fn step(&mut self, supervised: Mode, vehicle: Option<&VehicleState>) -> Navigation {
        if let Some((_, age)) = &mut self.streamed {
            *age = age.saturating_add(1);
        }
        let flying = supervised == Mode::Flying;
        if !flying {
            return self.on_ground(supervised, vehicle);
        }
        if !self.flying {
            self.flying = true;
            self.home_world = Some(self.start_world);
        }
        self.starting = false;
        let mission_item = (self.mode == NavigationMode::Mission).then(|| self.item_number());
        let event = self.navigate(vehicle);
        let reference = self.shaper.step(&mut self.state, &self.setpoint);
        self.judge_airborne(vehicle, &reference);
        if self.is_stuck(vehicle, &reference) {
            self.hold();
            let event = Some(NavigationEvent::TakeOffFailed);
            return Navigation { reference, command: Some(Command::Disarm), event };
        }
        let landed = event == Some(NavigationEvent::Landed);
        let command = landed.then_some(Command::Disarm);
        match mission_item.flatten() {
            Some(number) if landed => {
                self.current = 0;
                self.put_off = event;
                let event = Some(NavigationEvent::ItemReached(number));
                Navigation { reference, command, event }
            }
            _ => Navigation { reference, command, event: event.or(self.put_off.take()) },
        }
    }

    /// The reference stands where the vehicle is; a flight that was asked for starts.
    fn on_ground(&mut self, supervised: Mode, vehicle: Option<&VehicleState>) -> Navigation {
        if core::mem::take(&mut self.flying) || (self.starting && supervised != Mode::Armed) {
            self.hold();
            self.starting = false;
        }
        (self.airborne, self.stuck) = (Airborne::Ground, 0);
        if let Some(vehicle) = vehicle.filter(|vehicle| vehicle.position_world.is_finite()) {
            self.state = ShaperState::at_rest(vehicle.position_world, heading(vehicle));
            self.start_world = vehicle.position_world;
            self.home_world.get_or_insert(vehicle.position_world);
        }
        let command = (self.starting && supervised == Mode::Armed).then_some(Command::Start);
        let event = self.put_off.take();
        Navigation { reference: self.shaper.reference(&self.state), command, event }
    }

    fn item_number(&self) -> Option<u16> {
        self.mission.get(self.current).map(|item| item.number)
    }

    /// Forgets a start that the supervisor refused.
    pub fn start_refused(&mut self) {
        if core::mem::take(&mut self.starting) {
            self.hold();
        }
    }

    /// Moves the mode on; the set-point of the tick is then in place.
    fn navigate(&mut self, vehicle: Option<&VehicleState>) -> Option<NavigationEvent> {
        match self.mode {
            NavigationMode::Hold => None,
            NavigationMode::TakeOff => self.reached(vehicle, 0.0).then(|| {
                let here = self.setpoint;
                self.enter(NavigationMode::Hold);
                self.setpoint = here;
                NavigationEvent::TakenOff
            }),
            NavigationMode::Offboard => match self.fresh_setpoint() {
                Some(setpoint) => {
                    self.setpoint = setpoint;
                    None
                }
                None => {
                    self.hold();
                    Some(NavigationEvent::OffboardLost)
                }
            },
            NavigationMode::Return => self.homeward(vehicle),
            NavigationMode::Land => self.land(vehicle),
            NavigationMode::Mission => self.next_item(vehicle),
        }
    }

    fn homeward(&mut self, vehicle: Option<&VehicleState>) -> Option<NavigationEvent> {
        let (home, here) = (self.home_world(), self.reference_position());
        let height = home.z + self.config.return_altitude;
        match self.stage {
            Stage::Climb if self.held == 0 => {
                self.setpoint = Setpoint::at(Vec3::new(here.x, here.y, here.z.max(height)));
                self.held = 1;
                None
            }
            Stage::Climb => {
                if self.reached(vehicle, 0.0) {
                    let height = self.setpoint.position_world[2].unwrap_or(height);
                    self.setpoint = Setpoint::at(Vec3::new(home.x, home.y, height));
                    (self.stage, self.held) = (Stage::Way, 0);
                }
                None
            }
            Stage::Way | Stage::Descent => self.land(vehicle),
        }
    }

    /// To the place at the height that is flown, then down until the vehicle stands.
    fn land(&mut self, vehicle: Option<&VehicleState>) -> Option<NavigationEvent> {
        if self.stage != Stage::Descent {
            if self.reached(vehicle, 0.0) {
                (self.stage, self.held) = (Stage::Descent, 0);
            }
            return None;
        }
        let [x, y, _] = self.setpoint.position_world;
        self.setpoint.position_world = [x, y, None];
        self.setpoint.velocity_world = [None, None, Some(-self.config.land_speed)];
        let gap = self.reference_position().z + LANDED_GAP;
        let stands = vehicle.is_some_and(|vehicle| {
            vehicle.position_world.z > gap && vehicle.velocity_world.z.abs() < LANDED_SPEED
        });
        self.held = if stands { self.held.saturating_add(1) } else { 0 };
        (self.seconds(self.held) >= LANDED_TIME).then(|| {
            self.hold();
            NavigationEvent::Landed
        })
    }

    fn next_item(&mut self, vehicle: Option<&VehicleState>) -> Option<NavigationEvent> {
        let Some(item) = self.mission.get(self.current).copied() else {
            let here = self.setpoint;
            self.enter(NavigationMode::Hold);
            self.setpoint = here;
            self.current = 0;
            return Some(NavigationEvent::MissionFinished);
        };
        let done = match item.kind {
            MissionKind::Speed(speed) => {
                // Checked when the mission was set.
                let _ = self.set_speed(speed);
                true
            }
            MissionKind::Land => {
                let target = item.position_world;
                if self.stage == Stage::Climb {
                    let height = self.reference_position().z;
                    self.setpoint = Setpoint::at(Vec3::new(target.x, target.y, height));
                    self.setpoint.yaw = item.yaw;
                    self.stage = Stage::Way;
                }
                return self.land(vehicle);
            }
            MissionKind::Return => {
                self.enter(NavigationMode::Return);
                return Some(NavigationEvent::ItemReached(item.number));
            }
            MissionKind::TakeOff => {
                if self.stage == Stage::Climb {
                    let here = self.reference_position();
                    let height = item.position_world.z;
                    self.setpoint = Setpoint::at(Vec3::new(here.x, here.y, height));
                    self.stage = Stage::Way;
                }
                self.reached(vehicle, 0.0)
            }
            MissionKind::Waypoint | MissionKind::Loiter => {
                self.setpoint = Setpoint { yaw: item.yaw, ..Setpoint::at(item.position_world) };
                self.reached(vehicle, item.hold_time) && item.kind != MissionKind::Loiter
            }
        };
        done.then(|| {
            (self.current, self.stage, self.held) = (self.current + 1, Stage::Climb, 0);
            NavigationEvent::ItemReached(item.number)
        })
    }

    /// `true` once reference and vehicle have been at the set-point's place for `hold_time` (s).
    fn reached(&mut self, vehicle: Option<&VehicleState>, hold_time: f32) -> bool {
        let Setpoint { position_world: [Some(x), Some(y), Some(z)], .. } = self.setpoint else {
            return false;
        };
        let (target, radius) = (Vec3::new(x, y, z), self.config.acceptance_radius);
        let reference = self.shaper.reference(&self.state);
        let near = |position: Vec3| (position - target).length() <= radius;
        let there = near(reference.position_world)
            && reference.velocity_world.length() <= REACHED_SPEED
            && vehicle.is_some_and(|vehicle| near(vehicle.position_world));
        // Inside once is enough to begin to wait: the vehicle may sway while it does.
        self.held =
            if there || self.held > 1 { self.held.max(1).saturating_add(1) } else { self.held };
        self.held > 1 && self.seconds(self.held - 2) >= hold_time
    }

    /// `true` once the vehicle has stood for too long below a reference that has taken off.
    fn is_stuck(&mut self, vehicle: Option<&VehicleState>, reference: &Reference) -> bool {
        let stands = vehicle.is_some_and(|vehicle| {
            vehicle.position_world.z < self.start_world.z + AIRBORNE
                && vehicle.velocity_world.length() < LANDED_SPEED
                && vehicle.position_world.z + STUCK_GAP < reference.position_world.z
        });
        self.stuck = if stands { self.stuck.saturating_add(1) } else { 0 };
        self.seconds(self.stuck) >= STUCK_TIME
    }

    fn seconds(&self, ticks: u32) -> f32 {
        ticks as f32 * self.config.shaper.step_period
    }

    fn judge_airborne(&mut self, vehicle: Option<&VehicleState>, reference: &Reference) {
        let descending = self.stage == Stage::Descent;
        let height = vehicle.map_or(reference.position_world.z, |vehicle| vehicle.position_world.z);
        self.airborne = match (self.airborne, self.mode) {
            (_, NavigationMode::Land | NavigationMode::Return | NavigationMode::Mission)
                if descending =>
            {
                Airborne::Landing
            }
            (Airborne::Ground, _) if height < self.start_world.z + AIRBORNE => Airborne::Ground,
            (_, NavigationMode::TakeOff) => Airborne::TakingOff,
            _ => Airborne::Air,
        };
    }
}

/// A configuration of the navigation that has been checked.
#[derive(Clone, Debug)]
pub struct CheckedNavigation {
    config: NavigationConfig,
    shaper: Shaper,
}

impl NavigationConfig {
    /// Checks the configuration.
    ///
    /// # Errors
    /// Names a field that is out of its range.
    pub fn check(&self) -> Result<CheckedNavigation, ConfigError> {
        let heights = [
            ("navigation.take_off_altitude", self.take_off_altitude),
            ("navigation.return_altitude", self.return_altitude),
        ];
        for (name, height) in heights {
            require(name, height, Bound::Inside(0.5, 1000.0), "height, m")?;
        }
        let slow = Bound::Inside(0.05, self.shaper.descent_max);
        require("navigation.land_speed", self.land_speed, slow, "at most descent_max, m/s")?;
        let near = Bound::Inside(0.05, 100.0);
        require("navigation.acceptance_radius", self.acceptance_radius, near, "distance, m")?;
        let silence = Bound::Inside(0.01, 60.0);
        require("navigation.setpoint_timeout", self.setpoint_timeout, silence, "time, s")?;
        Ok(CheckedNavigation { config: *self, shaper: Shaper::new(&self.shaper)? })
    }
}

/// Angle of body x from world x about world z (rad).
fn heading(vehicle: &VehicleState) -> f32 {
    let forward = rotate(vehicle.attitude, Vec3::X);
    libm::atan2f(forward.y, forward.x)
}

#[cfg(test)]
mod tests;
