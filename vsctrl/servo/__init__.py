"""Six degrees of freedom in the time domain: the simulator, with NumPy alone.

It shares no formula with ``vsctrl.derive`` (except the generated kernels) and none with
``vsctrl.diagram``, so that their agreement is evidence.
"""

from vsctrl.servo.camera.camera import Camera, View
from vsctrl.servo.camera.target import CUBE_LEDS, Target
from vsctrl.servo.control.law import Command, Law
from vsctrl.servo.estimation.depth_observer import DepthObserver
from vsctrl.servo.estimation.image_filter import ImageFilter
from vsctrl.servo.estimation.pose_from_image import PoseFit, pose_from_image
from vsctrl.servo.estimation.triangulation import Structure, target_from_motion
from vsctrl.servo.feasibility.following import Feasibility, Reading, feasibility
from vsctrl.servo.feasibility.joints import JointPath
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.retiming import Retimed, fastest, slowed
from vsctrl.servo.features.feature_sets import MEASURES
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
from vsctrl.servo.results.run import Run
from vsctrl.servo.results.status import Event, Status
from vsctrl.servo.robot.gantry import FreeCamera, Gantry
from vsctrl.servo.scenario import Scenario, schema
from vsctrl.servo.simulate import simulate

__all__ = [
    "CUBE_LEDS",
    "MEASURES",
    "Blend",
    "Camera",
    "Command",
    "ConstantScrew",
    "DepthObserver",
    "Event",
    "Feasibility",
    "FreeCamera",
    "Gantry",
    "ImageFilter",
    "JointPath",
    "Jump",
    "Law",
    "Limits",
    "Linked",
    "Oscillation",
    "Path",
    "PoseFit",
    "Reading",
    "Retimed",
    "Run",
    "Scenario",
    "Status",
    "Structure",
    "Target",
    "Trajectory",
    "View",
    "fastest",
    "feasibility",
    "hold",
    "pose_from_image",
    "rotation",
    "schema",
    "simulate",
    "slowed",
    "target_from_motion",
    "translation",
]


def __dir__() -> list[str]:
    return list(__all__)
