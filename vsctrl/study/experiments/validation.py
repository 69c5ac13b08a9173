"""Every experiment that holds theory and simulator to each other, in one value and one table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from vsctrl import tables
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.experiments.dominant_mode import DecayModes, decay_modes
from vsctrl.study.experiments.frequency_response import SineResponse, sine_response
from vsctrl.study.experiments.matrix_law import MatrixLaw, matrix_law
from vsctrl.study.experiments.stability_limit import StabilityEdge, stability_edge
from vsctrl.study.runs import latency
from vsctrl.study.tracking.comparison import Comparison, validate

P = TypeVar("P")
Part = Comparison | StabilityEdge | DecayModes | MatrixLaw | SineResponse


@dataclass(frozen=True, repr=False)
class Validation(tables.Tables):
    """What was compared, and in `left_out` why something was not, by its name.

    >>> vs.validate_all(vs.paper.sliding()).left_out
    {}
    """

    scenario: Scenario
    edge: StabilityEdge
    decay: DecayModes
    ramp: Comparison | None = None
    matrix: MatrixLaw | None = None
    sine: SineResponse | None = None
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The experiments that there are, in the order of the table."""
        parts = (self.ramp, self.edge, self.decay, self.matrix, self.sine)
        return tuple(part for part in parts if part is not None)

    @property
    def agrees(self) -> bool:
        """Whether nothing disagrees."""
        return all(part.agrees is not False for part in self.parts)

    def data(self) -> dict[str, Any]:
        """Every experiment as JSON takes it, and why others were left out."""
        names = ("ramp", "edge", "decay", "matrix", "sine")
        parts = {name: getattr(self, name) for name in names}
        return {
            "agrees": bool(self.agrees),
            **{name: part.data() for name, part in parts.items() if part is not None},
            "left_out": self.left_out,
        }

    def _tables(self) -> tuple[Part, ...]:
        return self.parts

    def _words(self) -> list[str]:
        missing = [f"{name} left out: {why}" for name, why in self.left_out.items()]
        rows = [row for part in self.parts for row in part.rows if row.agrees is not None]
        wrong = sum(not row.agrees for row in rows)
        verdict = f"{len(rows) - wrong} of {len(rows)} rows agree." + " SOME DO NOT." * bool(wrong)
        return [*missing, verdict]


@keywords
def validate_all(
    scenario: GivenScenario, progress: Callable[[str], None] = lambda step: None
) -> Validation:
    """The ramp, the stability limit, decay, the matrix law and a Bode plot, theory and simulation.

    They are `validate`, `stability_edge`, `decay_modes`, `matrix_law` and `sine_response`, from the
    scenario's start, before its target, with its law and its vision. What a scenario has no answer
    to, such as a steady lag at an unstable gain, is left out, with the reason. `progress` is told
    each step as it begins.
    Errors: `InputError` where the latency is no whole number of frames, or the target does not tell
    all motions apart.

    >>> found = vs.validate_all(vs.paper.sliding())
    >>> found.edge.agrees
    True
    """
    scenario = as_scenario(scenario)
    left_out: dict[str, str] = {}

    def attempt(name: str, make: Callable[[Scenario], P]) -> P | None:
        progress(name)
        try:
            return make(scenario)
        except InputError as error:
            left_out[name] = str(error)
            return None

    latency(scenario)
    ramp = attempt("ramp", validate)
    progress("stability limit")
    edge = stability_edge(scenario)
    progress("decay")
    rates = decay_modes(scenario)
    matrix = attempt("matrix law", matrix_law)
    sine = attempt("sine", sine_response)
    return Validation(scenario, edge, rates, ramp, matrix, sine, left_out)
