"""The lag of a camera predicted by several ways and simulated, side by side.

For each combination of feed-forward, latency and reference placement: SymPy's closed form, the
Padé model's and the exact-delay engine's response to the same reference, and the lag of the
six-degree-of-freedom simulation, with the largest disagreement between them. The rooms that
produce the numbers know nothing of each other; this is where they meet.

What is compared depends on the motion: of a constant twist and on the legs of a triangle the
steady lag (`SteadyLag`), of a sine amplitude and phase (`Wave`), and of whatever is not a constant
twist the lag at every frame as well (`History`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.motion.trajectory import Oscillation
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.tracking.cases import cases, is_sideways
from vsctrl.study.tracking.lag_history import History, Missing, history, missing
from vsctrl.study.tracking.sine_error import Wave, polar, wave
from vsctrl.study.tracking.steady_lag import (
    PADE_ORDER,
    SteadyLag,
    allowance,
    millimetres,
    ramp,
    row,
)
from vsctrl.study.tracking.triangle import legs
from vsctrl.tables import Tables, html, text

Found = TypeVar("Found", SteadyLag, Wave, History)

LAG, LEG = "steady lag along the motion, mm", "lag at the end of a leg, mm"
WAVE = "error of the sine, mm ∠ degrees"
HISTORY = "lag at every frame, mm"


@dataclass(frozen=True, repr=False)
class Comparison(Tables):
    """Every case of a scenario, and whether all ways agree wherever there is something to compare.

    `rows`: the steady lag, of a constant twist or on the legs of a triangle; `waves`: amplitude
    and phase, of a sine; `histories`: the lag frame by frame, of all but a constant twist, and
    `missing` the cases without one; `note`: why there is none of them.

    >>> found = vs.validate(vs.paper.sliding())
    >>> found.agrees
    True
    """

    scenario: Scenario
    rows: tuple[SteadyLag, ...] = ()
    waves: tuple[Wave, ...] = ()
    histories: tuple[History, ...] = ()
    note: str = ""
    missing: tuple[Missing, ...] = ()

    @property
    def agrees(self) -> bool | None:
        """True or False over the cases that can be compared; None where none can."""
        rows: list[SteadyLag | Wave | History] = [*self.rows, *self.waves, *self.histories]
        known = [row.agrees for row in rows if row.agrees is not None]
        return all(known) if known else None

    @property
    def exact_motion(self) -> bool:
        """Whether figure 1 describes this motion exactly: no turning, no change of depth."""
        return is_sideways(self.scenario)

    @property
    def on_legs(self) -> bool:
        """Whether the steady lag is that of the legs of a triangle."""
        return bool(self.rows) and bool(self.histories)

    @property
    def own_histories(self) -> tuple[History, ...]:
        """Those with the scenario's own latency and placement: without feed-forward and with it."""
        latency, placement = self.scenario.vision.latency, self.scenario.law.placement
        if not latency and placement == "actuator":
            placement = "measurement"  # there is one case for both without latency
        wanted = (latency, placement)
        return tuple(each for each in self.histories if (each.delay, each.placement) == wanted)

    @property
    def largest_disagreement(self) -> float | None:
        """Over all steady lags or sines that can be compared, m."""
        rows: Sequence[SteadyLag | Wave] = self.rows or self.waves
        known = [row.disagreement for row in rows if row.disagreement is not None]
        return max(known, default=None)

    def row(self, *, feedforward: bool, delay: float, placement: str = "measurement") -> SteadyLag:
        """The row of one case. Raises InputError where the comparison holds no such case."""
        return _pick(self.rows, feedforward, delay, placement)

    def wave(self, *, feedforward: bool, delay: float, placement: str = "measurement") -> Wave:
        """The sine of one case. Raises InputError where the comparison holds no such case."""
        return _pick(self.waves, feedforward, delay, placement)

    def history(
        self, *, feedforward: bool, delay: float, placement: str = "measurement"
    ) -> History:
        """The history of one case. Raises InputError where the comparison holds no such case."""
        return _pick(self.histories, feedforward, delay, placement)

    @property
    def remarks_on_rows(self) -> tuple[str, ...]:
        """What the table of steady lags allows, and how long was simulated for it."""
        out = [allowance(self.exact_motion)] if self.rows else []
        own = self.scenario.motion.duration
        lasted = max((row.lasted for row in self.rows), default=0.0)
        if lasted > own + 1.5 * self.scenario.vision.period:
            out.append(
                f"Simulated for {lasted:g} s, so that the transient is over; the scenario itself "
                f"ends after {own:g} s."
            )
        return tuple(out)

    @property
    def remarks_on_waves(self) -> tuple[str, ...]:
        """What the table of sines allows and why, and what holding the velocity does to them."""
        holds = [w for w in self.waves if w.hold is not None]
        out = _allowances([w for w in self.waves if w.sampled is not None])
        if not holds:
            return out
        most = max(w.hold or 0.0 for w in holds)
        remaining = max(w.left_by_repair or 0.0 for w in holds)
        text = (
            f"The closed form is up to {1e3 * most:.3f} mm off the sampled loop: it does not know "
            "that the velocity is held over a frame, which acts like half a period more of latency "
            f"in the actuator. With that put into it, {1e3 * remaining:.1e} mm are left."
        )
        return (*out, text.replace("e-", "e−"))

    @property
    def remarks_on_histories(self) -> tuple[str, ...]:
        """What the table of every frame allows and why."""
        return _allowances(self.histories)

    def data(self) -> dict[str, Any]:
        """All rows as JSON takes them, lengths in m, null where there is none."""
        return {
            "agrees": self.agrees,
            "tracking": [row.data() for row in self.rows],
            "waves": [wave.data() for wave in self.waves],
            "histories": [history.data() for history in self.histories],
            "tracking_note": self.note,
            "left_out": list(self.left_out),
        }

    @property
    def left_out(self) -> tuple[str, ...]:
        """Keys of the scenario that the cases are without (`Scenario.beyond_theory`), dotted."""
        return tuple(self.scenario.beyond_theory)

    def _words(self) -> list[str]:
        """What is said below the tables."""
        notes = [self.note] if self.note else []
        if self.left_out and self._tables():
            notes.append(f"Left out of the comparison: {', '.join(self.left_out)}.")
        return notes

    def _tables(self) -> list[_Table]:
        """Those that have rows."""
        pade = f"Padé {PADE_ORDER}"
        without = [[o.case, *"––––", o.note] for o in self.missing] if self.histories else []
        tables = [
            _Table(
                LEG if self.on_legs else LAG,
                ["closed form", pade, "exact delay", "6-DOF"],
                [*map(_row_cells, self.rows)],
                12,
                self.remarks_on_rows,
            ),
            _Table(
                WAVE,
                ["closed form", "exact delay", "sampled", "6-DOF"],
                [*map(_wave_cells, self.waves)],
                19,
                self.remarks_on_waves,
            ),
            _Table(
                HISTORY,
                ["largest", "rms", "difference", "allowed"],
                [*map(_history_cells, self.histories), *without],
                12,
                self.remarks_on_histories,
            ),
        ]
        return [table for table in tables if table.body]


