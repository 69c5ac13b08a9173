"""When each quantity is sampled, and which is delayed by how much: decided in this one place.

Frames k = 0..N at ``t_k = k Tₛ``. Two honest simulators disagree by millimetres if these differ.
"""

from typing import Literal, NamedTuple

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array

Placement = Literal["measurement", "aligned", "actuator"]


class Delays(NamedTuple):
    """Ages, in video periods, of what meets at a frame."""

    measured: float
    reference: float
    command: float


def delays(placement: Placement, periods: float) -> Delays:
    """What the latency delays: the image, image and reference alike, or the command."""
    return {
        "measurement": Delays(periods, 0.0, 0.0),
        "aligned": Delays(periods, periods, 0.0),
        "actuator": Delays(0.0, 0.0, periods),
    }[placement]


def delayed(t: Array, period: float, periods: float) -> Array:
    """The times ``t_k − periods·Tₛ``, never before 0; on the frames where that is whole.

    t: (n,) in s, the frames.
    """
    d = timing.whole(periods)
    if d is None:
        return np.maximum(t - periods * period, 0.0)
    return t[np.maximum(np.arange(len(t)) - d, 0)]
