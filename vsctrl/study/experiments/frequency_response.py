"""A Bode plot measured in the simulator: a sideways sine followed in six degrees of freedom.

A sideways motion at constant depth makes the image error exactly linear in the lag, so that the
steady error is a sine too, and figure 1 with its velocity held over a frame gives its amplitude and
phase at the frames to rounding. The continuous loop, shown beside it, misses the hold.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vsctrl import loop, timing
from vsctrl.arrays import Complex
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.experiments.experiment import Experiment, Measured, Value
from vsctrl.study.modes import nearest_depth, sideways_ratio
from vsctrl.study.runs import run, settling
from vsctrl.study.sine_fit import sine_fit
from vsctrl.symbols import T_s, d, k_ff, kappa, lam, omega, s, tau

AMPLITUDE = 0.02  #: of the motion, in nearest depths
DIRECTION = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
POINTS = 8  #: frequencies where none are given …
LOWEST, HIGHEST = 0.2, 0.9  #: … from this share of λ to this share of π/Tₛ
SEEN = 40  #: frames, at least, that a sine is fitted to, and at least half a cycle
ROUNDING = 1e-10  #: of the motion
REASON = "exact for a sideways motion: rounding and what is left of the transient"


@dataclass(frozen=True, kw_only=True)
class SineRow(Measured):
    """E/S* at one frequency ω (rad/s), with or without feed-forward.

    >>> vs.study.sine_response(vs.paper.sliding(), omega=[2.0]).rows[0].omega
    2.0
    """

    omega: float
    feedforward: bool


@dataclass(frozen=True, repr=False)
class SineResponse(Experiment):
    """E/S* of the true error: as amplitude and phase by the continuous, held, and 6-DOF loop.

    >>> len(vs.study.sine_response(vs.paper.sliding(), omega=[2.0]).rows)
    2
    """

    rows: tuple[SineRow, ...]

    title: ClassVar[str] = "error of a sideways sine, as a share of the motion: amplitude ∠ phase"

    def shown(self, value: Value | None) -> str:
        """Amplitude to five digits after the point, phase to a hundredth of a degree."""
        if value is None:
            return "–"
        phase = math.degrees(cmath.phase(value)) if abs(value) >= 5e-6 else 0.0
        return f"{abs(value):.5f} ∠{phase:8.2f}°"

    def curve(self, omega: ArrayLike, *, feedforward: bool, held: bool = True) -> Complex:
        """E/S* by theory at any frequencies ω (rad/s), complex, to draw the rows over."""
        of = _theory(self.scenario, feedforward, held)
        return np.array([of(float(w)) for w in np.ravel(omega)]).reshape(np.shape(omega))


@keywords
def sine_response(scenario: GivenScenario, omega: ArrayLike | None = None) -> SineResponse:
    """Amplitude and phase of the error of a sideways sine, with and without feed-forward.

    κTₛ(λ z^{−d·[aligned]} + k_ff jω)/(z − 1 + κλTₛ z^{−d}) − 1 at z = e^{jωTₛ}, with the scenario's
    placement; `omega`: frequencies in rad/s below π/Tₛ, by default eight from λ/5 up to nine
    tenths of it. Errors: `InputError` for other frequencies, where the loop is unstable as
    sampled, or the latency is no whole number of frames.

    >>> vs.study.sine_response(vs.paper.sliding(), omega=[2.0]).agrees
    True
    """
    scenario = as_scenario(scenario)
    top = math.pi / scenario.vision.period
    if omega is None:
        low = min(LOWEST * scenario.law.lam, LOWEST * top)
        omega = np.geomspace(low, HIGHEST * top, POINTS)
    grid = np.atleast_1d(np.asarray(omega, dtype=np.float64)).ravel()
    if not grid.size or not ((grid > 0) & (grid < top)).all():
        raise InputError(
            f"omega: {grid.tolist()} holds frequencies that frames of "
            f"{1e3 * scenario.vision.period:g} ms cannot tell; give some above 0 and below "
            f"{top:.4g} rad/s."
        )
    rows = [_row(scenario, on, float(w)) for on in (False, True) for w in grid]
    return SineResponse(scenario, tuple(rows))


def _row(scenario: Scenario, feedforward: bool, w: float) -> SineRow:
    frames, remaining = settling(scenario, "error")
    exact = _theory(scenario, feedforward, held=True)(w)
    amplitude, cycle = AMPLITUDE * nearest_depth(scenario), 2 * math.pi / w
    tail = max(SEEN, timing.first_frame(cycle / 2, scenario.vision.period))
    result = run(
        scenario,
        frames + tail,
        kind="oscillation",
        waveform="sine",
        direction=DIRECTION,
        amplitude=amplitude,
        cycle=cycle,
        speed=None,
        k_ff=_gain(scenario, feedforward),
    )
    simulated = None
    if result.status.complete:
        simulated = sine_fit(result.t[frames:], result.lag[frames:, 0] / amplitude, w)
    return SineRow(
        case=f"ω = {w:.4g} rad/s, {'with' if feedforward else 'without'} feed-forward",
        predicted=_theory(scenario, feedforward, held=False)(w),
        exact=exact,
        simulated=simulated,
        allowed=(ROUNDING + 10 * remaining) * (1 + abs(exact)),
        reason=REASON,
        note="" if result.status.complete else f"the run ended: {result.status.kind}",
        omega=w,
        feedforward=feedforward,
    )


def _gain(scenario: Scenario, feedforward: bool) -> float:
    return (scenario.law.k_ff or 1.0) if feedforward else 0.0


def _theory(scenario: Scenario, feedforward: bool, held: bool) -> Callable[[float], complex]:
    """E/S* of figure 1 over ω, in continuous time or with the velocity held over a frame."""
    law, period, latency = scenario.law, scenario.vision.period, scenario.vision.latency
    values = {kappa: sideways_ratio(scenario), lam: law.lam, k_ff: _gain(scenario, feedforward)}
    if held:
        sampled = loop.sampled_sine_error(law.placement)
        sampled = sampled.subs(values | {T_s: period, d: scenario.latency_frames})
        return lambda w: complex(sampled.subs(omega, w))
    continuous = loop.tracking_transfer(law.placement).subs(values | {tau: latency})
    return lambda w: complex(continuous.subs(s, 1j * w))
