//! Traffic of hosts and ground stations, and what it asks of the processor.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail};
use firmware::rate_loop::Group;
use firmware::rates;

use super::analysis::{Analysis, Cost};
use super::response::Demand;
use super::tasks::{Task, View, bounded, group, tick, us};
use super::timing::Model;
use crate::disassembly::Listing;
use crate::elf::Image;

/// Least time between two bytes of the link: 10 bits at 2 Mbit/s (us).
pub const BYTE: u64 = 5;
/// The same for the ground station's port, at 921,600 bit/s.
pub const MAVLINK_BYTE: u64 = 10;
/// Ticks between two bursts of samples.
const BURST_PERIOD: u64 = 20;

/// Constants of the sources, by name.
type Constants = &'static [(&'static str, u64)];

/// Traffic in flight, as response times assume it; beside it one other message of the host per 20 ms.
pub struct Traffic {
    /// Words for it.
    pub name: &'static str,
    /// Frames with samples or references per tick.
    frames: u64,
    /// Those of them that renew the inputs of the next tick: all but measurements.
    renewing: u64,
    /// Bytes of these per tick.
    bytes: u64,
    /// Constants for a release that finds all of it.
    constants: Constants,
    /// What comes more than this, once in [`BURST_PERIOD`] ticks.
    burst: Option<Burst>,
    /// Functions that such a release does not call, by parts of their names.
    without: &'static [&'static str],
    /// Bytes of a ground station per tick.
    station: u64,
    /// A task without a bound holds its locks, for example to carry out a message of a ground station.
    pub unbounded: bool,
    /// Tasks that have to meet their deadlines under it.
    pub hard: &'static [&'static str],
}

/// Samples that come at once.
struct Burst {
    /// Frames and bytes more than those of other ticks.
    frames: u64,
    bytes: u64,
    /// Constants for a release that finds all of the tick's frames.
    constants: Constants,
}

const RECEIVERS_AND_CONTROL: &[&str] = &["receive", "receive_mavlink", "control"];
const ALL: &[&str] =
    &["receive", "receive_mavlink", "control", "state_input", "telemetry", "housekeeping"];

/// A state takes 67 bytes, a reference 111, an inertial sample 44 at most and a measurement 27; a full line carries 200 per
/// millisecond. In a burst every sensor gives a measurement at once, behind two lost inertial samples: the
/// estimator predicts three times and corrects eight.
pub const TRAFFIC: [Traffic; 4] = [
    Traffic {
        name: "a state per tick",
        frames: 1,
        renewing: 1,
        station: 20,
        unbounded: false,
        bytes: 67,
        constants: &[("FRAMES_PER_RELEASE", 1), ("RECEIVED", 67)],
        burst: None,
        without: &[ESTIMATOR],
        hard: ALL,
    },
    Traffic {
        name: "the line full",
        frames: 2,
        renewing: 2,
        station: 93,
        unbounded: true,
        bytes: 200,
        constants: &[("FRAMES_PER_RELEASE", 2), ("RECEIVED", 200)],
        burst: None,
        without: &[ESTIMATOR],
        hard: RECEIVERS_AND_CONTROL,
    },
    Traffic {
        name: "by sensors",
        frames: 2,
        renewing: 1,
        station: 20,
        unbounded: false,
        bytes: 71,
        constants: BY_SENSORS,
        burst: None,
        without: &[REFERENCE, STATE],
        hard: ALL,
    },
    Traffic {
        name: "all sensors at once",
        frames: 2,
        renewing: 1,
        station: 20,
        unbounded: false,
        bytes: 71,
        constants: BY_SENSORS,
        burst: Some(Burst {
            frames: 7,
            bytes: 129,
            constants: &[("FRAMES_PER_RELEASE", 9), ("RECEIVED", 200)],
        }),
        without: &[REFERENCE, STATE],
        hard: RECEIVERS_AND_CONTROL,
    },
];

/// An inertial sample and one measurement, no sample lost; the estimator's loops as its test derives them.
const BY_SENSORS: Constants = &[
    ("FRAMES_PER_RELEASE", 2),
    ("RECEIVED", 71),
    ("MISSED_MAX", 0),
    ("MEASUREMENTS", 1),
    ("NOISE_COLUMNS", 42),
    ("NOISE_ELEMENTS", 214),
];

/// For a release that finds nothing.
const NOTHING: Constants = &[("FRAMES_PER_RELEASE", 0)];

/// The estimator aboard, which is off while the host sends states.
const ESTIMATOR: &str = "OnboardNavigation::step";
/// Parse a reference and a state, which the host does not stream then.
const REFERENCE: &str = "impl serde_core::de::Deserialize for ctrl_core::reference::Reference";
const STATE: &str = "impl serde_core::de::Deserialize for ctrl_core::vehicle::VehicleState";
/// Carries out a message that is no sample.
const HANDLE: &str = "firmware::session::HostSession::handle";
const FRAME: &str = "link::frame::Decoder<M>::take_frame";
/// Checks a text, which no sample has.
const TEXT: &str = "core::str::converts::from_utf8";
/// Kept by the release before, which was for the same tick.
const TRAJECTORY: &str = "ReferenceSource::on_trajectory";
const PILOT: &str = "Pilot::advance";
/// What a release does that changes the inputs.
const PREPARE: &str = "firmware::app::prepare";
const NEXT_FRAME: &str = "app::next_frame";

