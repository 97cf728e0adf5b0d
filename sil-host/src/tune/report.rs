//! Report of a proposal: a table, or the same as JSON.

use std::fmt::Write;

use ctrl_core::error::{Bound, Condition};
use serde_json::{Value, json};

use super::check::Check;
use super::design::{audit, stressed};
use super::document::controller;
use super::margin::Rotors;
use super::noise_trade::{Trade, trade};
use super::pole::Pole;
use super::proposal::Proposal;
use super::returning::{return_speeds, settling_times};
use super::steady::Steady;
use super::survey::{LoopSurvey, Met, Which};
use super::ultimate::Bounds;
use sim::number::number;

/// Names of the body axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Everything about a proposal and its check, if it was flown.
#[must_use]
pub fn table(proposal: &Proposal, check: Option<&Check>) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "\n{}: {}\n", proposal.request.name, wanted(proposal));
    text += &controller(&proposal.law);
    text += "\nInequalities of the core, all kept with the margin taken off:\n";
    text += &inequalities(proposal);
    text += "\nPoles at hover, nominal vehicle, small signals [1/s]; z of the sampled loop:\n";
    for survey in &proposal.surveys {
        text += &poles(survey, f64::from(proposal.law.step_period()));
    }
    text += "\nWorst over the corners of mass, inertia, its estimate and the smooth signs:\n";
    for survey in &proposal.surveys {
        text += &worst(survey, asked(proposal, survey.which));
    }
    text += &rotors(proposal);
    text += &push(proposal, check);
    text += "\nPredicted ultimate bounds, disturbances at their bounds:\n";
    text += &bounds(proposal, check);
    text += &noise(proposal, check);
    if let Some(check) = check {
        text += &flown(check);
    }
    text
}

/// Time until a lasting push is held.
fn push(proposal: &Proposal, check: Option<&Check>) -> String {
    let Some(predicted) = proposal.push_settling else { return String::new() };
    let Steady { acceleration, torque } = proposal.request.steady;
    let flown = check.and_then(|check| check.push).map_or_else(String::new, |push| {
        let longest = push.flown.map_or_else(|| "not held".to_owned(), |it| finite(it, "s"));
        format!(", flown {longest} ({} flights)", push.flights)
    });
    format!(
        "\nA push of {} m/s^2 and {} N m that lasts, at once: below 1 cm and 0.1 degree after {}{flown}\n",
        number(acceleration),
        number(torque),
        finite(predicted, "s")
    )
}

/// Torque activity under rate noise, and what other bandwidths would make of it.
fn noise(proposal: &Proposal, check: Option<&Check>) -> String {
    let Some(predicted) = proposal.activity else { return String::new() };
    let noise = number(proposal.request.rate_noise);
    let mut text = format!("\nTorque under rate noise of {noise} rad/s at every tick, in hover:\n");
    let flown = check.and_then(|check| check.noise).map(|noise| noise.flown);
    let shown = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), number);
    let _ = writeln!(text, "  {:<44} {:>10} {:>10}", "", "predicted", "flown");
    for (label, predicted, flown) in [
        ("rms over all axes [N m]", predicted.torque, flown.map(|it| it[0])),
        ("rms of its change per tick [N m]", predicted.change, flown.map(|it| it[1])),
    ] {
        let _ = writeln!(text, "  {label:<44} {:>10} {:>10}", number(predicted), shown(flown));
    }
    let _ = writeln!(
        text,
        "\n  {:>27}  {:>22}  {:>13}",
        "attitude bandwidth [rad/s]", "slope of smooth sign/k4", "torque [N m]"
    );
    for Trade { attitude_bandwidth, met } in trade(&proposal.request) {
        let (slope, torque) = match met {
            Some((slope, torque)) => (number(slope), number(torque)),
            None => ("-".to_owned(), "no gains".to_owned()),
        };
        let bandwidth = number(attitude_bandwidth);
        let _ = writeln!(text, "  {bandwidth:>27}  {slope:>22}  {torque:>13}");
    }
    text
}

fn wanted(proposal: &Proposal) -> String {
    let wanted = &proposal.request.wanted;
    let heading = if wanted.heading_bandwidth == wanted.attitude_bandwidth {
        String::new()
    } else {
        format!(" heading {} rad/s,", number(wanted.heading_bandwidth))
    };
    format!(
        "position {} rad/s, attitude {} rad/s,{heading} damping {}, margin {}",
        number(wanted.position_bandwidth),
        number(wanted.attitude_bandwidth),
        number(wanted.damping),
        number(wanted.margin)
    )
}

