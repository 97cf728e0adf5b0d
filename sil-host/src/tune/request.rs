//! Request for gains: known intervals of the vehicle, its limits and the requested closed loop, read from a
//! short vehicle file or from a scenario, whose own gains are ignored.

use ctrl_core::filter::{RateFilter, RateFilterConfig};
use ctrl_core::rotors::RotorModel;
use ctrl_core::vehicle::{GRAVITY, InitialEstimate, Interval, Uncertainty, VectorInterval};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::digits::rounded;
use super::margin::Rotors;
use super::steady::{HorizontalBounds, Steady};
use ctrl_core::controller::ControllerConfig;
use sim::scenario::document::TomlText;
use sim::scenario::{BuiltIn, LoadedScenario, Scenario, ScenarioError};

/// Input of the gain design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Request {
    /// Name of the proposed scenario.
    pub name: String,
    /// Known intervals of vehicle and disturbance.
    pub known: Uncertainty,
    /// Estimates at the first tick.
    pub initial: InitialEstimate,
    /// Part of `D2` that may be a lasting torque about each axis (N m); the rest is zero-mean noise.
    #[serde(with = "sim::per_axis")]
    pub lasting_torque: DVec3,
    /// Disturbances that last, on top of `D1` and `D2`, for integral action.
    pub steady: Steady,
    /// `M_p` (m/s^2).
    pub reference_acceleration_max: f32,
    /// `dt` (s).
    pub step_period: f32,
    /// `M_f` (N) and `M_tau` (N m): controller 2; none: controller 1.
    pub limits: Option<Limits>,
    /// Rotors between command and wrench.
    pub rotors: Rotors,
    /// Filters of the body rate before the law.
    pub rate_filter: RateFilterConfig,
    /// Standard deviation of white noise of each component of the body rate at every tick (rad/s).
    pub rate_noise: f64,
    /// Requested closed loop.
    pub wanted: Wanted,
    /// Values of it that were given; the rest are defaults, which depend on the limits.
    #[serde(skip)]
    pub options: WantedOptions,
}

/// Limits of controller 2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// `M_f` (N).
    pub thrust_max: f32,
    /// `M_tau` about each axis (N m).
    #[serde(with = "ctrl_core::per_axis")]
    pub torque_max: Vec3,
}

/// Requested closed loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Wanted {
    /// Least modulus of the poles of position and height (rad/s).
    pub position_bandwidth: f64,
    /// Least modulus of the poles of the attitude about a tilt axis (rad/s).
    pub attitude_bandwidth: f64,
    /// The same about the vertical body axis.
    pub heading_bandwidth: f64,
    /// Least damping ratio of all of them.
    pub damping: f64,
    /// Share of every inequality's headroom that is kept as margin.
    pub margin: f64,
    /// Position error up to which the position loop stays about linear, `1/k1` at least (m).
    pub position_range: f64,
    /// Attitude error up to which the torque suffices for the attitude's bandwidth (rad); controller 2.
    pub attitude_range: f64,
    /// Least phase margin of the loops behind rotors that lag or delay (deg).
    pub phase_margin_deg: f64,
    /// Slope of the rotational smooth sign at zero, as a multiple of `k4`; none: the steepest that fits.
    pub rotation_slope: Option<f64>,
    /// Most torque activity that the rate noise may make, root mean square over all axes (N m); none: any.
    pub noise_torque_max: Option<f64>,
    /// Least speed of return from far away on any axis (m/s); zero for any.
    pub return_speed: f64,
    /// Quotient of the rotors' lag and of what the lead of a model of them inside the law leaves; none: no model.
    pub rotor_lead: Option<f64>,
}

