"""The report in numbers: the documented schema of ``report.json``.

One model a table, so that the file, its JSON Schema (``vsctrl report --schema``) and this
documentation are one thing. Lengths are in m, gains in s⁻¹, angles in rad; ``null`` stands where
there is no value: no steady lag, or a margin that nothing limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import metadata
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from vsctrl.derive import ledger
from vsctrl.report.section import Entry
from vsctrl.study.statements import about

SCHEMA: Literal["vsctrl-report/2"] = "vsctrl-report/2"


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class VerdictTable(_Table):
    """The first lines of the page."""

    kind: Literal["good", "warning", "bad"] | None = Field(
        description="good: it works; warning: not as theory says, or not settled; bad: it fails; "
        "null: nothing is judged"
    )
    sentences: tuple[str, ...]


class MarginsTable(_Table):
    """Margins of the loop opened at the measured signal, delay exact."""

    stable: bool = Field(description="whether the continuous-time closed loop is stable")
    unstable_roots: int = Field(description="characteristic roots on or right of the axis")
    gain: float | None = Field(description="factor on λ up to instability; null = no limit")
    phase_rad: float | None = Field(description="phase margin, rad")
    delay_s: float | None = Field(description="further delay up to instability, s")
    peak_sensitivity: float = Field(description="Ms = max |1/(1 + L)|")
    python_control_pade_order: int = Field(description="order of the model of the next three")
    python_control_gain: float | None
    python_control_phase_rad: float | None
    python_control_delay_s: float | None


class LimitsTable(_Table):
    """Gain limits, s⁻¹; null = no limit."""

    lam: float = Field(description="the scenario's gain")
    stable_as_sampled: bool = Field(description="whether lam is below `sampled`")
    continuous: float | None = Field(description="λ at which the continuous loop is unstable")
    sampled: float | None = Field(description="the same with the twist held over a video period")
    fastest_continuous: float | None = Field(description="λ of the double root, continuous")
    fastest_sampled: float | None = Field(description="λ of the double root, sampled")


class ReadingTable(_Table):
    """What one reading of the gain means."""

    label: str
    lam: float = Field(description="s⁻¹")
    per_sample: float
    gain_margin: float | None
    phase_margin_rad: float | None
    share_of_continuous: float = Field(description="λ/λ_max in continuous time")
    share_of_sampled: float = Field(description="λ/λ_max as sampled")
    lag_without_feedforward_m: float | None
    settling_s: float = Field(description="3/(κλ)")


class PadeTable(_Table):
    """What a Padé model of one order gets wrong on this loop."""

    order: int
    gain_limit: float = Field(description="s⁻¹")
    gain_limit_error: float = Field(description="relative to the exact limit")
    step_error: float = Field(description="largest error of the unit step response")


class TrackingRow(_Table):
    """The steady lag along the motion, or at the end of a triangle's leg; negative = behind."""

    case: str
    feedforward: bool
    delay_s: float
    aligned: bool = Field(description="whether the reference is delayed like the measurement")
    placement: Literal["measurement", "aligned", "actuator"]
    formula: str = Field(description="closed form, for a reference of speed v")
    analytic_m: float | None = Field(description="its value")
    pade_m: float | None = Field(description="python-control, Padé model of order 4")
    exact_m: float | None = Field(description="exact-delay engine")
    simulated_m: float | None = Field(description="six-degree-of-freedom simulation")
    simulated_s: float = Field(
        description="length of that simulation, as long as its transient needs; 0 without one"
    )
    disagreement_m: float | None = Field(description="largest difference between the four")
    allowed_m: float = Field(description="disagreement that counts as agreement")
    agrees: bool | None = Field(
        description="whether that is within 1 % or 10 µm; within 1 % of v(τ + 1/κλ) where the "
        "motion turns or changes depth, of which the loop is the first order"
    )
    note: str


class WaveRow(_Table):
    """The error of a sine A sin ωt, m sin(ωt + rad), by each way; null = no steady error."""

    case: str
    feedforward: bool
    delay_s: float
    placement: Literal["measurement", "aligned", "actuator"]
    formula: str = Field(description="E/S* in closed form, for a frequency omega")
    analytic_m: float | None = Field(description="its amplitude")
    analytic_rad: float | None = Field(description="its phase")
    pade_m: float | None = Field(description="python-control, Padé model of order 4")
    pade_rad: float | None
    exact_m: float | None = Field(description="exact-delay engine, fitted to a cycle")
    exact_rad: float | None
    sampled_m: float | None = Field(description="loop in z, with the velocity held over a frame")
    sampled_rad: float | None
    simulated_m: float | None = Field(description="six degrees of freedom, fitted to a cycle")
    simulated_rad: float | None
    repaired_m: float | None = Field(description="closed form with half a period more latency")
    repaired_rad: float | None
    disagreement_m: float | None = Field(
        description="the larger of |exact − analytic| and |simulated − sampled|"
    )
    allowed_m: float = Field(description="disagreement that counts as agreement")
    agrees: bool | None
    reason: str = Field(description="where allowed_m comes from")
    note: str


