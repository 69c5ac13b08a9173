"""The lag on the legs of a triangle: each is a ramp, entered from the one before it.

A leg is long enough or not for what its turn sets off to end. Where it is, the lag just before the
next turn is that of a ramp; where it is not, there is no steady lag, and the row says what is left.
"""

from __future__ import annotations

import numpy as np

from vsctrl import timing
from vsctrl.diagram import Ramp, Signal
from vsctrl.servo.motion.trajectory import Oscillation
from vsctrl.study.tracking.cases import MOST_FRAMES, Case
from vsctrl.study.tracking.steady_lag import ReferenceCourse, tolerance

MOST_LEGS = 40  #: that are answered before the lag is read
SHARE = 0.1  #: of the tolerance, that a transient may still make up


def legs(reference: Oscillation, case: Case) -> ReferenceCourse:
    """The triangle of a case's scenario, read at the last frame before its last turn."""
    cycle, period = reference.period, case.scenario.vision.period
    duration = _long_enough(case, reference)
    turns = [(0.25 + k / 2) * cycle for k in range(MOST_LEGS)]
    turns = [turn for turn in turns if turn < duration + period / 2]
    frames = timing.last_frame(duration, period)
    end = min(frames, timing.first_frame(turns[-1], period) - 1) if turns else frames
    read_at = max(end, 0) * period
    before = max((turn for turn in turns if turn <= read_at), default=0.0)
    sign = float(np.sign(reference.twist(read_at) @ reference.direction))
    note = _remaining(case, read_at - before)
    return ReferenceCourse(triangle(reference, read_at), read_at, frames * period, sign, note)


def triangle(reference: Oscillation, until: float) -> Signal:
    """The way along the direction of a triangle as a sum of delayed ramps, true up to `until`, s.

    v·t, and 2v·(t − t_k) less or more from every turn t_k on.
    """
    speed = 4 * reference.amplitude / reference.period
    total: Signal = Ramp(speed)
    k, turn = 0, reference.period / 4
    while turn < until:
        total = total + Ramp(2 * speed if k % 2 else -2 * speed).delayed(turn)
        k, turn = k + 1, (0.25 + (k + 1) / 2) * reference.period
    return total


def _long_enough(case: Case, reference: Oscillation) -> float:
    """The length of the run, s: that of the scenario, or of a quarter and a whole leg if longer."""
    period = case.scenario.vision.period
    wanted = timing.first_frame(0.75 * reference.period, period) * period
    own = case.scenario.motion.duration
    return max(own, wanted) if wanted <= MOST_FRAMES * period else own


def _remaining(case: Case, seconds: float) -> str:
    """What is left of the transient that a leg began with, in words; empty where it is over."""
    if not case.is_stable_as_sampled or case.system.unstable_roots:
        return ""
    speed = case.scenario.speed
    # A turn changes the speed by 2v, and with it the lag by about twice v (τ + 1/κλ).
    size = 2 * speed * (case.delay + 1 / (case.kappa * case.scenario.law.lam))
    remaining = case.left_after(seconds)
    if remaining * size <= SHARE * tolerance(case.steady_lag):
        return ""
    percent = 100 * remaining
    return f"no steady lag: {seconds:.3g} s into the leg, {percent:.2g}% of its turn is left"
