"""From blocks in numbers to state space plus delay channels."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.linalg import matrix_balance

from vsctrl.arrays import Array
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.realisation import descriptor
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import pruned
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients


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
    form = _Assembly(diagram, blocks, sources)
    outputs = np.array([*(form.signal(name) for name in targets), *form.delayed])
    outputs = outputs.reshape(len(targets) + len(form.delayed), form.width)
    reduced = descriptor.reduce(form.pencil(), outputs, [block.name for block in blocks])
    system = descriptor.causal(reduced, tuple(form.delays), sources, targets)
    whole = DelaySystem(*system)
    return _balanced(pruned(whole) if sources and targets else whole)


class _Assembly:
    """All blocks side by side, wired: rows over the columns [X | a | u, w].

    Block b holds ξ, ξ', …, ξ^(N−1) as states and a = ξ^(N) as an algebraic variable, with
    den(d/dt) ξ = input and output = num(d/dt) ξ; a differentiator simply has N > deg den.
    Each delayed sum of ξ's is one channel.
    """

    def __init__(
        self, diagram: Wiring, blocks: list[BlockCoefficients], sources: tuple[str, ...]
    ) -> None:
        self.diagram = diagram
        self.orders = [max((k for k, _ in (*b.num, *b.den)), default=0) for b in blocks]
        self.starts = np.concatenate([[0], np.cumsum(self.orders)]).astype(int)
        self.states, self.blocks = int(self.starts[-1]), len(blocks)
        channels = [len({tau for _, tau in side} - {0}) for b in blocks for side in (b.num, b.den)]
        #: the first column of u, and the first of w
        self.u, self.w = self.states + self.blocks, self.states + self.blocks + len(sources)
        self.width = self.w + sum(channels)
        self.delays: list[Fraction] = []
        self.delayed: list[Array] = []
        self.out = {name: np.eye(1, self.width, self.u + j)[0] for j, name in enumerate(sources)}
        inner = []
        for i, (b, block) in enumerate(zip(blocks, diagram.blocks, strict=True)):
            inner.append(self._combination(i, b.den))
            self.out[block.output] = self._combination(i, b.num)
        self.ties = np.zeros((self.blocks, self.width))
        for i, block in enumerate(diagram.blocks):
            self.ties[i] = inner[i] - self.signal(block.input)

    def pencil(self) -> descriptor.Pencil:
        """X' = (rows of X') · [X; a; U] and 0 = (rows of blocks) · [X; a; U]."""
        slope = np.zeros((self.states, self.width))
        for i, order in enumerate(self.orders):
            for k in range(order):
                slope[self.starts[i] + k, self._column(i, k + 1)] = 1.0
        return descriptor.Pencil(slope, self.ties, self.states, self.blocks)

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