/// What the response times take for granted.
pub const CONTRACT: [&str; 7] = [
    "a ground station sends 20 bytes per millisecond, and none of its messages is being carried out (the line full: 93, and one is)",
    "the host sends a state per tick (67 bytes), or a state and a reference (the line full), or an inertial sample and one measurement (by sensors)",
    "all sensors at once: once in 20 ticks a measurement of each of eight sources, behind two lost inertial samples",
    "it sends one other message per 20 ms, in flight",
    "telemetry is not subscribed to faster than its own rate",
    "entering and leaving an exception costs 60 cycles, 30 for a handler that uses no floating-point register",
    "on the ground, where settings are checked, groups below control may miss their deadlines",
];

/// Cycles of entering and leaving an exception, and of the first fetches behind both: without wait states 12 and 12, and
/// with lazy stacking 17 more for each once the floating-point registers are used.
#[derive(Clone, Copy)]
pub struct Exception(u64);

impl Exception {
    /// Of a handler that starts at `start`.
    pub fn of(analysis: &Analysis, start: u64) -> Self {
        let (mut open, mut seen, mut floats) = (vec![start], BTreeSet::new(), false);
        while let Some(function) = open.pop().filter(|_| !floats) {
            if !seen.insert(function) {
                continue;
            }
            match analysis.known(function) {
                None => floats = true,
                Some(known) => {
                    let nodes = &known.graph.nodes;
                    floats |= nodes.values().any(|node| node.instruction.name().starts_with('v'));
                    open.extend(nodes.values().filter_map(|node| node.callee));
                }
            }
        }
        Self(if floats { 60 } else { 30 })
    }
}

/// Parts of state input's cost.
pub struct StateInput {
    /// A release that finds the samples of a tick.
    samples: Cost,
    /// One that finds those of a burst.
    burst: Option<Cost>,
    /// A release that renews the inputs once more.
    again: Cost,
    /// A release that finds nothing that renews them.
    nothing: Cost,
    /// A message that is neither state nor reference, with its frame.
    other: Vec<Cost>,
}

impl StateInput {
    /// From the image's machine code.
    pub fn bound(
        path: &std::path::Path,
        image: &Image,
        listing: &Listing,
        busy: &mut Analysis,
        traffic: &Traffic,
    ) -> Result<Self> {
        let start = |name: &str| image.named_like(name).map(|function| function.range.start);
        let root = image.named("DCMI")?.range.start;
        let other = [HANDLE, FRAME].map(|name| busy.cost(start(name)?));
        let release = |constants: &[(&'static str, u64)], without: &[&'static str]| {
            let view = View::new(path, constants, without)?;
            view.analysis(image, listing).cost(root)
        };
        let samples = [&[HANDLE, TEXT], traffic.without].concat();
        let again = [HANDLE, FRAME, TRAJECTORY, PILOT, ESTIMATOR, NEXT_FRAME];
        let burst = traffic.burst.as_ref().map(|burst| release(burst.constants, &samples));
        Ok(Self {
            samples: release(traffic.constants, &samples)?,
            burst: burst.transpose()?,
            again: release(NOTHING, &again)?,
            nothing: release(NOTHING, &[&again[..], &[PREPARE]].concat())?,
            other: other.into_iter().collect::<Result<_>>()?,
        })
    }
}

/// Demands of all tasks with a known rate.
pub fn demands(
    costs: &BTreeMap<String, (u64, Cost, Cost)>,
    exceptions: &BTreeMap<String, Exception>,
    tasks: &[Task],
    input: &StateInput,
    traffic: &Traffic,
    model: Model,
) -> Result<Vec<Demand>> {
    let mut demands = Vec::new();
    for task in bounded(tasks) {
        let mut add = |part: &str, cost: u64, jobs: u64, period: u64| {
            let (name, task, priority) =
                (format!("{}{part}", task.name), task.name.clone(), task.priority);
            let byte = if task == "receive_mavlink" { MAVLINK_BYTE } else { BYTE };
            let spacing = if jobs > 1 { us(byte) } else { period };
            demands.push(Demand { name, task, priority, cost, jobs, period, spacing });
        };
        let Exception(exception) = exceptions[&task.name];
        let busy = costs[&task.name].2.total(model) + exception;
        match (group(&task.name), &*task.name) {
            (_, "receive") => {
                add("", busy, traffic.bytes, us(tick()));
                if let Some(burst) = &traffic.burst {
                    add(", burst", busy, burst.bytes, us(BURST_PERIOD * tick()));
                }
            }
            (_, "receive_mavlink") => add("", busy, traffic.station, us(tick())),
            (Some(config), "state_input") => {
                // One release at the tick, and one at the end of each frame.
                let cost = |part: &Cost| part.total(model) + exception;
                let (again, nothing) = (cost(&input.again), cost(&input.nothing));
                let Traffic { frames, renewing, .. } = *traffic;
                let samples =
                    cost(&input.samples) + renewing * again + (frames - renewing) * nothing;
                add(", samples", samples, 1, us(u64::from(config.period) * tick()));
                if let (Some(found), Some(burst)) = (&input.burst, &traffic.burst) {
                    let more = cost(found) + burst.frames * nothing;
                    let burst = more.saturating_sub(cost(&input.samples));
                    add(", burst", burst, 1, us(BURST_PERIOD * tick()));
                }
                let other: u64 = input.other.iter().map(|cost| cost.total(model)).sum();
                let telemetry = rates::CONFIG.groups[Group::Telemetry as usize];
                add(", others", other + again, 1, us(u64::from(telemetry.period) * tick()));
            }
            (Some(config), _) => add("", busy, 1, us(u64::from(config.period) * tick())),
            (None, name) => bail!("nothing says how often `{name}` is released: add it here"),
        }
    }
    Ok(demands)
}