@dataclass(frozen=True)
class _Table:
    """A table to print: the cells of a row are a case, numbers `width` wide, and a mark."""

    title: str
    heads: list[str]
    body: list[list[str]]
    width: int
    remarks: tuple[str, ...]

    def __str__(self) -> str:
        first = max(44, *(len(cells[0]) + 1 for cells in self.body))
        form = f"{{:{first}}}" + f"{{:>{self.width}}}" * len(self.heads) + "  {}"
        return "\n".join([text([[self.title, *self.heads], *self.body], form), *self.remarks])

    def _repr_html_(self) -> str:
        rows = [
            [*cells, mark.replace("DISAGREE", "disagree").strip()] for *cells, mark in self.body
        ]
        heads = ("case", *self.heads, "")
        return html(rows, heads=heads, caption=self.title, remarks=self.remarks)


def _allowances(rows: Sequence[Wave] | Sequence[History]) -> tuple[str, ...]:
    """What is allowed and why, a sentence for each reason."""
    out = []
    for reason in dict.fromkeys(each.reason for each in rows):
        most = max(each.allowed for each in rows if each.reason == reason)
        out.append(f"Allowed are {1e3 * most:.1e} mm, {reason}.".replace("e-", "e−"))
    return tuple(out)


@keywords
def validate(scenario: GivenScenario) -> Comparison:
    """Predict and simulate the lag of a scenario, with its options switched on and off.

    Cases: feed-forward off and on (1 where the scenario has none), latency 0 and the scenario's,
    the latency in the measurement, aligned, and in the actuator if the scenario has it there.
    The loop of figure 1 is taken with κ = `law.depth_ratio`, which a uniform depth error of points
    makes of a translation (over the focal ratio, where the motion is sideways). Start offset, noise
    and whatever else theory does not know of are left out (`Scenario.ideal`), and named below the
    tables (`Comparison.left_out`).
    A constant twist has a steady lag, v [τ − (1 − k_ff κ)/(κλ)] with a late measurement, and so
    has a leg of a triangle, read just before it ends, if it is long enough; a sine has an error of
    its own frequency. Whatever changes its twist is also held, frame by frame, to figure 1 with its
    velocity held over a frame.
    Errors: `InputError` where the reference has no translation.

    >>> found = vs.validate(vs.paper.sliding())
    >>> len(found.rows)
    8
    """
    scenario = as_scenario(scenario)
    every = cases(scenario)
    reference = scenario.reference
    _check_translates(scenario)
    if scenario.constant_twist is not None:
        return Comparison(scenario, tuple(row(case, ramp)[0] for case in every))
    rows: list[SteadyLag] = []
    waves: list[Wave] = []
    histories: list[History] = []
    unstable: list[Missing] = []
    for case in every:
        run = None
        if not isinstance(reference, Oscillation):
            run = case.run() if case.is_stable_as_sampled else None
        elif reference.waveform == "triangle":
            lag, run = row(case, partial(legs, reference))
            rows.append(lag)
        else:
            sine, run = wave(case, reference)
            waves.append(sine)
        if run is not None:
            histories.append(history(case, run))
        elif not case.is_stable_as_sampled:
            unstable.append(missing(case))
    note = "" if rows or waves or histories else "No case is stable as sampled: none has a lag."
    return Comparison(scenario, tuple(rows), tuple(waves), tuple(histories), note, tuple(unstable))


