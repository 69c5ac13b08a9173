"""Six degrees of freedom in the time domain: the simulator, with NumPy alone.

It shares no formula with ``vsctrl.derive`` (except the generated kernels) and none with
``vsctrl.diagram``, so that their agreement is evidence.
"""

from vsctrl.servo.camera.camera import Camera as Camera
from vsctrl.servo.camera.camera import View as View
from vsctrl.servo.camera.target import CUBE_LEDS as CUBE_LEDS
from vsctrl.servo.camera.target import Target as Target
from vsctrl.servo.control.law import Command as Command
from vsctrl.servo.control.law import Law as Law
from vsctrl.servo.estimation.depth_observer import DepthObserver as DepthObserver
from vsctrl.servo.estimation.image_filter import ImageFilter as ImageFilter
from vsctrl.servo.estimation.pose_from_image import PoseFit as PoseFit
from vsctrl.servo.estimation.pose_from_image import pose_from_image as pose_from_image
from vsctrl.servo.estimation.triangulation import Structure as Structure
from vsctrl.servo.estimation.triangulation import target_from_motion as target_from_motion
from vsctrl.servo.feasibility.following import Feasibility as Feasibility
from vsctrl.servo.feasibility.following import Reading as Reading
from vsctrl.servo.feasibility.following import feasibility as feasibility
from vsctrl.servo.feasibility.joints import JointPath as JointPath
from vsctrl.servo.feasibility.limits import Limits as Limits
from vsctrl.servo.feasibility.retiming import Retimed as Retimed
from vsctrl.servo.feasibility.retiming import fastest as fastest
from vsctrl.servo.feasibility.retiming import slowed as slowed
from vsctrl.servo.features.feature_sets import MEASURES as MEASURES
from vsctrl.servo.motion.linked import Blend as Blend
from vsctrl.servo.motion.linked import Linked as Linked
from vsctrl.servo.motion.path import Path as Path
from vsctrl.servo.motion.trajectory import ConstantScrew as ConstantScrew
from vsctrl.servo.motion.trajectory import Jump as Jump
from vsctrl.servo.motion.trajectory import Oscillation as Oscillation
from vsctrl.servo.motion.trajectory import Trajectory as Trajectory
from vsctrl.servo.motion.trajectory import hold as hold
from vsctrl.servo.motion.trajectory import rotation as rotation
from vsctrl.servo.motion.trajectory import translation as translation
from vsctrl.servo.results.run import Run as Run
from vsctrl.servo.results.status import Event as Event
from vsctrl.servo.results.status import Status as Status
from vsctrl.servo.robot.gantry import FreeCamera as FreeCamera
from vsctrl.servo.robot.gantry import Gantry as Gantry
from vsctrl.servo.scenario import Scenario as Scenario
from vsctrl.servo.scenario import schema as schema
from vsctrl.servo.simulate import simulate as simulate
