"""From blocks in numbers to state space plus delay channels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.realisation import causality, descriptor, paths, units
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import pruned
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients, Side
from vsctrl.errors import InputError


def realise(
    diagram: Wiring,
    blocks: list[BlockCoefficients],
    sources: tuple[str, ...],
    targets: tuple[str, ...],
) -> DelaySystem:
    """The delay system from some inputs to some signals of a diagram in numbers.

    With no sources and no targets it is the autonomous system, whose poles are the diagram's.
    Errors: `InputError` for a singular algebraic loop, an improper channel, a block without a
    finite or causal gain.
    """
    kept = {block.output for block in diagram.blocks}
    if sources and targets:  # rounding would couple what no signal reaches
        kept = paths.between(diagram, sources, targets)
    pairs = zip(diagram.blocks, blocks, strict=True)
    second = units.of_time([b for block, b in pairs if block.output in kept])
    try:
        form = _Assembly(diagram, units.in_units(blocks, second), sources, kept)
    except OverflowError:  # coefficients from one end of the floats to the other
        second, form = 1.0, _Assembly(diagram, blocks, sources, kept)
    scale = form.units(targets)
    pencil, outputs = form.pencil(scale), form.outputs(targets, scale)
    reduced = descriptor.reduce(pencil, outputs, form.names)
    try:
        system = causality.causal(reduced, tuple(form.delays), sources, targets)
    except causality.AdvancedError as loop:
        raise _advanced(diagram, blocks, {form.owners[j] for j in loop.channels}) from None
    whole = _in_seconds(DelaySystem(*system), second, scale)
    return _balanced(pruned(whole) if sources and targets else whole)


def _in_seconds(system: DelaySystem, second: float, scale: _Units) -> DelaySystem:
    """The system in the user's units again; states and what is delayed keep theirs."""
    r, p = system.inputs, system.outputs
    A, B, C, D = system.A / second, system.B / second, system.C.copy(), system.D.copy()
    C[:p], D[:p] = C[:p] * scale.targets[:, None], D[:p] * scale.targets[:, None]
    B[:, :r], D[:, :r] = B[:, :r] / scale.sources, D[:, :r] / scale.sources
    delays = tuple(tau * Fraction(second) for tau in system.delays)
    return DelaySystem(A, B, C, D, delays)


def _advanced(diagram: Wiring, blocks: list[BlockCoefficients], late: Iterable[str]) -> InputError:
    """The refusal of loops that differentiate their own past, through the outputs of `late`."""
    improper = {block.name for block in blocks if block.improper}
    inside = [block.name for block in paths.loops_through(diagram, late)]
    named = [name for name in inside if name in improper] or inside
    return InputError(
        f"at: the loop through {', '.join(inside)} differentiates its own delayed output (an "
        f"advanced equation); filter {' and '.join(map(repr, named))}, e.g. s/(1 + s/N) for s."
    )


@dataclass(frozen=True)
class _Units:
    """What the columns, the ties and the targets are counted in, as the sources are."""

    columns: Array
    ties: Array
    targets: Array
    sources: float


