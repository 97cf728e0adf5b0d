//! Parameters that survive a restart: storing, and forgetting what is stored.

use ctrl_core::controller::TrackingController;
use link::{Downlink, ParameterOrigin, ParametersInForce, Rejection};

use super::{HostSession, accept};
use crate::exchange::ControlStatus;
use crate::parameter_store::StoreError;
use crate::scenario::{self, BuiltInMission};
use crate::stored_parameters::StoredParameters;

/// A change of the stored parameters, until it is done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storage {
    sequence: u16,
    parameters: StoredParameters,
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
        let parameters = StoredParameters::of(&self.tuning);
        self.storage = Some(Storage { sequence, parameters, begun: false });
        Ok(())
    }

    /// Restores the built-in parameters and requests that the stored ones are forgotten.
    #[inline(never)]
    pub(super) fn forget(&mut self, sequence: u16, status: ControlStatus) -> Result<(), Rejection> {
        self.require_idle(status)?;
        self.tune(built_in()?.tuning)?;
        let parameters = StoredParameters::Forgotten;
        self.storage = Some(Storage { sequence, parameters, begun: false });
        Ok(())
    }

    /// Refuses parameters that cannot fly the built-in trajectory, with which every start begins.
    #[inline(never)]
    fn accept_built_in_trajectory(&self) -> Result<(), Rejection> {
        let mission = built_in()?;
        Ok(accept(&self.law, &mission.trajectory.check(self.law.step_period())?)?)
    }

    /// Parameters to be stored, once; [`stored`](Self::stored) has to follow.
    pub fn next_to_store(&mut self) -> Option<StoredParameters> {
        let storage = self.storage.as_mut().filter(|storage| !storage.begun)?;
        storage.begun = true;
        Some(storage.parameters)
    }

    /// Answers a request to store: with the generation, if that succeeded.
    pub fn stored(&mut self, result: Result<u32, StoreError>) {
        let Some(Storage { sequence, parameters, .. }) = self.storage.take() else { return };
        let result = match result {
            Ok(generation) => {
                let origin = match parameters {
                    StoredParameters::Set(_) => ParameterOrigin::Stored,
                    StoredParameters::Forgotten => ParameterOrigin::BuiltIn,
                };
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

/// The mission in the image. An error means a damaged image, which did not start.
fn built_in() -> Result<BuiltInMission, Rejection> {
    scenario::built_in_mission().map_err(|_| Rejection::StorageFailed)
}
