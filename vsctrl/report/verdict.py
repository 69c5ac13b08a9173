"""The report's first lines: what this loop does, in a few sentences and millimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

from vsctrl.report.sentences import agreement, tracking
from vsctrl.servo.results.outcome import notice
from vsctrl.study import LoopReport


@dataclass(frozen=True)
class Verdict:
    """`kind` colours the page: good, warning (the ways disagree), bad (unstable)."""

    kind: Literal["good", "warning", "bad"]
    sentences: tuple[str, ...]


def verdict(result: LoopReport) -> Verdict:
    """Read a report: the lag with and without the derivative term, agreement, headroom."""
    stable = result.stability.is_stable
    agrees, nothing = result.comparison.agrees, bool(result.comparison.note)
    sentences = [
        *([] if stable else [_unstable(result)]),
        *tracking(result),
        *agreement(result.comparison),
        *([_headroom(result)] if stable else []),
        *_as_configured(result),
        *(f"Is this meant? {doubt}" for doubt in result.scenario.doubts),
    ]
    own = result.outcome
    fine = (agrees or nothing) and (own is None or own.settled)
    failed = not stable or (own is not None and not own.status.ok)
    return Verdict("bad" if failed else "good" if fine else "warning", tuple(sentences))


def _as_configured(result: LoopReport) -> list[str]:
    """What the scenario has that theory leaves out, and how its own run ended."""
    if result.outcome is None:
        return []
    names = list(result.scenario.beyond_theory)
    listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
    return [
        f"All this is the loop of figure 1, and this scenario is more: theory leaves out {listed}. "
        f"As configured: {notice(result.outcome)}"
    ]


def per_second(value: float) -> str:
    """A gain with its unit: to a hundredth, and three digits of what is less than a tenth."""
    text = f"{value:.2f}" if value >= 0.1 else f"{Decimal(f'{value:.3g}'):f}"
    return f"{text} s⁻¹"


def _direction(result: LoopReport) -> str:
    """Which direction a limit is that of, where it is not the motion's own."""
    first, along = result.stability.ratio, result.stability.ratio_along_motion
    if math.isclose(first, along, rel_tol=1e-9):
        return ""
    return (
        " That is the limit of the direction that shakes first, which the law's wrong depths or "
        f"focal length leave with κ = {first:.3g}; along the motion κ is {along:.3g}, and a run "
        "that starts exactly on its reference may not show it."
    )


def _unstable(result: LoopReport) -> str:
    law, period = result.scenario.law, result.scenario.vision.period
    limits, kappa = result.stability.limits, result.stability.ratio
    calibration = "" if kappa == 1 else f" and a calibration with κ = {kappa:.3g}"
    text = (
        f"This loop is unstable: λ = {law.lam:g} s⁻¹ is above {per_second(limits.sampled)}, the "
        f"most that {1e3 * result.scenario.vision.latency:g} ms of latency"
        f"{calibration} allow when the velocity is held over {1e3 * period:g} ms"
    )
    if law.lam < limits.continuous < math.inf:
        text += f" (continuous-time theory would still allow {per_second(limits.continuous)})"
    text += f". Lower λ: {per_second(limits.fastest_sampled)} is the fastest without oscillation."
    return text + _direction(result)


def _headroom(result: LoopReport) -> str:
    lam, limits = result.scenario.law.lam, result.stability.limits
    factor = limits.sampled / lam
    subject = "The loop" if result.as_configured is None else "The loop of figure 1 by itself"
    text = (
        f"{subject} is stable: λ = {lam:g} s⁻¹ may be raised "
        f"{f'{factor:.2g}' if factor < 100 else f'{factor:.0f}'}-fold, to "
        f"{per_second(limits.sampled)}, before it shakes"
    )
    if math.isfinite(limits.continuous) and limits.continuous > 1.01 * limits.sampled:
        share = limits.continuous / limits.sampled - 1
        text += (
            f"; continuous-time theory, {per_second(limits.continuous)}, promises {share:.0%} too "
            "much"
        )
    return text + "." + _direction(result)
