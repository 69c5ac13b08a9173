"""A linear recursion with long but few taps: what a sampled loop is once it is closed.

    [x[k+1]; v[k]; y[k]]  =  Σ_d taps[d] · [x[k−d]; v[k−d]; e[k−d]],

x the continuous states, v the held signals, e the inputs. It is run and evaluated as it stands,
and becomes a state space by shift registers. It is never multiplied out into polynomials in z,
whose coefficients could not hold a dominant pole beside a long delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError, LimitError

Array = NDArray[np.float64]

#: The largest dense eigenproblem that is tried: 3000 states take half a minute.
MOST_STATES = 3000
#: A cancelled delay of more samples leaves noise so near the unit circle that it hides roots.
CANCELLED = 100
#: Further than this in log z, no true eigenvalue is wrong.
FURTHEST = 0.05


@dataclass(frozen=True)
class Recursion:
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
        late = max(self.taps)
        past = np.zeros((late + length + 1, m + samples.shape[1]))
        past[late : late + length, m:] = samples
        ago, wide = np.array(list(self.taps)), np.hstack(list(self.taps.values()))
        y = np.zeros((length, wide.shape[0] - m))
        for k in range(late, late + length):
            # v[k] does not act through v[k] any more, so one product gives all three.
            new = wide @ past[k - ago].ravel()
            past[k + 1, : self.states] = new[: self.states]
            past[k, self.states : m] = new[self.states : m]
            y[k - late] = new[m:]
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

    def poles(self, n: int | None = None) -> NDArray[np.complex128]:
        """The n poles of largest modulus, or all, polished; conjugates together.

        Eigenvalues of a long register that empties itself are rounding noise, ε^{1/d} and not 0.
        They are told from roots by what rounding does to them, and returned as zeros.
        Errors: `LimitError` for too many states, or a cancelled delay of over 100 samples.
        """
        if n is not None and (isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1):
            raise InputError(f"poles: n = {n!r} is not usable; give a whole number of 1 or more.")
        return self._all_poles[:n].copy()

    @cached_property
    def is_stable(self) -> bool:
        """Whether all poles are inside the unit circle."""
        return bool((np.abs(self._all_poles) < 1).all())

    @cached_property
    def _all_poles(self) -> NDArray[np.complex128]:
        inner = {d: matrix[: self.inner, : self.inner] for d, matrix in self.taps.items()}
        A = Recursion(inner, self.states, self.held).state_space()[0]
        if len(A) > MOST_STATES:
            raise LimitError(
                f"poles: the registers hold {len(A)} samples and {MOST_STATES} is the limit of a "
                "dense eigenproblem; ask for a longer period."
            )
        z = np.asarray(np.linalg.eigvals(A), complex)
        z = self._polished(z)
        order = np.lexsort((-z.imag, np.round(np.abs(np.angle(z)), 9), -np.round(np.abs(z), 12)))
        return z[order]

    def _polished(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Newton on det P in log z: as good as P itself, whatever the length of the registers."""
        start = z[np.abs(z) > 0]
        w = np.log(start)
        with np.errstate(all="ignore"):
            step, doubt = self._newton(start)
            # What d samples of decay bring below rounding, rounding may have made.
            late = max(self.taps)
            told = (np.abs(step) <= FURTHEST) & (doubt <= 1e-3)
            noise = ~told & (np.abs(start) ** late < 1e-6)
            if noise.any() and late > CANCELLED:
                raise LimitError(
                    f"poles: the loop cancels a delay of {late} samples (a Smith predictor?), and "
                    "what is left cannot be told from rounding; take responses, or a longer period."
                )
            for _ in range(3):
                # Where the determinant overflows or roots merge, the eigenvalue is better.
                good = np.isfinite(step) & ~noise & (np.abs(step) < 1e-3)
                w[good] -= step[good]
                step, _ = self._newton(np.exp(w))
        better = np.where(noise, 0.0, np.exp(w))
        better[start.imag == 0] = better[start.imag == 0].real
        out = np.zeros_like(z)
        out[: len(start)] = better
        return out

    def _newton(self, z: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], Array]:
        """Newton's step in log z, and how far rounding of the taps may move a root from there."""
        P, slope = self.characteristic(z)
        m = self.inner
        size = np.abs(P) + sum(
            np.abs(z[:, None, None]) ** (-d) * np.abs(matrix[:m, :m])
            for d, matrix in self.taps.items()
        )
        step, doubt = np.zeros(len(z), complex), np.zeros(len(z))
        for i in range(len(z)):
            try:
                inverse = np.linalg.inv(P[i])
            except np.linalg.LinAlgError:
                # A root to the last digit, or so small that z^{−d} has swallowed the rest of P.
                doubt[i] = np.inf
                continue
            step[i] = 1 / np.trace(inverse @ slope[i])
            doubt[i] = 4e-15 * (np.abs(inverse).T * size[i]).sum() * abs(step[i])
        return step, doubt

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """(A, B, C, D) with shift registers for what is late, on the side that needs fewer."""
        m, n, taps = self.inner, self.states, self.taps
        late = [d for d in taps if d]
        columns = {
            c: max(d for d in late if taps[d][:, c].any())
            for c in range(taps[0].shape[1])
            if any(taps[d][:, c].any() for d in late)
        }
        rows, depth, mix = _different(taps, late)
        if sum(columns.values()) < sum(depth):
            whole, keeps = _registers_of_columns(taps, columns)
        else:
            whole, keeps = _registers_of_rows(taps, rows, depth, mix)
        # Rows [x⁺; v; y; registers⁺] over [x; v; e; registers]: put v in, then sort.
        v = whole[n:m].copy()
        rest, gain = np.delete(whole, range(n, m), 0), np.delete(whole, range(n, m), 0)[:, n:m]
        closed = np.delete(rest + gain @ v, range(n, m), 1)
        outputs, inputs = taps[0].shape[0] - m, taps[0].shape[1] - m
        r = [*range(n), *range(n + outputs, n + outputs + keeps)]
        c = [*range(n), *range(n + inputs, n + inputs + keeps)]
        y, u = range(n, n + outputs), range(n, n + inputs)
        A, B, C, D = (closed[np.ix_(i, j)] for i, j in ((r, c), (r, u), (y, c), (y, u)))
        return A, B, C, D