class _Assembly:
    """All blocks side by side, wired: rows over the columns [X | a | u, w].

    Each section of a block holds ξ, ξ', …, ξ^(N−1) as states and a = ξ^(N) as an algebraic
    variable, with den(d/dt) ξ = input and output = num(d/dt) ξ, which the next section is fed; a
    differentiator simply has N > deg den.
    Each delayed sum of ξ's is one channel. Blocks whose output is not in `kept` are left out.
    """

    def __init__(
        self,
        diagram: Wiring,
        blocks: list[BlockCoefficients],
        sources: tuple[str, ...],
        kept: set[str],
    ) -> None:
        self.diagram, self.sources = diagram, sources
        pairs = zip(diagram.blocks, blocks, strict=True)
        chosen = [(block, b.sections) for block, b in pairs if block.output in kept]
        self.own = {block.output: own for block, own in chosen}
        sections = [section for own in self.own.values() for section in own]
        self.orders = [max((k for side in pair for k, _ in side), default=0) for pair in sections]
        self.starts = np.concatenate([[0], np.cumsum(self.orders)]).astype(int)
        self.states, self.sections = int(self.starts[-1]), len(sections)
        channels = [len({tau for _, tau in side} - {0}) for pair in sections for side in pair]
        #: the first column of u, and the first of w
        self.u = self.states + self.sections
        self.w = self.u + len(sources)
        self.width = self.w + sum(channels)
        self.delays: list[Fraction] = []
        self.delayed: list[Array] = []
        self.owners: list[str] = []  #: the output of the block that each delay channel is of
        self.names = [block.name for block, own in chosen for _ in own]  #: of each section's block
        self.out = {name: np.eye(1, self.width, self.u + j)[0] for j, name in enumerate(sources)}
        self.ties = np.zeros((self.sections, self.width))
        i = 0
        for block, own in chosen:
            for k, (num, den) in enumerate(own):
                self.ties[i] = self._combination(i, den)
                if k:
                    self.ties[i] -= self.out[block.output]
                self.out[block.output] = self._combination(i, num)
                i += 1
            self.owners += [block.output] * (len(self.delays) - len(self.owners))
        i = 0
        for block, own in chosen:
            self.ties[i] -= self.signal(block.input)
            i += len(own)

    def units(self, targets: tuple[str, ...]) -> _Units:
        """Units in which the gains round every loop are alike."""
        gains = {name: math.prod(map(_gain, own)) for name, own in self.own.items()}
        signals = units.Signals.of(self.diagram, gains, self.sources, targets)
        columns = np.full(self.width, signals.sources)
        ties: list[float] = []
        delayed: list[float] = []
        for name, own in self.own.items():
            unit = signals.inputs[name]
            for section in own:
                num, den = section
                i = len(ties)
                ties.append(units.power_of_two(unit))
                inner = units.power_of_two(unit / units.size(den))
                columns[self.starts[i] : self.starts[i + 1]] = inner
                columns[self.states + i] = inner
                delayed += [ties[-1]] * len({tau for _, tau in den} - {0})
                unit *= _gain(section)
                delayed += [units.power_of_two(unit)] * len({tau for _, tau in num} - {0})
        columns[self.w :] = delayed
        shown = [
            sum(
                gains[leaf] * signals.inputs[leaf] if leaf in gains else signals.sources
                for leaf in resolve(self.diagram, name)
                if leaf in self.out
            )
            for name in targets
        ]
        ends = np.array([units.power_of_two(size) for size in shown])
        return _Units(columns, np.array(ties), ends, signals.sources)

    def pencil(self, scale: _Units) -> descriptor.Pencil:
        """X' = (rows of X') · [X; a; U] and 0 = (rows of blocks) · [X; a; U]."""
        slope = np.zeros((self.states, self.width))
        for i, order in enumerate(self.orders):
            for k in range(order):
                slope[self.starts[i] + k, self._column(i, k + 1)] = 1.0
        slope *= scale.columns / scale.columns[: self.states, None]
        ties = self.ties * scale.columns / scale.ties[:, None]
        return descriptor.Pencil(slope, ties, self.states, self.sections)

    def outputs(self, targets: tuple[str, ...], scale: _Units) -> Array:
        """The targets and what is delayed as rows over [X | a | u, w]."""
        rows = np.array([*(self.signal(name) for name in targets), *self.delayed])
        rows = rows.reshape(len(targets) + len(self.delayed), self.width) * scale.columns
        return rows / np.concatenate([scale.targets, scale.columns[self.w :]])[:, None]

    def signal(self, name: str) -> Array:
        """A signal of the diagram as a row over [X | a | u, w]; inputs not asked for are zero."""
        row = np.zeros(self.width)
        for leaf, factor in resolve(self.diagram, name).items():
            if leaf in self.out:
                row = row + factor * self.out[leaf]
        return row

    def _column(self, i: int, k: int) -> int:
        return int(self.starts[i]) + k if k < self.orders[i] else self.states + i

    def _combination(self, i: int, side: dict[tuple[int, Fraction], float]) -> Array:
        """Σ c ξ^(k)(t − τ) as a row; what is delayed becomes a channel of its own."""
        direct = np.zeros(self.width)
        delayed: dict[Fraction, Array] = {}
        for (k, tau), c in side.items():
            row = direct if tau == 0 else delayed.setdefault(tau, np.zeros(self.width))
            row[self._column(i, k)] += c
        for tau, row in sorted(delayed.items()):
            direct[self.w + len(self.delays)] = 1.0
            self.delays.append(tau)
            self.delayed.append(row)
        return direct


def _gain(section: tuple[Side, Side]) -> float:
    num, den = section
    return units.size(num) / units.size(den)


def _balanced(system: DelaySystem) -> DelaySystem:
    """The same system with its states in units, powers of 2, in which rows and columns of A match.

    The derivatives that a block of high order holds differ by powers of its rates; left in units of
    one, rounding of the large ones would drown the small ones. No digit of the transfer matrix is
    lost: A → T⁻¹ A T, B → T⁻¹ B, C → C T with a diagonal T.
    """
    if not len(system.A):
        return system
    unit = units.balancing(system.A)
    A, B = system.A * unit / unit[:, None], system.B / unit[:, None]
    return DelaySystem(A, B, system.C * unit, system.D, system.delays)
