"""Six degrees of freedom in the time domain: the simulator, with NumPy alone.

It shares no formula with ``vsctrl.derive`` (except the generated kernels) and none with
``vsctrl.diagram``, so that their agreement is evidence.
"""

from vsctrl.servo.control.law import Command, Law
from vsctrl.servo.feasibility.following import Feasibility, Reading, feasibility
from vsctrl.servo.feasibility.joints import JointPath
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.timing import Retimed, fastest, slowed
from vsctrl.servo.motion.linked import Blend, Linked
from vsctrl.servo.motion.path import Path
from vsctrl.servo.motion.trajectory import (
    ConstantScrew,
    Jump,
    Oscillation,
    Trajectory,
    hold,
    rotation,
    translation,
)
from vsctrl.servo.plant.camera import Camera, View
from vsctrl.servo.plant.robot import FreeCamera, Gantry
from vsctrl.servo.plant.target import CUBE_LEDS, Target
from vsctrl.servo.run import Run, Status
from vsctrl.servo.scenario import Scenario, schema
from vsctrl.servo.simulate import simulate

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