def _different(taps: dict[int, Array], late: list[int]) -> tuple[list[int], list[int], Array]:
    """The rows that late taps fill, proportional ones once: (rows, their depth, mix of them)."""
    size = taps[0].shape[0]
    rows: list[int] = []
    mix = np.zeros((size, size))
    flat = np.hstack([taps[d] for d in late]) if late else np.zeros((size, 1))
    for i in np.flatnonzero(flat.any(1)):
        for j, first in enumerate(rows):
            factor = flat[i] @ flat[first] / (flat[first] @ flat[first])
            if np.abs(flat[i] - factor * flat[first]).max() <= 1e-15 * np.abs(flat[i]).max():
                mix[i, j] = factor
                break
        else:
            mix[i, len(rows)] = 1.0
            rows.append(int(i))
    depth = [max(d for d in late if taps[d][i].any()) for i in rows]
    return rows, depth, mix[:, : len(rows)]


def _registers_of_rows(
    taps: dict[int, Array], rows: list[int], depth: list[int], mix: Array
) -> tuple[Array, int]:
    """Each late row adds what it will need d samples from now to its register, d places back."""
    height, width = taps[0].shape
    starts = np.concatenate([[0], np.cumsum(depth)]).astype(int)
    keeps = int(starts[-1])
    whole = np.zeros((height + keeps, width + keeps))
    whole[:height, :width] = taps[0]
    for j, (row, start, length) in enumerate(zip(rows, starts, depth, strict=False)):
        whole[:height, width + start] = mix[:, j]
        for i in range(length - 1):
            whole[height + start + i, width + start + i + 1] = 1.0
        for d in taps:
            if 0 < d <= length:
                whole[height + start + d - 1, :width] = taps[d][row]
    return whole, keeps


def _registers_of_columns(taps: dict[int, Array], columns: dict[int, int]) -> tuple[Array, int]:
    """Each signal that is used late is remembered; place d − 1 holds it d samples ago."""
    height, width = taps[0].shape
    keeps = sum(columns.values())
    whole = np.zeros((height + keeps, width + keeps))
    whole[:height, :width] = taps[0]
    start = 0
    for c, length in columns.items():
        whole[height + start, c] = 1.0
        for i in range(1, length):
            whole[height + start + i, width + start + i - 1] = 1.0
        for d in taps:
            if 0 < d <= length:
                whole[:height, width + start + d - 1] += taps[d][:, c]
        start += length
    return whole, keeps
