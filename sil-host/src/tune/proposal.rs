//! A proposal: the gains and the predicted errors.

use glam::{DVec3, Vec3};

use super::design::design;
use super::digits::rounded_up;
use super::filter::slow_delay;
use super::hover::Hover;
use super::infeasible::{Infeasible, Remedy};
use super::margin::{Margins, Rotors, margins};
use super::noise::{Activity, activity};
use super::push::settling_time;
use super::request::Request;
use super::survey::{LoopSurvey, Which};
use super::ultimate::Ultimate;
use ctrl_core::controller::ControllerConfig;

/// Time constants of the slowest mode after which the start counts as forgotten.
const FORGOTTEN: f64 = 10.0;

/// Time for which flights are judged after that, in units of the position bandwidth's inverse: three periods.
const JUDGED: f64 = 20.0;

/// Errors [m, rad] below which a flight is not judged: rounding, and what is left of the start.
const FLOOR: f64 = 1e-3;

/// Gains, and the predictions for the vehicle with them.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Request that it meets.
    pub request: Request,
    /// The controller, complete.
    pub law: ControllerConfig,
    /// The loops at hover over the corners of the uncertainty.
    pub surveys: Vec<LoopSurvey>,
    /// Stability margins of the loops behind the rotors.
    pub margins: Vec<Margins>,
    /// Predicted ultimate bounds.
    pub ultimate: Ultimate,
    /// Torque activity of the rate noise, if there is any.
    pub activity: Option<Activity>,
    /// Time until a lasting push at its bound is held (s), with integral action.
    pub push_settling: Option<f64>,
    /// Time from which on the bounds hold in the check flights (s).
    pub settle_time: f64,
    /// Length of the check flights (s).
    pub duration: f64,
}

impl Proposal {
    /// Gains for `request`.
    ///
    /// # Errors
    /// The inequality that no choice of gains meets.
    pub fn new(request: Request) -> Result<Self, Infeasible> {
        let (law, ultimate) = predicted(&request).map_err(|error| error.remedied(&request))?;
        let surveys =
            Which::of(&law).into_iter().map(|it| LoopSurvey::new(it, &law)).collect::<Vec<_>>();
        let margins = margins(&law, &request.rotors, &request.rate_filter);
        let activity = (request.rate_noise > 0.0)
            .then(|| activity(&law, request.rate_noise, &request.rotors, &request.rate_filter));
        let decay = surveys.iter().map(|it| it.decay.value).fold(f64::INFINITY, f64::min);
        let cascade = law.cascade();
        let width = f64::from(cascade.delta_min_translation.min(cascade.delta_min_rotation));
        let smoothing = (20.0 / width).ln() / f64::from(cascade.delta_1);
        let push_settling =
            (!request.steady.is_none()).then(|| settling_time(&law, &request.steady));
        let settle_time = (FORGOTTEN / decay).max(smoothing).max(push_settling.unwrap_or(0.0));
        let settle_time = settle_time.ceil();
        let duration = (settle_time + JUDGED / request.wanted.position_bandwidth).ceil();
        Ok(Self {
            request,
            law,
            surveys,
            margins,
            ultimate,
            activity,
            push_settling,
            settle_time,
            duration,
        })
    }

    /// Start of the scenario from its reference (m).
    #[must_use]
    pub fn start_offset(&self) -> DVec3 {
        0.5 * self.request.wanted.position_range * DVec3::new(1.0, -1.0, -1.0)
    }

    /// Bounds of the check: position (m), `q_e`, tilt and heading (rad).
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        let peak = &self.ultimate.peak;
        [peak.position, peak.attitude, peak.tilt, peak.heading]
            .map(|bound| rounded_up(bound.unwrap_or(f64::INFINITY).max(FLOOR)))
    }
}

/// The number of axes that are alike, else all three.
fn per_axis(x: Vec3) -> String {
    if x == Vec3::splat(x.x) { format!("{:?}", x.x) } else { format!("{:?}", x.to_array()) }
}

/// Gains for `request`, and their predicted errors.
fn predicted(request: &Request) -> Result<(ControllerConfig, Ultimate), Infeasible> {
    let law = design(request)?;
    // To slow signals a filter is a delay of the rate; the peaks take it as one of the wrench, which is worse.
    let filtered = slow_delay(&request.rate_filter, request.step_period.into());
    let rotors = Rotors { delay: request.rotors.delay + filtered, ..request.rotors };
    let ultimate = Ultimate::new(&law, request.lasting_torque, &request.steady, &rotors);
    out_of_range(&law, &ultimate).map_or(Ok((law, ultimate)), Err)
}

impl Infeasible {
    /// With the remedies first that each make all of `request` feasible: the deciding value, and the bandwidth
    /// of the attitude where one was asked for.
    fn remedied(mut self, request: &Request) -> Self {
        let asked = request.options.attitude_bandwidth;
        let slower = asked.map(|bandwidth| (Remedy::AttitudeBandwidth, bandwidth));
        let slower = slower.filter(|it| self.deciding.iter().all(|(remedy, _)| *remedy != it.0));
        let passes = |request: &Request| predicted(request).is_ok();
        for (remedy, value) in slower.into_iter().chain(self.deciding.clone()) {
            if let Some(words) = remedy.sufficient(request, value, passes) {
                self.remedies.insert(0, words);
            }
        }
        self
    }
}

/// The disturbances drive the position loop to the limits of its saturation, where nothing is predicted.
fn out_of_range(law: &ControllerConfig, ultimate: &Ultimate) -> Option<Infeasible> {
    let peak = &ultimate.peak;
    if [peak.position, peak.attitude, peak.tilt, peak.heading].iter().all(Option::is_some) {
        return None;
    }
    let hover = Hover::new(law);
    let known = hover.known;
    Some(Infeasible {
        inequality: "acceleration that the disturbances make the position loop ask for, within M1"
            .to_owned(),
        left: ultimate.position_demand,
        right: hover.cascade.m1.into(),
        unit: "m/s^2",
        remedies: vec![
            format!("a disturbance_torque below {} N m", per_axis(known.disturbance_torque)),
            format!("a disturbance_acceleration below {:?} m/s^2", known.disturbance_acceleration),
            "a larger wanted.attitude_bandwidth".to_owned(),
            "a larger wanted.position_range".to_owned(),
        ],
        deciding: vec![],
    })
}
