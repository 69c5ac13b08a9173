"""The law to first order about the reference at the start, measured from outside.

At a small lag ξ the law of a scenario asks for ``−λ M ξ`` of a target at rest; through the hand it
becomes ``−λ A M ξ`` of the camera. With ``M = L̂⁺L`` this is the loop of figure 1 in six degrees of
freedom, and the matrix is measured as finite differences of the assembled controller, so that it
holds for every law that a scenario may have: features, depths, scheme, gains.
"""

from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.camera.sensor import CameraSensor
from vsctrl.servo.control.measurement import Measurement
from vsctrl.servo.pose import adjoint, exp
from vsctrl.servo.scenario import Scenario, assembly

# Steps of the differences, as shares of the depth and in rad: truncation 1e-12, rounding 1e-12.
STEP = 1e-3
# What is as near to the identity is that.
EXACT = 1e-9
# Eigenvalues of A M below this share of the greatest are 0: nothing pulls in their direction.
NOTHING = 1e-6

# The law alone, before a reference and a target at rest, and an image at once.
_AT_REST: dict[str, Any] = {
    "kind": "hold", "latency": 0.0, "placement": "measurement", "preview": 0.0, "preview_ff": 0.0,
    "smooth": None, "T_i": None, "noise_px": 0.0, "quantum_px": 0.0, "outliers": 0.0,
    "on_lost": "continue", "dead_time": 0.0, "drift": (0.0,) * 6, "sway": None,
    "offset": (0.0,) * 6, "predictor": "none", "tau_hat": None,
}  # fmt: skip


def pull(scenario: Scenario) -> Array | None:
    """``A M``, (6, 6), lengths as shares of the depth: how the law pulls the camera back.

    None where the law cannot be asked about such small lags (no pose fits, a lag leads behind a
    point).
    """
    try:
        still = scenario.with_(**_AT_REST, duration=2 * scenario.vision.period)
    except InputError:
        return None
    sensor, ages = assembly.sensor(still), assembly.delays(still)
    plan = assembly.plan(still, sensor, still.t, ages)
    reference, hand = plan.pose[0], assembly.hand_eye(still)
    scale = lengths(still)
    start = reference @ exp(np.array(scenario.start.offset))

    def asked(xi: Array) -> Array:
        """The first twist at a lag, (6,) → (6,)."""
        controller = assembly.controller(still, plan, still.t)
        frame = 0
        if still.law.interaction == "initial":  # which L̂ keeps is that of the true start
            controller.control(_seen(sensor, start, plan.image[0], frame), np.zeros(6), False)
            frame = 1
        shown = _seen(sensor, reference @ exp(xi), plan.image[0], frame)
        T = controller.control(shown, np.zeros(6), False).T
        return T if hand is None else adjoint(hand) @ T

    columns = []
    for axis in range(6):
        step = np.zeros(6)
        step[axis] = STEP * scale[axis]
        with np.errstate(all="ignore"):
            try:
                near, far = (asked(share * step) - asked(-share * step) for share in (1, 2))
            except (InputError, np.linalg.LinAlgError):
                return None
        # Differences of two widths leave the fourth power of the step.
        columns.append((8 * near - far) / (-12 * STEP * still.law.lam) / scale)
    matrix = np.array(columns).T
    return matrix if np.isfinite(matrix).all() else None


def pull_of_camera(scenario: Scenario) -> Array:
    """``A M``, (6, 6) in m and rad. Raises InputError where the law cannot be asked for it."""
    matrix = pull(scenario)
    if matrix is None or np.linalg.matrix_rank(matrix, NOTHING) < 6:
        raise InputError(
            f"{scenario.name}: the law cannot tell all motions of the camera apart at the start, "
            "so that no gain makes it follow; choose other points, not all on one line."
        )
    if np.abs(matrix - np.eye(6)).max() < EXACT:
        return np.eye(6)
    unit = lengths(scenario)
    return matrix * unit[:, None] / unit


def lengths(scenario: Scenario) -> Array:
    """What one unit of each entry of a twist counts for, (6,): translations in mean depths."""
    points = np.array(scenario.target.points)
    depths = assembly.sensor(scenario).camera.points(scenario.reference.pose(0.0), points)[:, 2]
    return np.array([float(depths.mean())] * 3 + [1.0] * 3)


def _seen(sensor: CameraSensor, oTc: Array, before: Array, frame: int) -> Measurement:
    """What the law is shown from oTc (4, 4), without latency or noise."""
    image = sensor.look(oTc, before)
    return Measurement(frame, image.features, image.depths, None, True, lambda: oTc)
