"""The curve of a system over ω: fine enough for every turn, with a phase that never slips by 360°.

A grid that is chosen beforehand loses whole turns of a long delay: e^{−2s}/(s + 1) falls by 115°
from one to the next of 200 points a decade and a half apart from 0.1 to 100 rad/s. Here the curve
is halved into Chebyshev pieces until they hold it to rounding, and no step on a piece turns far.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.checks import quoted, reals
from vsctrl.diagram.frequency.piecewise import chebyshev_pieces, log_grid
from vsctrl.errors import InputError, LimitError
from vsctrl.report.plots.subject import Subject

TURNED = 2e4  #: rad of delay up to which a curve is followed
SHOWN = 6 * math.pi  #: rad of delay that are shown where nobody asks for more
POINTS = 500  #: of a curve, at least
ON_PIECE = 12  #: points of a piece, at least: it holds no more than about a turn


@dataclass(frozen=True, eq=False)
class Curve:
    """omega (n,) in rad/s, values (n,), and the continuous phase (n,) in degrees."""

    omega: Array
    values: Complex
    phase: Array


def band(what: str, drawn: list[Subject], omega: Any = None) -> tuple[float, float]:
    """(low, high) in rad/s that all are drawn over: what was asked for, or where they bend.

    Errors: `InputError` for an omega that is no list of two frequencies above 0 or more.
    """
    if omega is not None:
        w = reals(omega)
        if w is None or w.ndim != 1 or len(w) < 2 or not (w > 0).all() or not w.min() < w.max():
            raise InputError(
                f"{what}: omega = {quoted(omega)} is not usable; give (low, high) in rad/s, "
                "or a list of frequencies above 0."
            )
        return float(w.min()), float(w.max())
    ends = np.array([_own_band(each) for each in drawn])
    low, high = float(ends[:, 0].min()), float(ends[:, 1].max())
    return max(low, 1e-12 * high), high


def _own_band(subject: Subject) -> tuple[float, float]:
    """A decade beyond the corners, as far as the delays have not turned the phase too often."""
    if subject.samples is not None:
        w = subject.samples[0]
        return float(w[0]), float(w[-1])
    top = subject.top
    rates = subject.rates[(subject.rates > 1e-200) & (subject.rates < 1e200)]
    rates = np.minimum(rates, top)
    if subject.delay_s:
        rates = np.append(rates, min(1 / subject.delay_s, top))
    if not len(rates):
        rates = np.array([min(1.0, top)])
    rates = rates[rates > 1e-9 * rates.max()]
    low, high = float(rates.min()) / 10, 10 * float(rates.max())
    matter = _crossings(subject)
    if subject.delay_s and top == math.inf:
        high = min(high, max(SHOWN / subject.delay_s, 3 * max(matter, default=0.0)))
    high = max(high, 3 * max(matter, default=0.0))
    low = min(low, 0.3 * min(matter, default=math.inf), high / 30)
    return low, min(high, top)


def _crossings(subject: Subject) -> list[float]:
    """The frequencies (rad/s) of the crossings that the margins are read at."""
    m = subject.margins
    if m is None:
        return []
    last = max((w for w, _ in m.gain_crossings), default=0.0)
    near = min((abs(math.log(f)) for _, f in m.phase_crossings if f > 0), default=0.0)
    found = [w for w, f in m.phase_crossings if f > 0 and abs(math.log(f)) <= near + 1e-9]
    found += [w for w, _ in m.gain_crossings[:1]] + [last]
    return [w for w in found if 0 < w < math.inf]


def curve(what: str, subject: Subject, low: float, high: float) -> Curve:
    """The subject from `low` to `high` (rad/s), less where it does not go so far.

    The phase begins at that of the power of ω which the subject is far below its corners, −180°
    where it is negative there, and turns clockwise at a pole on the axis.
    Errors: `LimitError` for a band in which the delays turn the phase too often to follow.
    """
    if subject.samples is not None:
        w, values = subject.samples
        inside = (w >= low) & (w <= high)
        # The steps are as they were given: there is nothing to refine them by.
        return Curve(w[inside], values[inside], np.degrees(np.unwrap(np.angle(values)))[inside])
    high = min(high, subject.top)
    if subject.delay_s * high > TURNED and subject.top == math.inf:
        raise LimitError(
            f"{what}: up to {high:.4g} rad/s the delays of {subject.delay_s:.4g} s turn the phase "
            f"{subject.delay_s * high / 2 / math.pi:.0f} times, too often to be drawn; "
            f"end omega at {TURNED / subject.delay_s:.4g} rad/s or before."
        )
    rates = subject.rates[(subject.rates > 1e-200) & (subject.rates < 1e200)]
    rates = np.append(rates, 1 / subject.delay_s if subject.delay_s else high)
    start = max(min(low, 1e-2 * float(rates.min())), 1e-9 * low)
    omega = _grid(subject, start, low, high)
    with np.errstate(all="ignore"):
        values = subject.at(omega)
    known = np.isfinite(values) & (values != 0)
    if not known.any():
        return Curve(omega, values, np.full(len(omega), math.nan))
    phase = np.full(len(omega), math.nan)
    phase[known] = np.degrees(_phase(omega[known], values[known]))
    shown = omega >= low * (1 - 1e-12)
    return Curve(omega[shown], values[shown], phase[shown])


def _grid(subject: Subject, start: float, low: float, high: float) -> Array:
    """Frequencies from `start` to `high`, so close that no step turns by more than a quarter."""

    def at(s: Any) -> Any:
        return subject.at(np.minimum(np.imag(s).ravel(), high)).reshape(np.shape(s))

    ends, _ = chebyshev_pieces(at, log_grid(start, high), subject.delay_s)
    number = max(ON_PIECE, math.ceil(POINTS / len(ends)))
    inside = ends[:, :1] + (np.arange(number) + 0.5) / number * np.diff(ends, axis=1)
    omega = np.exp(np.concatenate([ends.ravel(), inside.ravel()]))
    return np.unique(np.append(np.minimum(omega, high), [low, high]))


def _phase(omega: Array, values: Complex) -> Array:
    """Continuous phase, rad, of values that turn by less than π from one to the next."""
    steps = np.angle(values[1:] / values[:-1])
    size = np.log(np.abs(values))
    for i in np.flatnonzero(np.abs(steps) > 0.9 * math.pi):
        # Through a pole on the axis, which the contour passes on its right, it turns clockwise;
        # through a zero the other way.
        around = size[max(i - 8, 0) : i + 10]
        pole = max(size[i], size[i + 1]) - around.min() > around.max() - min(size[i], size[i + 1])
        steps[i] = -abs(steps[i]) if pole else abs(steps[i])
    first = float(np.angle(values[0]))
    asymptote = _power(omega, size) * math.pi / 2
    beyond = (first - asymptote + math.pi) % (2 * math.pi) - math.pi
    # A negative gain is −180°, not +180°.
    beyond -= 2 * math.pi * (beyond > math.pi / 2)
    return np.asarray(asymptote + beyond + np.concatenate([[0.0], np.cumsum(steps)]))


def _power(omega: Array, size: Array) -> int:
    """The whole power of ω that the values follow at the low end."""
    away = min(int(np.searchsorted(omega, 4 * omega[0])), len(omega) - 1)
    if not away:
        return 0
    return round((size[away] - size[0]) / math.log(omega[away] / omega[0]))
