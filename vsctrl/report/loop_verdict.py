"""The first lines about a loop: is it stable, what it answers, what limits it, what mends it.

A loop that a computer closes is judged as sampled, and what is of continuous time is said to be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from vsctrl.diagram import Loop
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.report.loop_answers import answers
from vsctrl.report.section import Colour, Verdict
from vsctrl.report.wording import digits, listed, time
from vsctrl.study.examination.gain_ranges import calmer, known, stable_ranges, turned

ROBUST = 2.0  #: Ms, above which a loop is close to shaking (Åström, Hägglund: 1.2 to 2)
ROUNDING = 1e-6  #: relative, by which Ms may be above that
SAME = 1.01  #: ratio of two gains that are as good as one
ON_THE_AXIS = 1e-9  #: share of its modulus by which a root is beside the imaginary axis


@dataclass(frozen=True)
class Limits:
    """What limits a loop: L opened at a signal, its margins, and the `period` of an L of z."""

    at: str
    L: Any
    margins: Margins
    period: float | None = None


def loop_verdict(loop: Loop, margins: Margins | None, own: Limits | None) -> Verdict:
    """Read the numbers of a loop; `margins` in continuous time, its `own` as it runs, if any."""
    roots = _unstable_roots(loop, margins)
    sampled = None if loop.sampled is None else loop.sampled.is_stable
    edge = margins is not None and not margins.stable and not roots
    first = _works(loop, roots, sampled, edge)
    if sampled is False or (sampled is None and (roots or edge)):
        back = tuple(_way_back(loop, own))
        return Verdict("bad", (first, *back), back, "unstable")
    word = _word(own, bool(roots or edge))
    kind: Colour = "good" if word == "stable" else "warning"
    told = (first, *answers(loop), *_limits(loop, own), *_promised(loop, own))
    return Verdict(kind, told, word=word)


def _word(own: Limits | None, as_sampled_only: bool) -> str:
    """What a loop that works is called: what there is to say against it, if anything."""
    if own is not None and _weak(own.margins):
        return "stable, little margin"
    if own is not None and own.margins.delay == 0:
        return "stable, bears no delay"
    return "stable, as sampled only" if as_sampled_only else "stable"


def own_limits(loop: Loop, margins: Margins | None) -> Limits | None:
    """Of the loop as a computer closes it, broken at its hold; else as it is."""
    if loop.sampled is not None and loop.hold not in loop.diagram.inputs:
        opened = known(loop.sampled.open)
        found = None if opened is None else known(opened.margins)
        return None if found is None else Limits(loop.hold, opened, found, loop.period)
    return None if margins is None else Limits(loop.opened, loop.open, margins)


def _weak(margins: Margins) -> bool:
    return margins.peak_sensitivity > ROBUST * (1 + ROUNDING)


def _unstable_roots(loop: Loop, margins: Margins | None) -> float:
    roots = loop.system.unstable_roots
    # A root at 0 that no signal shows, as of a predictor's integrator, moves nothing.
    return max(0.0, roots - _hidden_at_zero(margins))


def _hidden_at_zero(margins: Margins | None) -> int:
    hidden = () if margins is None else margins.hidden_roots
    return sum(1 for root in hidden if abs(root) < ON_THE_AXIS)


# Does it work ------------------------------------------------------------------------------------
def _works(loop: Loop, roots: float, sampled: bool | None, edge: bool) -> str:
    held = "" if loop.period is None else f"as sampled every {time(loop.period, loop.time_unit)}"
    continuous = _roots(loop, roots, edge)
    if not continuous:
        if sampled is False:
            return f"This loop is unstable {held}, though it is stable in continuous time."
        return f"This loop is stable{f' {held}, and in continuous time' if held else ''}."
    if sampled is None:
        return f"This loop is {'not stable' if edge else 'unstable'}: {continuous}."
    if sampled:
        return f"This loop is stable {held}; in continuous time it is not: {continuous}."
    return f"This loop is unstable {held}, and in continuous time: {continuous}."


def _roots(loop: Loop, roots: float, edge: bool) -> str:
    """What of its roots makes a loop unstable in continuous time; empty of a stable one."""
    if edge:
        return "a chain of characteristic roots tends to the imaginary axis"
    if not roots:
        return ""
    where = _where(loop, roots)
    if math.isinf(roots):
        return f"infinitely many characteristic roots are {where}"
    n = int(roots)
    return f"{n} characteristic root{'s are' if n > 1 else ' is'} {where}"


def _where(loop: Loop, roots: float) -> str:
    """On the axis, right of it, or some of both, as is to be seen of the roots themselves."""
    axis = "the imaginary axis"
    if math.isinf(roots):
        return f"right of {axis}"
    found = known(lambda: loop.system.poles(min(int(roots), 12)))
    if found is None or not len(found):
        return f"on or right of {axis}"
    beside = [root.real > ON_THE_AXIS * abs(root) and root.real > 0 for root in found]
    return f"right of {axis}" if all(beside) else f"on {'or right of ' * any(beside)}{axis}"


# What limits it ----------------------------------------------------------------------------------
def _limits(loop: Loop, own: Limits | None) -> list[str]:
    if own is None:
        if loop.opened:
            return ["How much gain and delay it bears cannot be told."]
        return ["No loop runs through any signal, so nothing limits it."]
    found = own.margins
    text = f"Opened at {own.at}{', as sampled' if own.period else ''}, "
    parts = _gain(found) + _delay(loop, own)
    if parts:
        text += f"{listed(parts)} before it is unstable"
    elif found.delay:
        text += "neither more gain nor more delay makes it unstable"
    else:
        text += "more gain does not make it unstable"
    if not found.delay:
        text += "; it bears no further delay at all"
    text += f"; Ms = {digits(found.peak_sensitivity, 3)}"
    if _weak(found):
        advice = {"lower": ": lower the gain", "raise": ": raise the gain"}
        text += f" is above {ROBUST:g}, which is little margin"
        text += advice.get(calmer(own.L, found, own.period), "")
    return [f"{text}."]


def _gain(margins: Margins) -> list[str]:
    """How far the gain may go up and down."""
    up = f"raised {_fold(margins.gain)}" if math.isfinite(margins.gain) else ""
    down = f"lowered to {digits(margins.gain_down, 3)} times" if margins.gain_down > 0 else ""
    return [f"its gain may be {' or '.join(filter(None, (up, down)))}"] if up or down else []


def _fold(factor: float) -> str:
    """A factor above 1; of a little above 1 more digits are told."""
    return f"{digits(factor, 3 if factor >= 1.05 else 5)}-fold"


def _delay(loop: Loop, own: Limits) -> list[str]:
    """What more of delay it bears: of a sampled loop in whole periods, of which that is exact."""
    delay = own.margins.delay
    if not math.isfinite(delay) or delay <= 0:
        return []
    if own.period is None:
        return [f"it bears {time(delay, loop.time_unit)} more of delay"]
    whole = math.floor(delay / own.period * (1 - ROUNDING))
    if not whole:
        return ["it bears less than a further period of delay"]
    return [f"it bears {whole} further period{'s' * (whole > 1)} of delay"]


def _promised(loop: Loop, own: Limits | None) -> list[str]:
    """What continuous time says of the gain of a sampled loop, where that is more than is true."""
    if own is None or own.period is None or not math.isfinite(own.margins.gain):
        return []
    found = known(lambda: loop.system.open(own.at).margins())
    if found is None or not found.stable:
        return []
    if math.isinf(found.gain):
        return ["In continuous time no gain would be too high."]
    if found.gain > SAME * own.margins.gain:
        return [f"In continuous time its gain could be raised {_fold(found.gain)}."]
    return []


# What mends it -----------------------------------------------------------------------------------
def _way_back(loop: Loop, own: Limits | None) -> list[str]:
    """With which gain it is stable, found by counting the roots of the loop that has it."""
    found = None if own is None else known(lambda: stable_ranges(loop, own.at, own.margins))
    if own is None or found is None:
        return []
    ranges, all_of_them = found
    if ranges:
        low, high = min(ranges, key=_away)
        return [f"Opened at {own.at}, it is stable with {_within(low, high)} its gain."]
    if known(lambda: turned(loop, own.at)):
        return [f"With the opposite sign at {own.at} it is stable: it feeds back positively."]
    return [f"No gain at {own.at} makes it stable."] if all_of_them else []


def _away(ends: tuple[float, float]) -> float:
    """How far a range is from 1, which is not in it."""
    low, high = ends
    return -math.log(high) if high <= 1 else math.log(low) if low >= 1 else 0.0


def _within(low: float, high: float) -> str:
    if low == 0:
        return f"less than {digits(high, 3)} times"
    if math.isinf(high):
        return f"more than {digits(low, 3)} times"
    return f"{digits(low, 3)} to {digits(high, 3)} times"
