//! A share of a campaign: consecutive runs, so that several machines take one each.

use std::ops::Range;
use std::str::FromStr;

/// Share of a campaign: its number and the number of shares; written `i/n`, counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    count: u32,
}

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Numbers of its runs, of `runs` in all. Shares differ by at most one run.
    #[must_use]
    pub fn range(self, runs: u32) -> Range<u32> {
        let end = |shards: u32| {
            let runs = u64::from(runs) * u64::from(shards) / u64::from(self.count);
            u32::try_from(runs).unwrap_or(u32::MAX)
        };
        end(self.number - 1)..end(self.number)
    }

    /// Name of its directory of results.
    #[must_use]
    pub fn directory_name(self, campaign: &str) -> String {
        let Self { number, count } = self;
        if self == Self::WHOLE {
            campaign.to_owned()
        } else {
            format!("{campaign}.{number}-of-{count}")
        }
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(number, count)| {
            Some(Self { number: number.parse().ok()?, count: count.parse().ok()? })
        });
        parts
            .filter(|shard| (1..=shard.count).contains(&shard.number))
            .ok_or_else(|| format!("`{text}` must be i/n with 1 <= i <= n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_cover_every_run_once() {
        for runs in [0, 1, 2, 7, 100, 65_536, u32::MAX] {
            for count in [1, 2, 3, 7, 64] {
                let mut next = 0;
                for number in 1..=count {
                    let range = Shard { number, count }.range(runs);
                    assert_eq!(range.start, next);
                    assert!(range.len() as u32 - runs / count <= 1);
                    next = range.end;
                }
                assert_eq!(next, runs);
            }
        }
    }

    #[test]
    fn shards_are_written_as_fractions_from_one_on() {
        assert_eq!("2/3".parse(), Ok(Shard { number: 2, count: 3 }));
        for wrong in ["0/3", "4/3", "1", "1/0", "-1/3", "a/b"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
        assert_eq!(Shard::WHOLE.directory_name("a"), "a");
        assert_eq!(Shard { number: 2, count: 3 }.directory_name("a"), "a.2-of-3");
    }
}
