"""A statement of the paper with its proof: what was printed, what is so, and how that is known.

The status of a claim is not believed but found: ``Claim.prove`` runs the derivation, and the proof
holds only where it finds the status that the claim states.
"""

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from itertools import combinations
from typing import Any, Literal

from vsctrl.derive.claims.decision import Decision, Facts, decide, text

Status = Literal["holds", "erratum", "ambiguous", "conditional"]
_READABLE = 40  # characters
_Proposer = Callable[[Callable[[], "Evidence"]], "Claim"]


@dataclass(frozen=True)
class Evidence:
    """What a derivation brings: residuals, which are zero where a statement holds, or relations.

    ``printed``: of the statement as printed, in general. ``corrected``: of its corrected form.
    ``under``: of the printed form where its condition is met. ``readings``: what each reading of
    the print comes to, an expression or matrix each. ``at``: a place at which the printed form is
    tried first. Give ``corrected`` for an erratum, ``under`` for a condition, ``readings`` for an
    ambiguity.
    """

    printed: Facts = ()
    corrected: Facts = ()
    under: Facts = ()
    readings: Mapping[str, Any] = field(default_factory=dict)
    at: Mapping[Any, Any] = field(default_factory=dict)

    def found(self) -> tuple[Status | None, Decision]:
        """The status that follows, or None where the residuals settle nothing, and why."""
        amended = decide((self.corrected, self.under))
        if not amended.zero:
            return None, amended
        if self.readings:
            return self._among_readings()
        printed = decide(self.printed, self.at)
        if printed.zero is None:
            return None, printed
        if printed.zero:
            return "holds", printed
        if _given(self.corrected):
            return "erratum", printed
        return ("conditional" if _given(self.under) else None), printed

    def _among_readings(self) -> tuple[Status | None, Decision]:
        """Ambiguous where two readings differ, unless two that come before are undecided."""
        for (one, a), (other, b) in combinations(self.readings.items(), 2):
            difference = decide(a - b, self.at)
            if difference.zero is None:
                return None, difference
            if difference.zero is False:
                shown = f"“{one}” less “{other}”: {difference.shown}"
                return "ambiguous", self._values() or Decision(False, shown)
        return "holds", Decision(True, "0")

    def _values(self) -> Decision | None:
        """What each reading comes to, where all are short enough to read side by side."""
        shown = {name: text(reading) for name, reading in self.readings.items()}
        if max(map(len, shown.values())) > _READABLE:
            return None
        return Decision(False, "; ".join(f"{name}: {value}" for name, value in shown.items()))


@dataclass(frozen=True)
class Proof:
    """What running a derivation found.

    ``holds``: it confirms the status of its claim. ``found``: the status that it finds, None where
    it settles none. ``residual``: 0, or where and by how much the printed form fails, or what the
    readings come to. ``explanation``: the derivation in words.

    >>> vs.derive.ledger()[0].prove().holds
    True
    """

    holds: bool
    found: Status | None
    residual: str
    explanation: str

    def __bool__(self) -> bool:
        return self.holds


@dataclass(frozen=True)
class Claim:
    """One statement of the paper and what becomes of it when it is derived.

    ``equation``: its number, as (12), or its place for what has none, unique in the ledger;
    ``section``: of the paper; ``statement``: as the paper has it, plain text; ``formula``: the same
    in LaTeX, empty for prose; ``status``: "holds", "erratum" (the printed form fails, the corrected
    one is proved), "conditional" (it holds under a condition) or "ambiguous" (readings of the print
    differ); ``correction``: corrected form, condition or choice, empty where the statement holds;
    ``explanation``: the derivation in words; ``evidence``: the derivation itself.

    >>> claim = vs.derive.ledger()[0]
    >>> claim.equation, claim.status
    ('abstract', 'holds')
    """

    equation: str
    section: str
    statement: str
    formula: str
    status: Status
    correction: str
    explanation: str
    evidence: Callable[[], Evidence]

    def prove(self) -> Proof:
        """Run the derivation. Nothing is kept: a second call derives again."""
        found, decision = self.evidence().found()
        return Proof(found == self.status, found, decision.shown, self.explanation)

    def proof(self) -> bool:
        """Whether the derivation, run now, confirms the status."""
        return self.prove().holds

    def __str__(self) -> str:
        correction = f" → {self.correction}" if self.correction else ""
        return f"{self.equation} {self.status}: {self.statement}{correction}"

    def __reduce_ex__(self, protocol: Any) -> Any:
        """A claim of a module travels by its name: it stands where its derivation was defined."""
        place = self.evidence.__module__, self.evidence.__name__
        if vars(sys.modules[place[0]]).get(place[1]) is self:
            return _of_module, place
        return super().__reduce_ex__(protocol)

    def _repr_latex_(self) -> str | None:
        """The formula as printed, for a notebook."""
        return rf"$\displaystyle {self.formula}$" if self.formula else None


def claim(
    equation: str,
    section: str,
    statement: str,
    formula: str = "",
    *,
    status: Status,
    correction: str = "",
) -> _Proposer:
    """Make a `Claim` of a function that derives it; the function's docstring is the explanation."""

    def propose(evidence: Callable[[], Evidence]) -> Claim:
        explanation = " ".join(inspect.cleandoc(evidence.__doc__ or "").split())
        return Claim(
            equation, section, statement, formula, status, correction, explanation, evidence
        )

    return propose


def _of_module(module: str, name: str) -> Claim:
    found: Claim = getattr(import_module(module), name)
    return found


def _given(facts: Facts) -> bool:
    return not (isinstance(facts, tuple) and not facts)