/// The conditions that compare two numbers; signs and finiteness are left out.
fn compared(conditions: Vec<Condition>) -> impl Iterator<Item = (Condition, f64)> {
    conditions.into_iter().filter_map(|condition| match condition.bound {
        Bound::AtMost(limit) | Bound::Below(limit) => Some((condition, f64::from(limit))),
        _ => None,
    })
}

fn inequalities(proposal: &Proposal) -> String {
    let mut text = String::new();
    for (condition, limit) in compared(audit(&proposal.law)) {
        let value = f64::from(condition.value);
        let relation = if matches!(condition.bound, Bound::Below(_)) { "<" } else { "<=" };
        let (left, right) = (number(value), number(limit));
        let (margin, name) = (number(limit - value), condition.parameter);
        let _ = writeln!(text, "  {left:>10} {relation:<2} {right:<8} margin {margin:<9} {name}");
    }
    text
}

fn poles(survey: &LoopSurvey, dt: f64) -> String {
    let upper = |poles: &[Pole]| poles.iter().filter(|pole| pole.im >= -1e-9).copied().collect();
    let (continuous, sampled): (Vec<Pole>, Vec<Pole>) =
        (upper(&survey.nominal), upper(&survey.nominal_sampled));
    let shown = |pole: &Pole| {
        let im = if pole.im > 1e-6 * pole.modulus() {
            format!(" +- {}i", number(pole.im))
        } else {
            String::new()
        };
        format!("{}{im}", number(pole.re))
    };
    let z = |pole: &Pole| number(pole.sampled_modulus(dt));
    let list = |of: Vec<String>| of.join(", ");
    format!(
        "  {:<22} {}   |z| {}\n",
        survey.which.name(),
        list(continuous.iter().map(shown).collect()),
        list(sampled.iter().map(z).collect())
    )
}

fn rotors(proposal: &Proposal) -> String {
    let Rotors { lag, delay } = proposal.request.rotors;
    let filter = &proposal.request.rate_filter;
    let filters = if filter.is_empty() { "" } else { " and the filters of the rate" };
    let residual = proposal.law.rotors().residual_lag;
    let led = if residual > 0.0 {
        format!(
            " of which the law's model with its lead leaves {} s for the torque",
            number(residual.into())
        )
    } else {
        String::new()
    };
    let mut text = format!(
        "\nMargins with a lag of {} s{led} and a delay of {} s{filters}, worst corner:\n",
        number(lag),
        number(delay)
    );
    for margins in &proposal.margins {
        let decibels = 20.0 * margins.gain.log10();
        let _ = writeln!(
            text,
            "  {:<22} phase {:.1} deg, gain {}, delay {} more, lag up to {}",
            margins.which.name(),
            margins.phase.to_degrees(),
            finite(decibels, "dB"),
            finite(1e3 * margins.delay, "ms"),
            finite(1e3 * margins.lag, "ms"),
        );
    }
    text + &returns(proposal)
}

/// A number with its unit; in words if there is no limit.
fn finite(x: f64, unit: &str) -> String {
    if x.is_finite() { format!("{x:.1} {unit}") } else { "any".to_owned() }
}

/// Start of the return whose time is told (m).
const FAR: f64 = 10.0;

fn returns(proposal: &Proposal) -> String {
    let [along, up] = return_speeds(&proposal.law).map(|speed| {
        if speed.is_finite() { format!("{} m/s", number(speed)) } else { "any speed".to_owned() }
    });
    let [settled, high] = settling_times(&proposal.law, FAR).map(|time| finite(time, "s"));
    format!(
        "\nReturn from far away: {along} on a horizontal axis, {up} on the vertical one\n\
         From rest {FAR} m away to within {} m: {settled} and {high}\n",
        0.05 * FAR
    )
}

/// Bandwidth and damping asked of a loop; none of the height while the mass adapts.
fn asked(proposal: &Proposal, which: Which) -> (Option<f64>, f64) {
    let wanted = &proposal.request.wanted;
    match which {
        Which::Attitude => (Some(wanted.attitude_bandwidth), wanted.damping),
        Which::Heading => (Some(wanted.heading_bandwidth), wanted.damping),
        _ if which.learns() => (None, 0.5 * wanted.damping),
        _ => (Some(wanted.position_bandwidth), wanted.damping),
    }
}

fn worst(survey: &LoopSurvey, (bandwidth, damping): (Option<f64>, f64)) -> String {
    let least = bandwidth.map_or_else(String::new, |asked| format!(" (>= {})", number(asked)));
    let damped = number(damping);
    format!(
        "  {:<22} bandwidth {}{least} rad/s{}\n{:<25}damping {} (>= {damped}){}; |z| <= {}\n",
        survey.which.name(),
        number(survey.bandwidth.value),
        corner(survey.which, &survey.bandwidth),
        "",
        number(survey.damping.value),
        corner(survey.which, &survey.damping),
        number(survey.sampled_modulus)
    )
}