/// `[wanted]` of a vehicle file, or the flags of the same names; what is absent has a default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WantedOptions {
    /// See [`Wanted`]; 0.5 rad/s.
    pub position_bandwidth: Option<f64>,
    /// See [`Wanted`]; five times the position's.
    pub attitude_bandwidth: Option<f64>,
    /// See [`Wanted`]; the attitude's, less where there is less torque for the inertia.
    pub heading_bandwidth: Option<f64>,
    /// See [`Wanted`]; 0.5.
    pub damping: Option<f64>,
    /// See [`Wanted`]; 0.1.
    pub margin: Option<f64>,
    /// See [`Wanted`]; 0.2 m.
    pub position_range: Option<f64>,
    /// See [`Wanted`]; 0.15 rad.
    pub attitude_range: Option<f64>,
    /// See [`Wanted`]; 30 degrees.
    pub phase_margin_deg: Option<f64>,
    /// See [`Wanted`]; the steepest that step period and noise allow.
    pub rotation_slope: Option<f64>,
    /// See [`Wanted`]; any.
    pub noise_torque_max: Option<f64>,
    /// See [`Request::rate_noise`]; a flag, whose key in a vehicle file is beside the vehicle's.
    #[serde(skip)]
    pub rate_noise: Option<f64>,
    /// See [`Wanted`]; zero.
    pub return_speed: Option<f64>,
    /// See [`Wanted`]; no model.
    pub rotor_lead: Option<f64>,
    /// See [`Steady`]; a flag, whose key in a vehicle file is beside the vehicle's.
    #[serde(skip)]
    pub steady_acceleration: Option<f64>,
    /// The same.
    #[serde(skip)]
    pub steady_torque: Option<f64>,
}

impl WantedOptions {
    /// These where given, else `other`.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            position_bandwidth: self.position_bandwidth.or(other.position_bandwidth),
            attitude_bandwidth: self.attitude_bandwidth.or(other.attitude_bandwidth),
            heading_bandwidth: self.heading_bandwidth.or(other.heading_bandwidth),
            damping: self.damping.or(other.damping),
            margin: self.margin.or(other.margin),
            position_range: self.position_range.or(other.position_range),
            attitude_range: self.attitude_range.or(other.attitude_range),
            phase_margin_deg: self.phase_margin_deg.or(other.phase_margin_deg),
            rotation_slope: self.rotation_slope.or(other.rotation_slope),
            noise_torque_max: self.noise_torque_max.or(other.noise_torque_max),
            rate_noise: self.rate_noise.or(other.rate_noise),
            return_speed: self.return_speed.or(other.return_speed),
            rotor_lead: self.rotor_lead.or(other.rotor_lead),
            steady_acceleration: self.steady_acceleration.or(other.steady_acceleration),
            steady_torque: self.steady_torque.or(other.steady_torque),
        }
    }

    /// With every default filled in; `agility` is the angular acceleration that a controller with
    /// limited torque has to spare for its manoeuvres about each axis (rad/s^2).
    #[must_use]
    pub fn complete(self, agility: impl Fn(f64) -> DVec3, rotors: &Rotors) -> Wanted {
        let position_bandwidth = self.position_bandwidth.unwrap_or(0.5);
        let margin = self.margin.unwrap_or(0.1);
        let attitude_range = self.attitude_range.unwrap_or(0.15);
        let agility = agility(margin);
        let tilting = agility.x.min(agility.y);
        let fastest = (tilting / attitude_range).max(0.0).sqrt();
        let left = rotors.lag / self.rotor_lead.unwrap_or(1.0);
        let followed = ROTOR_SHARE / (left + rotors.delay);
        let attitude_bandwidth = self
            .attitude_bandwidth
            .unwrap_or((5.0 * position_bandwidth).min(0.75 * fastest).min(followed));
        // The same share of what each axis has to spare.
        let slower = if agility.z < tilting { (agility.z / tilting).max(0.0).sqrt() } else { 1.0 };
        Wanted {
            position_bandwidth,
            attitude_bandwidth,
            heading_bandwidth: self.heading_bandwidth.unwrap_or(slower * attitude_bandwidth),
            damping: self.damping.unwrap_or(0.5),
            margin,
            position_range: self.position_range.unwrap_or(0.2),
            attitude_range,
            phase_margin_deg: self.phase_margin_deg.unwrap_or(30.0),
            rotation_slope: self.rotation_slope,
            noise_torque_max: self.noise_torque_max,
            return_speed: self.return_speed.unwrap_or(0.0),
            rotor_lead: self.rotor_lead,
        }
    }
}

/// By default the attitude's bandwidth times lag and delay of the rotors is at most this.
const ROTOR_SHARE: f64 = 0.15;

/// A vehicle file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct VehicleFile {
    #[serde(default = "tuned")]
    name: String,
    mass: Interval,
    inertia: VectorInterval,
    disturbance_acceleration: f32,
    #[serde(with = "ctrl_core::per_axis")]
    disturbance_torque: Vec3,
    #[serde(default, with = "sim::per_axis::optional")]
    lasting_torque: Option<DVec3>,
    #[serde(default)]
    steady_acceleration: f64,
    #[serde(default)]
    steady_torque: f64,
    reference_acceleration_max: f32,
    thrust_max: Option<f32>,
    #[serde(default, with = "sim::per_axis::optional")]
    torque_max: Option<DVec3>,
    step_period: f32,
    #[serde(default)]
    rotor_lag: f64,
    #[serde(default)]
    delay: f64,
    #[serde(default)]
    rate_noise: f64,
    #[serde(default)]
    rate_filter: RateFilterConfig,
    #[serde(default)]
    wanted: WantedOptions,
}

