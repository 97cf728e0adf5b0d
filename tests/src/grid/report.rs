//! Prints what was measured beside the bounds, and collects the flights that broke one.

use std::collections::BTreeMap;

use super::{Errors, LAST_LEG, Outcome, documented};

/// Speed (m/s) at which a vehicle that is still far must come closer, averaged over its last leg.
///
/// Saturated, the law of (13) returns at 1.4 to 2.4 m/s on a horizontal axis and at 0.49 to 0.59 m/s on
/// the vertical one with the shipped gains (`docs/verification.md`).
const RETURN_SPEED_MIN: f64 = 0.3;

impl Outcome {
    /// `true` if it is where the reference is.
    fn arrived(&self, bounds: &Errors) -> bool {
        self.settled.position <= bounds.position
    }

    /// `true` if it has just arrived, or comes closer: fast enough, or by half while the last metres
    /// take their exponential course.
    fn returns(&self, bounds: &Errors) -> bool {
        let [before, after] = self.last_leg;
        let closer = (RETURN_SPEED_MIN * LAST_LEG).min(0.5 * before);
        after <= bounds.position || before - after >= closer
    }

    /// The fault of the flight, if any. A flight `on_the_way` may end before it arrives.
    #[must_use]
    pub fn fault(&self, bounds: &Errors, on_the_way: bool) -> Option<String> {
        if let Some(breach) = self.breach {
            return Some(format!("{breach:?}"));
        }
        let orientation = Errors { position: 0.0, ..self.settled };
        if !orientation.within(bounds) {
            return Some(format!("{:?} after settling", self.settled));
        }
        let good = self.arrived(bounds) || on_the_way && self.returns(bounds);
        (!good).then(|| format!("{} m off, last leg {:?} m", self.settled.position, self.last_leg))
    }
}

/// Prints the largest errors by kind of disturbance beside the bounds of the page's `section`.
///
/// # Panics
/// When a flight broke a bound; names every such flight.
pub fn check(section: &str, outcomes: &[Outcome], on_the_way: bool) {
    let mut groups = BTreeMap::<_, Vec<&Outcome>>::new();
    for outcome in outcomes {
        groups.entry(format!("{:?}", outcome.case.disturbance)).or_default().push(outcome);
    }
    println!("{section}: measured (bound)");
    let mut faults = Vec::new();
    for (kind, group) in groups {
        let bounds = documented(section, group[0].case.disturbance);
        let at_home: Vec<_> = group.iter().filter(|outcome| outcome.arrived(&bounds)).collect();
        let worst = group.iter().map(|o| o.settled).fold(Errors::default(), Errors::max);
        let position = at_home.iter().map(|o| o.settled.position).fold(0.0, f64::max);
        let farthest = group.iter().map(|o| o.farthest).fold(0.0, f64::max);
        println!(
            "{kind:9} {} flights, {} arrived: position {position:.1e} ({:.0e}) m, attitude {:.1e} ({:.0e}), \
             tilt {:.1e} ({:.0e}), heading {:.1e} ({:.0e}) rad; farthest {farthest:.0} m",
            group.len(),
            at_home.len(),
            bounds.position,
            worst.attitude,
            bounds.attitude,
            worst.tilt,
            bounds.tilt,
            worst.heading,
            bounds.heading,
        );
        faults.extend(group.iter().filter_map(|outcome| {
            let fault = outcome.fault(&bounds, on_the_way)?;
            Some(format!("{}: {fault}", outcome.case))
        }));
    }
    assert!(faults.is_empty(), "{section}: {} flights:\n{}", faults.len(), faults.join("\n"));
}
