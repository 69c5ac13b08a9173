"""The error behind a sine: an amplitude and a phase, known in five ways.

Two are continuous in time (the closed form, and the exact-delay engine's response once it has
settled) and must be the same; two hold the velocity over a frame (the loop in z, and the
six-degree-of-freedom simulation) and must be the same. Between the pairs lies the hold, which
acts like half a period of further latency in the actuator; with that put into it the continuous
form comes close to the others, as the column `repaired` shows.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from vsctrl import loop, timing
from vsctrl.diagram import Block, Diagram, Sine
from vsctrl.servo import Run, Scenario
from vsctrl.servo.motion.trajectory import Oscillation
from vsctrl.study.runs import settling
from vsctrl.study.sine_fit import sine_fit
from vsctrl.study.tracking.cases import Case, CaseResult, is_sideways
from vsctrl.study.tracking.lag_history import held_twin
from vsctrl.study.tracking.steady_lag import ABSOLUTE, PADE_ORDER, RELATIVE
from vsctrl.symbols import T_s, d, ell, k_ff, kappa, lam, omega, s, tau
from vsctrl.tables import finite

if TYPE_CHECKING:
    from vsctrl.diagram.system import System
    from vsctrl.symbols import Expr


ROUNDING = 1e-9  #: of the motion
ENDED = 1e-10  #: of a transient, what is left of it when the continuous error is read
FEWEST, MOST = 40, 4000  #: frames that a sine is fitted to, if a cycle has fewer or more
POINTS = 64  #: of the exact response that a sine is fitted to


@dataclass(frozen=True)
class Wave(CaseResult):
    """One case: the steady error as a complex amplitude in m, of a reference A sin ωt.

    The error is |z| sin(ωt + arg z). `analytic`: E/S*(jω) A by `formula`; `pade`: the same of
    python-control's model; `exact`: fitted to the exact-delay response; `sampled`: of the loop in
    z; `simulated`: fitted to the simulation; `repaired`: `analytic` with half a period more in the
    actuator. `None`
    where a way has no answer; `note` says why. `allowed` (m) is the difference between sampled and
    simulated that counts as agreement, `reason` where it comes from.

    >>> found = vs.validate(vs.paper.oscillation("sine"))
    >>> found.waves[0].agrees
    True
    """

    formula: Expr
    analytic: complex | None
    pade: complex | None
    exact: complex | None
    sampled: complex | None
    simulated: complex | None
    repaired: complex | None
    allowed: float
    reason: str
    note: str = ""
    contradicted: bool = False  #: the simulation failed where theory promises a steady error

    @property
    def disagreement(self) -> float | None:
        """The larger of two differences, m: exact − analytic and simulated − sampled."""
        smooth = _distance(self.exact, self.analytic)
        held = _distance(self.simulated, self.sampled)
        if smooth is None or held is None:
            return None
        return max(smooth, held) if np.isfinite([smooth, held]).all() else math.inf

    @property
    def hold(self) -> float | None:
        """What holding the velocity changes, |sampled − analytic| in m."""
        return _distance(self.sampled, self.analytic)

    @property
    def left_by_repair(self) -> float | None:
        """What remains of that with half a period put into the formula, m."""
        return _distance(self.sampled, self.repaired)

    @property
    def agrees(self) -> bool | None:
        """Whether both differences are within what is allowed; None where there are none."""
        if self.contradicted:
            return False
        return None if self.disagreement is None else self.disagreement <= self.allowed

    def data(self) -> dict[str, Any]:
        """The row as JSON takes it, amplitudes in m and phases in rad."""
        polar: dict[str, float | None] = {}
        for way in ("analytic", "pade", "exact", "sampled", "simulated", "repaired"):
            value = getattr(self, way)
            polar[f"{way}_m"] = None if value is None else abs(value)
            polar[f"{way}_rad"] = None if value is None else cmath.phase(value)
        return super().data() | {
            **polar,
            "formula": str(self.formula),
            "disagreement_m": finite(self.disagreement),
            "allowed_m": self.allowed,
            "agrees": self.agrees,
            "reason": self.reason,
            "note": self.note,
        }


def _distance(one: complex | None, other: complex | None) -> float | None:
    return None if one is None or other is None else abs(one - other)


def wave(case: Case, reference: Oscillation) -> tuple[Wave, Run | None]:
    """One case of a sine by all ways, and its simulation where the loop is stable as sampled."""
    system, amplitude, w = case.system, reference.amplitude, 2 * math.pi / reference.period
    period = case.scenario.vision.period
    analytic = pade = exact = sampled = simulated = repaired = run = None
    notes, contradicted, remaining = [], False, 0.0
    if system.unstable_roots:
        notes.append("no steady error: the loop is unstable")
    else:
        analytic = amplitude * _continuous(case, w)
        pade = amplitude * complex(system["S_ref", "S"].pade(PADE_ORDER)(1j * w) - 1)
        exact = _settled(system, amplitude, w) if w * period < math.pi else None
    if not case.is_stable_as_sampled:
        notes.append(f"unstable at {1e3 * period:g} ms sampling")
    elif not w * period < math.pi:
        notes.append(f"frames of {1e3 * period:g} ms cannot tell so fast a sine")
    else:
        frames, remaining = settling(case.own, "error")
        tail = min(max(FEWEST, timing.first_frame(reference.period, period)), MOST)
        sampled = amplitude * _held(case, w)
        repaired = amplitude * _repaired(case, w)
        run = case.run(max(case.scenario.motion.duration, (frames + tail) * period))
        if run.status.complete:
            error = run.lag[-tail:, :3] @ reference.direction[:3]
            simulated = sine_fit(run.t[-tail:], error, w)
        else:
            notes.append(f"the simulation ended: {run.status.kind}")
            contradicted = True
    allowed, reason = _allowed(case.scenario, amplitude, sampled, remaining)
    unit: Any = omega
    done = Wave(
        **case.labels,
        formula=case.formula(Sine(unit)),
        analytic=analytic,
        pade=pade,
        exact=exact,
        sampled=sampled,
        simulated=simulated,
        repaired=repaired,
        allowed=allowed,
        reason=reason,
        note="; ".join(notes),
        contradicted=contradicted,
    )
    return done, run


def polar(value: complex | None) -> str:
    """A complex amplitude as mm to the micrometre and degrees to the hundredth, or a dash."""
    if value is None:
        return "–"
    if abs(value) < 5e-7:
        return "0.000"
    text = f"{1e3 * abs(value):.3f} ∠{math.degrees(cmath.phase(value)):+.2f}°"
    return text.replace("-", "−")


def _allowed(
    scenario: Scenario, amplitude: float, sampled: complex | None, remaining: float
) -> tuple[float, str]:
    size = abs(sampled or 0.0)
    if is_sideways(scenario):
        reason = "since a sideways motion is exact but for rounding and the transient's end"
        return (ROUNDING + 10 * remaining) * (amplitude + size), reason
    reason = (
        f"{RELATIVE:.0%} of the error or {1e6 * ABSOLUTE:g} µm, since figure 1 is the first order "
        "of a motion that turns or changes depth"
    )
    return max(RELATIVE * size, ABSOLUTE), reason


def _numbers(case: Case) -> dict[Any, float]:
    return {lam: case.values["lam"], k_ff: case.k_ff, kappa: case.kappa}


def _continuous(case: Case, w: float) -> complex:
    transfer = loop.tracking_transfer(case.placement).subs({**_numbers(case), tau: case.delay})
    return complex(transfer.subs(s, 1j * w))


def _held(case: Case, w: float) -> complex:
    period = case.scenario.vision.period
    samples = timing.whole_periods(case.delay, period)
    if samples is None:
        twin, z = held_twin(case), cmath.exp(1j * w * period)
        delay = cmath.exp(-1j * w * case.delay) if case.is_late_between_frames else 1.0
        compared, rate = (complex(twin[name, "S"](z)) for name in ("S_ref", "S_rate"))
        return delay * compared + 1j * w * rate - 1
    held = {T_s: period, d: samples}
    transfer = loop.sampled_sine_error(case.placement).subs({**_numbers(case), **held})
    return complex(transfer.subs(omega, w))


def _repaired(case: Case, w: float) -> complex:
    half = case.scenario.vision.period / 2
    loop_of = _with_hold(case.placement).at(case.values, ell=case.kappa, ell_hat=1.0, T_s=2 * half)
    return complex(loop_of["S_ref", "S"](1j * w) - 1)


@cache
def _with_hold(placement: loop.Placement) -> Diagram:
    """Figure 1 with the hold as half a period of latency in front of the robot."""
    base = loop.diagram(placement)
    (vision,) = (block for block in loop.diagram().blocks if block.output == "S_meas")
    held = vision.expr.subs(tau, T_s / 2)  # e^{−sTₛ/2}
    robot = Block("robot, camera", ell / s * held, f"{base.drivers['S'].inputs[0]} -> S")
    parts = [robot if part.output == "S" else part for part in base.parts]
    return Diagram(parts, inputs=base.inputs, outputs=base.outputs)


def _settled(system: System, amplitude: float, w: float) -> complex:
    """The amplitude of the exact-delay error over a cycle after the transient."""
    channel = system["S_ref", "S"]
    if not channel.expr.has(s):  # a gain answers at once, and has nothing to settle
        return amplitude * complex(channel.expr - 1)
    ended = math.log(ENDED) / float(system.poles(1)[0].real)
    t = np.linspace(ended, ended + 2 * math.pi / w, POINTS, endpoint=False)
    response = channel.response(Sine(w, amplitude), t)
    return sine_fit(t, response.y.ravel() - amplitude * np.sin(w * t), w)