fn tuned() -> String {
    "tuned".to_owned()
}

impl Request {
    /// With the defaults of `wanted` for the limits as they are.
    #[must_use]
    pub fn completed(mut self) -> Self {
        let torque = self.limits.map_or(DVec3::INFINITY, |limits| limits.torque_max.as_dvec3());
        let inertia = self.known.inertia.upper.as_dvec3();
        let lasting = self.torque_that_lasts();
        let agility = |margin: f64| ((1.0 - margin) * torque - lasting) / inertia;
        self.wanted = self.options.complete(agility, &self.rotors);
        self
    }

    /// `true` if the three axes are alike: one attitude loop stands for all.
    #[must_use]
    pub fn axes_alike(&self) -> bool {
        let Uncertainty { inertia, disturbance_torque, .. } = &self.known;
        let limits = self.limits.map_or(Vec3::ZERO, |limits| limits.torque_max);
        let f32s = [inertia.lower, inertia.upper, *disturbance_torque, limits];
        f32s.into_iter().all(|it| it == Vec3::splat(it.x))
            && self.lasting_torque == DVec3::splat(self.lasting_torque.x)
            && self.wanted.heading_bandwidth == self.wanted.attitude_bandwidth
    }

    /// Model of the rotors inside the law; a lead leaves at least one step of the lag.
    #[must_use]
    pub fn rotor_model(&self) -> RotorModel {
        let lag = self.rotors.lag;
        let left = |lead: f64| (lag / lead).max(f64::from(self.step_period).min(lag));
        self.wanted.rotor_lead.map_or(RotorModel::OFF, |lead| RotorModel {
            lag: lag as f32,
            residual_lag: rounded(left(lead)) as f32,
        })
    }

    /// Torque that may last about each axis, within `D2` and on top of it (N m).
    #[must_use]
    pub fn torque_that_lasts(&self) -> DVec3 {
        self.lasting_torque + DVec3::splat(self.steady.torque)
    }

    /// Wanted bandwidth of the attitude about each axis (rad/s).
    #[must_use]
    pub fn attitude_bandwidths(&self) -> DVec3 {
        let Wanted { attitude_bandwidth, heading_bandwidth, .. } = self.wanted;
        DVec3::new(attitude_bandwidth, attitude_bandwidth, heading_bandwidth)
    }

    /// From the built-in scenario, scenario file or vehicle file `name`; `flags` take precedence.
    ///
    /// # Errors
    /// Names file, line and key of what cannot be read, is unknown or is out of its range.
    pub fn open(name: &str, flags: WantedOptions) -> Result<Self, ScenarioError> {
        if BuiltIn::named(name).is_none()
            && let Ok(text) = std::fs::read_to_string(name)
        {
            return Self::parse(name, &text, flags);
        }
        // A file that cannot be read is refused there, with the names of the scenarios.
        let loaded = LoadedScenario::open(name, &[])?;
        Self::checked(from_scenario(loaded.scenario(), flags), name, loaded.text())
    }

