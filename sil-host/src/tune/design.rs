//! The gains: a first guess in closed form, then larger or better damped until the surveyed poles
//! are where they were wanted at every corner, and small enough for every inequality of the core.

use ctrl_core::config::CascadeGains;
use ctrl_core::error::{Bound, Condition, ConfigError};
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::GRAVITY;
use glam::DVec3;

use super::assembly::assembled;
use super::digits::{rounded, rounded_down};
use super::hover::Hover;
use super::infeasible::{Infeasible, Remedy};
use super::lasting;
use super::margin::{Rotors, margins};
use super::noise::activity;
use super::request::Request;
use super::returning::return_speeds;
use super::room::{acceleration, auxiliary_gain};
use super::survey::{LoopSurvey, Met, Which};
use ctrl_core::controller::ControllerConfig;
use sim::number::number;

const G: f64 = GRAVITY as f64;

/// Slope of `D1 h(G, delta)` through `k2`, relative to that of the saturations: small, so that the
/// loop is much the same for small signals and for large ones.
const TRANSLATION_SLOPE: f64 = 0.25;

/// Slopes of the rotational smooth sign at zero to try, as multiples of `k4`: the steepest that the step
/// period allows leaves the smallest error.
const ROTATION_SLOPES: [f64; 5] = [4.0, 2.0, 1.0, 0.5, 0.25];

/// Share of the position loop's damping that the coupling term may take or give.
const COUPLING: f64 = 0.02;

/// Shares of `M1` in `M1 + M2` to try, from a half on: the larger one returns faster from far away.
const POSITION_SHARES: u32 = 11;

/// Growth of a factor of the guess at a time, and the most times.
const GROWTH: f64 = 1.04;
const ROUNDS: u32 = 60;

/// Every condition of the controller's constructor, whether it holds or not.
#[must_use]
pub fn audit(law: &ControllerConfig) -> Vec<Condition> {
    let mut conditions = Vec::new();
    let see = |condition: &Condition| conditions.push(*condition);
    match law {
        ControllerConfig::RobustAdaptive(config) => RobustAdaptive::audit(config, see),
        ControllerConfig::Saturated(config) => Saturated::audit(config, see),
    }
    conditions
}

/// Asks the core's constructor.
///
/// # Errors
/// The first condition that does not hold.
pub fn accept(law: &ControllerConfig) -> Result<(), ConfigError> {
    match law {
        ControllerConfig::RobustAdaptive(config) => RobustAdaptive::new(config).map(drop),
        ControllerConfig::Saturated(config) => Saturated::new(config).map(drop),
    }
}

/// `law` with the share `margin` of its inequalities' headroom used up: accelerations larger, or the step
/// longer, by `1/(1 - margin)`. The core must still accept each.
#[must_use]
pub fn stressed(law: &ControllerConfig, margin: f64) -> [ControllerConfig; 2] {
    let factor = (1.0 / (1.0 - margin)) as f32;
    let (mut pushed, mut slowed) = (*law, *law);
    let cascade = pushed.cascade_mut();
    cascade.m1 *= factor;
    cascade.m2 *= factor;
    match &mut slowed {
        ControllerConfig::RobustAdaptive(config) => config.step_period *= factor,
        ControllerConfig::Saturated(config) => config.step_period *= factor,
    }
    [pushed, slowed]
}

/// By what the first guess is multiplied.
#[derive(Clone, Copy, Debug)]
struct Factors {
    position: f64,
    position_damping: f64,
    attitude: f64,
    attitude_damping: f64,
    /// As those of the attitude while the axes are alike.
    heading: f64,
    heading_damping: f64,
    rotation_slope: f64,
    /// Share of `M1` in `M1 + M2`.
    position_share: f64,
}

/// Gains that meet `request`.
///
/// # Errors
/// The inequality that no choice of gains meets.
pub fn design(request: &Request) -> Result<ControllerConfig, Infeasible> {
    let asked = request.wanted.return_speed;
    let mut fastest = 0.0f64;
    for step in 0..POSITION_SHARES {
        let law = with_position_share(request, 0.5 + 0.02 * f64::from(step))?;
        let [along, up] = return_speeds(&law);
        fastest = fastest.max(along.min(up));
        if fastest >= asked {
            return Ok(law);
        }
    }
    Err(Infeasible {
        inequality:
            "speed of return from far away asked against the most that M1 up to 0.7 (M1 + M2) \
                     leaves on the slower axis"
                .to_owned(),
        left: asked,
        right: fastest,
        unit: "m/s",
        remedies: vec!["a larger wanted.damping".to_owned()],
        deciding: vec![(Remedy::PositionBandwidth, request.wanted.position_bandwidth)],
    })
}

