//! Parameters, and the key of signatures, that survive a restart: storing, and forgetting what is stored.

use ctrl_core::controller::TrackingController;
use link::{Downlink, ParameterOrigin, ParametersInForce, Rejection, Secret};

use super::{HostSession, accept};
use crate::exchange::ControlStatus;
use crate::parameter_store::StoreError;
use crate::scenario::BUILT_IN_MISSION;
use crate::stored_parameters::StoredParameters;
use crate::stored_signing::{Change, StoredSigning};

/// A change of what is stored, until it is done; no setting changes meanwhile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storage {
    wanted: Wanted,
    begun: bool,
}

/// What is to be stored, and the number of the message that asks for it.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    /// The parameters in force.
    Tuning(u16),
    /// That there are none.
    BuiltIn(u16),
    /// Another key of signatures, or none; whose clock goes on from the second number.
    Key(u16, Option<StoredSigning>, u64),
    /// The same key with a later time.
    Time(StoredSigning),
}

/// A change of the signatures that has been stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SigningChange {
    /// Key, and the time up to which its clock may go; none: without signatures.
    pub stored: Option<StoredSigning>,
    /// Time that the clock goes on from at least, with another key (10 us since 2015-01-01).
    pub timestamp: Option<u64>,
}

impl HostSession<'_> {
    /// Requests that the parameters in force are stored, if the next start could fly with them.
    pub(super) fn persist(
        &mut self,
        sequence: u16,
        status: ControlStatus,
    ) -> Result<(), Rejection> {
        self.require_idle(status)?;
        self.accept_built_in_trajectory()?;
        self.want(Wanted::Tuning(sequence));
        Ok(())
    }

    /// Restores the built-in parameters and requests that the stored ones are forgotten.
    pub(super) fn forget(&mut self, sequence: u16, status: ControlStatus) -> Result<(), Rejection> {
        self.require_idle(status)?;
        self.tune(&BUILT_IN_MISSION.tuning)?;
        self.want(Wanted::BuiltIn(sequence));
        Ok(())
    }

    fn want(&mut self, wanted: Wanted) {
        self.storage = Some(Storage { wanted, begun: false });
    }

    /// Requests that a key of signatures is stored, or, all zeros, the one before forgotten; it is in force once that is
    /// done.
    pub(super) fn keep_key(
        &mut self,
        sequence: u16,
        secret: &Secret,
        timestamp: u64,
        status: ControlStatus,
    ) -> Result<(), Rejection> {
        self.require_idle(status)?;
        let key = (secret.0 != [0; 32]).then(|| StoredSigning::ahead(secret.0, timestamp));
        self.want(Wanted::Key(sequence, key, timestamp));
        Ok(())
    }

    /// Requests that a later time is stored with the key of signatures, if nothing stands against it now.
    pub fn keep_signing_time(&mut self, signing: StoredSigning, status: ControlStatus) {
        if self.signing_storable && self.require_idle(status).is_ok() {
            self.want(Wanted::Time(signing));
        }
    }

    /// Key and clock of signatures after they have been stored, once.
    pub fn take_signing(&mut self) -> Option<SigningChange> {
        self.signing.take()
    }

    /// Refuses parameters that cannot fly the built-in trajectory, with which every start begins.
    #[inline(never)]
    fn accept_built_in_trajectory(&self) -> Result<(), Rejection> {
        let trajectory = BUILT_IN_MISSION.trajectory.check(self.law.step_period())?;
        Ok(accept(&self.law, &trajectory)?)
    }

    /// What is to be stored, once; [`stored`](Self::stored) has to follow.
    #[inline(never)]
    pub fn next_to_store(&mut self) -> Option<Change> {
        let storage = self.storage.as_mut().filter(|storage| !storage.begun)?;
        storage.begun = true;
        Some(match storage.wanted {
            Wanted::Tuning(_) => Change::Parameters(StoredParameters::of(&self.tuning)),
            Wanted::BuiltIn(_) => Change::Parameters(StoredParameters::Forgotten),
            Wanted::Key(_, signing, _) => Change::Signing(signing),
            Wanted::Time(signing) => Change::Signing(Some(signing)),
        })
    }

    /// Answers a request to store: with the generation, if that succeeded.
    pub fn stored(&mut self, result: Result<u32, StoreError>) {
        let Some(Storage { wanted, .. }) = self.storage.take() else { return };
        if let Ok(generation) = result {
            self.in_force.generation = generation;
            match wanted {
                Wanted::Tuning(_) => self.now_in_force(ParameterOrigin::Stored),
                Wanted::BuiltIn(_) => self.now_in_force(ParameterOrigin::BuiltIn),
                Wanted::Key(_, stored, timestamp) => {
                    self.signing = Some(SigningChange { stored, timestamp: Some(timestamp) });
                    self.signing_storable = true;
                }
                Wanted::Time(stored) => {
                    let stored = Some(stored);
                    self.signing = Some(SigningChange { stored, timestamp: None });
                }
            }
        }
        let sequence = match wanted {
            Wanted::Tuning(sequence) | Wanted::BuiltIn(sequence) => {
                self.answer(Downlink::ParametersInForce(self.in_force));
                sequence
            }
            Wanted::Key(sequence, ..) => sequence,
            Wanted::Time(_) => {
                // A memory that is full or broken is not tried again and again: a restart makes room.
                self.signing_storable = result.is_ok();
                return;
            }
        };
        self.acknowledge(
            sequence,
            result.map(|_| ()).map_err(|error| match error {
                StoreError::Full => Rejection::StorageFull,
                StoreError::Failed => Rejection::StorageFailed,
            }),
        );
    }

    fn now_in_force(&mut self, origin: ParameterOrigin) {
        self.in_force = ParametersInForce { origin, changed: false, ..self.in_force };
    }
}