    /// From the text of a scenario (it has a `[controller]`) or of a vehicle file.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn parse(name: &str, text: &str, flags: WantedOptions) -> Result<Self, ScenarioError> {
        let document = TomlText::parse(name, text)?;
        let request = if document.contains(&["controller".to_owned()]) {
            from_scenario(LoadedScenario::parse(name, text, &[])?.scenario(), flags)
        } else {
            let file: VehicleFile = document.deserialize()?;
            match from_vehicle(file, flags) {
                Ok(request) => request,
                Err((key, message)) => return Err(document.error(&[key.to_owned()], message)),
            }
        };
        Self::checked(request, name, text)
    }

    fn checked(self, name: &str, text: &str) -> Result<Self, ScenarioError> {
        match self.first_fault() {
            None => Ok(self),
            Some((path, message)) => {
                let path: Vec<_> = path.split('.').map(str::to_owned).collect();
                Err(TomlText::parse(name, text)?.error(&path, message))
            }
        }
    }

    /// Key and message of the first value outside its range. The core checks the rest of what its
    /// constructors see.
    fn first_fault(&self) -> Option<(&'static str, String)> {
        let Self { known, wanted, .. } = self;
        let g = f64::from(GRAVITY);
        let d2 = known.disturbance_torque.as_dvec3();
        let limits = self.limits.unwrap_or(Limits { thrust_max: 1.0, torque_max: Vec3::ONE });
        let at = |path, value: f64, lower: f64, upper: f64, unit| (path, value, lower, upper, unit);
        let of_axes = (0..3).flat_map(|axis| {
            let inertia = known.inertia.axes()[axis];
            let lower = f64::from(inertia.lower);
            [
                at("inertia.lower", lower, 1e-8, 1e5, "kg m^2"),
                at("inertia.upper", inertia.upper.into(), lower, 1e5, "kg m^2"),
                at("disturbance_torque", d2[axis], 0.0, 1e6, "N m"),
                at("lasting_torque", self.lasting_torque[axis], 0.0, d2[axis], "N m"),
                at("torque_max", limits.torque_max[axis].into(), 1e-9, 1e6, "N m"),
            ]
        });
        [
            at("mass.lower", known.mass.lower.into(), 1e-3, 1e4, "kg"),
            at("mass.upper", known.mass.upper.into(), known.mass.lower.into(), 1e4, "kg"),
            at("disturbance_acceleration", known.disturbance_acceleration.into(), 0.0, g, "m/s^2"),
            at(
                "reference_acceleration_max",
                self.reference_acceleration_max.into(),
                0.0,
                g,
                "m/s^2",
            ),
            at("steady_acceleration", self.steady.acceleration, 0.0, g, "m/s^2"),
            at("steady_torque", self.steady.torque, 0.0, 1e6, "N m"),
            at("step_period", self.step_period.into(), 1e-4, 0.1, "s"),
            at("thrust_max", limits.thrust_max.into(), 1e-3, 1e6, "N"),
            at("rotor_lag", self.rotors.lag, 0.0, 1.0, "s"),
            at("delay", self.rotors.delay, 0.0, 0.5, "s"),
            at("rate_noise", self.rate_noise, 0.0, 100.0, "rad/s"),
            at(
                "wanted.rotation_slope",
                wanted.rotation_slope.unwrap_or(1.0),
                0.01,
                100.0,
                "times k4",
            ),
            at("wanted.noise_torque_max", wanted.noise_torque_max.unwrap_or(1.0), 1e-9, 1e6, "N m"),
            at("wanted.phase_margin_deg", wanted.phase_margin_deg, 1.0, 80.0, "deg"),
            at("wanted.position_bandwidth", wanted.position_bandwidth, 0.01, 100.0, "rad/s"),
            at("wanted.return_speed", wanted.return_speed, 0.0, 100.0, "m/s"),
            at("wanted.rotor_lead", wanted.rotor_lead.unwrap_or(1.0), 1.0, 100.0, "times less lag"),
            at("wanted.damping", wanted.damping, 0.1, 0.95, "of critical damping"),
            at("wanted.margin", wanted.margin, 0.0, 0.9, "of each inequality's headroom"),
            at("wanted.position_range", wanted.position_range, 1e-3, 1e3, "m"),
            at("wanted.attitude_range", wanted.attitude_range, 1e-3, 3.0, "rad"),
            at("wanted.attitude_bandwidth", wanted.attitude_bandwidth, 0.0, 1000.0, "rad/s"),
            at("wanted.heading_bandwidth", wanted.heading_bandwidth, 0.0, 1000.0, "rad/s"),
        ]
        .into_iter()
        .chain(of_axes)
        .find(|&(_, value, lower, upper, _)| !(lower <= value && value <= upper))
        .map(|(path, value, lower, upper, unit)| {
            // The shortest decimals in the core's precision: without what widening to f64 adds.
            let [value, lower, upper] = [value, lower, upper].map(|number| number as f32);
            (path, format!("{value} must be in [{lower}, {upper}] {unit}"))
        })
        .or_else(|| {
            let useless = wanted.rotor_lead.is_some() && self.rotors.lag == 0.0;
            useless.then(|| ("wanted.rotor_lead", "needs a rotor_lag above zero".to_owned()))
        })
        .or_else(|| {
            let refused = RateFilter::new(&self.rate_filter, self.step_period).err()?;
            Some(("rate_filter", refused.to_string()))
        })
    }
}

