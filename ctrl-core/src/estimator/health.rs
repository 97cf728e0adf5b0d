//! Health of one source: stuck, jumping, missing, not finite.

/// Fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// Nothing was accepted for longer than its timeout, or ever.
    Missing,
    /// The same sample again and again.
    Stuck,
    /// Outside the gate again and again.
    Jumping,
    /// The last sample was not finite or out of every range.
    NotFinite,
}

/// Counters of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    last: [u32; 6],
    repetitions: u16,
    rejections: u16,
    unusable: bool,
    /// Step of the last accepted sample; none before the first.
    accepted: Option<u32>,
}

impl Health {
    /// Before the first sample.
    pub const NEW: Self =
        Self { last: [0; 6], repetitions: 0, rejections: 0, unusable: false, accepted: None };

    /// Receives a sample's numbers; `true` if it has been the same `limit` times in a row or more.
    #[inline(always)]
    pub(super) fn is_stuck<const N: usize>(&mut self, numbers: &[f32; N], limit: u16) -> bool {
        let mut same = true;
        // wcet: at most 6 iterations
        for (last, number) in self.last.iter_mut().zip(numbers) {
            same &= *last == number.to_bits();
            *last = number.to_bits();
        }
        self.repetitions = if same { self.repetitions.saturating_add(1) } else { 0 };
        self.unusable = false;
        self.repetitions >= limit - 1
    }

    /// The sample was taken in at `step`.
    #[inline(always)]
    pub(super) fn accept(&mut self, step: u32) {
        self.accepted = Some(step);
        self.rejections = 0;
    }

    /// The sample lay outside the gate.
    pub(super) fn reject(&mut self) {
        self.rejections = self.rejections.saturating_add(1);
    }

    /// The sample was not finite or out of every range.
    pub(super) fn refuse(&mut self) {
        self.unusable = true;
    }

    /// Rejections in a row.
    #[must_use]
    pub fn rejections(&self) -> u16 {
        self.rejections
    }

    /// Steps since the last accepted sample; none before the first.
    #[must_use]
    pub fn age(&self, step: u32) -> Option<u32> {
        self.accepted.map(|accepted| step.wrapping_sub(accepted))
    }

    /// The fault, the gravest first; `timeout` in steps.
    pub(super) fn fault(
        &self,
        step: u32,
        timeout: f32,
        limits: &super::FaultLimits,
    ) -> Option<Fault> {
        let missing = self.age(step).is_none_or(|age| age as f32 > timeout);
        if self.unusable {
            Some(Fault::NotFinite)
        } else if self.repetitions >= limits.repetitions - 1 {
            Some(Fault::Stuck)
        } else if self.rejections >= limits.rejections {
            Some(Fault::Jumping)
        } else {
            missing.then_some(Fault::Missing)
        }
    }
}
