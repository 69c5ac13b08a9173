"""Six degrees of freedom in the time domain: the simulator, with NumPy alone.

It shares no formula with ``vsctrl.derive`` (except the generated kernels) and none with
``vsctrl.diagram``, so that their agreement is evidence.
"""

from vsctrl.servo.camera import Camera, View
from vsctrl.servo.law import Command, Law
from vsctrl.servo.run import Run, Status
from vsctrl.servo.scenario import Scenario
from vsctrl.servo.simulate import simulate
from vsctrl.servo.target import CUBE_LEDS, Target
from vsctrl.servo.trajectory import ConstantScrew

__all__ = [
    "CUBE_LEDS",
    "Camera",
    "Command",
    "ConstantScrew",
    "Law",
    "Run",
    "Scenario",
    "Status",
    "Target",
    "View",
    "simulate",
]