/// Gains with that share of `M1` in `M1 + M2`.
fn with_position_share(request: &Request, share: f64) -> Result<ControllerConfig, Infeasible> {
    let asked = request.wanted.rotation_slope;
    let slopes = asked.map_or_else(|| ROTATION_SLOPES.to_vec(), |slope| vec![slope]);
    let found = |slope| search(request, slope, share).and_then(|law| quiet(request, law));
    let mut outcomes = slopes.into_iter().map(found);
    let steepest = outcomes.next().expect("there are slopes to try");
    // The error of the least slope is that of the gains that ask least of the step period.
    let mut law = outcomes.fold(steepest, |kept, next| if kept.is_ok() { kept } else { next })?;
    adapt_mass(&mut law, request.wanted.damping);
    lasting::adapt(request, &mut law)?;
    with_margin(&law, request.wanted.margin).map_err(|error| refused(request, &error))?;
    Ok(law)
}

/// Checks that the core accepts `law` with `margin`.
///
/// # Errors
/// The first condition that does not hold, as it stands under the stress.
pub fn with_margin(law: &ControllerConfig, margin: f64) -> Result<(), ConfigError> {
    stressed(law, margin).iter().try_for_each(accept)
}

/// Grows the factors until the poles are where they were wanted.
fn search(
    request: &Request,
    rotation_slope: f64,
    position_share: f64,
) -> Result<ControllerConfig, Infeasible> {
    let wanted = &request.wanted;
    let mut factors = Factors {
        position: 1.0,
        position_damping: 1.0,
        attitude: 1.0,
        attitude_damping: 1.0,
        heading: 1.0,
        heading_damping: 1.0,
        rotation_slope,
        position_share,
    };
    let mut fault = None;
    let alike = request.axes_alike();
    for _ in 0..ROUNDS {
        if alike {
            factors.heading = factors.attitude;
            factors.heading_damping = factors.attitude_damping;
        }
        let law = first_guess(request, &factors)?;
        with_margin(&law, wanted.margin).map_err(|error| refused(request, &error))?;
        let [lateral, vertical, attitude] =
            [Which::Lateral, Which::Vertical, Which::Attitude].map(|it| LoopSurvey::new(it, &law));
        fault = None;
        let mut short = |met: f64, asked: f64, factor: &mut f64, what: (&LoopSurvey, bool)| {
            if met < asked {
                *factor *= GROWTH;
                fault = Some((what.0.clone(), what.1));
            }
        };
        let bandwidth = wanted.position_bandwidth;
        short(
            attitude.bandwidth.value,
            wanted.attitude_bandwidth,
            &mut factors.attitude,
            (&attitude, true),
        );
        short(
            attitude.damping.value,
            wanted.damping,
            &mut factors.attitude_damping,
            (&attitude, false),
        );
        if !alike {
            let heading = LoopSurvey::new(Which::Heading, &law);
            let Met { value, .. } = heading.bandwidth;
            short(value, wanted.heading_bandwidth, &mut factors.heading, (&heading, true));
            let Met { value, .. } = heading.damping;
            short(value, wanted.damping, &mut factors.heading_damping, (&heading, false));
        }
        short(
            vertical.damping.value,
            wanted.damping,
            &mut factors.position_damping,
            (&vertical, false),
        );
        short(vertical.bandwidth.value, bandwidth, &mut factors.position, (&vertical, true));
        if vertical.bandwidth.value >= bandwidth {
            short(lateral.bandwidth.value, bandwidth, &mut factors.position, (&lateral, true));
        }
        // The slow pair of poles is the position's, which the lag of the tilt costs damping: more of
        // it, or a faster attitude. The fast pair is the attitude's.
        let asked = wanted.damping;
        let middle = (bandwidth * wanted.attitude_bandwidth).sqrt();
        if lateral.damping.pole.modulus() < middle {
            short(lateral.damping.value, asked, &mut factors.position_damping, (&lateral, false));
            short(lateral.damping.value, asked, &mut factors.attitude, (&lateral, false));
        } else {
            short(lateral.damping.value, asked, &mut factors.attitude_damping, (&lateral, false));
        }
        if fault.is_none() {
            return behind_rotors(request, law);
        }
    }
    Err(poles_out_of_reach(request, &fault.expect("a fault kept the search going")))
}

