"""The lag of a camera predicted three ways and simulated, side by side.

For each combination of feed-forward, latency and reference placement: SymPy's closed form, its
value, the Padé model's and the exact-delay engine's response to the same ramp, and the lag of the
six-degree-of-freedom simulation, with the largest disagreement between them. The rooms that
produce the numbers know nothing of each other; this is where they meet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from vsctrl import loop
from vsctrl.diagram import Ramp
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate
from vsctrl.symbols import v

if TYPE_CHECKING:
    import sympy as sp

    from vsctrl.diagram.system import System

PADE_ORDER = 4
RELATIVE = 0.01  #: agreement asked of all ways, as a share of the closed form …
ABSOLUTE = 10e-6  #: … or in metres, where the closed form is (nearly) zero
MOST_FRAMES = 10_000  #: the longest run that waiting for the end of a transient may cost


@dataclass(frozen=True)
class Row:
    """One case: the steady lag along the motion in m, negative = behind, by each way.

    `None` where a way has no answer; `note` then says why. `formula` is the closed form.
    A simulation that runs away where the loop should be stable is a disagreement.
    """

    case: str
    feedforward: bool
    delay: float  #: s
    placement: str
    formula: sp.Expr
    analytic: float | None
    pade: float | None
    exact: float | None
    simulated: float | None
    note: str = ""
    contradicted: bool = False  #: the simulation failed where theory promises a steady lag

    @property
    def disagreement(self) -> float | None:
        """The largest difference between any two of the four ways, m."""
        values = [self.analytic, self.pade, self.exact, self.simulated]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        return max(known) - min(known) if np.isfinite(known).all() else math.inf

    @property
    def tolerance(self) -> float:
        """The disagreement that still counts as agreement, m."""
        return max(RELATIVE * abs(self.analytic or 0.0), ABSOLUTE)

    @property
    def agrees(self) -> bool | None:
        """Whether all four ways agree; None where one of them has no answer to give."""
        if self.contradicted:
            return False
        return None if self.disagreement is None else self.disagreement <= self.tolerance


@dataclass(frozen=True)
class Comparison:
    """Every case of a scenario, and whether all ways agree wherever there is a steady lag."""

    scenario: Scenario
    rows: tuple[Row, ...]

    @property
    def agrees(self) -> bool | None:
        """True or False over the cases that can be compared; None where none can."""
        known = [row.agrees for row in self.rows if row.agrees is not None]
        return all(known) if known else None

    @property
    def exact_motion(self) -> bool:
        """Whether figure 1 describes this motion exactly: no turning, no change of depth."""
        T = self.scenario.constant_twist
        return T is not None and not T[2:].any()

    @property
    def largest_disagreement(self) -> float | None:
        """Over all cases that can be compared, m."""
        known = [row.disagreement for row in self.rows if row.disagreement is not None]
        return max(known, default=None)

    def row(self, *, feedforward: bool, delay: float, placement: str = "measurement") -> Row:
        """The row of one case. Raises InputError where the comparison holds no such case."""
        for row in self.rows:
            if (row.feedforward, row.placement) == (feedforward, placement) and math.isclose(
                row.delay, delay, abs_tol=1e-12
            ):
                return row
        raise InputError(
            f"comparison: there is no case with delay {delay} s and placement {placement!r}; "
            f"it has {', '.join(dict.fromkeys(row.case for row in self.rows))}."
        )

    def __str__(self) -> str:
        head = f"{'steady lag along the motion, mm':44}" + "".join(
            f"{title:>12}"
            for title in ("closed form", f"Padé {PADE_ORDER}", "exact delay", "6-DOF")
        )
        lines = [head]
        for row in self.rows:
            values = (row.analytic, row.pade, row.exact, row.simulated)
            numbers = "".join(f"{millimetres(value):>12}" for value in values)
            mark = {True: "  agree", False: "  DISAGREE ", None: "  "}[row.agrees] + row.note
            lines.append(f"{row.case:44}{numbers}{mark}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        titles = ("case", "closed form", f"Padé {PADE_ORDER}", "exact delay", "6-DOF", "")
        body = "<tr>" + "".join(f"<th>{title}</th>" for title in titles) + "</tr>"
        for row in self.rows:
            values = (row.analytic, row.pade, row.exact, row.simulated)
            mark = {True: "agree", False: "disagree ", None: ""}[row.agrees] + row.note
            cells = [row.case, *(millimetres(value) for value in values), mark]
            body += "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
        return f"<table><caption>steady lag along the motion, mm</caption>{body}</table>"


def validate(scenario: Scenario) -> Comparison:
    """Predict and simulate the steady lag of a scenario, with its options switched on and off.

    Cases: feed-forward off and on (1 where the scenario has none), latency 0 and the scenario's,
    the latency in the measurement, aligned, and in the actuator if the scenario has it there.
    The loop of figure 1 is taken with κ = `law.depth_ratio`, which a uniform depth error of points
    makes of a translation. Start offset and pixel noise are left out.
    Errors: `InputError` where the twist of the reference changes or has no translation, or the
    latency is no whole number of frames.
    """
    T = scenario.constant_twist
    if T is None:
        speed, duration = scenario.speed, scenario.motion.duration
        raise InputError(
            "motion.kind: the closed forms compared here are those of a constant twist, and a "
            f'motion of kind "{scenario.motion.kind}" changes it; look at simulate(scenario), or '
            "validate a slide at its greatest speed: "
            f'scenario.with_(kind="screw", V=({speed:.4g}, 0, 0), duration={duration:.4g}).'
        )
    if not T[:3].any():
        field = "motion.V" if scenario.motion.kind == "screw" else "motion"
        raise InputError(
            f"{field}: the reference does not translate, so there is no lag in metres to "
            f"validate; give {field} a velocity, or look at simulate(scenario).lag."
        )
    scenario.latency_frames  # noqa: B018 - a latency between frames is refused before any work
    latency, on = scenario.vision.latency, scenario.law.k_ff or 1.0
    placements = ["measurement", "aligned"]
    if scenario.law.placement == "actuator":
        placements.append("actuator")
    cases = product((0.0, on), dict.fromkeys((0.0, latency)), placements)
    rows = [
        _row(scenario, k_ff, delay, placement)
        for k_ff, delay, placement in cases
        if delay or placement != "actuator"  # without latency it is the first case again
    ]
    return Comparison(scenario, tuple(rows))


def _row(scenario: Scenario, k_ff: float, delay: float, placement: Any) -> Row:
    law, period = scenario.law, scenario.vision.period
    values = {"lam": law.lam, "k_ff": k_ff, "tau": delay}
    speed = scenario.speed
    formula = _formula(placement, k_ff, delay, law.depth_ratio)
    where = {"measurement": "late", "aligned": "late, aligned", "actuator": "late in the actuator"}
    late = f"{1e3 * delay:g} ms {where[placement]}" if delay else "no latency"
    late += ", aligned" if placement == "aligned" and not delay else ""
    case = f"{'with' if k_ff else 'without'} feed-forward, {late}"
    system = loop.diagram(placement).at(values, ell=law.depth_ratio, ell_hat=1.0)
    sampled_limit = loop.gain_limit(delay, period=period, kappa=law.depth_ratio)
    analytic = pade = exact = None
    horizon, over = _horizon(scenario, system, float(sampled_limit))
    notes = []
    if system.unstable_roots:
        notes.append("no steady lag: the loop is unstable")
    else:
        analytic = float(
            loop.tracking_error(Ramp(speed), placement, kappa=law.depth_ratio, **values)
        )
        exact = _exact(system, speed, horizon)
        pade = _pade(system, speed, horizon)
    simulated, contradicted = None, False
    if law.lam >= sampled_limit:
        notes.append(f"unstable at {1e3 * period:g} ms sampling")
    else:
        run = simulate(
            scenario.with_(
                k_ff=k_ff,
                latency=delay,
                placement=placement,
                duration=horizon,
                offset=(0.0,) * 6,
                noise_px=0.0,
            )
        )
        if run.status.ok:
            simulated = float(run.lag_along_motion[-1])
        else:
            notes.append(f"the simulation ended: {run.status.kind}")
            contradicted = True
    if not over:
        notes.append(f"transient not over after {horizon:g} s")
        analytic = None
    return Row(
        case=case,
        feedforward=bool(k_ff),
        delay=delay,
        placement=placement,
        formula=formula,
        analytic=analytic,
        pade=pade,
        exact=exact,
        simulated=simulated,
        note="; ".join(notes),
        contradicted=contradicted,
    )


def _formula(placement: Any, k_ff: float, delay: float, depth_ratio: float) -> sp.Expr:
    """The closed form for a ramp of slope v, what is 0 or 1 in this case put in."""
    known: dict[str, Any] = {} if delay else {"tau": 0}
    known |= {"k_ff": int(k_ff)} if k_ff in (0.0, 1.0) else {}
    known |= {"kappa": 1} if depth_ratio == 1 else {}
    return loop.tracking_error(Ramp(v), placement, **known)


def _horizon(scenario: Scenario, system: System, sampled_limit: float) -> tuple[float, bool]:
    """How long to run until the transient is below 1e-6 of itself (s), and whether that fits."""
    rate = -float(system.poles(1)[0].real)
    if scenario.law.lam >= sampled_limit or rate <= 0:
        return scenario.motion.duration, True
    # Near the sampled limit the held loop decays more slowly than the continuous one.
    rate *= max(1 - scenario.law.lam / sampled_limit, 0.02)
    needed = max(scenario.motion.duration, 14 / rate)
    frames = min(math.ceil(needed / scenario.vision.period), MOST_FRAMES)
    wanted = frames * scenario.vision.period
    try:
        scenario.with_(duration=wanted)
    except InputError:  # the longer path leaves the target; stay with the scenario's own
        wanted = scenario.motion.duration
    return wanted, wanted >= min(needed, 7 / rate)


def _exact(system: System, speed: float, horizon: float) -> float:
    response = system["S_ref", "S"].response(Ramp(speed), [horizon])
    return float(response.y.ravel()[-1] - speed * horizon)


def _pade(system: System, speed: float, horizon: float) -> float:
    """python-control's response of the Padé model to the same ramp."""
    import control

    t = np.linspace(0.0, horizon, 2001)
    model = system["S_ref", "S"].pade(PADE_ORDER)
    response = control.forced_response(model, t, speed * t)
    return float(np.ravel(response.outputs)[-1] - speed * horizon)


def millimetres(value: float | None) -> str:
    """A length in mm to the micrometre, a dash where there is none, never a negative zero."""
    if value is None:
        return "–"
    text = f"{1e3 * value:+.3f}"
    return "0.000" if float(text) == 0 else text.replace("-", "−")
