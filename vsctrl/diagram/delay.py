"""The numeric system behind every exact-delay face: state space plus delay channels.

    x' = A x + B [u; w]      y = C[:p] x + D[:p] [u; w]      wⱼ(t) = zⱼ(t − τⱼ)
                             z = C[p:] x + D[p:] [u; w]

Every delay of a diagram is one channel zⱼ → wⱼ; the rest is finite-dimensional. Delays that are
zero have become algebraic before they get here. How derivatives of signals are removed is left to
`descriptor`; what is computed from the system, to `frequency`, `roots`, `response` and `pade`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from vsctrl.diagram import descriptor
from vsctrl.diagram.transfer import BlockCoefficients
from vsctrl.diagram.wiring import resolve

if TYPE_CHECKING:
    from vsctrl.diagram.wiring import Wiring

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DelaySystem:
    """A (n, n), B (n, r+m), C (p+m, n), D (p+m, r+m) and the m delays in seconds, all > 0."""

    A: Array
    B: Array
    C: Array
    D: Array
    delays: tuple[Fraction, ...]

    @property
    def inputs(self) -> int:
        """Number r of external inputs."""
        return self.B.shape[1] - len(self.delays)

    @property
    def outputs(self) -> int:
        """Number p of external outputs."""
        return self.C.shape[0] - len(self.delays)

    def scaled(self, unit: float) -> DelaySystem:
        """The same system with time counted in multiples of `unit` (s)."""
        slope = np.array([[unit]])
        delays = tuple(tau / Fraction(unit) for tau in self.delays)
        return DelaySystem(self.A * slope, self.B * slope, self.C, self.D, delays)

    def closed(self, sign: int) -> DelaySystem:
        """The autonomous system left when its one output is fed back to its one input.

        `sign` −1: the loop transfer function L of 1 + L is minus this system.
        """
        r = 1
        gain = 1 / (1 - self.D[0, 0])
        u = gain * np.concatenate([self.C[0], self.D[0, r:]])
        n = len(self.A)
        states = np.hstack([self.A, self.B[:, r:]]) + np.outer(self.B[:, 0], u)
        rest = np.hstack([self.C[1:], self.D[1:, r:]]) + np.outer(self.D[1:, 0], u)
        return DelaySystem(states[:, :n], states[:, n:], rest[:, :n], rest[:, n:], self.delays)

    def characteristic(self, at: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The matrix [[sI − A, −B₂], [−Δ C₂, I − Δ D₂₂]], Δ = diag e^{−sτ}; its zeros are poles.

        `at` has any shape; the result is (…, n+m, n+m).
        """
        tau, fixed, unit, late, _ = self._affine
        lag = np.exp(-at[..., None] * tau)[..., None]
        return np.asarray(fixed + at[..., None, None] * unit - lag * late, complex)

    @cached_property
    def _affine(self) -> tuple[Array, Array, Array, Array, Array]:
        """(τ, M₀, E, K, diag(τ) K) with characteristic(s) = M₀ + s E − Δ K."""
        n, r, p = len(self.A), self.inputs, self.outputs
        tau = np.array([float(delay) for delay in self.delays])
        size = n + len(tau)
        fixed, late, unit = np.eye(size), np.zeros((size, size)), np.zeros((size, size))
        fixed[:n, :n], fixed[:n, n:] = -self.A, -self.B[:, r:]
        late[n:, :n], late[n:, n:] = self.C[p:], self.D[p:, r:]
        unit[:n, :n] = np.eye(n)
        tau = np.concatenate([np.zeros(n), tau])
        return tau, fixed, unit, late, tau[:, None] * late

    def characteristic_and_slope(
        self, at: NDArray[np.complex128]
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """`characteristic` and its derivative with respect to s, same shape."""
        tau, fixed, unit, late, slope = self._affine
        lag = np.exp(-at[..., None] * tau)[..., None]
        matrix = fixed + at[..., None, None] * unit - lag * late
        return np.asarray(matrix, complex), np.asarray(unit + lag * slope, complex)

    def transfer(self, at: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The p×r transfer matrix at each s of `at`, exact; (…, p, r)."""
        n, r, p = len(self.A), self.inputs, self.outputs
        lag = np.exp(-at[..., None] * np.array([float(tau) for tau in self.delays]))[..., None]
        right = np.zeros((*at.shape, n + len(self.delays), r), complex)
        right[..., :n, :] = self.B[:, :r]
        right[..., n:, :] = lag * self.D[p:, :r]
        inner = np.linalg.solve(self.characteristic(at), right)
        left = np.hstack([self.C[:p], self.D[:p, r:]])
        return np.asarray(left @ inner + self.D[:p, :r], complex)


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
    form = _Assembly.of(diagram, blocks, sources)
    outputs = [form.signal(diagram, name) for name in targets] + form.delayed
    reduced = descriptor.reduce(
        form.pencil(), np.array(outputs).reshape(len(outputs), form.width), [b.name for b in blocks]
    )
    system = descriptor.causal(reduced, len(sources), tuple(form.delays), sources, targets)
    whole = DelaySystem(*system)
    return _balanced(_pruned(whole) if sources and targets else whole)


class _Assembly:
    """All blocks side by side, wired: rows over the columns [X | a | u, w].

    Block b holds ξ, ξ', …, ξ^(N−1) as states and a = ξ^(N) as an algebraic variable, with
    den(d/dt) ξ = input and output = num(d/dt) ξ; a differentiator simply has N > deg den.
    Each delayed sum of ξ's is one channel.
    """

    def __init__(self, orders: list[int], inputs: int, channels: int) -> None:
        self.starts = np.concatenate([[0], np.cumsum(orders)]).astype(int)
        self.states, self.blocks = int(self.starts[-1]), len(orders)
        self.orders = orders
        self.width = self.states + self.blocks + inputs + channels
        self.inputs = inputs
        self.delays: list[Fraction] = []
        self.delayed: list[Array] = []
        self.inner: list[Array] = []
        self.out: dict[str, Array] = {}
        self.pencil_rows = np.zeros((self.blocks, self.width))

    @classmethod
    def of(
        cls, diagram: Wiring, blocks: list[BlockCoefficients], sources: tuple[str, ...]
    ) -> _Assembly:
        orders = [max((k for k, _ in (*b.num, *b.den)), default=0) for b in blocks]
        channels = sum(
            len({tau for _, tau in side} - {0}) for b in blocks for side in (b.num, b.den)
        )
        self = cls(orders, len(sources), channels)
        for i, (b, block) in enumerate(zip(blocks, diagram.blocks, strict=True)):
            self.inner.append(self._combination(i, b.den))
            self.out[block.output] = self._combination(i, b.num)
        for j, name in enumerate(sources):
            self.out[name] = self._unit(self.states + self.blocks + j)
        for i, block in enumerate(diagram.blocks):
            self.pencil_rows[i] = self.inner[i] - self.signal(diagram, block.input)
        return self

    def pencil(self) -> descriptor.Pencil:
        """X' = (rows of X') · [X; a; U] and 0 = (rows of blocks) · [X; a; U]."""
        slope = np.zeros((self.states, self.width))
        for i, order in enumerate(self.orders):
            for k in range(order):
                slope[self.starts[i] + k, self._column(i, k + 1)] = 1.0
        return descriptor.Pencil(slope, self.pencil_rows, self.states, self.blocks)

    def signal(self, diagram: Wiring, name: str) -> Array:
        """A signal of the diagram as a row over [X | a | u, w]; inputs not asked for are zero."""
        row = np.zeros(self.width)
        for leaf, factor in resolve(diagram, name).items():
            if leaf in self.out:
                row = row + factor * self.out[leaf]
        return row

    def _column(self, i: int, k: int) -> int:
        return int(self.starts[i]) + k if k < self.orders[i] else self.states + i

    def _unit(self, column: int) -> Array:
        row = np.zeros(self.width)
        row[column] = 1.0
        return row

    def _combination(self, i: int, side: dict[tuple[int, Fraction], float]) -> Array:
        """Σ c ξ^(k)(t − τ) as a row; what is delayed becomes a channel of its own."""
        direct = np.zeros(self.width)
        late: dict[Fraction, Array] = {}
        for (k, tau), c in side.items():
            row = direct if tau == 0 else late.setdefault(tau, np.zeros(self.width))
            row[self._column(i, k)] += c
        for tau, row in sorted(late.items()):
            direct[self.states + self.blocks + self.inputs + len(self.delays)] = 1.0
            self.delays.append(tau)
            self.delayed.append(row)
        return direct


def _pruned(system: DelaySystem) -> DelaySystem:
    """Drop the states and delay channels that the inputs do not reach or the outputs do not see."""
    n, r, p, m = len(system.A), system.inputs, system.outputs, len(system.delays)
    # Node i < n is state i, node n + j is delay channel j; an edge means "depends on".
    edges = np.zeros((n + m, n + m), bool)
    edges[:n, :n], edges[:n, n:] = system.A != 0, system.B[:, r:] != 0
    edges[n:, :n], edges[n:, n:] = system.C[p:] != 0, system.D[p:, r:] != 0
    driven = np.concatenate([system.B[:, :r].any(1), system.D[p:, :r].any(1)])
    seen = np.concatenate([system.C[:p].any(0), system.D[:p, r:].any(0)])
    for _ in range(n + m):
        driven = driven | (edges & driven).any(1)
        seen = seen | (edges.T & seen).any(1)
    keep = driven & seen
    x, w = np.flatnonzero(keep[:n]), np.flatnonzero(keep[n:])
    columns, rows = np.r_[0:r, r + w].astype(int), np.r_[0:p, p + w].astype(int)
    return DelaySystem(
        system.A[np.ix_(x, x)],
        system.B[np.ix_(x, columns)],
        system.C[np.ix_(rows, x)],
        system.D[np.ix_(rows, columns)],
        tuple(system.delays[j] for j in w),
    )


def _balanced(system: DelaySystem) -> DelaySystem:
    """The same system with its states in units, powers of 2, in which rows and columns of A match.

    The derivatives that a block of high order holds differ by powers of its rates; left in units of
    one, rounding of the large ones would drown the small ones. No digit of the transfer matrix is
    lost: A → T⁻¹ A T, B → T⁻¹ B, C → C T with a diagonal T.
    """
    if not len(system.A):
        return system
    _, (unit, _) = matrix_balance(system.A, permute=False, separate=True)
    return DelaySystem(
        system.A * unit / unit[:, None],
        system.B / unit[:, None],
        system.C * unit,
        system.D,
        system.delays,
    )