/// `law`, if the rate noise makes no more torque activity than was asked for.
fn quiet(request: &Request, law: ControllerConfig) -> Result<ControllerConfig, Infeasible> {
    let Request { rate_noise, rotors, rate_filter, wanted, .. } = request;
    if *rate_noise == 0.0 {
        return Ok(law);
    }
    let found = activity(&law, *rate_noise, rotors, rate_filter);
    let asked = wanted.noise_torque_max.map(|most| ("rms over all axes", found.torque, most));
    let limits = request.limits.map_or(DVec3::INFINITY, |limits| limits.torque_max.as_dvec3());
    let axis = (found.axes / limits).max_position();
    let clipped =
        ("three standard deviations about one axis", 3.0 * found.axes[axis], limits[axis]);
    let over = asked.into_iter().chain([clipped]).find(|(_, torque, most)| torque > most);
    let Some((which, left, right)) = over else { return Ok(law) };
    let bound = if which == clipped.0 { "torque_max" } else { "wanted.noise_torque_max" };
    Err(Infeasible {
        inequality: format!(
            "torque that rate noise of {} rad/s makes, {which}, within {bound}",
            number(*rate_noise)
        ),
        left,
        right,
        unit: "N m",
        remedies: vec![
            "a smaller wanted.rotation_slope".to_owned(),
            "a rate_filter".to_owned(),
            "a smaller wanted.position_bandwidth".to_owned(),
        ],
        deciding: vec![(Remedy::AttitudeBandwidth, wanted.attitude_bandwidth)],
    })
}

/// `law`, if its loops have the phase margin asked for behind rotors that lag or delay.
fn behind_rotors(request: &Request, law: ControllerConfig) -> Result<ControllerConfig, Infeasible> {
    let Rotors { lag, delay } = request.rotors;
    if request.rotors.is_prompt() && request.rate_filter.is_empty() {
        return Ok(law);
    }
    let asked = request.wanted.phase_margin_deg;
    let all = margins(&law, &request.rotors, &request.rate_filter);
    let least = all.into_iter().min_by(|a, b| a.phase.total_cmp(&b.phase));
    let Some(least) = least.filter(|it| it.phase.to_degrees() < asked) else { return Ok(law) };
    let filters = if request.rate_filter.is_empty() { "" } else { " and filters of the rate" };
    let slower = match least.which {
        Which::Heading | Which::HeadingIntegral => {
            (Remedy::HeadingBandwidth, request.wanted.heading_bandwidth)
        }
        _ => (Remedy::AttitudeBandwidth, request.wanted.attitude_bandwidth),
    };
    let lead = request.wanted.rotor_lead.unwrap_or(1.0);
    let led = (lag > 0.0).then_some((Remedy::RotorLead, lead));
    Err(Infeasible {
        inequality: format!(
            "phase margin asked of the loop of {} against what rotors with a lag of {} s and a delay of {} s{filters} \
             leave it (with this delay it is stable up to a lag of {} s)",
            least.which.name(),
            number(lag),
            number(delay),
            number(least.lag),
        ),
        left: asked,
        right: least.phase.to_degrees(),
        unit: "deg",
        remedies: vec!["faster rotors".to_owned(), "a smaller disturbance_torque".to_owned()],
        deciding: [slower].into_iter().chain(led).collect(),
    })
}

fn poles_out_of_reach(request: &Request, (survey, bandwidth): &(LoopSurvey, bool)) -> Infeasible {
    let (what, unit, met, asked) = if *bandwidth {
        let wanted = &request.wanted;
        let asked = match survey.which {
            Which::Attitude => wanted.attitude_bandwidth,
            Which::Heading => wanted.heading_bandwidth,
            _ => wanted.position_bandwidth,
        };
        ("bandwidth", "rad/s", survey.bandwidth, asked)
    } else {
        ("damping", "of critical", survey.damping, request.wanted.damping)
    };
    let corner = met.corner;
    Infeasible {
        inequality: format!(
            "{what} asked of the loop of {} against what it has at inertia {} kg m^2, taken for {}",
            survey.which.name(),
            number(corner.inertia),
            number(corner.inertia_estimate)
        ),
        left: asked,
        right: met.value,
        unit,
        remedies: vec!["a narrower interval of the inertia".to_owned()],
        deciding: vec![match (bandwidth, survey.which) {
            (false, _) => (Remedy::Damping, met.value),
            (true, Which::Attitude) => (Remedy::AttitudeBandwidth, met.value),
            (true, Which::Heading) => (Remedy::HeadingBandwidth, met.value),
            (true, _) => (Remedy::PositionBandwidth, met.value),
        }],
    }
}

/// The core refuses gains with the margin taken off.
fn refused(request: &Request, error: &ConfigError) -> Infeasible {
    let ConfigError { parameter, value, bound, source, .. } = *error;
    let right = match bound {
        Bound::AtMost(limit) | Bound::Below(limit) => limit.into(),
        _ => f64::NAN,
    };
    let left = f64::from(value);
    let margin = number(request.wanted.margin);
    let mut remedies = vec!["a smaller wanted.attitude_bandwidth".to_owned()];
    let mut deciding = vec![];
    if parameter.starts_with("step_period") {
        let needed = f64::from(request.step_period) * right / left;
        deciding.push((Remedy::StepPeriod, needed));
        remedies.push("a narrower interval of the inertia".to_owned());
    }
    Infeasible {
        inequality: format!("{parameter} must be {bound} with a margin of {margin} ({source})"),
        left,
        right,
        unit: "with the margin taken off",
        remedies,
        deciding,
    }
}