def _check_translates(scenario: Scenario) -> None:
    T = scenario.constant_twist
    if T[:3].any() if T is not None else scenario.speed:
        return
    field = "motion.V" if scenario.motion.kind == "screw" else "motion"
    raise InputError(
        f"{field}: the reference does not translate, so there is no lag in metres to "
        f"validate; give {field} a velocity, or look at simulate(scenario).lag."
    )


def _pick(rows: Sequence[Found], feedforward: bool, delay: float, placement: str) -> Found:
    for each in rows:
        same = (each.feedforward, each.placement) == (feedforward, placement)
        if same and math.isclose(each.delay, delay, abs_tol=1e-12):
            return each
    known = ", ".join(dict.fromkeys(each.case for each in rows)) or "none"
    raise InputError(
        f"comparison: there is no case with delay {delay} s and placement {quoted(placement)}; "
        f"it has {known}."
    )


# Tables ----------------------------------------------------------------------------------------
def _row_cells(row: SteadyLag) -> list[str]:
    values = (row.analytic, row.pade, row.exact, row.simulated)
    return [row.case, *(millimetres(value) for value in values), _mark(row.agrees, row.note)]


def _wave_cells(wave: Wave) -> list[str]:
    values = (wave.analytic, wave.exact, wave.sampled, wave.simulated)
    return [wave.case, *(polar(value) for value in values), _mark(wave.agrees, wave.note)]


def _history_cells(history: History) -> list[str]:
    sizes = (history.largest, history.root_mean_square)
    limits = (history.disagreement, history.allowed)
    return [
        history.case,
        *(f"{1e3 * size:.3f}" for size in sizes),
        *(f"{1e3 * size:.1e}".replace("-", "−") if math.isfinite(size) else "–" for size in limits),
        _mark(history.agrees, history.note),
    ]


def _mark(agrees: bool | None, note: str) -> str:
    return {True: "agree ", False: "DISAGREE ", None: ""}[agrees] + note
