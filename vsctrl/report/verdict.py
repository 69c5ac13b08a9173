"""The report's first lines: what this loop does, in a few sentences and millimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from vsctrl.report.sentences import agreement, tracking
from vsctrl.servo.results.outcome import notice, outcome
from vsctrl.study import Examination


@dataclass(frozen=True)
class Verdict:
    """`kind` colours the page: good, warning (the ways disagree), bad (unstable)."""

    kind: Literal["good", "warning", "bad"]
    sentences: tuple[str, ...]


def verdict(found: Examination) -> Verdict:
    """Read an examination: the lag with and without the derivative term, agreement, headroom."""
    stable = found.stability.is_stable
    agrees, nothing = found.comparison.agrees, bool(found.comparison.note)
    sentences = [
        *([] if stable else [_unstable(found)]),
        *tracking(found),
        *agreement(found.comparison),
        *([_headroom(found)] if stable else []),
        *_as_configured(found),
    ]
    own = None if found.as_configured is None else outcome(found.as_configured)
    fine = (agrees or nothing) and (own is None or own.settled)
    failed = not stable or (own is not None and not own.status.ok)
    return Verdict("bad" if failed else "good" if fine else "warning", tuple(sentences))


def _as_configured(found: Examination) -> list[str]:
    """What the scenario has that theory leaves out, and how its own run ended."""
    run = found.as_configured
    if run is None:
        return []
    names = list(found.scenario.beyond_theory)
    listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
    return [
        f"All this is the loop of figure 1, and this scenario is more: theory leaves out {listed}. "
        f"As configured: {notice(outcome(run))}"
    ]


def _subject(found: Examination) -> str:
    """What is stable or not: the loop of figure 1 alone, where the scenario is more."""
    return "The loop" if found.as_configured is None else "The loop of figure 1 by itself"


def _direction(found: Examination) -> str:
    """Which direction a limit is that of, where it is not the motion's own."""
    first, along = found.stability.ratio, found.stability.ratio_along_motion
    if math.isclose(first, along, rel_tol=1e-9):
        return ""
    return (
        " That is the limit of the direction that shakes first, which the law's wrong depths or "
        f"focal length leave with κ = {first:.3g}; along the motion κ is {along:.3g}, and a run "
        "that starts exactly on its reference may not show it."
    )


def _fold(factor: float) -> str:
    return f"{factor:.2g}-fold" if factor < 100 else f"{factor:.0f}-fold"


def _unstable(found: Examination) -> str:
    law, period = found.scenario.law, found.scenario.vision.period
    limits = found.stability.limits
    text = (
        f"This loop is unstable: λ = {law.lam:g} s⁻¹ is above {limits.sampled:.2f} s⁻¹, the most "
        f"that {1e3 * found.scenario.vision.latency:g} ms of latency"
        f"{_calibration(found.stability.ratio)} allow when the velocity is held over "
        f"{1e3 * period:g} ms"
    )
    if law.lam < limits.continuous < math.inf:
        text += f" (continuous-time theory would still allow {limits.continuous:.2f} s⁻¹)"
    text += f". Lower λ: {limits.fastest_sampled:.2f} s⁻¹ is the fastest without oscillation."
    return text + _direction(found)


def _calibration(ratio: float) -> str:
    return "" if ratio == 1 else f" and a calibration with κ = {ratio:.3g}"


def _headroom(found: Examination) -> str:
    lam, limits = found.scenario.law.lam, found.stability.limits
    factor = limits.sampled / lam
    text = (
        f"{_subject(found)} is stable: λ = {lam:g} s⁻¹ may be raised {_fold(factor)}, to "
        f"{limits.sampled:.2f} s⁻¹, before it shakes"
    )
    if math.isfinite(limits.continuous) and limits.continuous > 1.01 * limits.sampled:
        share = limits.continuous / limits.sampled - 1
        text += (
            f"; continuous-time theory, {limits.continuous:.2f} s⁻¹, promises {share:.0%} too much"
        )
    return text + "." + _direction(found)