class HistoryRow(_Table):
    """The lag at every frame, simulated and by figure 1 with its velocity held over a frame."""

    case: str
    feedforward: bool
    delay_s: float
    placement: Literal["measurement", "aligned", "actuator"]
    frames: int = Field(description="that were compared")
    largest_m: float = Field(description="largest simulated lag to either side")
    rms_m: float = Field(description="root mean square of the simulated lag")
    disagreement_m: float | None = Field(description="largest at any frame; null = run ended early")
    allowed_m: float = Field(description="disagreement that counts as agreement")
    agrees: bool
    reason: str = Field(description="where allowed_m comes from")
    note: str


class ClaimRow(_Table):
    """One statement of the paper, and what became of it."""

    equation: str = Field(description="its number, or what it is about")
    section: str
    status: Literal["holds", "erratum", "ambiguous", "conditional"]
    statement: str = Field(description="as the paper has it")
    correction: str = Field(description="the corrected form or the condition; empty if it holds")


class CaseTable(_Table):
    """One trial of a statement."""

    condition: str
    value: float = Field(description="in the statement's unit")
    holds: bool | None = Field(description="null for a number that is only shown")


class StatementRow(_Table):
    """What the paper says of its law and its experiments, tried and judged."""

    where: str = Field(description="section and figure")
    says: str = Field(description="in our words, but for short quotations")
    claim: str = Field(description="the same as a relation that the cases have values for")
    unit: str
    verdict: Literal["confirmed", "depends", "refuted", "not checkable"]
    cases: tuple[CaseTable, ...]
    sentence: str = Field(description="what was found")
    how: str = Field(description="in which way the values were found")


class FigureOne(_Table):
    """The loop of figure 1 and its errors by every way, of a scenario that is no more than that."""

    margins: MarginsTable
    limits: LimitsTable
    readings: tuple[ReadingTable, ...]
    pade: tuple[PadeTable, ...]
    agrees: bool | None = Field(description="whether all ways agree; null where none compare")
    tracking: tuple[TrackingRow, ...] = Field(description="empty where no lag is steady")
    waves: tuple[WaveRow, ...] = Field(description="of a sine")
    histories: tuple[HistoryRow, ...] = Field(description="of all but a constant twist")
    tracking_note: str = Field(description="why there is nothing to compare; empty where there is")


class EntryTable(_Table):
    """One result of the report."""

    kind: str = Field(description="scenario, loop, run, …")
    name: str
    verdict: VerdictTable
    figure_1: FigureOne | None = Field(
        description="of a scenario that is the loop of figure 1 and no more; else null"
    )
    data: dict[str, Any] = Field(description="its other numbers; every name ends in its unit")


class ReportData(_Table):
    """The whole of ``report.json``."""

    schema_: Literal["vsctrl-report/2"] = Field(SCHEMA, alias="schema")
    version: str = Field(description="version of vsctrl")
    title: str
    entries: tuple[EntryTable, ...]
    ledger: tuple[ClaimRow, ...] = Field(description="empty without an experiment of the paper")
    statements: tuple[StatementRow, ...] = Field(
        description="empty without an experiment of the paper"
    )

    def text(self) -> str:
        """The file's text."""
        return self.model_dump_json(by_alias=True, indent=2) + "\n"

    @classmethod
    def of(cls, title: str, entries: Sequence[Entry]) -> Self:
        """The numbers of a report's entries."""
        scenarios = [each.source.scenario for each in entries if each.kind == "scenario"]
        said = next((rows for s in scenarios if len(rows := about(s))), None)
        tables = [
            {
                "kind": each.kind,
                "name": each.name,
                "verdict": each.verdict,
                "figure_1": each.data.get("figure_1"),
                "data": {key: value for key, value in each.data.items() if key != "figure_1"},
            }
            for each in entries
        ]
        return cls.model_validate(
            {
                "schema": SCHEMA,
                "version": metadata.version("vsctrl"),
                "title": title,
                "entries": tables,
                "ledger": () if said is None else ledger(),
                "statements": () if said is None else said.rows,
            },
            from_attributes=True,
        )
