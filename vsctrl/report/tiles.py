"""Four questions of a scenario or a loop, each answered by a number: the first look at a page.

Is it stable and by how much, how far off is it, how fast does it answer, what limits it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vsctrl.diagram import Loop
from vsctrl.report.gain_limits import LITTLE, causes
from vsctrl.report.how_far import CLOSE, NOTHING
from vsctrl.report.loop_verdict import ROBUST, Limits
from vsctrl.report.section import Colour, Tile
from vsctrl.report.wording import digits, length, listed, per_second, seconds, time
from vsctrl.study.examination.examination import Examination

ASKED = ("Is it stable?", "How far off?", "How fast does it answer?", "What limits it?")


# Of a scenario -----------------------------------------------------------------------------------
def scenario_tiles(x: Examination) -> list[Tile]:
    """Of the loop and the run as configured; none where the loop was not judged."""
    if x.loop is None:
        return []
    proof = "limits" if x.figure_1 is not None else "loop"
    return [_stable(x, proof), _off(x), _fast(x, proof), _limit(x, proof)]


def _stable(x: Examination, proof: str) -> Tile:
    assert x.loop is not None
    lam, limit = x.loop.elements.lam, x.loop.gain_limit
    if not x.loop.is_stable:
        value = "never" if limit == 0 else f"{digits(lam / limit, 3)}×" if limit < lam else "no"
        meaning = {"never": "no gain is stable", "no": "unstable at this gain"}.get(
            value, "its gain limit: unstable"
        )
        return Tile(ASKED[0], value, meaning, proof, "bad")
    if not math.isfinite(limit):
        return Tile(ASKED[0], "∞", "stable at any gain", proof, "good")
    kind: Colour = "good" if limit / lam > LITTLE else "warning"
    if limit <= lam:
        return Tile(ASKED[0], "yes", "though gains just beside it are not", proof, "warning")
    return Tile(ASKED[0], f"{digits(limit / lam, 3)}×", "more gain until it shakes", proof, kind)


def _off(x: Examination) -> Tile:
    anchor = _where(x)
    if not x.run.status.complete:
        return Tile(ASKED[1], f"{x.run.t[-1]:g} s", "the run ends early", anchor, "bad")
    last = x.last
    if last.kind == "at its reference":
        return Tile(ASKED[1], "< 10 µm", "on its reference", anchor, "good")
    mean, swing = abs(last.mean), last.half_range
    if not last.along_motion:
        kind: Colour | None = "good" if x.positioning is not None and x.arrives else None
        return Tile(ASKED[1], length(last.distance), "away at the end of the run", anchor, kind)
    if swing > max(mean, NOTHING):
        return Tile(ASKED[1], f"±{length(swing)}", "swinging along the motion", anchor)
    side = "behind its reference" if last.mean < 0 else "ahead of its reference"
    about = f" ± {length(swing)}" if swing > max(CLOSE * mean, NOTHING) else ""
    return Tile(ASKED[1], length(mean), f"{about} {side}".strip(), anchor)


def _where(x: Examination) -> str:
    """The section about how far off the camera is."""
    if x.positioning is not None:
        return "arrival"
    if x.figure_1 is None:
        return "run"
    c = x.figure_1.comparison
    return "lag" if c.rows or c.waves or c.histories else "runs"


def _fast(x: Examination, proof: str) -> Tile:
    assert x.loop is not None
    p = x.positioning
    if p is not None and p.simulated.to_image is not None and x.arrives:
        value, meaning = seconds(p.simulated.to_image), "until within 1 px for good"
        return Tile(ASKED[2], value, meaning, "arrival")
    constant = None if x.advice is None else x.advice.constant
    if not x.loop.is_stable or constant is None:
        growth = x.loop.growth
        if growth <= 1 or not np.isfinite(growth):
            return Tile(ASKED[2], "–", "errors do not die out", proof, "bad")
        value = seconds(x.loop.elements.period / math.log(growth))
        return Tile(ASKED[2], value, "until an error is e times as large", proof, "bad")
    if constant < x.loop.elements.period:
        return Tile(ASKED[2], seconds(x.loop.elements.period), "errors die out in a frame", proof)
    return Tile(ASKED[2], seconds(constant), "until errors fall to 1/e", proof)


def _limit(x: Examination, proof: str) -> Tile:
    assert x.loop is not None
    limit = x.loop.gain_limit
    if limit == 0:
        return Tile(ASKED[3], "λ = 0", "no gain is stable", proof, "bad")
    if not math.isfinite(limit):
        return Tile(ASKED[3], "nothing", "stable at any gain", proof)
    why = listed(causes(x))
    return Tile(ASKED[3], f"λ < {per_second(limit)}", f"by {why}", proof)


# Of a loop ---------------------------------------------------------------------------------------
def loop_tiles(loop: Loop, own: Limits | None, unstable: bool, info: Any) -> list[Tile]:
    """Of a loop: `own`: its limits, `info`: the figures of its first step, where it has any."""
    return [_loop_stable(own, unstable), *_answered(loop, info, unstable), _bears(loop, own)]


def _loop_stable(own: Limits | None, unstable: bool) -> Tile:
    if unstable:
        return Tile(ASKED[0], "no", "it is unstable", "margins" if own else "roots", "bad")
    if own is None:
        return Tile(ASKED[0], "yes", "stable", "roots", "good")
    peak = own.margins.peak_sensitivity
    kind: Colour = "good" if peak <= ROBUST else "warning"
    gain = own.margins.gain
    if math.isfinite(gain):
        word = "more gain until it is unstable"
        return Tile(ASKED[0], f"{digits(gain, 3)}×", word, "margins", kind)
    return Tile(ASKED[0], f"Ms {digits(peak, 3)}", "stable at any higher gain", "margins", kind)


def _answered(loop: Loop, info: Any, unstable: bool) -> list[Tile]:
    if unstable:
        return []
    if info is None or info.final is None or not math.isfinite(info.settling_time):
        return []
    settles = time(info.settling_time, loop.time_unit)
    if not info.final:
        off = Tile(ASKED[1], digits(info.peak or 0.0, 3), "at most, of a unit step", "responses")
    elif info.overshoot is None or info.overshoot < 5e-4:
        off = Tile(ASKED[1], "0 %", f"overshoot; settles at {digits(info.final, 4)}", "responses")
    else:
        value = f"{digits(100 * info.overshoot, 2)} %"
        off = Tile(ASKED[1], value, f"overshoot; settles at {digits(info.final, 4)}", "responses")
    return [off, Tile(ASKED[2], settles, "until within 2 % for good", "responses")]


def _bears(loop: Loop, own: Limits | None) -> Tile:
    if own is None:
        return Tile(ASKED[3], "–", "no loop runs through any signal", "roots")
    found = own.margins
    if not found.stable:
        return Tile(ASKED[3], f"Ms {digits(found.peak_sensitivity, 3)}", f"at {own.at}", "margins")
    if math.isfinite(found.delay) and found.delay > 0:
        value, meaning = time(found.delay, loop.time_unit), f"more delay at {own.at}"
        return Tile(ASKED[3], value, meaning, "margins")
    if found.delay == 0:
        return Tile(ASKED[3], "0 s", "no further delay at all", "margins", "warning")
    return Tile(
        ASKED[3], f"Ms {digits(found.peak_sensitivity, 3)}", "no delay limits it", "margins"
    )
