"""The band of frequencies that a model is held to."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np

from vsctrl.checks import quoted
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.errors import InputError

Band = tuple[float, float]


def checked_band(channel: NumericChannel, band: Any) -> Band:
    """A band (low, high) in rad/s; without one, from 0 to a full turn of the longest delay, 2π/τ.

    Up to there a delay can bring a loop to −180° by itself, so that crossover, bandwidth and the
    peaks of a loop that the delay limits lie inside. Without a delay it ends at ten times the
    fastest rate.
    """
    if band is None:
        system = channel.realisation
        if system.delays:
            return 0.0, 2 * math.pi / float(system.tau.max())
        fastest = float(np.abs(np.linalg.eigvals(system.A)).max(initial=0.0))
        return 0.0, 10 * fastest or 10.0
    pair = tuple(band) if isinstance(band, tuple | list | np.ndarray) else ()
    numbers = all(isinstance(w, Real) and not isinstance(w, bool) for w in pair)
    if len(pair) == 2 and numbers and 0 <= pair[0] < pair[1] < math.inf:
        return float(pair[0]), float(pair[1])
    raise InputError(
        f"pade: band = {quoted(band)} is no band; give two frequencies in rad/s, as (0.01, 50), "
        "the "
        "first 0 or more and below the second."
    )
