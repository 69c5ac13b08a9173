"""A linear difference equation with few, maybe long delays: what a closed sampled loop is.

    [x[k+1]; v[k]; y[k]]  =  Σ_d taps[d] · [x[k−d]; v[k−d]; e[k−d]],

x the continuous states, v the held signals, e the inputs. It is run and evaluated as it stands,
and becomes a state space by shift registers; its poles are left to `poles`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.caching import Caching

MANY = 2000  #: samples above which a run …
FEW = 500  #: … of a state space not larger than this goes block by block, …
BLOCK = 128  #: … of so many samples each

_Rows = tuple[list[int], list[int], Array]  #: (rows, their depth, mix of them)


@dataclass(frozen=True)
class DifferenceEquation(Caching):
    """The closed loop: taps[d] over rows [x⁺; v; y] and columns [x; v; e], v[k] solved for."""

    taps: dict[int, Array]
    states: int
    held: int

    @property
    def inner(self) -> int:
        """Number of x and v together."""
        return self.states + self.held

    def matrices(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Σ_d taps[d] z^{−d} at each z; (…, rows, columns)."""
        out: NDArray[np.complex128] = sum(
            z[..., None, None] ** (-d) * matrix for d, matrix in self.taps.items()
        )  # type: ignore[assignment]
        return out

    def characteristic(self, z: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], ...]:
        """P(z) = diag(z I, I) − the inner taps, singular at the poles, and z dP/dz."""
        m, n = self.inner, self.states
        P = -self.matrices(z)[..., :m, :m]
        slope = np.zeros_like(P)
        for d, matrix in self.taps.items():
            slope += d * z[..., None, None] ** (-d) * matrix[:m, :m]
        for i in range(m):
            P[..., i, i] += z if i < n else 1.0
            slope[..., i, i] += z if i < n else 0.0
        return P, slope

    def run(self, samples: Array) -> Array:
        """y[k], (n, p), for input samples e[k], (n, r), from rest."""
        m, length = self.inner, len(samples)
        if length > MANY and self.order <= FEW and samples.shape[1] == 1:
            return _in_blocks(self.state_space(), samples[:, 0])
        longest = max(self.taps)
        past = np.zeros((longest + length + 1, m + samples.shape[1]))
        past[longest : longest + length, m:] = samples
        ago, wide = np.array(list(self.taps)), np.hstack(list(self.taps.values()))
        y = np.zeros((length, wide.shape[0] - m))
        for k in range(longest, longest + length):
            # v[k] does not act through v[k] any more, so one product gives all three.
            new = wide @ past[k - ago].ravel()
            past[k + 1, : self.states] = new[: self.states]
            past[k, self.states : m] = new[self.states : m]
            y[k - longest] = new[m:]
        return y

    def transfer(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The value at each z ≠ 0, (…, p, r); infinite at a pole."""
        m = self.inner
        P, _ = self.characteristic(z)
        taps = self.matrices(z)
        try:
            through = np.linalg.solve(P, taps[..., :m, m:])
        except np.linalg.LinAlgError:
            if z.ndim:
                flat = [self.transfer(np.asarray(point)) for point in z.ravel()]
                return np.reshape(flat, (*z.shape, *flat[0].shape))
            return self._near(z)
        return np.asarray(taps[..., m:, :m] @ through + taps[..., m:, m:], complex)

    def _near(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """At a root that the channel may not show: the mean of a small circle, or infinity."""
        turn = np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
        far, near = (self.transfer(z * (1 + r * turn)) for r in (1e-4, 5e-5))
        grows = np.abs(near).max(axis=0) > 1.5 * np.abs(far).max(axis=0)
        return np.where(grows, complex(np.inf), near.mean(axis=0))

    @property
    def order(self) -> int:
        """Number of states of `state_space`: the continuous ones and all registers."""
        return self.states + self._registers[2]

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """(A, B, C, D) with shift registers for what is delayed, on the side that needs fewer."""
        m, n, taps = self.inner, self.states, self.taps
        rows, columns, keeps = self._registers
        matrix = _registers_of_columns(taps, columns) if columns else _registers_of_rows(taps, rows)
        # Rows [x⁺; v; y; registers⁺] over [x; v; e; registers]: put v in, then sort.
        v = matrix[n:m].copy()
        rest, gain = np.delete(matrix, range(n, m), 0), np.delete(matrix, range(n, m), 0)[:, n:m]
        closed = np.delete(rest + gain @ v, range(n, m), 1)
        outputs, inputs = taps[0].shape[0] - m, taps[0].shape[1] - m
        r = [*range(n), *range(n + outputs, n + outputs + keeps)]
        c = [*range(n), *range(n + inputs, n + inputs + keeps)]
        y, u = range(n, n + outputs), range(n, n + inputs)
        A, B, C, D = (closed[np.ix_(i, j)] for i, j in ((r, c), (r, u), (y, c), (y, u)))
        return A, B, C, D

    @cached_property
    def _registers(self) -> tuple[_Rows, dict[int, int], int]:
        """The delayed rows, or else the columns with their depths; and how many registers."""
        delays = [d for d in self.taps if d]
        columns = {
            c: max(d for d in delays if self.taps[d][:, c].any())
            for c in range(self.taps[0].shape[1])
            if any(self.taps[d][:, c].any() for d in delays)
        }
        rows = _different(self.taps, delays)
        if sum(columns.values()) < sum(rows[1]):
            return rows, columns, sum(columns.values())
        return rows, {}, sum(rows[1])


def _in_blocks(system: tuple[Array, Array, Array, Array], u: Array) -> Array:
    """y[k], (n, p), of a one-input state space from rest: each block from the state before it."""
    A, B, C, D = system
    powers = [np.eye(len(A))]
    for _ in range(BLOCK):
        powers.append(A @ powers[-1])
    seen = np.stack([C @ power for power in powers[:-1]])  # (block, p, states)
    pulse = np.concatenate([D[None, :, 0], (seen @ B)[:-1, :, 0]])  # (block, p)
    ago = np.subtract.outer(np.arange(BLOCK), np.arange(BLOCK))
    direct = np.where((ago >= 0)[..., None], pulse[np.maximum(ago, 0)], 0.0).transpose(0, 2, 1)
    into = np.hstack([power @ B for power in powers[-2::-1]])  # (states, block)
    blocks = np.zeros((-(-len(u) // BLOCK), BLOCK))
    blocks.ravel()[: len(u)] = u
    y = blocks @ direct.reshape(-1, BLOCK).T
    x = np.zeros(len(A))
    onward = np.vstack([seen.reshape(-1, len(A)), powers[-1]])
    entering = blocks @ into.T
    for k, come in enumerate(entering):
        both = onward @ x
        y[k] += both[: y.shape[1]]
        x = both[y.shape[1] :] + come
    return np.asarray(y.reshape(-1, len(C))[: len(u)])


def _different(taps: dict[int, Array], delays: list[int]) -> _Rows:
    """The rows that delayed taps fill, proportional ones once: (rows, their depth, mix of them)."""
    size = taps[0].shape[0]
    rows: list[int] = []
    mix = np.zeros((size, size))
    flat = np.hstack([taps[d] for d in delays]) if delays else np.zeros((size, 1))
    top = np.abs(flat).max(axis=1, keepdims=True)
    unit = flat / np.where(top > 0, top, 1.0)  # squares of what is tiny would be 0
    for i in np.flatnonzero(flat.any(1)):
        for j, first in enumerate(rows):
            factor = unit[i] @ unit[first] / (unit[first] @ unit[first])
            if np.abs(unit[i] - factor * unit[first]).max() <= 1e-15:
                mix[i, j] = factor * (top[i, 0] / top[first, 0])
                break
        else:
            mix[i, len(rows)] = 1.0
            rows.append(int(i))
    depth = [max(d for d in delays if taps[d][i].any()) for i in rows]
    return rows, depth, mix[:, : len(rows)]


def _registers_of_rows(taps: dict[int, Array], delayed: _Rows) -> Array:
    """Each delayed row adds what it will need d samples from now to its register, d places back."""
    rows, depth, mix = delayed
    height, width = taps[0].shape
    starts = np.concatenate([[0], np.cumsum(depth)]).astype(int)
    keeps = int(starts[-1])
    matrix = np.zeros((height + keeps, width + keeps))
    matrix[:height, :width] = taps[0]
    for j, (row, start, length) in enumerate(zip(rows, starts, depth, strict=False)):
        matrix[:height, width + start] = mix[:, j]
        for i in range(length - 1):
            matrix[height + start + i, width + start + i + 1] = 1.0
        for d in taps:
            if 0 < d <= length:
                matrix[height + start + d - 1, :width] = taps[d][row]
    return matrix


def _registers_of_columns(taps: dict[int, Array], columns: dict[int, int]) -> Array:
    """Each signal that is used delayed is remembered; place d − 1 holds it d samples ago.

    These are the registers of the rows of the transposed taps, transposed.
    """
    mix = np.eye(taps[0].shape[1])[:, list(columns)]
    rows = list(columns), list(columns.values()), mix
    return np.ascontiguousarray(_registers_of_rows({d: T.T for d, T in taps.items()}, rows).T)
