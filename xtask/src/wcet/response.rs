//! Response times under fixed priorities with preemption.
//!
//! The recurrence of Joseph and Pandya (1986) with blocking, as in the priority ceiling protocol that RTIC's
//! locks are (Sha, Rajkumar and Lehoczky 1990):
//!
//! ```text
//! R = C + B + sum over higher priorities j of N_j(R) C_j
//! N_j(R) = min(n_j ceil(R / T_j), ceil(R / s_j)): jobs that come in bunches of n_j per period, s_j apart at least
//! ```

/// One source of demand on the processor, in cycles.
#[derive(Clone, Debug)]
pub struct Demand {
    /// What asks for it.
    pub name: String,
    /// Task that serves it.
    pub task: String,
    /// The highest number is served first.
    pub priority: u64,
    /// Most for each job, with the exceptions' entry and exit.
    pub cost: u64,
    /// Most jobs per period.
    pub jobs: u64,
    /// Period.
    pub period: u64,
    /// Least time between two jobs.
    pub spacing: u64,
}

impl Demand {
    /// Most cycles that the jobs of an interval take.
    fn within(&self, interval: u64) -> u64 {
        let bunches = self.jobs * interval.div_ceil(self.period);
        bunches.min(interval.div_ceil(self.spacing)) * self.cost
    }
}

/// Response time of a job that costs `cost`, delayed by `blocking` and by the demands that go before it; none if it
/// is not done after `limit`.
pub fn response(cost: u64, blocking: u64, before: &[&Demand], limit: u64) -> Option<u64> {
    let mut response = cost + blocking;
    while response <= limit {
        let delays = before.iter().map(|demand| demand.within(response));
        let next = cost + blocking + delays.sum::<u64>();
        if next == response {
            return Some(response);
        }
        response = next;
    }
    None
}

/// Part of the processor that the demands take in the long run.
pub fn utilisation(demands: &[Demand]) -> f64 {
    let share = |demand: &Demand| (demand.jobs * demand.cost) as f64 / demand.period as f64;
    demands.iter().map(share).sum()
}

#[cfg(test)]
mod tests {
    use super::{Demand, response, utilisation};

    /// The example of Burns and Wellings, *Real-Time Systems and Programming Languages*: periods 80, 40, 20,
    /// costs 40, 10, 5; responses 80, 15, 5.
    fn example() -> Vec<Demand> {
        [("a", 1, 40, 80), ("b", 2, 10, 40), ("c", 3, 5, 20)]
            .map(|(name, priority, cost, period)| Demand {
                name: name.into(),
                task: name.into(),
                priority,
                cost,
                jobs: 1,
                period,
                spacing: period,
            })
            .into()
    }

    fn at(cost: u64, priority: u64, blocking: u64, limit: u64) -> Option<u64> {
        let demands = example();
        let before: Vec<_> = demands.iter().filter(|demand| demand.priority > priority).collect();
        response(cost, blocking, &before, limit)
    }

    #[test]
    fn the_textbooks_example_has_its_response_times() {
        let of = |cost, priority| at(cost, priority, 0, 1000);
        assert_eq!((of(40, 1), of(10, 2), of(5, 3)), (Some(80), Some(15), Some(5)));
        assert_eq!(utilisation(&example()), 1.0);
    }

    #[test]
    fn blocking_and_overload_count() {
        assert_eq!(at(5, 3, 7, 1000), Some(12));
        assert_eq!(at(10, 2, 7, 1000), Some(27));
        assert_eq!(at(41, 1, 0, 80), None);
        assert_eq!(at(200, 0, 0, 1_000_000), None);
    }

    #[test]
    fn jobs_of_a_bunch_come_no_closer_than_they_can() {
        // Ten bytes of 2 in 100, 5 apart.
        let name = || "bytes".to_owned();
        let (priority, cost, jobs) = (2, 2, 10);
        let demand =
            Demand { name: name(), task: name(), priority, cost, jobs, period: 100, spacing: 5 };
        assert_eq!([1, 6, 50, 100, 101].map(|time| demand.within(time)), [2, 4, 20, 20, 40]);
        assert_eq!(utilisation(std::slice::from_ref(&demand)), 0.2);
        // 30 and two for each 5 begun: 30 + 10 * 2 within 50.
        assert_eq!(response(30, 0, &[&demand], 1000), Some(50));
    }
}
