//! Faults of the line between host and vehicle, injected by a seeded schedule.

use std::collections::VecDeque;
use std::str::FromStr;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::recording::Direction;

/// Ticks that a delayed frame is late: longer than a sample stands for.
pub const DELAY: u64 = 8;
/// Most bytes of a burst of garbage.
pub const GARBAGE_MAX: u64 = 300;

/// Fault of a frame on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It does not arrive.
    Lost,
    /// It arrives twice.
    Duplicated,
    /// It arrives after the frames of the next tick.
    Reordered,
    /// Its end is missing, delimiter included.
    Truncated,
    /// One bit is another.
    Flipped,
    /// It arrives [`DELAY`] ticks late.
    Delayed,
    /// Random bytes come before it.
    Garbage,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 7] = [
        Self::Lost,
        Self::Duplicated,
        Self::Reordered,
        Self::Truncated,
        Self::Flipped,
        Self::Delayed,
        Self::Garbage,
    ];
}

impl FromStr for Fault {
    type Err = String;

    /// The fault of that name in lower case.
    fn from_str(name: &str) -> Result<Self, String> {
        let named = |fault: &Self| format!("{fault:?}").eq_ignore_ascii_case(name);
        Self::ALL.into_iter().find(named).ok_or_else(|| {
            let known = Self::ALL.map(|fault| format!("{fault:?}").to_lowercase());
            format!("no fault `{name}`: choose from {}", known.join(", "))
        })
    }
}

impl FromStr for FaultDirection {
    type Err = String;

    /// `up`, `down` or `both`.
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "up" => Ok(Self::Up),
            "down" => Ok(Self::Down),
            "both" => Ok(Self::Both),
            _ => Err(format!("no direction `{name}`: choose from up, down, both")),
        }
    }
}

/// The damaged direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FaultDirection {
    /// Those to the vehicle.
    #[default]
    Up,
    /// Those from the vehicle.
    Down,
    /// All.
    Both,
}

impl FaultDirection {
    /// The directions.
    #[must_use]
    pub fn directions(self) -> &'static [Direction] {
        match self {
            Self::Up => &[Direction::ToVehicle],
            Self::Down => &[Direction::FromVehicle],
            Self::Both => &Direction::BOTH,
        }
    }
}

/// Damages frames at random; the same seed damages the same frames. The first tick, which starts a
/// flight, is spared.
#[derive(Clone, Debug)]
pub struct LinkFaults {
    random: Xoshiro256PlusPlus,
    kinds: Vec<Fault>,
    /// A frame is damaged when a random number is below.
    threshold: u64,
    late: VecDeque<(u64, Vec<u8>)>,
    tick: u64,
    injected: u32,
}

impl LinkFaults {
    /// Damages a share `rate` of all frames, in 0 to 1, with any of `kinds`.
    #[must_use]
    pub fn new(seed: u64, kinds: &[Fault], rate: f64) -> Self {
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            kinds: kinds.to_vec(),
            threshold: (rate.clamp(0.0, 1.0) * u64::MAX as f64) as u64,
            late: VecDeque::new(),
            tick: 0,
            injected: 0,
        }
    }

    /// Frames that were damaged.
    #[must_use]
    pub fn injected(&self) -> u32 {
        self.injected
    }

    /// Bytes that arrive in a tick in which `frames` are sent.
    pub fn pass(&mut self, frames: Vec<Vec<u8>>) -> Vec<u8> {
        let mut line = Vec::new();
        for frame in frames {
            if self.tick == 0 || self.kinds.is_empty() || self.random.next_u64() >= self.threshold {
                line.extend_from_slice(&frame);
            } else {
                self.injected += 1;
                let index = self.below(self.kinds.len() as u64) as usize;
                self.damage(self.kinds[index], frame, &mut line);
            }
        }
        let (due, late) = self.late.drain(..).partition(|(due, _)| *due <= self.tick);
        self.late = late;
        let due: VecDeque<_> = due;
        due.into_iter().for_each(|(_, frame)| line.extend(frame));
        self.tick += 1;
        line
    }

    fn damage(&mut self, kind: Fault, mut frame: Vec<u8>, line: &mut Vec<u8>) {
        match kind {
            Fault::Lost => {}
            Fault::Duplicated => line.extend(frame.repeat(2)),
            Fault::Reordered => self.late.push_back((self.tick + 1, frame)),
            Fault::Delayed => self.late.push_back((self.tick + DELAY, frame)),
            Fault::Truncated => {
                frame.truncate(self.below(frame.len() as u64) as usize);
                line.extend(frame);
            }
            Fault::Flipped => {
                let bit = self.below(8 * frame.len() as u64);
                frame[(bit / 8) as usize] ^= 1 << (bit % 8);
                line.extend(frame);
            }
            Fault::Garbage => {
                for _ in 0..=self.below(GARBAGE_MAX) {
                    line.push(self.random.next_u64() as u8);
                }
                line.extend(frame);
            }
        }
    }

    /// A random number below `end`, which is small and not zero.
    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: [u8; 4] = [3, 1, 2, 0];

    fn pass(kind: Fault, ticks: usize) -> Vec<Vec<u8>> {
        let mut faults = LinkFaults::new(1, &[kind], 1.0);
        assert_eq!(faults.pass(vec![FRAME.to_vec()]), FRAME);
        let passed = (0..ticks).map(|_| faults.pass(vec![FRAME.to_vec()])).collect();
        assert_eq!(faults.injected() as usize, ticks);
        passed
    }

    #[test]
    fn each_fault_does_what_it_is_called() {
        assert_eq!(pass(Fault::Lost, 1), [Vec::<u8>::new(); 1]);
        assert_eq!(pass(Fault::Duplicated, 1), [FRAME.repeat(2)]);
        assert_eq!(pass(Fault::Reordered, 2), [Vec::new(), FRAME.to_vec()]);
        let delayed = pass(Fault::Delayed, 10);
        assert!(delayed.iter().take(8).all(Vec::is_empty));
        assert_eq!(delayed[8..], [FRAME.to_vec(), FRAME.to_vec()]);
        for line in pass(Fault::Truncated, 50) {
            assert!(line.len() < 4 && FRAME.starts_with(&line));
        }
        for line in pass(Fault::Flipped, 50) {
            let changed: u32 = line.iter().zip(FRAME).map(|(a, b)| (a ^ b).count_ones()).sum();
            assert_eq!((line.len(), changed), (4, 1));
        }
        for line in pass(Fault::Garbage, 50) {
            assert!(line.len() > 4 && line.ends_with(&FRAME));
        }
    }

    #[test]
    fn the_seed_decides_and_the_rate_is_kept() {
        let run = |seed| {
            let mut faults = LinkFaults::new(seed, &Fault::ALL, 0.1);
            let lines: Vec<_> = (0..10_000).map(|_| faults.pass(vec![FRAME.to_vec()])).collect();
            (lines, faults.injected())
        };
        assert_eq!(run(5), run(5));
        assert_ne!(run(5).0, run(6).0);
        assert!((900..1100).contains(&run(5).1), "{}", run(5).1);
        let mut none = LinkFaults::new(5, &Fault::ALL, 0.0);
        assert_eq!(none.pass(vec![FRAME.to_vec(); 3]), FRAME.repeat(3));
    }
}
