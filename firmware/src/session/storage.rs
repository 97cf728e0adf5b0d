//! Parameters that survive a restart: storing, and forgetting what is stored.

use ctrl_core::controller::TrackingController;
use link::{Downlink, ParameterOrigin, ParametersInForce, Rejection};

use super::{HostSession, accept};
use crate::exchange::ControlStatus;
use crate::parameter_store::{Payload, StoreError};
use crate::scenario::BUILT_IN_MISSION;
use crate::stored_parameters::StoredParameters;

/// A change of the stored parameters, until it is done; no setting changes meanwhile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storage {
    sequence: u16,
    /// [`ParameterOrigin::Stored`] to store the tuning, or `BuiltIn` to forget what is stored.
    origin: ParameterOrigin,
    begun: bool,
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
        self.storage = Some(Storage { sequence, origin: ParameterOrigin::Stored, begun: false });
        Ok(())
    }

    /// Restores the built-in parameters and requests that the stored ones are forgotten.
    pub(super) fn forget(&mut self, sequence: u16, status: ControlStatus) -> Result<(), Rejection> {
        self.require_idle(status)?;
        self.tune(&BUILT_IN_MISSION.tuning)?;
        self.storage = Some(Storage { sequence, origin: ParameterOrigin::BuiltIn, begun: false });
        Ok(())
    }

    /// Refuses parameters that cannot fly the built-in trajectory, with which every start begins.
    #[inline(never)]
    fn accept_built_in_trajectory(&self) -> Result<(), Rejection> {
        let trajectory = BUILT_IN_MISSION.trajectory.check(self.law.step_period())?;
        Ok(accept(&self.law, &trajectory)?)
    }

    /// Record of the parameters to be stored, once; [`stored`](Self::stored) has to follow.
    #[inline(never)]
    pub fn next_to_store(&mut self) -> Option<Payload> {
        let storage = self.storage.as_mut().filter(|storage| !storage.begun)?;
        storage.begun = true;
        Some(match storage.origin {
            ParameterOrigin::Stored => StoredParameters::of(&self.tuning).encode(),
            _ => StoredParameters::Forgotten.encode(),
        })
    }

    /// Answers a request to store: with the generation, if that succeeded.
    pub fn stored(&mut self, result: Result<u32, StoreError>) {
        let Some(Storage { sequence, origin, .. }) = self.storage.take() else { return };
        let result = match result {
            Ok(generation) => {
                self.in_force = ParametersInForce { origin, generation, changed: false };
                Ok(())
            }
            Err(StoreError::Full) => Err(Rejection::StorageFull),
            Err(StoreError::Failed) => Err(Rejection::StorageFailed),
        };
        self.answer(Downlink::ParametersInForce(self.in_force));
        self.acknowledge(sequence, result);
    }
}
