"""The control law (10): from an image error to a camera twist.

Which frame's image reaches the law, and when its twist is applied, is left to ``simulate``; what L̂
is made of to ``nominal_camera``, where it is taken to ``controller``.

Source: eq. (10) of the paper; Malis, Improving vision-based control using efficient second-order
minimization techniques (ICRA 2004) for the mean of two interaction matrices.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from vsctrl.arrays import Array

Interaction = Literal["current", "desired", "mean", "initial"]

# A singular value below this share of the largest one counts as zero: the direction that it
# belongs to would be driven by rounding, not by the image.
RANK_TOLERANCE = 1e-10


class Command(NamedTuple):
    """Twist (6,) and the rank of the L̂ that made it (6 when every direction is seen).

    >>> command = vs.servo.Command(np.zeros(6), 6)
    >>> command.rank
    6
    """

    T: Array
    rank: int


@dataclass(frozen=True, slots=True)
class Law:
    """``T = −λ L̂⁺ e + k_ff L̂⁺ ds*/dt`` (eq. 10).

    lam: gain λ in s⁻¹; k_ff: feed-forward gain (1 = the paper's law, 0 = without its second term).

    >>> slide = vs.paper.sliding()
    >>> slide.law.lam
    2.5
    """

    lam: float
    k_ff: float = 1.0

    def twist(self, L_hat: Array, e: Array, ds: Array) -> Command:
        """Twist of least squares, of least norm where L̂ loses rank.

        ``min |L̂ T − (−λ e + k_ff ds*/dt)|``, which is ``L̂⁺`` applied to the right-hand side.

        L_hat: (m, 6); e: (m,) in the unit of the features; ds: (m,) per s. Returns T (6,) in m/s
        and rad/s with the rank of L̂ at the relative threshold ``RANK_TOLERANCE``.
        """
        demand = self.k_ff * ds - self.lam * e
        T, _, rank, _ = np.linalg.lstsq(L_hat, demand, rcond=RANK_TOLERANCE)
        return Command(np.asarray(T, dtype=np.float64), int(rank))
