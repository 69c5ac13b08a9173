"""What a loop answers to the steps that are applied to it, in sentences."""

from __future__ import annotations

import math
from functools import partial

from vsctrl.diagram import Loop
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.performance.step_figures import StepInfo
from vsctrl.report.wording import digits, listed, time
from vsctrl.study.examination.gain_ranges import known

SEEN = 1e-3  #: share of the final value, below which an overshoot is not spoken of


def answers(loop: Loop) -> list[str]:
    """What the first signal that is watched does after a step at each input that gets one."""
    out = []
    for one in loop.applied:
        if one.kind != "step" or not one.size or not loop.watched:
            continue
        info = known(partial(loop.step_info, one.input, loop.watched[0]))
        if info is not None and info.final is not None and math.isfinite(info.settling_time):
            out.append(_sentence(loop, one, info))
    return out


def first_step_info(loop: Loop) -> StepInfo | None:
    """Of the first signal that is watched after the first step that is applied; None without."""
    inputs = [one.input for one in loop.applied if one.kind == "step" and one.size]
    if not inputs or not loop.watched:
        return None
    found: StepInfo | None = known(partial(loop.step_info, inputs[0], loop.watched[0]))
    return found


def _sentence(loop: Loop, one: Applied, info: StepInfo) -> str:
    when = "As sampled, after" if loop.sampled else "After"
    start = f"{when} a step of {digits(one.size, 4)} in {one.input}, {loop.watched[0]}"
    if not info.final:
        return f"{start} {_returns(loop, one, info)}."
    return f"{start} {_settles(loop, one, info)}."


def _returns(loop: Loop, one: Applied, info: StepInfo) -> str:
    """Of a signal that ends where it began."""
    if not info.peak:
        return "does not move"
    at = info.peak_time or 0.0
    after = f"after {time(at, loop.time_unit)}" if at else "at once"
    back = time(info.settling_time, loop.time_unit)
    return (
        f"is off by up to {digits(one.size * info.peak, 3)} ({after}) and back within 2 % of that "
        f"after {back}"
    )


def _settles(loop: Loop, one: Applied, info: StepInfo) -> str:
    """Of a signal that ends elsewhere."""
    unit = loop.time_unit
    end = one.size * (info.final or 0.0)
    if not info.settling_time:
        return f"is at {digits(end, 4)} at once"
    over = info.overshoot or 0.0
    parts = []
    if info.rise_time:
        parts.append(f"{'rises' if end > 0 else 'falls'} in {time(info.rise_time, unit)}")
    elif info.rise_time == 0:
        parts.append("jumps")
    if over > SEEN:
        parts.append(f"overshoots by {digits(100 * over, 3)} %")
    within = f"within 2 % after {time(info.settling_time, unit)}"
    return listed([*parts, f"settles at {digits(end, 4)}"]) + f", {within}"
