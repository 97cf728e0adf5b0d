"""Tracking controllers for VTOL UAVs with checked guarantees.

The same core that flies in the firmware, the same simulated vehicle, monitors and campaigns as the
program's, bit for bit. World axes are east, north, up; body axes forward, left, up; SI units; quaternions
take body to world and are written scalar first: w, x, y, z.

    >>> import gyrfalcon
    >>> flight = gyrfalcon.run("tilt-recovery")
    >>> flight.plot().savefig("tilt-recovery.png")
"""

from . import _core, processor

processor.check(_core.processor_extensions())

from ._core import (
    BatchController,
    BatchFlight,
    BatchVehicle,
    Controller,
    Scenario,
    StepOutput,
    Tick,
    __version__,
    built_in_campaigns,
    built_in_scenarios,
    failure_probability,
)
from .campaigns import CampaignResult, Proposal, campaign, merge, tune
from .errors import CampaignError, ConfigError, GyrfalconError, InfeasibleError, ScenarioError
from .flight import Flight, run
from .monitor import Monitor
from .quantity import QUANTITIES, Quantity
from .status import Status
from .verdict import Verdict, Verdicts

__all__ = [
    "QUANTITIES",
    "BatchController",
    "BatchFlight",
    "BatchVehicle",
    "CampaignError",
    "CampaignResult",
    "ConfigError",
    "Controller",
    "Flight",
    "GyrfalconError",
    "InfeasibleError",
    "Monitor",
    "Proposal",
    "Quantity",
    "Scenario",
    "ScenarioError",
    "Status",
    "StepOutput",
    "Tick",
    "Verdict",
    "Verdicts",
    "__version__",
    "built_in_campaigns",
    "built_in_scenarios",
    "campaign",
    "failure_probability",
    "merge",
    "run",
    "tune",
]
