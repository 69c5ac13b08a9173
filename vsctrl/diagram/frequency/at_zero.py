"""What a channel is at s = 0: its gain there, and the power of s that it starts with."""

from __future__ import annotations

import math

from vsctrl.diagram.frequency.numeric_channel import NumericChannel


def leading(channel: NumericChannel) -> tuple[int, float]:
    """(n, K) of H(s) → K sⁿ as s → 0; (0, 0) where H is 0 throughout."""
    at_zero = channel.at_zero
    if at_zero:
        return (at_zero.power, channel.sign * at_zero.value) if at_zero.value else (0, 0.0)
    local = channel.beside(0j)
    if local is None or not len(local.a):
        return 0, 0.0
    size = float((local.a[0] / local.b[0]).real) * local.radius ** (-local.order)
    return local.order, channel.sign * size


def dc_gain(channel: NumericChannel) -> float:
    """lim H(s) as s → 0 from above: 0, a number, or ±∞ at a pole there."""
    power, size = leading(channel)
    if power > 0 or not size:
        return 0.0
    return float(channel(0.0).real) if power == 0 else math.copysign(math.inf, size)
