"""The parts of the loop that a description asks for: what no other module reads out of tables.

Each function makes one part; ``simulate`` puts them together, ``checks`` tries some beforehand.
"""

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo import timing
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.camera.sensor import CameraSensor, MeasurementErrors, Schedule
from vsctrl.servo.camera.target import Target
from vsctrl.servo.control.controller import Controller, ImageController, PoseController
from vsctrl.servo.control.depths import ConstantDepths, Depths, EstimatedDepths, TrueDepths
from vsctrl.servo.control.gain_schedule import GainSchedule
from vsctrl.servo.control.law import Law
from vsctrl.servo.control.nominal_camera import NominalCamera
from vsctrl.servo.control.prediction import Kalman, Predictor, Smith
from vsctrl.servo.control.reference_image import Plan, Planner
from vsctrl.servo.estimation.image_filter import ImageFilter
from vsctrl.servo.features.feature_sets import measures
from vsctrl.servo.pose import exp
from vsctrl.servo.robot.capability import Capability
from vsctrl.servo.robot.carrier import Carrier
from vsctrl.servo.robot.gantry import Gantry
from vsctrl.servo.scenario.description import Description
from vsctrl.servo.timing import Delays
from vsctrl.timing import in_periods


def delays(description: Description) -> Delays:
    """Ages of image, reference and command at a frame, in video periods."""
    vision = description.vision
    periods = in_periods(vision.latency, vision.period)
    return timing.delays(description.law.placement, periods)


def target(description: Description) -> Target:
    """The points, and how they move."""
    table = description.target
    return Target(np.array(table.points), np.array(table.drift), table.sway)


def sensor(description: Description) -> CameraSensor:
    """The true camera and what it shows of the points."""
    table, size = description.camera, description.camera.size_px
    return CameraSensor(
        Camera(table.Fx, table.Fy),
        np.array(description.target.points),
        table.k1,
        None if size is None else np.array(size) / 2,
    )


def schedule(description: Description, t: Array, age: float) -> Schedule:
    """Which image of ``age`` periods each of the frames t (n,) in s is given."""
    table = description.vision
    errors = MeasurementErrors(**table.model_dump(exclude={"period", "latency"}))
    return Schedule.of(errors, t, table.period, len(description.target.points), age)


def plan(description: Description, true: CameraSensor, t: Array, ages: Delays) -> Plan:
    """The reference at the frames t (n,) in s. Raises InputError where it cannot be computed."""
    law, table = description.law, description.reference_image
    planner = Planner.of(
        description.reference,
        true,
        focal_ratio=table.reference_focal_ratio,
        depth_ratio=table.reference_depth_ratio,
        centre_px=table.reference_centre_px,
        k1=table.reference_k1,
        hand_eye=table.reference_hand_eye,
    )
    at_error = timing.delayed(t, description.vision.period, ages.reference) + law.preview
    return planner.plan(t, at_error, t + (law.preview + law.preview_ff), law.features)


def hand_eye(description: Description) -> Array | None:
    """Pose of the camera that the hand assumes in the true one, (4, 4), None where they are one."""
    twist = description.calibration.hand_eye
    return exp(np.array(twist)) if any(twist) else None


def carrier(description: Description, frames: int, ages: Delays) -> Carrier:
    """What carries the camera, from where it really starts, for that many frames."""
    robot, period = description.robot, description.vision.period
    start = description.reference.oTc0 @ exp(description.start.offset)
    joints = None if robot.joints is None else np.array(robot.joints)
    return Carrier(
        start,
        period,
        frames,
        delay=robot.dead_time + ages.command * period,
        hand_eye=hand_eye(description),
        capability=Capability(
            speed=robot.speed_limit,
            rate=robot.rate_limit,
            twist_acceleration=robot.acceleration_limit,
            angular_acceleration=robot.angular_acceleration_limit,
            time_constant=robot.time_constant,
            gantry=None if joints is None else Gantry.seeing(start, joints),
            joints0=joints,
            avoidance=robot.avoidance,
        ),
    )


def controller(description: Description, reference: Plan, t: Array) -> Controller:
    """The control law with all that the description adds to it, for the frames t (n,) in s."""
    table, nominal = description.law, nominal_camera(description)
    law, gains = Law(table.lam, table.k_ff), gain_schedule(description)
    if table.scheme == "pose":
        points = np.array(description.target.points)
        return PoseController(law, nominal, reference, t, points=points, gains=gains)
    return ImageController(
        law,
        nominal,
        reference,
        t,
        interaction=table.interaction,
        depths=depths(description, nominal, reference),
        gains=gains,
        predictor=predictor(description),
    )


def nominal_camera(description: Description) -> NominalCamera:
    """What the law assumes of camera and depths. Raises InputError for unknown features."""
    calibration, law = description.calibration, description.law
    p, phi = len(description.target.points), calibration.focal_ratio
    camera = Camera(phi * description.camera.Fx, phi * description.camera.Fy)
    ratios: Array | float = law.depth_ratio
    if calibration.depth_ratios is not None:
        ratios = ratios * np.array(calibration.depth_ratios)
    centre = calibration.centre_px
    features = measures(law.features, camera, p)
    return NominalCamera(camera, features, np.tile(centre, p) if any(centre) else None, ratios)


def gain_schedule(description: Description) -> GainSchedule | None:
    """Gains that are more than a number, or None where the feedback is −λ L̂⁺e."""
    law = description.law
    if law.smooth is None and law.T_i is None and law.lam_zero is None:
        return None
    return GainSchedule(
        law.lam,
        description.vision.period,
        smooth=law.smooth,
        T_i=law.T_i,
        lam_zero=law.lam_zero,
        lam_slope=law.lam_slope,
    )


def depths(description: Description, nominal: NominalCamera, reference: Plan) -> Depths:
    """The depths Ẑ that the law assumes."""
    frames, choice, vision = len(reference.s), description.law.depth, description.vision
    if choice == "estimated":
        noise_px = max(vision.noise_px, vision.quantum_px / 12**0.5)
        return EstimatedDepths(nominal, noise_px, reference.depths0, frames)
    if choice == "constant":
        return ConstantDepths(nominal.ratios * reference.depths0, frames)
    return TrueDepths(nominal.ratios, reference.compared.depths)


def predictor(description: Description) -> Predictor | None:
    """The predictor, or None; by default it assumes the true latency."""
    table, vision = description.predictor, description.vision
    kind, period = table.predictor, vision.period
    latency = vision.latency if table.tau_hat is None else table.tau_hat
    if kind == "none":
        return None
    if kind != "smith":
        return Kalman(ImageFilter(kind, period, latency, table.process, table.measurement_px))
    if table.tau_hat is None:
        latency += description.robot.dead_time
    # Before the run nothing was commanded, so that no more can have acted than all of it.
    return Smith(period, min(latency, (description.frames + 1) * period))
