"""When each quantity is sampled, and who is late by how much: decided in this one place.

Frames k = 0..N at ``t_k = k Tₛ``. Two honest simulators disagree by millimetres if these differ.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing

if TYPE_CHECKING:
    from vsctrl.servo.scenario import Placement

Array = NDArray[np.float64]


class Delays(NamedTuple):
    """Ages, in video periods, of what meets at a frame."""

    measured: float
    reference: float
    command: float


def delays(placement: "Placement", periods: float) -> Delays:
    """Who is late by the latency: the image, image and reference alike, or the robot."""
    return {
        "measurement": Delays(periods, 0.0, 0.0),
        "aligned": Delays(periods, periods, 0.0),
        "actuator": Delays(0.0, 0.0, periods),
    }[placement]


def late(t: Array, period: float, periods: float) -> Array:
    """The times ``t_k − periods·Tₛ``, never before 0; on the frames where that is whole.

    t: (n,) in s, the frames.
    """
    d = timing.whole(periods)
    if d is None:
        return np.maximum(t - periods * period, 0.0)
    return t[np.maximum(np.arange(len(t)) - d, 0)]
