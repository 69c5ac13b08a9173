"""The steady lag behind a reference of constant speed: four ways to know it, side by side.

A `ReferenceCourse` says what the reference does along its motion and when the lag is read: a ramp
at its end, or a leg of a triangle just before the turn. A `SteadyLag` holds what each way reads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.diagram import Ramp, Signal
from vsctrl.errors import InputError
from vsctrl.servo import Run, Scenario
from vsctrl.study.tracking.cases import MOST_FRAMES, Case, CaseResult, is_sideways
from vsctrl.symbols import v
from vsctrl.tables import finite

if TYPE_CHECKING:
    import control

    from vsctrl.diagram.system import System
    from vsctrl.symbols import Expr


WAYS = ("analytic", "pade", "exact", "simulated")
PADE_ORDER = 4
RELATIVE = 0.01  #: agreement asked of all ways, as a share of the closed form …
ABSOLUTE = 10e-6  #: … or in metres, where the closed form is (nearly) zero


@dataclass(frozen=True)
class SteadyLag(CaseResult):
    """One case: the steady lag along the motion in m, negative = behind, by each way.

    `None` where a way has no answer; `note` then says why. `formula` is the closed form.
    A simulation that runs away where the loop should be stable is a disagreement. Where a motion
    turns or changes depth, the terms of the lag are right to 1 % each, and may cancel in their sum.

    >>> found = vs.validate(vs.paper.sliding())
    >>> print(round(1e3 * found.rows[-2].exact, 3))
    3.2
    """

    formula: Expr
    analytic: float | None
    pade: float | None
    exact: float | None
    simulated: float | None
    note: str = ""
    contradicted: bool = False  #: the simulation failed where theory promises a steady lag
    terms: float = 0.0  #: v(τ + 1/κλ) where figure 1 is the first order of the motion, m
    lasted: float = 0.0  #: the length of the simulation, s; 0 without one

    @property
    def disagreement(self) -> float | None:
        """The largest difference between any two of the four ways, m."""
        values = [getattr(self, way) for way in WAYS]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        return max(known) - min(known) if np.isfinite(known).all() else math.inf

    @property
    def tolerance(self) -> float:
        """The disagreement that still counts as agreement, m."""
        return tolerance(max(abs(self.analytic or 0.0), self.terms))

    @property
    def agrees(self) -> bool | None:
        """Whether all four ways agree; None where one of them has no answer to give."""
        if self.contradicted:
            return False
        return None if self.disagreement is None else self.disagreement <= self.tolerance

    def data(self) -> dict[str, Any]:
        """The row as JSON takes it; every name ends in its unit."""
        return super().data() | {
            **{f"{way}_m": getattr(self, way) for way in WAYS},
            "aligned": self.placement == "aligned",
            "formula": str(self.formula),
            "simulated_s": self.lasted,
            "disagreement_m": finite(self.disagreement),
            "allowed_m": self.tolerance,
            "agrees": self.agrees,
            "note": self.note,
        }


@dataclass(frozen=True)
class ReferenceCourse:
    """The way along the motion over time, and when its lag is read.

    `signal`: a sum of ramps (m); `at`: the time of a frame (s), when the reference moves forwards
    (`sign` 1) or backwards (−1); `duration`: of the run, s; `note`: why the transient is not over
    by then, empty where it is.
    """

    signal: Signal
    at: float
    duration: float
    sign: float = 1.0
    note: str = ""


def tolerance(size: float) -> float:
    """The disagreement that counts as agreement on a steady lag of a size in m, m."""
    return max(RELATIVE * abs(size), ABSOLUTE)


def allowance(sideways: bool) -> str:
    """What `SteadyLag.tolerance` is, in a sentence; `sideways`: whether figure 1 is exact."""
    share = f"{RELATIVE:.0%}".replace("%", " %")
    of = "the closed form" if sideways else "v(τ + 1/κλ), or of the closed form if that is larger"
    return f"Allowed is {share} of {of}, but never less than {1e6 * ABSOLUTE:g} µm."


def row(case: Case, course_of: Callable[[Case], ReferenceCourse]) -> tuple[SteadyLag, Run | None]:
    """One case by all four ways, and its simulation where the loop should be stable in it."""
    scenario, system, law = case.scenario, case.system, case.scenario.law
    speed, period = scenario.speed, scenario.vision.period
    course = course_of(case)
    analytic = pade = exact = simulated = run = None
    notes, contradicted = [], False
    if system.unstable_roots:
        notes.append("no steady lag: the loop is unstable")
    else:
        analytic = case.steady_lag
        exact, pade = _exact(system, course), _pade(system, course)
    if not case.is_stable_as_sampled:
        notes.append(f"unstable at {1e3 * period:g} ms sampling")
    else:
        run = case.run(course.duration)
        if run.status.complete:
            simulated = float(run.lag_along_motion[timing.last_frame(course.at, period)])
        else:
            notes.append(f"the simulation ended: {run.status.kind}")
            contradicted = True
    if course.note:
        notes.append(course.note)
        analytic = None
    done = SteadyLag(
        **case.labels,
        formula=case.formula(Ramp(v)),
        analytic=analytic,
        pade=pade,
        exact=exact,
        simulated=simulated,
        note="; ".join(notes),
        contradicted=contradicted,
        terms=0.0 if is_sideways(scenario) else speed * (case.delay + 1 / (case.kappa * law.lam)),
        lasted=0.0 if run is None else float(run.t[-1]),
    )
    return done, run


def ramp(case: Case) -> ReferenceCourse:
    """A constant twist, read at the end of a run that is long enough for the transient."""
    horizon, over = _horizon(case)
    note = "" if over else f"transient not over after {horizon:g} s"
    return ReferenceCourse(Ramp(case.scenario.speed), horizon, horizon, note=note)


def _horizon(case: Case) -> tuple[float, bool]:
    """How long to run until the transient is below 1e-6 of itself (s), and whether that fits."""
    scenario: Scenario = case.scenario
    rate = -float(case.system.poles(1)[0].real)
    if not case.is_stable_as_sampled or rate <= 0:
        return scenario.motion.duration, True
    # Near the sampled limit the held loop decays more slowly than the continuous one.
    rate *= max(1 - scenario.law.lam / case.sampled_limit, 0.02)
    needed = max(scenario.motion.duration, 14 / rate)
    frames = min(timing.first_frame(needed, scenario.vision.period), MOST_FRAMES)
    wanted = frames * scenario.vision.period
    try:
        scenario.with_(duration=wanted)
    except InputError:  # the longer path leaves the target; stay with the scenario's own
        wanted = scenario.motion.duration
    return wanted, wanted >= min(needed, 7 / rate)


def _exact(system: System, course: ReferenceCourse) -> float:
    response = system["S_ref", "S"].response(course.signal, [course.at])
    error = response.y.ravel()[-1] - course.signal([course.at])[0]
    return float(course.sign * error)


def _pade(system: System, course: ReferenceCourse) -> float:
    """Of the Padé model, one ramp after the other, so that no turn falls between two steps."""
    model = system["S_ref", "S"].pade(PADE_ORDER)
    total = 0.0
    for start, part in course.signal.terms:
        t = np.linspace(0.0, course.at - float(start), 2001)
        total += float(forced_response(model, t, part(t))[-1])
    return float(course.sign * (total - course.signal([course.at])[0]))


def forced_response(model: control.StateSpace, t: Array, u: Array) -> Array:
    """python-control's response of a model to u at equally spaced times t, each (n,)."""
    import control

    if not model.nstates:  # a gain is taken for discrete, and its steps are then miscounted
        return np.asarray(model.D[0, 0] * u)
    return np.ravel(control.forced_response(model, t, u).outputs)


def millimetres(value: float | None) -> str:
    """A length in mm to the micrometre, a dash where there is none, never a negative zero."""
    if value is None:
        return "–"
    text = f"{1e3 * value:+.3f}"
    return "0.000" if float(text) == 0 else text.replace("-", "−")
