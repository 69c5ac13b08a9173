"""What a comparison of remedies for dead time holds: a row each, three tables, notes and JSON.

The numbers are made in `comparison`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from vsctrl import tables
from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.servo import Scenario
from vsctrl.study.compensation.compensators import Remedy
from vsctrl.study.experiments.experiment import Experiment, Measured

NUMBERS = ("predicted", "exact", "simulated", "allowed", "agrees", "reason")


@dataclass(frozen=True, kw_only=True)
class SteadyError(Measured):
    """A steady error, m: in closed form, by the exact delay and in six degrees of freedom.

    >>> vs.study.compare_remedies(vs.paper.sliding()).rows[0].error.agrees
    True
    """

    @property
    def disagreement(self) -> float:
        """The largest difference between any two of the three, m."""
        values = [self.predicted, self.exact, self.simulated]
        if any(value is None or not math.isfinite(value.real) for value in values):
            return math.inf
        known = [value.real for value in values if value is not None]
        return max(known) - min(known)


@dataclass(frozen=True, repr=False)
class SteadyErrors(Experiment):
    """Steady errors of a ramp in m, positive ahead and negative behind, one row a remedy."""

    columns: ClassVar[tuple[str, str, str]] = ("closed form", "exact delay", "6-DOF")
    scale: ClassVar[float] = 1e3


@dataclass(frozen=True, repr=False)
class TrueErrors(SteadyErrors):
    """Of the camera from its reference of now."""

    title: ClassVar[str] = "steady true error on a ramp, mm, + ahead, − behind"


@dataclass(frozen=True, repr=False)
class SeenErrors(SteadyErrors):
    """Of what the law compares, which may be late, early or predicted."""

    title: ClassVar[str] = "the error that the law sees meanwhile, mm"


@dataclass(frozen=True, repr=False)
class RemedyLimits(Experiment):
    """Gain limits in s⁻¹ over all directions of M = L̂⁺L, one row a remedy."""

    title: ClassVar[str] = "gain limit, s⁻¹"
    form: ClassVar[str] = ".4f"


@dataclass(frozen=True, kw_only=True)
class Treated:
    """One remedy and what came of it; no errors where it is unstable at the scenario's gain.

    `limit.simulated` is None where it was not searched for.

    >>> vs.study.compare_remedies(vs.paper.sliding()).rows[0].remedy.name
    'no remedy'
    """

    remedy: Remedy
    error: SteadyError | None
    seen: SteadyError | None
    limit: Measured
    note: str = ""

    @property
    def name(self) -> str:
        """The remedy in words."""
        return self.remedy.name

    @property
    def agrees(self) -> bool:
        """Whether theory and simulation agree wherever both have an answer."""
        parts = (self.error, self.seen, self.limit)
        return all(part.agrees for part in parts if part is not None)


@dataclass(frozen=True, repr=False)
class Remedies(tables.Tables):
    """All remedies of one scenario: `rows`, of a ramp of `speed` m/s, and `notes` in sentences.

    >>> len(vs.study.compare_remedies(vs.paper.sliding()).rows)
    12
    """

    scenario: Scenario
    speed: float
    rows: tuple[Treated, ...]
    notes: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether theory and simulation agree in every row."""
        return all(row.agrees for row in self.rows)

    @property
    def errors(self) -> TrueErrors:
        """The steady true errors as a table."""
        return TrueErrors(self.scenario, tuple(row.error for row in self.rows if row.error))

    @property
    def seen(self) -> SeenErrors:
        """The errors that the law sees as a table."""
        return SeenErrors(self.scenario, tuple(row.seen for row in self.rows if row.seen))

    @property
    def limits(self) -> RemedyLimits:
        """The gain limits as a table."""
        return RemedyLimits(self.scenario, tuple(row.limit for row in self.rows))

    def of(self, kind: str, mismatch: float = 0.0) -> Treated:
        """The first row of a kind, such as "Smith", with τ̂ − τ in s. Errors: `InputError`."""
        for row in self.rows:
            wrong = math.isclose(row.remedy.mismatch, mismatch, abs_tol=1e-9)
            if row.remedy.kind == kind and wrong:
                return row
        known = ", ".join(dict.fromkeys(row.remedy.kind for row in self.rows))
        raise InputError(
            f"remedies: there is no {quoted(kind)} with a mismatch of {mismatch:g} s; kinds are "
            f"{known}."
        )

    def data(self) -> dict[str, Any]:
        """The same as JSON takes it, lengths in m and gains in s⁻¹, null where there is none."""
        return {
            "scenario": {"name": self.scenario.name, "digest": self.scenario.digest},
            "speed_m_s": self.speed,
            "agrees": bool(self.agrees),
            "remedies": [_data(row) for row in self.rows],
            "notes": list(self.notes),
        }

    def _tables(self) -> list[Experiment]:
        return [table for table in (self.errors, self.seen, self.limits) if table.rows]

    def _words(self) -> list[str]:
        notes = dict.fromkeys(row.note for row in self.rows if row.note)
        lines = [
            f"{note}: {'; '.join(row.name for row in self.rows if row.note == note)}."
            for note in notes
        ]
        return [*lines, *self.notes]


def _data(row: Treated) -> dict[str, Any]:
    def numbers(measured: Measured | None) -> dict[str, Any] | None:
        return None if measured is None else {name: measured.data()[name] for name in NUMBERS}

    remedy = row.remedy
    return {
        "kind": remedy.kind,
        "name": remedy.name,
        "cost": remedy.cost,
        "mismatch_s": remedy.mismatch,
        "fields": dict(remedy.fields),
        "formula": str(remedy.formula),
        "seen_formula": str(remedy.seen_formula),
        "true_error_m": numbers(row.error),
        "seen_error_m": numbers(row.seen),
        "gain_limit": numbers(row.limit),
        "note": row.note,
    }
