//! Selection of the trajectory that the next flight follows.

use ctrl_core::controller::TrackingController;
use ctrl_core::error::ConfigError;
use ctrl_core::trajectory::{CheckedTrajectory, Circle, Hover, Lemniscate, RisingCircle};
use link::{Rejection, TrajectorySelection};

use super::{HostSession, SessionMemory, accept};

impl HostSession<'_> {
    #[inline(never)]
    pub(super) fn select_trajectory(
        &mut self,
        selection: &TrajectorySelection,
    ) -> Result<(), Rejection> {
        match selection {
            TrajectorySelection::Stream => self.memory.references.follow_stream(),
            TrajectorySelection::UploadedPath => self.select_path()?,
            shape => self.select_shape(shape)?,
        }
        Ok(())
    }

    /// Selects the uploaded path; it is built in the memory that it is flown from.
    fn select_path(&mut self) -> Result<(), Rejection> {
        let SessionMemory { references, upload, .. } = &mut *self.memory;
        let path = CheckedTrajectory::WaypointPath(upload.finish(self.law.step_period())?);
        accept(&self.law, &path)?;
        references.follow(&path);
        Ok(())
    }

    fn select_shape(&mut self, selection: &TrajectorySelection) -> Result<(), Rejection> {
        let shape = shape(selection, self.law.step_period())?.ok_or(Rejection::Unsupported)?;
        accept(&self.law, &shape)?;
        self.memory.references.follow(&shape);
        Ok(())
    }
}

/// A trajectory of a few numbers; none for a stream or a path.
fn shape(
    selection: &TrajectorySelection,
    step_period: f32,
) -> Result<Option<CheckedTrajectory<'static>>, ConfigError> {
    use CheckedTrajectory as Checked;
    Ok(Some(match selection {
        TrajectorySelection::Stream | TrajectorySelection::UploadedPath => return Ok(None),
        TrajectorySelection::Hover(config) => Checked::Hover(Hover::new(config, step_period)?),
        TrajectorySelection::RisingCircle(config) => {
            Checked::RisingCircle(RisingCircle::new(config, step_period)?)
        }
        TrajectorySelection::Circle(config) => Checked::Circle(Circle::new(config, step_period)?),
        TrajectorySelection::Lemniscate(config) => {
            Checked::Lemniscate(Lemniscate::new(config, step_period)?)
        }
    }))
}
