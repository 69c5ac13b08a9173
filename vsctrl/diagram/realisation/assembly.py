"""From blocks in numbers to state space plus delay channels."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import numpy as np
from scipy.linalg import matrix_balance

from vsctrl.arrays import Array
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.realisation import causality, descriptor, paths
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import pruned
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients
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
    form = _Assembly(diagram, blocks, sources, kept)
    outputs = np.array([*(form.signal(name) for name in targets), *form.delayed])
    outputs = outputs.reshape(len(targets) + len(form.delayed), form.width)
    reduced = descriptor.reduce(form.pencil(), outputs, form.names)
    try:
        system = causality.causal(reduced, tuple(form.delays), sources, targets)
    except causality.AdvancedError as loop:
        raise _advanced(diagram, blocks, {form.owners[j] for j in loop.channels}) from None
    whole = DelaySystem(*system)
    return _balanced(pruned(whole) if sources and targets else whole)


def _advanced(diagram: Wiring, blocks: list[BlockCoefficients], late: Iterable[str]) -> InputError:
    """The refusal of loops that differentiate their own past, through the outputs of `late`."""
    improper = {block.name for block in blocks if block.improper}
    inside = [block.name for block in paths.loops_through(diagram, late)]
    named = [name for name in inside if name in improper] or inside
    return InputError(
        f"at: the loop through {', '.join(inside)} differentiates its own delayed output (an "
        f"advanced equation); filter {' and '.join(map(repr, named))}, e.g. s/(1 + s/N) for s."
    )


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
        self.diagram = diagram
        pairs = zip(diagram.blocks, blocks, strict=True)
        chosen = [(block, b.sections) for block, b in pairs if block.output in kept]
        sections = [section for _, own in chosen for section in own]
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

    def pencil(self) -> descriptor.Pencil:
        """X' = (rows of X') · [X; a; U] and 0 = (rows of blocks) · [X; a; U]."""
        slope = np.zeros((self.states, self.width))
        for i, order in enumerate(self.orders):
            for k in range(order):
                slope[self.starts[i] + k, self._column(i, k + 1)] = 1.0
        return descriptor.Pencil(slope, self.ties, self.states, self.sections)

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


def _balanced(system: DelaySystem) -> DelaySystem:
    """The same system with its states in units, powers of 2, in which rows and columns of A match.

    The derivatives that a block of high order holds differ by powers of its rates; left in units of
    one, rounding of the large ones would drown the small ones. No digit of the transfer matrix is
    lost: A → T⁻¹ A T, B → T⁻¹ B, C → C T with a diagonal T.
    """
    if not len(system.A):
        return system
    _, (unit, _) = matrix_balance(system.A, permute=False, separate=True)
    A, B = system.A * unit / unit[:, None], system.B / unit[:, None]
    return DelaySystem(A, B, system.C * unit, system.D, system.delays)