/// Gains in closed form, see `docs/tune.md`, for loops `factors` times as fast and damped as wanted.
fn first_guess(request: &Request, factors: &Factors) -> Result<ControllerConfig, Infeasible> {
    let Request { known, wanted, .. } = request;
    let position = factors.position * wanted.position_bandwidth;
    let tilting = factors.attitude * wanted.attitude_bandwidth;
    let heading = factors.heading * wanted.heading_bandwidth;
    let attitude = DVec3::new(tilting, tilting, heading);
    let sum = acceleration(request, position)?;
    let k5 = auxiliary_gain(request, attitude)?;
    let share = factors.position_share;
    let [m1, m2] = [share, 1.0 - share].map(|share| rounded_down(share * sum));
    let middle = 0.5 * (m1 + m2);
    let k1 = rounded(position * position / m1);
    let k2 = rounded(factors.position_damping * wanted.damping * position / middle);
    let k3 = (2.0 * attitude).map(rounded);
    let (damping, turning) = (factors.attitude_damping, factors.heading_damping);
    let damping = DVec3::new(damping, damping, turning) * wanted.damping;
    let axes = [0, 1, 2].map(|axis| rate_gain(request, axis, k3[axis], damping[axis]));
    let k4 = DVec3::from(axes).map(rounded);
    let d1 = f64::from(known.disturbance_acceleration);
    let d2 = known.disturbance_torque.as_dvec3();
    // Without a disturbance the width of its smooth sign does not matter.
    let width = |bound: f64, slope: f64, otherwise: f64| {
        rounded(if bound > 0.0 { bound / slope } else { otherwise })
    };
    let lower = known.inertia.lower.as_dvec3();
    let inertia = if request.limits.is_some() { lower } else { DVec3::ONE };
    // One width for all axes: the slope of none is steeper than wanted.
    let widths = d2 / (factors.rotation_slope * k4 * inertia);
    let delta_rotation = if d2 == DVec3::ZERO { 0.02 * tilting } else { widths.max_element() };
    let cascade = CascadeGains {
        k1: k1 as f32,
        k2: k2 as f32,
        k3: k3.as_vec3(),
        c: rounded(COUPLING * k3.x / (4.0 * G * G * (k2 + k1 / (2.0 * k2 * middle)))) as f32,
        m1: m1 as f32,
        m2: m2 as f32,
        gamma1: 0.0,
        delta_1: rounded(0.5 * wanted.position_bandwidth) as f32,
        delta_min_translation: width(d1, TRANSLATION_SLOPE / k2, 0.1 * k2 * m1) as f32,
        delta_min_rotation: rounded(delta_rotation) as f32,
    };
    Ok(assembled(request, cascade, k4, k5, attitude))
}

/// `k4` with which the attitude about `axis` has the damping ratio `damping` at least at the corner that
/// damps worst, without the smooth sign.
fn rate_gain(request: &Request, axis: usize, k3: f64, damping: f64) -> f64 {
    let inertia = request.known.inertia.axes()[axis];
    let (lower, upper) = (f64::from(inertia.lower), f64::from(inertia.upper));
    let square = damping * damping;
    if request.limits.is_none() {
        // (k4/J)^2 = 4 square (k4 k3 + 1)/(2 J) at J_hi, taken for nothing.
        let half = square * upper * k3;
        half + (half * half + 2.0 * square * upper).sqrt()
    } else {
        // r (k4 + k3/2)^2 = 2 square (k4 k3 + 1) at r = J_lo/J_hi.
        let r = lower / upper;
        let half = k3 * (square / r - 0.5);
        let root = half * half + 2.0 * square / r - 0.25 * k3 * k3;
        (half + root.max(0.0).sqrt()).max(0.5 * k3)
    }
}

/// The largest `gamma1` at which height keeps half the damping wanted while the mass adapts. The
/// slower mode that it adds is that of the estimate.
fn adapt_mass(law: &mut ControllerConfig, damping: f64) {
    let hover = Hover::new(law);
    let heaviest = f64::from(hover.known.mass.upper);
    let cascade = *law.cascade();
    let sum = f64::from(cascade.m1 + cascade.m2);
    let mut gain = 2.0 * sum / (heaviest * G).powi(2);
    for _ in 0..ROUNDS {
        law.cascade_mut().gamma1 = rounded(gain) as f32;
        let survey = LoopSurvey::new(Which::VerticalAdaptive, law);
        if survey.damping.value >= 0.5 * damping && survey.decay.value > 0.0 {
            return;
        }
        gain /= GROWTH * GROWTH;
    }
}
