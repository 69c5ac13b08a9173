"""The first lines about a loop: is it stable, how far off, how fast, what limits it."""

from __future__ import annotations

import math

from vsctrl.diagram import Loop
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.errors import InputError, LimitError
from vsctrl.report.section import Verdict
from vsctrl.report.wording import digits, time

ROBUST = 2.0  #: Ms, above which a loop is close to shaking (Åström, Hägglund: 1.2 to 2)
LITTLE = 1e-6  #: of a set-point, an offset that is none


def loop_verdict(loop: Loop, margins: Margins | None) -> Verdict:
    """Read the numbers of a loop; `margins` is None where no loop runs through any signal."""
    roots = _unstable_roots(loop)
    sampled = None if loop.sampled is None else loop.sampled.is_stable
    stable = roots == 0 and sampled is not False
    first = _works(loop, roots, sampled)
    if not stable:
        return Verdict("bad", (first, *_way_back(loop, margins)))
    rest = [*_responses(loop), *_limits(loop, margins)]
    weak = margins is not None and margins.peak_sensitivity > ROBUST
    return Verdict("warning" if weak else "good", (first, *rest))


def _unstable_roots(loop: Loop) -> float:
    roots = loop.system.unstable_roots
    hidden = getattr(_margins(loop), "hidden_roots", ())
    # A root at 0 that no signal shows, as of a predictor's integrator, moves nothing.
    return max(0.0, roots - sum(1 for root in hidden if abs(root) < 1e-9))


def _margins(loop: Loop) -> Margins | None:
    try:
        return loop.open.margins()
    except (InputError, LimitError):
        return None


def _works(loop: Loop, roots: float, sampled: bool | None) -> str:
    held = "" if loop.period is None else f"as sampled every {time(loop.period, loop.time_unit)}"
    if roots and sampled:
        return (
            f"As sampled this loop is stable, {held}; in continuous time it is not: "
            f"{_roots(roots)}."
        )
    if roots:
        return f"This loop is unstable: {_roots(roots)}{', and ' + held + ' too' if held else ''}."
    if sampled is False:
        return f"This loop is unstable {held}, though it is stable in continuous time."
    return f"This loop is stable{', in continuous time and ' + held if held else ''}."


def _roots(roots: float) -> str:
    if math.isinf(roots):
        return "infinitely many characteristic roots are right of the imaginary axis"
    n = int(roots)
    return f"{n} characteristic root{'s are' if n > 1 else ' is'} right of the imaginary axis"


def _responses(loop: Loop) -> list[str]:
    """What the first output does after a step at each input that gets one."""
    out = []
    for one in loop.applied:
        if one.kind != "step" or not loop.watched:
            continue
        channel = loop.system[one.input, loop.watched[0]]
        try:
            info = channel.step_info()
        except (InputError, LimitError):
            continue
        name = f"After a step in {one.input}, {loop.watched[0]}"
        if info.final is None or math.isinf(info.settling_time):
            continue
        settled = time(info.settling_time, loop.time_unit)
        if abs(info.final) < LITTLE:
            peak = one.size * (info.peak or 0.0)
            at = time(info.peak_time or 0.0, loop.time_unit)
            out.append(
                f"{name} is off by up to {digits(peak, 3)} (after {at}) and back within 2 % of "
                f"that after {settled}."
            )
            continue
        overshoot = info.overshoot or 0.0
        over = f", overshooting by {100 * overshoot:.3g} %" if overshoot > 0.001 else ""
        rise = "" if info.rise_time is None else f"rises in {time(info.rise_time, loop.time_unit)}"
        out.append(
            f"{name} {rise}{over} and settles at {digits(one.size * info.final, 4)}, within 2 % "
            f"after {settled}."
        )
    return out


def _limits(loop: Loop, margins: Margins | None) -> list[str]:
    if margins is None:
        return ["No loop runs through any signal, so nothing limits it."]
    parts = []
    if math.isfinite(margins.gain):
        parts.append(f"its gain may be raised {digits(margins.gain, 3)}-fold")
    if math.isfinite(margins.delay):
        parts.append(f"it bears {time(margins.delay, loop.time_unit)} more of delay")
    if not parts:
        return [f"Opened at {loop.opened} neither gain nor delay limits it."]
    text = f"Opened at {loop.opened}, {' and '.join(parts)} before it shakes"
    text += f"; Ms = {margins.peak_sensitivity:.3g}"
    if margins.peak_sensitivity > ROBUST:
        text += f" is above {ROBUST:g}, which is little margin: lower the gain"
    return [text + "."]


def _way_back(loop: Loop, margins: Margins | None) -> list[str]:
    """What would make it stable, where the margins tell."""
    if margins is None:
        return []
    lower = [factor for _, factor in margins.phase_crossings if 0 < factor < 1]
    if not lower:
        return ["Lower its gain, or shorten what is late in it."]
    return [
        f"Opened at {loop.opened}, a pair of roots crosses the axis at {digits(min(lower), 3)} "
        "times its gain: below that it may be stable."
    ]
