"""A micro-motor that turns by impacts: simulator, Kalman filters, controller, identification.

>>> import micromotor as mm
>>> scene = mm.Scene({"position.to_deg": 37})
>>> move = mm.position(scene)
>>> move["ok"]
True

Names end in their unit, and clockwise and upward are positive. A drive is a number from -1 to 1: its size is the
amplitude, its sign the mode. Mode B, which turns the rotor clockwise, is positive.
"""

from ._micromotor import VERSION as __version__
from ._micromotor import Estimate, Loop, Moment, Motor, Motors, Scene
from .errors import IdentificationError, LogError, MicromotorError, RunError, SceneError
from .filters import Filtered, Health, LinearFiltered, Reason, Verdict, linear_filter, run_filter
from .identification import Identification, identify
from .logs import Log, read_log, write_recording
from .results import Result, Table
from .runs import calibrate, plan, position, rate, record, simulate, trials

__all__ = [
    "Estimate",
    "Filtered",
    "Health",
    "Identification",
    "IdentificationError",
    "LinearFiltered",
    "Log",
    "LogError",
    "Loop",
    "MicromotorError",
    "Moment",
    "Motor",
    "Motors",
    "Reason",
    "Result",
    "RunError",
    "Scene",
    "SceneError",
    "Table",
    "Verdict",
    "__version__",
    "calibrate",
    "identify",
    "linear_filter",
    "plan",
    "position",
    "rate",
    "read_log",
    "record",
    "run_filter",
    "simulate",
    "trials",
    "write_recording",
]
