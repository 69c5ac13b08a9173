"""The H2 and the H∞ norm of a channel, delays exact."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.frequency.at_zero import dc_gain
from vsctrl.diagram.frequency.followed import band_of
from vsctrl.diagram.frequency.high_frequency import HighFrequencyGain
from vsctrl.diagram.frequency.loop_margins import rates
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.frequency.supremum import supremum
from vsctrl.diagram.performance.course import course
from vsctrl.diagram.performance.decay import decay
from vsctrl.diagram.performance.features import Pieces
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.time.response import impulse_system
from vsctrl.errors import ImproperError, InputError


class PeakGain(NamedTuple):
    """The largest |H(jω)| and its frequency (rad/s), 0 or infinity where it is a limit there."""

    gain: float
    frequency: float


def norm(channel: NumericChannel, p: object) -> float:
    """See `Channel.norm`."""
    if isinstance(p, bool) or p not in (2, "inf", math.inf):
        raise InputError(f"norm: p = {quoted(p)} is not known; give 2 or 'inf'.")
    if decay(channel).rate <= 0:
        return math.inf
    return _h2(channel) if p == 2 else peak_gain(channel).gain


def _h2(channel: NumericChannel) -> float:
    """√∫h² dt; infinite where some of the input passes at once or delayed only."""
    try:
        system = impulse_system(channel.system, channel.source, channel.target)
    except ImproperError:
        return math.inf
    if not system.delays:
        return _h2_by_lyapunov(channel.realisation)
    pieces = Pieces.of(course(system, Step(), decay(channel)))
    return math.sqrt(pieces.integral_of_square())


def _h2_by_lyapunov(system: DelaySystem) -> float:
    """√(B' Q B) with A' Q + Q A + C' C = 0, of a system without delays and D = 0."""
    from scipy.linalg import solve_continuous_lyapunov

    if not len(system.A):
        return 0.0
    Q = solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C)
    return math.sqrt(max(float((system.B.T @ Q @ system.B)[0, 0]), 0.0))


def peak_gain(channel: NumericChannel) -> PeakGain:
    """See `Channel.peak_gain`."""
    system = channel.realisation
    at_zero = abs(dc_gain(channel))
    poles = decay(channel).poles
    if math.isinf(at_zero):
        return PeakGain(math.inf, 0.0)
    bends = np.concatenate([rates(channel), np.abs(poles)])
    far = HighFrequencyGain.of(system, channel.sign)
    found = [(at_zero, 0.0)]
    if not math.isnan(far.limit.real):
        found.append((abs(far.limit), math.inf))
    unit = _typical(channel, bends)
    if not unit:
        return PeakGain(*max(found))

    def H(s: Any) -> Any:
        return channel(s) / unit

    band = band_of(H, bends, falls=far.limit == 0)
    omega, value = supremum(H, band, np.abs(poles.imag), float(system.tau.sum()))
    found.append((value * unit, omega))
    if far.turns:
        found.append((_far_peak(far), math.inf))
    return PeakGain(*max(found, key=lambda at: at[0]))


def _typical(channel: NumericChannel, bends: Array) -> float:
    """The size of H where it bends, 0 where it is 0 throughout."""
    bends = bends[(bends > 0) & np.isfinite(bends)]
    low, high = (bends.min(), bends.max()) if len(bends) else (0.1, 10.0)
    size = np.abs(channel(1j * np.geomspace(low / 10, 10 * high, 64)))
    return float(size[np.isfinite(size)].max(initial=0.0))


def _far_peak(far: HighFrequencyGain) -> float:
    """lim sup |H| as ω → ∞."""

    def around(s: Any) -> Any:
        return far(far.period * np.log(np.imag(s)))

    return supremum(around, (1.0, math.e), np.zeros(0), 0.0)[1]
