//! One replica: particles that climb a score.

use super::Splitting;
use super::walk::{Place, Walk};

/// Score of a flight that violates the guarantee is positive; one that was refused has none.
pub type Score = Option<f64>;

/// A run with its score.
#[derive(Clone, Debug)]
struct Particle {
    place: Place,
    score: f64,
}

/// Particles, asked for a run to fly and told its score, one after the other.
#[derive(Clone, Debug)]
pub struct Replica {
    walk: Walk,
    dimensions: usize,
    size: usize,
    steps: u32,
    particles: Vec<Particle>,
    climb: Option<Climb>,
    /// `J`: particles replaced.
    pub replaced: u64,
    /// Proposals, and those of them that were accepted.
    pub proposed: u64,
    /// Proposals accepted.
    pub accepted: u64,
}

/// The walk of the copy that replaces the lowest particle.
#[derive(Clone, Debug)]
struct Climb {
    lowest: usize,
    level: (f64, f64),
    here: Particle,
    left: u32,
    accepted: u32,
}

impl Replica {
    /// Replica `number` of a campaign whose first seed is `seed`.
    pub fn new(splitting: &Splitting, seed: u32, number: u32, dimensions: usize) -> Self {
        Self {
            walk: Walk::new(seed.into(), number),
            dimensions,
            size: splitting.particles as usize,
            steps: splitting.steps,
            particles: Vec::new(),
            climb: None,
            replaced: 0,
            proposed: 0,
            accepted: 0,
        }
    }

    /// `true` once every particle violates the guarantee.
    pub fn is_done(&self) -> bool {
        self.particles.len() == self.size
            && self.climb.is_none()
            && self.particles.iter().all(|particle| particle.score > 0.0)
    }

    /// Places of the particles.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        self.particles.iter().map(|particle| &particle.place)
    }

    /// The next run to fly; none once it is done.
    pub fn ask(&mut self) -> Option<Place> {
        if self.particles.len() < self.size {
            return Some(self.walk.anywhere(self.dimensions));
        }
        if self.is_done() {
            return None;
        }
        let climb = match self.climb.take() {
            Some(climb) => climb,
            None => self.begin(),
        };
        let proposal = self.walk.proposal(&climb.here.place);
        self.climb = Some(climb);
        Some(proposal)
    }

    /// Takes the score of the run that was asked for last; `true` if it is kept.
    pub fn tell(&mut self, place: Place, score: Score) -> bool {
        let Some(climb) = &mut self.climb else {
            // Refused runs are no part of the distribution: another one is drawn.
            self.particles.extend(score.map(|score| Particle { place, score }));
            return score.is_some();
        };
        let above = score.is_some_and(|score| (score, place.order) > climb.level);
        if let Some(score) = score.filter(|_| above) {
            climb.here = Particle { place, score };
            climb.accepted += 1;
        }
        // A copy that stays where it is differs by its order all the same: no two particles are equal.
        let here = &mut climb.here;
        let least = if here.score > climb.level.0 { 0.0 } else { climb.level.1 };
        here.place.order = self.walk.order(least);
        climb.left -= 1;
        if climb.left == 0 {
            self.end();
        }
        above
    }

    /// Begins the walk of a copy in place of the lowest particle.
    fn begin(&mut self) -> Climb {
        let height = |index: &usize| {
            let particle = &self.particles[*index];
            (particle.score, particle.place.order)
        };
        let lowest = (0..self.size).min_by(|a, b| {
            let (a, b) = (height(a), height(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let lowest = lowest.unwrap_or_default();
        let level = height(&lowest);
        let other = self.walk.choice(self.size - 1);
        let here = self.particles[other + usize::from(other >= lowest)].clone();
        Climb { lowest, level, here, left: self.steps, accepted: 0 }
    }

    fn end(&mut self) {
        let Some(climb) = self.climb.take() else { return };
        self.particles[climb.lowest] = climb.here;
        self.replaced += 1;
        self.proposed += u64::from(self.steps);
        self.accepted += u64::from(climb.accepted);
        self.walk.adapt(f64::from(climb.accepted) / f64::from(self.steps));
    }
}
