"""What the figures of a step response are, and how they are read off any course in time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from vsctrl.checks import number, quoted, reals
from vsctrl.errors import InputError
from vsctrl.tables import Lines, Numbers

NOISE = 1e-11  #: of the final value, below which an overshoot is rounding
NOTHING = 1e-14  #: of the largest value, up to which nothing has arrived yet


class Response(Protocol):
    """A response from its beginning until it is at rest, on pieces of time or at samples."""

    def scaled(self, factor: float) -> Self:
        """y times a number."""

    def highest(self) -> tuple[float, float]:
        """(t, y) of the largest y, the first of equals."""

    def first_reaching(self, level: float) -> float | None:
        """The first t with y ≥ level; None where it is never."""

    def last_outside(self, level: float, band: float) -> float:
        """When |y − level| > band for the last time; 0 where it never is."""

    def beginning(self, least: float) -> float:
        """Until when |y| is no more than `least` from the start."""


@dataclass(frozen=True)
class StepInfo(Lines, Numbers):
    """The figures of the response to a unit step from rest; times in s, None where undefined.

    `rise_time` is from the first time at `rise[0]` of the final value to the first at `rise[1]`;
    after `settling_time` the response stays within `settling` times the final value of it;
    `overshoot` and `undershoot` are the largest excursions beyond the final value and to the other
    side of 0, as fractions of the final value; `peak` is the value farthest from 0, with its sign,
    at `peak_time`, which is infinite where the response only tends to it; before `dead_time` it
    is 0. Of a response that ends at 0, as to a disturbance that is made up for, `settling` is a
    fraction of the peak, and there is neither a rise nor an overshoot. `sentence` says what was
    left out and why. With a `period` (s) all of them are read at the samples, `settling_time` and
    `dead_time` at the first sample that is in the band, and that is not 0.
    """

    final: float | None
    rise_time: float | None
    settling_time: float
    overshoot: float | None
    undershoot: float | None
    peak: float | None
    peak_time: float | None
    dead_time: float | None
    settling: float
    rise: tuple[float, float]
    stable: bool
    sentence: str
    period: float | None = None

    def _lines(self) -> dict[str, str]:
        low, high = (f"{100 * part:g}" for part in self.rise)
        of = "final value" if self.final else "peak"
        return {
            "final value": _shown(self.final),
            f"rise time, {low} to {high} %": _shown(self.rise_time, " s"),
            f"settling time, {100 * self.settling:g} % of {of}": _shown(self.settling_time, " s"),
            "overshoot": _shown(self.overshoot, " %", 100),
            "undershoot": _shown(self.undershoot, " %", 100),
            "peak": f"{_shown(self.peak)}{self._peak_at}",
            "dead time": _shown(self.dead_time, " s"),
        }

    @property
    def _peak_at(self) -> str:
        if self.peak_time is None:
            return ""
        if math.isinf(self.peak_time):
            return ", which it tends to"
        return f" at {self.peak_time:.5g} s"

    def _sentences(self) -> list[str]:
        held = f"Read at the samples, every {self.period:g} s." if self.period else ""
        return [*filter(None, (held, self.sentence))]


def _shown(value: float | None, unit: str = "", times: float = 1.0) -> str:
    if value is None:
        return "–"
    return "never" if math.isinf(value) and unit == " s" else f"{times * value:.5g}{unit}"


def farthest(y: Response) -> float:
    """The largest |y|."""
    return max(y.highest()[1], y.scaled(-1).highest()[1])


def figures(
    y: Response, final: float, band: float, parts: tuple[float, float], ends: bool
) -> StepInfo:
    """Those of a response that tends to its final value, or `ends` at it."""
    size = max(farthest(y), abs(final))
    dead = y.beginning(NOTHING * size)
    if final == 0 or abs(final) <= NOISE * size:
        return _returning(y, band, parts, dead)
    return _rising(y, final, band, parts, dead, ends)


def unsettled(final: float, band: float, parts: tuple[float, float], why: str) -> StepInfo:
    """Of a channel that is not stable, which has next to none."""
    return StepInfo(
        final=final if math.isinf(final) else None,
        rise_time=None,
        settling_time=math.inf,
        overshoot=None,
        undershoot=None,
        peak=None,
        peak_time=None,
        dead_time=None,
        settling=band,
        rise=parts,
        stable=False,
        sentence=f"{why} Its step response does not settle.",
    )


def _rising(
    y: Response,
    final: float,
    band: float,
    parts: tuple[float, float],
    dead: float,
    ends: bool,
) -> StepInfo:
    """Those of a response that tends to a final value other than 0, or `ends` at it."""
    up = y.scaled(1 / final)
    (top_at, top), (low_at, low) = up.highest(), up.scaled(-1).highest()
    over, under = (x if x > NOISE else 0.0 for x in (top - 1, low))
    peak, peak_at = final, math.inf
    if over or ends:
        peak, peak_at = top * final, top_at
    if under > max(top, 1.0):
        peak, peak_at = -low * final, low_at
    begin, end = (up.first_reaching(part) for part in parts)
    return StepInfo(
        final=final,
        rise_time=None if begin is None or end is None else end - begin,
        settling_time=up.last_outside(1.0, band),
        overshoot=over,
        undershoot=under,
        peak=peak,
        peak_time=peak_at,
        dead_time=dead,
        settling=band,
        rise=parts,
        stable=True,
        sentence="",
    )


def _returning(y: Response, band: float, parts: tuple[float, float], dead: float) -> StepInfo:
    """Those of a response that ends at 0, where it began."""
    (top_at, top), (low_at, low) = y.highest(), y.scaled(-1).highest()
    peak, peak_at = (top, top_at) if top >= low else (-low, low_at)
    why = (
        "It ends at 0, as of a disturbance that is made up for: overshoot and rise time, relative "
        f"to the final value, are not defined; it is settled within {100 * band:g} % of its peak."
    )
    if not peak:
        why = "The channel is 0: nothing moves."
    return StepInfo(
        final=0.0,
        rise_time=None,
        settling_time=y.last_outside(0.0, band * abs(peak)) if peak else 0.0,
        overshoot=None,
        undershoot=None,
        peak=peak,
        peak_time=peak_at if peak else 0.0,
        dead_time=dead if peak else None,
        settling=band,
        rise=parts,
        stable=True,
        sentence=why,
    )


def settling_band(value: object) -> float:
    """`settling` of step_info, checked."""
    band = number("step_info: settling", value, "a fraction between 0 and 1, like 0.02")
    if not 1e-9 <= band < 1:
        raise InputError(
            f"step_info: settling = {band:g} is not usable; give a fraction between 0 and 1, like "
            "0.02, of 1e-9 or more."
        )
    return band


def rise_parts(value: object) -> tuple[float, float]:
    """`rise` of step_info, checked."""
    parts = reals(value)
    if parts is None or parts.shape != (2,) or not 0 <= parts[0] < parts[1] < 1:
        raise InputError(
            f"step_info: rise = {quoted(value)} is not usable; give two fractions of the final "
            "value, the lower first, both from 0 to below 1, like (0.1, 0.9)."
        )
    low, high = np.asarray(parts).tolist()
    return low, high
