"""Six degrees of freedom in the time domain: the simulator, with NumPy alone.

It shares no formula with ``vsctrl.derive`` (except the generated kernels) and none with
``vsctrl.diagram``, so that their agreement is evidence.
"""

from vsctrl.servo.camera import Camera, View
from vsctrl.servo.following import Feasibility, Reading, feasibility
from vsctrl.servo.joints import JointPath
from vsctrl.servo.law import Command, Law
from vsctrl.servo.limits import Limits
from vsctrl.servo.linked import Blend, Linked
from vsctrl.servo.path import Path
from vsctrl.servo.robot import FreeCamera, Gantry
from vsctrl.servo.run import Run, Status
from vsctrl.servo.scenario import Scenario, schema
from vsctrl.servo.simulate import simulate
from vsctrl.servo.target import CUBE_LEDS, Target
from vsctrl.servo.timing import Retimed, fastest, slowed
from vsctrl.servo.trajectory import (
    ConstantScrew,
    Jump,
    Oscillation,
    Trajectory,
    hold,
    rotation,
    translation,
)

__all__ = [
    "CUBE_LEDS",
    "Blend",
    "Camera",
    "Command",
    "ConstantScrew",
    "Feasibility",
    "FreeCamera",
    "Gantry",
    "JointPath",
    "Jump",
    "Law",
    "Limits",
    "Linked",
    "Oscillation",
    "Path",
    "Reading",
    "Retimed",
    "Run",
    "Scenario",
    "Status",
    "Target",
    "Trajectory",
    "View",
    "fastest",
    "feasibility",
    "hold",
    "rotation",
    "schema",
    "simulate",
    "slowed",
    "translation",
]