fn from_vehicle(
    file: VehicleFile,
    flags: WantedOptions,
) -> Result<Request, (&'static str, String)> {
    let limits = match (file.thrust_max, file.torque_max) {
        (Some(thrust_max), Some(torque_max)) => {
            Some(Limits { thrust_max, torque_max: torque_max.as_vec3() })
        }
        (None, None) => None,
        (Some(_), None) => return Err(("thrust_max", both("torque_max"))),
        (None, Some(_)) => return Err(("torque_max", both("thrust_max"))),
    };
    let known = Uncertainty {
        mass: file.mass,
        inertia: file.inertia,
        disturbance_acceleration: file.disturbance_acceleration,
        disturbance_torque: file.disturbance_torque,
    };
    let rotors = Rotors { lag: file.rotor_lag, delay: file.delay };
    let middle = |interval: Interval| libm::sqrtf(interval.lower * interval.upper);
    let options = flags.or(file.wanted);
    // Both in single precision: the same number in the file is the same bound.
    let lasting_torque = file.lasting_torque.map_or(file.disturbance_torque, |it| it.as_vec3());
    Ok(Request {
        name: file.name,
        known,
        // In the middle by ratio: what counts is how many times too large or too small they are.
        initial: InitialEstimate {
            mass: middle(known.mass),
            inertia: Vec3::from(known.inertia.axes().map(middle)),
        },
        lasting_torque: lasting_torque.as_dvec3(),
        steady: Steady {
            acceleration: flags.steady_acceleration.unwrap_or(file.steady_acceleration),
            torque: flags.steady_torque.unwrap_or(file.steady_torque),
        },
        reference_acceleration_max: file.reference_acceleration_max,
        step_period: file.step_period,
        limits,
        rotors,
        rate_filter: file.rate_filter,
        rate_noise: flags.rate_noise.unwrap_or(file.rate_noise),
        wanted: options.complete(|_| DVec3::ZERO, &rotors),
        options,
    }
    .completed())
}

fn both(missing: &str) -> String {
    format!("needs {missing} beside it (controller 2); without both, controller 1 is tuned")
}

fn from_scenario(scenario: &Scenario, flags: WantedOptions) -> Request {
    let controller = &scenario.controller;
    let known = *controller.uncertainty();
    let mut lasting = scenario.disturbance;
    lasting.noise = None;
    let (reference_acceleration_max, limits) = match controller {
        ControllerConfig::RobustAdaptive(config) => (config.reference_acceleration_max, None),
        ControllerConfig::Saturated(config) => (
            config.reference_acceleration_max,
            Some(Limits { thrust_max: config.thrust_max, torque_max: config.torque_max }),
        ),
    };
    let actuation = scenario.effective_actuation();
    let model = controller.rotors();
    let modelled = (model.lag > 0.0).then_some(f64::from(model.lag));
    let lead = modelled.map(|lag| {
        if model.residual_lag > 0.0 { lag / f64::from(model.residual_lag) } else { 1.0 }
    });
    let flags = WantedOptions { rotor_lead: flags.rotor_lead.or(lead), ..flags };
    let rotors = Rotors {
        lag: actuation.rotor_lag.or(modelled).unwrap_or_default(),
        delay: actuation.delay.unwrap_or_default(),
    };
    let noise = scenario.state_feedback.rate_body.and_then(|it| it.white_noise);
    let bounds = HorizontalBounds::new(&known, reference_acceleration_max);
    let borne = Steady::borne(controller.integral(), &bounds);
    let steady = Steady {
        acceleration: flags.steady_acceleration.unwrap_or(borne.acceleration),
        torque: flags.steady_torque.unwrap_or(borne.torque),
    };
    // What the integral action bears is not `D2`'s.
    let lasting = (lasting.bounds().1 - DVec3::splat(steady.torque)).max(DVec3::ZERO);
    let lasting_torque = lasting.min(known.disturbance_torque.as_dvec3());
    Request {
        name: format!("{}-tuned", scenario.name),
        known,
        initial: *controller.initial(),
        lasting_torque,
        steady,
        reference_acceleration_max,
        step_period: controller.step_period(),
        limits,
        rotors,
        rate_filter: scenario.rate_filter,
        rate_noise: flags.rate_noise.or(noise).unwrap_or_default(),
        wanted: flags.complete(|_| DVec3::ZERO, &rotors),
        options: flags,
    }
    .completed()
}
