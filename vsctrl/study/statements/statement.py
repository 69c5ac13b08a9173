"""A statement of the paper, what came of it in each case that was tried, and the table of all.

A verdict is never chosen: it follows from the cases, and each case carries the number from which it
follows. Making statements is left to the modules beside this one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

from vsctrl import tables

Verdict = Literal["confirmed", "depends", "refuted", "not checkable"]
MEANINGS: dict[Verdict, str] = {
    "confirmed": "it holds in every case tried",
    "depends": "it holds in some of the cases and fails in others",
    "refuted": "it fails in every case tried",
    "not checkable": "the paper gives too little to decide; the numbers are what follows from it",
}


@dataclass(frozen=True)
class Trial:
    """One trial: under which condition, what number came out, and whether the statement holds.

    `holds` is None for a number that is only shown beside the others.
    """

    condition: str
    value: float
    holds: bool | None = None


@dataclass(frozen=True, kw_only=True)
class Statement:
    """What the paper says in a place, and what was found.

    `says` is in our words, but for short quotations; `claim` is the same as a relation that
    `cases` have values for, in `unit`. `how` tells the way in which the values were found.

    >>> vs.study.statements().rows[0].verdict
    'depends'
    """

    where: str
    says: str
    claim: str
    unit: str = ""
    cases: tuple[Trial, ...]
    sentence: str
    how: str

    @property
    def figures(self) -> tuple[int, ...]:
        """The numbers of the paper's figures that it is about."""
        named = re.search(r"figures? ([0-9, and]+)", self.where)
        return tuple(map(int, re.findall(r"[0-9]+", named[1]))) if named else ()

    @property
    def measured(self) -> float:
        """The value of the first case."""
        return self.cases[0].value

    @property
    def verdict(self) -> Verdict:
        """What the cases say together."""
        answers = {case.holds for case in self.cases} - {None}
        if not answers:
            return "not checkable"
        return "depends" if len(answers) == 2 else "confirmed" if True in answers else "refuted"

    def case(self, condition: str) -> Trial:
        """The case of a condition. Raises KeyError where there is no such case."""
        return {case.condition: case for case in reversed(self.cases)}[condition]

    def shown(self, case: Trial) -> str:
        """A case as the table prints it: condition, value, whether the statement holds."""
        mark = {True: "holds", False: "fails", None: ""}[case.holds]
        return f"{case.condition}: {shown(case.value, self.unit)}{', ' * bool(mark)}{mark}"

    def data(self) -> dict[str, Any]:
        """The statement as JSON takes it."""
        cases = [asdict(case) for case in self.cases]
        return {**vars(self), "cases": cases, "verdict": self.verdict}

    def __str__(self) -> str:
        lines = [f"{self.where}: {self.says} [{self.claim}] {self.verdict.upper()}"]
        lines += [f"    {self.shown(case)}" for case in self.cases]
        return "\n".join([*lines, f"    {self.sentence}", f"    ({self.how})"])


@dataclass(frozen=True, repr=False)
class Statements(tables.Printed):
    """All statements in the paper's order.

    >>> vs.study.statements().summary.split(",")[0]
    'Of 26 statements of the paper'
    """

    rows: tuple[Statement, ...]

    def __iter__(self) -> Iterator[Statement]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: int) -> Statement:
        return self.rows[index]

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many of each verdict there are."""
        number = Counter(row.verdict for row in self.rows)
        return {verdict: number[verdict] for verdict in MEANINGS}

    def figure(self, number: int) -> tuple[Statement, ...]:
        """The statements about a figure of the paper; none where it has none."""
        return tuple(row for row in self.rows if number in row.figures)

    @property
    def summary(self) -> str:
        """The counts in a sentence."""
        words = {"confirmed": "are confirmed", "depends": "depend on the case"}
        words |= {"refuted": "are refuted", "not checkable": "cannot be checked"}
        counts = [f"{number} {words[verdict]}" for verdict, number in self.counts.items() if number]
        return f"Of {len(self)} statements of the paper, " + ", ".join(counts) + "."

    def data(self) -> dict[str, Any]:
        """All statements and the counts as JSON takes them."""
        return {"counts": self.counts, "statements": [row.data() for row in self.rows]}

    def __str__(self) -> str:
        return "\n".join([*map(str, self.rows), self.summary])

    def _repr_html_(self) -> str:
        heads = ("where", "the paper says", "cases", "verdict", "found")
        rows = [
            (row.where, row.says, "\n".join(map(row.shown, row.cases)), row.verdict, row.sentence)
            for row in self.rows
        ]
        return tables.html(rows, heads=heads, caption=self.summary, left=len(heads), top=True)


def shown(value: float, unit: str = "") -> str:
    """A number to three decimals or four digits with its unit; a real minus, never −0."""
    rounded = round(value, 3) or 0.0
    text = (f"{rounded:g}" if abs(value) < 100 else f"{value:.4g}").replace("-", "−")
    return f"{text}°" if unit == "°" else f"{text} {unit}".rstrip()