fn corner(which: Which, met: &Met) -> String {
    let at = met.corner;
    match which {
        Which::Vertical => String::new(),
        Which::VerticalAdaptive => format!(" at {} kg", number(at.mass)),
        _ => {
            let [inertia, estimate] = [at.inertia, at.inertia_estimate].map(number);
            format!(" at J {inertia} taken for {estimate}{}", ["", " about y", " about z"][at.axis])
        }
    }
}

/// One of the bounds.
type Pick = fn(&Bounds) -> Option<f64>;

fn bounds(proposal: &Proposal, check: Option<&Check>) -> String {
    let ultimate = &proposal.ultimate;
    let mut text = format!("  {:<44} {:>10} {:>10} {:>10}\n", "", "rms", "peak", "observed");
    let rows: [(&str, &str, Pick); 5] = [
        ("position error [m]", "position error", |it| it.position),
        ("attitude error, angle of q_e [rad]", "attitude error", |it| it.attitude),
        ("tilt error [rad]", "tilt error", |it| it.tilt),
        ("heading error [rad]", "heading error", |it| it.heading),
        ("rate error w_e [rad/s]", "rate error", |it| it.rate_error),
    ];
    for (label, name, of) in rows {
        let comparisons = check.map_or(&[][..], |check| &check.comparisons);
        let seen = comparisons.iter().find(|it| it.name.starts_with(name));
        let shown = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), number);
        let observed = shown(seen.and_then(|it| it.observed));
        let (mean, peak) = (shown(of(&ultimate.mean)), shown(of(&ultimate.peak)));
        let _ = writeln!(text, "  {label:<44} {mean:>10} {peak:>10} {observed:>10}");
    }
    text
}

fn flown(check: &Check) -> String {
    let Check { flights, held, reasons, .. } = check;
    let mut text = format!("\n  {held} of {flights} check flights kept every guarantee\n");
    for reason in reasons {
        let _ = writeln!(text, "  FAIL {reason}");
    }
    if check.noise.is_some_and(|noise| !noise.passed()) {
        let _ = writeln!(text, "  FAIL torque under rate noise: not the predicted one to 10 %");
    }
    if check.push.is_some_and(|push| !push.passed()) {
        let _ = writeln!(text, "  FAIL a push that lasts: not held in the predicted time");
    }
    text
}

/// The same as JSON.
#[must_use]
pub fn json(proposal: &Proposal, check: Option<&Check>, passed: bool) -> String {
    let gains = toml_edit::de::from_str::<Value>(&controller(&proposal.law));
    let value = json!({
        "passed": passed,
        "request": proposal.request,
        "controller": gains.map(|it| it["controller"].clone()).unwrap_or_default(),
        "conditions": conditions(proposal),
        "loops": proposal.surveys.iter().map(of_loop).collect::<Vec<_>>(),
        "margins": proposal.margins,
        "return_speed": return_speeds(&proposal.law),
        "settling_time": settling_times(&proposal.law, FAR),
        "ultimate": proposal.ultimate,
        "activity": proposal.activity,
        "push_settling": proposal.push_settling,
        "check": check,
    });
    format!("{value:#}")
}

/// Every condition of the constructor, with its value once the margin is taken off.
fn conditions(proposal: &Proposal) -> Vec<Value> {
    let [pushed, slowed] = stressed(&proposal.law, proposal.request.wanted.margin);
    let all = audit(&proposal.law).into_iter().zip(audit(&pushed)).zip(audit(&slowed));
    all.map(|((it, pushed), slowed)| {
        json!({
            "parameter": it.parameter,
            "value": it.value,
            "bound": it.bound.to_string(),
            "source": it.source,
            "holds": it.holds(),
            "holds_with_margin": pushed.holds() && slowed.holds(),
        })
    })
    .collect()
}

fn of_loop(survey: &LoopSurvey) -> Value {
    let list = |poles: &[Pole]| poles.iter().map(|pole| [pole.re, pole.im]).collect::<Vec<_>>();
    let met = |met: &Met| {
        let at = met.corner;
        json!({
            "value": met.value,
            "axis": AXES[at.axis],
            "mass": at.mass,
            "inertia": at.inertia,
            "inertia_estimate": at.inertia_estimate,
            "translation_slope": at.translation_slope,
            "rotation_slope": at.rotation_slope,
        })
    };
    json!({
        "loop": survey.which,
        "poles": list(&survey.nominal),
        "sampled_poles": list(&survey.nominal_sampled),
        "bandwidth": met(&survey.bandwidth),
        "damping": met(&survey.damping),
        "sampled_modulus": survey.sampled_modulus,
    })
}
