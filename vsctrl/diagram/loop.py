"""A loop of one's own: a diagram with its numbers and what is asked of it, as a file or in hand.

A `Loop` is frozen and valid: whatever exists can be computed. Every way to make one (a TOML file,
keywords, a variation of another one) passes the same checks and fails with one `InputError` that
lists all problems. Nothing is computed here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from vsctrl import files, toml
from vsctrl.caching import Caching
from vsctrl.checks import quoted, require_kind
from vsctrl.diagram.channel import Channel, OpenLoop
from vsctrl.diagram.diagram import Diagram
from vsctrl.diagram.document import check, read, summary, write
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.performance.step_figures import StepInfo
from vsctrl.diagram.sampled.channel import SampledChannel
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.diagram.system import System
from vsctrl.errors import InputError, LimitError
from vsctrl.problems import FieldsError, Problem

SETTLED = 8.0  #: time constants of the slowest root after which a response is shown no longer


@dataclass(frozen=True)
class Loop(Caching):
    """A diagram, a number for each of its parameters (SI), and what is asked of it.

    `opened` is the signal at which L of the margins is broken; left out, the first output that a
    loop runs through, else the first such signal. `applied` says what its inputs get, `watched` the
    signals whose responses are of interest (left out: the outputs), over `duration` (s). With a
    `period` (s) a computer closes the loop, which holds the signal `hold` and runs the blocks in
    `digital` by the method named there, as `System.sampled` has it. Times are shown in `time_unit`;
    `units` and `meanings` say of parameters in which unit a file has them and what they are.
    Errors: one `InputError` that lists everything for which the loop cannot be computed.

    >>> loop = vs.Loop(vs.figure1, {"lam": 2.5, "tau": 0.08, "ell": 1, "ell_hat": 1, "k_ff": 1})
    >>> loop.with_(lam=5).open.margins().stable
    True
    """

    diagram: Diagram
    values: Mapping[str, float] = field(default_factory=dict)
    name: str = "loop"
    description: str = ""
    opened: str = ""
    applied: tuple[Applied, ...] = ()
    watched: tuple[str, ...] = ()
    duration: float | None = None
    period: float | None = None
    hold: str = ""
    digital: Mapping[str, str] = field(default_factory=dict)
    time_unit: str = "s"
    units: Mapping[str, str] = field(default_factory=dict)
    meanings: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_kind("Loop: diagram", self.diagram, Diagram, "give a vs.Diagram")
        for name in ("values", "digital", "units", "meanings"):
            if not isinstance(mapping := getattr(self, name), Mapping):
                raise InputError(f"Loop: {name} = {quoted(mapping)} maps no names; give a dict.")
            object.__setattr__(self, name, dict(mapping))
        for name in ("applied", "watched"):
            listed = getattr(self, name)
            one = isinstance(listed, str | Applied)
            if not one and not isinstance(listed, tuple | list):
                raise InputError(f"Loop: {name} = {quoted(listed)} is no list; give a tuple.")
            object.__setattr__(self, name, (listed,) if one else tuple(listed))
        if problems := [*self._problems()]:
            raise FieldsError(problems)
        object.__setattr__(self, "values", self.system.values)
        if not self.watched:
            object.__setattr__(self, "watched", self.diagram.outputs)
        if not self.opened:
            object.__setattr__(self, "opened", next(iter(check.in_a_loop(self.diagram)), ""))

    def _problems(self) -> Iterator[Problem]:
        for key in ("name", "description"):
            if not isinstance(getattr(self, key), str):
                yield key, f"{quoted(getattr(self, key))} is not text; write it in quotes"
        wrong = [*check.value_problems(self.diagram, self.values)]
        yield from (*wrong, *check.unit_problems(self.units))
        yield from check.asked_problems(
            self.diagram, self.opened, self.applied, self.watched, self.duration, self.time_unit
        )
        held = [*check.sampling_problems(self.diagram, self.period, self.hold, self.digital)]
        yield from held
        if wrong:
            return
        try:
            self.system  # noqa: B018 - what has no finite value is refused when made
        except (InputError, LimitError) as error:
            yield "parameters", _sentence(error, "at: ")
            return
        if held:
            return
        try:
            self.sampled  # noqa: B018
        except (InputError, LimitError) as error:
            yield "sampling", _sentence(error, "sampled: ")

    @cached_property
    def system(self) -> System:
        """The diagram with its numbers, every delay exact."""
        return self.diagram.at(self.values)

    @cached_property
    def sampled(self) -> SampledSystem | None:
        """The twin in z that a computer closes, None where there is no sampling period."""
        if self.period is None:
            return None
        return self.system.sampled(self.period, self.hold, self.digital)

    @cached_property
    def open(self) -> OpenLoop:
        """L of the return difference 1 + L, broken at `opened`.

        Errors: `InputError` where no loop runs through any signal.
        """
        if not self.opened:
            raise InputError("open: no loop runs through any signal of the diagram; feed one back.")
        return self.system.open(self.opened)

    @cached_property
    def horizon(self) -> float:
        """How long a response is shown (s): `duration`, or until the slowest root has settled."""
        if self.duration is not None:
            return float(self.duration)
        begun = max((float(one.at) for one in self.applied), default=0.0)
        late = float(sum(set().union(*(block.delays for block in self.system.blocks))))
        rates = self._rates()
        slowest = SETTLED / min(rates) if rates else 0.0
        span = begun + 3 * late + slowest
        return span if math.isfinite(span) and span > 0 else 1.0

    def _rates(self) -> list[float]:
        """How fast (1/s) its slowest modes die out, as sampled where a computer closes it."""
        if self.sampled is not None:
            try:
                z = np.abs(self.sampled.poles(6))
            except LimitError:  # so many that they are not asked for; those of continuous time do
                z = np.zeros(0)
            if len(z := z[(z > 0) & (z < 1)]):
                return list(-np.log(z) / float(self.sampled.period))
        return [abs(root.real) for root in self.system.poles(6) if root.real < 0]

    def channel(self, source: str, target: str) -> Channel | SampledChannel:
        """The channel of the loop as it runs: at the samples where a computer closes it.

        Errors: `InputError` for signals that there are not.
        """
        return (self.sampled or self.system)[source, target]

    def step_info(self, source: str, target: str) -> StepInfo:
        """The step figures of a channel as it runs, worked out once. Errors: as of the channel."""
        if (source, target) not in self._step_infos:
            self._step_infos[source, target] = self.channel(source, target).step_info()
        return self._step_infos[source, target]

    @cached_property
    def _step_infos(self) -> dict[tuple[str, str], StepInfo]:
        return {}

    def with_(self, **values: float) -> Self:
        """The same loop with other numbers (SI) for some parameters, ``with_(K=3)``.

        Errors: `InputError` for a name that is none and a number with which it cannot be computed.
        """
        return replace(self, values={**self.values, **values})

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Loop from the text of a loop file. Errors: `InputError` that lists all problems."""
        found = read.read(toml.parse(text))
        problems, loop = found.problems, None
        if found.whole:
            try:
                diagram = Diagram(found.parts, found.inputs, found.outputs)
                keywords = {name: name for name in diagram.parameters}
                keywords |= write.called(diagram)
                for name in ("values", "units", "meanings"):
                    given = found.fields.get(name, {})
                    found.fields[name] = {keywords.get(k, k): x for k, x in given.items()}
                loop = cls(diagram, **found.fields)
            except FieldsError as error:
                known = {name for name, _ in problems}
                problems += [problem for problem in error.problems if problem[0] not in known]
            except InputError as error:
                problems.append(("block", _sentence(error, "Diagram: ")))
        if problems or loop is None:
            raise FieldsError(problems)
        return loop

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Loop from a file in UTF-8. Errors: `InputError` that starts with the file's name."""
        text = files.read_text(files.as_path("path", path), "TOML file")
        try:
            return cls.from_toml(text)
        except FieldsError as error:
            raise FieldsError(error.problems, source=str(path)) from None

    @classmethod
    def from_control(cls, system: Any, **fields: Any) -> Self:
        """Loop of a python-control system in continuous time, as `Diagram.from_control` has it.

        Further keywords are fields of the loop, like `applied`. Errors: `InputError`.
        """
        diagram = Diagram.from_control(system)
        return cls(diagram, **{"name": str(system.name), **fields})

    def to_toml(self) -> str:
        """The text of a loop file, ready to edit, of which `from_toml` makes the same loop.

        Errors: `InputError` for formulas that no file can hold.
        """
        diagram = write.diagram_tables(self.diagram, self.values, self.units, self.meanings)
        tables: dict[str, Any] = {"name": self.name}
        tables |= {"description": self.description} if self.description else {}
        tables |= {"time_unit": self.time_unit}
        tables |= {side: diagram.pop(side) for side in ("inputs", "outputs")}
        tables |= {"open": self.opened} if self.opened else {}
        tables |= {"watch": self.watched} if self.watched != self.diagram.outputs else {}
        if self.duration is not None:
            tables["duration"] = write.time(self.duration, self.time_unit)
        tables |= diagram | {"apply": write.applied_tables(self.applied, self.time_unit)}
        if self.period is not None:
            sampling = {"period": write.time(self.period, self.time_unit), "hold": self.hold}
            digital = {"digital": toml.Inline(self.digital)} if self.digital else {}
            tables["sampling"] = sampling | digital
        return write.text(tables)

    def save(self, path: str | Path) -> None:
        """Write `to_toml` to a file: all of it or nothing. Errors: `InputError`."""
        files.write(files.as_path("path", path), self.to_toml(), "loop")

    def _repr_svg_(self) -> str:
        return self.diagram._repr_svg_()

    def __str__(self) -> str:
        return summary.lines(self.diagram, {f.name: getattr(self, f.name) for f in fields(self)})


def _sentence(error: Exception, front: str) -> str:
    return str(error).removeprefix(front).rstrip(".")
