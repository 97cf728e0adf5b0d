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

from ._core import Controller, Scenario, StepOutput, Tick, __version__, built_in_scenarios
from .errors import ConfigError, GyrfalconError, ScenarioError
from .flight import Flight, run
from .monitor import Monitor
from .quantity import QUANTITIES, Quantity
from .status import Status
from .verdict import Verdict, Verdicts

__all__ = [
    "QUANTITIES",
    "ConfigError",
    "Controller",
    "Flight",
    "GyrfalconError",
    "Monitor",
    "Quantity",
    "Scenario",
    "ScenarioError",
    "Status",
    "StepOutput",
    "Tick",
    "Verdict",
    "Verdicts",
    "__version__",
    "built_in_scenarios",
    "run",
]
