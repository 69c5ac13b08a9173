"""What two keys of a scenario cannot mean together, in sentences.

Each key is right by itself here; nothing of geometry is computed, which is left to ``checks``.
"""

from collections.abc import Iterator

import numpy as np

from vsctrl.problems import Problem
from vsctrl.servo.features.feature_sets import MEASURES
from vsctrl.servo.robot.gantry import Gantry
from vsctrl.servo.scenario.description import Description


def contradictions(scenario: Description) -> Iterator[Problem]:
    """Pairs of the key to change and the sentence about it, all that there are."""
    yield from _delays(scenario)
    yield from _features(scenario)
    yield from _law(scenario)
    yield from _target(scenario)
    yield from _robot(scenario)


def _delays(scenario: Description) -> Iterator[Problem]:
    placement, dead_time = scenario.law.placement, scenario.robot.dead_time
    if dead_time and placement == "aligned":
        yield (
            "robot.dead_time",
            f"{dead_time:g} s of dead time in the robot cannot be aligned: law.placement = "
            '"aligned" delays the reference like the image, and the robot is late after both; '
            'choose law.placement = "measurement" or dead_time = 0',
        )
    if dead_time and placement == "actuator":
        yield (
            "robot.dead_time",
            'law.placement = "actuator" already puts vision.latency into the robot; choose '
            '"measurement", or dead_time = 0',
        )
    if scenario.predictor.predictor == "none":
        return
    if placement != "measurement":
        yield (
            "predictor.predictor",
            f'a predictor brings a late image up to now, and law.placement = "{placement}" leaves '
            'it nothing to predict; choose law.placement = "measurement" or predictor = "none"',
        )


def _features(scenario: Description) -> Iterator[Problem]:
    name, n = scenario.law.features, len(scenario.target.points)
    least = MEASURES[name].least
    if n < least:
        yield (
            "law.features",
            f'"{name}" needs a target of {least} points or more, and this one has {n}; add points '
            'or choose "points"',
        )
    if name == "points":
        return
    if scenario.predictor.predictor in ("velocity", "acceleration"):
        yield (
            "predictor.predictor",
            f'a Kalman filter follows image points, not law.features = "{name}"; choose "points" '
            "or another predictor",
        )
    lens = {
        "camera.k1": scenario.camera.k1 != 0,
        "reference_image.reference_k1": bool(scenario.reference_image.reference_k1),
        "reference_image.reference_centre_px": any(scenario.reference_image.reference_centre_px),
    }
    for field, is_set in lens.items():
        if is_set:
            yield (
                field,
                f"through such a lens ds*/dt is known for points only, not for law.features = "
                f'"{name}"; choose "points" or leave it out',
            )


def _law(scenario: Description) -> Iterator[Problem]:
    law = scenario.law
    if law.depth == "estimated" and law.interaction == "initial":
        yield (
            "law.depth",
            'depths are estimated along the way, and law.interaction = "initial" keeps the first '
            'ones; choose another interaction, or depth = "constant"',
        )
    if law.scheme == "image":
        return
    image = scenario.reference_image
    unused = {
        "law.features": law.features != "points",
        "law.interaction": law.interaction != "current",
        "law.depth": law.depth != "true",
        "law.depth_ratio": law.depth_ratio != 1,
        "calibration.depth_ratios": scenario.calibration.depth_ratios is not None,
        "predictor.predictor": scenario.predictor.predictor != "none",
        **{
            f"reference_image.{name}": getattr(image, name) != field.default
            for name, field in type(image).model_fields.items()
            if name != "reference_hand_eye"
        },
    }
    for field, is_set in unused.items():
        if is_set:
            yield (
                field,
                'has no meaning for law.scheme = "pose", which finds the pose from the points; '
                'choose scheme = "image" or leave it out',
            )


def _target(scenario: Description) -> Iterator[Problem]:
    ratios, n = scenario.calibration.depth_ratios, len(scenario.target.points)
    if ratios is not None and len(ratios) != n:
        yield (
            "calibration.depth_ratios",
            f"{len(ratios)} ratios for {n} points; give one for each point",
        )
    if scenario.target.sway is not None and not any(scenario.target.drift):
        yield (
            "target.sway",
            "a target without drift cannot swing; give target.drift, the greatest twist, or leave "
            "sway out",
        )


def _robot(scenario: Description) -> Iterator[Problem]:
    joints = scenario.robot.joints
    if joints is None:
        return
    gantry, q = Gantry(), np.array(joints)
    for k in np.flatnonzero((q < gantry.lower) | (q > gantry.upper)):
        yield (
            "robot.joints",
            f"joint {k + 1} at {q[k]:g} is outside its range, {gantry.lower[k]:g} to "
            f"{gantry.upper[k]:g}; begin inside",
        )
    if gantry.singularity(q) < gantry.wrist_margin:
        yield (
            "robot.joints",
            f"joint 5 at {q[4]:g} rad makes the axes 4 and 6 of the wrist one, where it cannot "
            "turn the camera every way; begin away from ±π/2",
        )
