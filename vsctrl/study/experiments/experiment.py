"""Predicted, exact and measured in the simulator, side by side: the table of every experiment.

A row says what theory promises, what six degrees of freedom did, how far apart they may be, and
why. Making rows is left to the experiments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from vsctrl.servo import Scenario
from vsctrl.tables import Printed, finite, fitting, html, plain, text

Value = float | complex


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One quantity: what `exact` theory says and what was `simulated`, which must agree.

    `predicted` is the simpler law that one would use first, shown beside them (None where it has no
    answer). `allowed` is the distance between exact and simulated that counts as agreement, and
    `reason` where it comes from. A simulation without an answer disagrees; `note` says what
    happened.

    >>> found = vs.study.stability_edge(vs.paper.sliding(), frames=(2,), depth_ratios=())
    >>> print(round(found.rows[0].simulated, 3))
    15.451
    """

    case: str
    predicted: Value | None
    exact: Value
    simulated: Value | None
    allowed: float
    reason: str
    note: str = ""

    @property
    def disagreement(self) -> float:
        """How far the simulation is from exact theory, in their unit; infinite without one."""
        if self.simulated is None:
            return math.inf
        difference = abs(self.simulated - self.exact)
        return difference if math.isfinite(difference) else math.inf

    @property
    def agrees(self) -> bool:
        """Whether the disagreement is within what is allowed."""
        return self.disagreement <= self.allowed

    def data(self) -> dict[str, Any]:
        """The row as JSON takes it, in the experiment's unit; complex numbers as two parts."""
        known = {field.name: plain(getattr(self, field.name)) for field in fields(self)}
        disagreement, agrees = finite(self.disagreement), bool(self.agrees)
        return known | {"disagreement": disagreement, "agrees": agrees}


@dataclass(frozen=True, repr=False)
class Experiment(Printed):
    """The rows of one experiment, and whether all of them agree.

    >>> found = vs.study.decay_modes(vs.paper.sliding(), gains=(2.5,))
    >>> isinstance(found, vs.study.Experiment)
    True
    """

    scenario: Scenario
    rows: tuple[Measured, ...]

    title: ClassVar[str]
    #: Names of predicted, exact and simulated.
    columns: ClassVar[tuple[str, str, str]] = ("continuous", "sampled", "6-DOF")
    scale: ClassVar[float] = 1.0  #: from SI units to those of the title
    form: ClassVar[str] = "+.4f"  #: of a value in the unit of the title

    @property
    def agrees(self) -> bool:
        """Whether every row agrees."""
        return all(row.agrees for row in self.rows)

    @property
    def worst(self) -> Measured:
        """The row that uses most of what it is allowed, or goes farthest beyond it."""
        return max(self.rows, key=lambda row: row.disagreement / row.allowed)

    def shown(self, value: Value | None) -> str:
        """A value as the table prints it, a dash where there is none."""
        return number(None if value is None else self.scale * value, self.form)

    def distance(self, value: float) -> str:
        """A disagreement or what is allowed of it, in the unit of the values shown."""
        return f"{self.scale * value:.1e}" if math.isfinite(value) else "–"

    def data(self) -> dict[str, Any]:
        """The table as JSON takes it; the title names the unit."""
        return {
            "title": self.title,
            "columns": dict(zip(("predicted", "exact", "simulated"), self.columns, strict=True)),
            "agrees": bool(self.agrees),
            "rows": [row.data() for row in self.rows],
        }

    def __str__(self) -> str:
        lines = [self._head(), *map(self._cells, self.rows)]
        form = fitting(lines, "<>>>>>") + "  {:8}  {}"
        return "\n".join([self.title, text(lines, form), *self._foot()])

    def _repr_html_(self) -> str:
        rows = map(self._cells, self.rows)
        return html(rows, heads=self._head(), caption=self.title, remarks=self._foot())

    @property
    def _reason(self) -> str:
        """Where what is allowed comes from, if that is the same in all rows; else empty."""
        reasons = {row.reason for row in self.rows}
        return reasons.pop() if len(reasons) == 1 and len(self.rows) > 1 else ""

    def _head(self) -> list[str]:
        noted = not self._reason or any(row.note for row in self.rows)
        last = ("note" if self._reason else "since") if noted else ""
        return ["case", *self.columns, "disagreement", "allowed", "", last]

    def _foot(self) -> list[str]:
        if not self._reason:
            return []
        unmeasured = all(row.simulated is None for row in self.rows)
        return [f"{self.columns[2] if unmeasured else 'Allowed since'}: {self._reason}."]

    def _cells(self, row: Measured) -> list[str]:
        values = [self.shown(value) for value in (row.predicted, row.exact, row.simulated)]
        mark = "DISAGREE" if not row.agrees else "" if row.simulated is None else "agree"
        why = "; ".join(filter(None, (row.note, "" if self._reason else row.reason)))
        texts = [*values, self.distance(row.disagreement), self.distance(row.allowed)]
        return [row.case, *(text.replace("-", "−") for text in texts), mark, why]


def number(value: Value | None, form: str) -> str:
    """A number in the given format, a complex one with its imaginary part if that shows.

    A dash where there is none, ∞ where nothing limits, and never a negative zero.
    """
    if value is None or math.isinf(value.real):
        return "–" if value is None else "∞"
    real, imag = (_unsigned_zero(format(part, form)) for part in (value.real, value.imag))
    return real if float(imag) == 0 else f"{real}{imag}j"


def _unsigned_zero(text: str) -> str:
    return text.lstrip("+-") if float(text) == 0 else text
