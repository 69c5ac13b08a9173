"""The poles of a difference equation, a few or thousands, however long its delays.

They are the zeros of det P, P(z) = diag(z I, I) − Σ_d taps[d] z^{−d}. Short registers are a dense
eigenproblem. Of long ones, det P is a polynomial with few terms,

    det P = zⁿ Σ_k c_k z^{−k},

which says how many zeros there are and where to begin; Aberth's iteration then moves all of them at
once by the logarithmic derivative of P itself, so that no rounding of the c_k gets into them.
A dense polynomial would report a pole of 1.23 beside a delay of 80 samples where 0.9968 is true.
Sources: O. Aberth, Math. Comp. 27 (1973); D. A. Bini, Numer. Algorithms 13 (1996) for the start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.caching import Caching
from vsctrl.checks import is_whole, quoted
from vsctrl.diagram.numerics.graphs import components
from vsctrl.diagram.sampled.difference_equation import DifferenceEquation
from vsctrl.errors import InputError, LimitError

Series = dict[int, tuple[float, float]]  #: power of 1/z → (coefficient, sum of what was added up)

DENSE = 160  #: states up to which the dense eigenproblem is the quicker one
MOST_STATES = 3000  #: of the largest dense eigenproblem that is tried, which takes half a minute
MOST_POLES = 6000  #: Aberth's iteration takes two seconds for 2000 and grows with the square
CANCELLED = 100  #: samples of a cancelled delay beyond which its noise hides eigenvalues
FURTHEST = 0.05  #: in log z, by which a true eigenvalue may be wrong
ROUNDING = 1e-13  #: of what was added up to a coefficient, below which it is rounding
MOST_PRODUCTS = 200_000
MOST_ROUNDS = 120


def poles(equation: DifferenceEquation) -> Complex:
    """All poles, the largest first, conjugates together; registers that empty themselves are 0.

    Errors: `LimitError` for more than `MOST_POLES`, and for a wide loop (more than about ten
    states and held signals, all acting on each other) with a delay of thousands of samples.
    """
    m = equation.inner
    inner = {d: matrix[:m, :m] for d, matrix in equation.taps.items() if d == 0 or matrix.any()}
    equation = DifferenceEquation(inner, equation.states, equation.held)
    parts = [_of_loop(part) for part in _loops(equation)]
    # Between the loops nothing but registers that empty themselves.
    z = np.concatenate([*parts, np.zeros(0, complex)])
    z = z[np.argsort(z == 0, kind="stable")]
    z = np.pad(z, (0, max(0, equation.order - len(z))))[: equation.order]
    order = np.lexsort((-z.imag, np.round(np.abs(np.angle(z)), 9), -np.round(np.abs(z), 12)))
    return z[order]


def _loops(equation: DifferenceEquation) -> list[DifferenceEquation]:
    """The parts that act on themselves, whose determinants make up that of the whole.

    Integrators in a row then have their pole at 1 each, instead of one that is multiple.
    """
    acts = sum(np.abs(matrix) for matrix in equation.taps.values())
    label = components(np.asarray(acts))
    out = []
    for k in range(int(label.max(initial=-1)) + 1):
        at = np.flatnonzero(label == k)
        states = int((at < equation.states).sum())
        taps = {d: matrix[np.ix_(at, at)] for d, matrix in equation.taps.items()}
        taps = {d: matrix for d, matrix in taps.items() if d == 0 or matrix.any()}
        if any(matrix.any() for matrix in taps.values()):
            out.append(DifferenceEquation(taps, states, len(at) - states))
    return out


def _of_loop(equation: DifferenceEquation) -> Complex:
    """The poles of a part all of which acts on itself, in no order."""
    z = _dense(equation) if equation.order <= DENSE else None
    if z is None:
        series = _determinant(equation)
        z = _simultaneous(equation, series) if series else _dense(equation, last=True)
    if z is None:
        raise LimitError(
            f"poles: the loop cancels a delay of {max(equation.taps)} samples (a Smith predictor?),"
            " and what is left cannot be told from rounding; take responses, or a longer period."
        )
    return z


# Few states: eigenvalues -------------------------------------------------------------------------
def _dense(equation: DifferenceEquation, last: bool = False) -> Complex | None:
    """Eigenvalues, polished; None where rounding hides some and this is not the `last` resort.

    Eigenvalues of a long register that empties itself are rounding noise, ε^{1/d} and not 0.
    They are told from roots by what rounding does to them.
    """
    if last and equation.order > MOST_STATES:
        raise _too_many(equation.order, MOST_STATES)
    z = np.asarray(np.linalg.eigvals(equation.state_space()[0]), complex)
    start = z[np.abs(z) > 0]
    w = np.log(start)
    longest = max(equation.taps)
    with np.errstate(all="ignore"):
        step, doubt = _newton(equation, start)
        # What d samples of decay bring below rounding, rounding may have made.
        certain = (np.abs(step) <= FURTHEST) & (doubt <= 1e-3)
        noise = ~certain & (np.abs(start) ** longest < 1e-6)
        if noise.any() and (not last or longest > CANCELLED):
            return None
        for _ in range(3):
            # Where the determinant overflows or roots merge, the eigenvalue is better.
            good = np.isfinite(step) & ~noise & (np.abs(step) < 1e-3)
            w[good] -= step[good]
            step, _ = _newton(equation, np.exp(w))
    better = np.where(noise, 0.0, np.exp(w))
    better[start.imag == 0] = better[start.imag == 0].real
    out = np.zeros_like(z)
    out[: len(start)] = better
    return out


def _newton(equation: DifferenceEquation, z: Complex) -> tuple[Complex, Array]:
    """Newton's step in log z, and how far rounding of the taps may move a root from there."""
    P, slope = equation.characteristic(z)
    size = np.abs(P) + sum(
        np.abs(z[:, None, None]) ** (-d) * np.abs(matrix) for d, matrix in equation.taps.items()
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


# Long registers: all zeros of a polynomial with few terms --------------------------------------
def _determinant(equation: DifferenceEquation) -> Series | None:
    """The terms c_k of det P = zⁿ Σ c_k z^{−k}, by minors over the rows; None if too many."""
    m, n = equation.inner, equation.states
    rows: list[list[dict[int, float]]] = [[{} for _ in range(m)] for _ in range(m)]
    for d, matrix in equation.taps.items():
        for i, j in zip(*np.nonzero(matrix), strict=True):
            # The rows of states are divided by z.
            rows[i][j][d + (1 if i < n else 0)] = -float(matrix[i, j])
    for i in range(m):
        rows[i][i][0] = rows[i][i].get(0, 0.0) + 1.0
    minors: dict[int, Series] = {0: {0: (1.0, 1.0)}}
    work = 0
    for row in rows:
        longer: dict[int, Series] = {}
        for used, minor in minors.items():
            for j, entry in enumerate(row):
                if used >> j & 1 or not entry:
                    continue
                sign = -1.0 if (used >> j).bit_count() % 2 else 1.0
                into = longer.setdefault(used | 1 << j, {})
                work += len(entry) * len(minor)
                if work > MOST_PRODUCTS:
                    return None
                for a, value in entry.items():
                    for b, (c, size) in minor.items():
                        old, most = into.get(a + b, (0.0, 0.0))
                        more = most + abs(value) * size
                        into[a + b] = old + sign * value * c, more
        minors = longer
    return minors[(1 << m) - 1]


def _simultaneous(equation: DifferenceEquation, series: Series) -> Complex:
    """All zeros at once, and a zero for every register that empties itself."""
    terms = {k: c for k, (c, size) in series.items() if abs(c) > ROUNDING * size}
    count = max(terms)
    if count > MOST_POLES:
        raise _too_many(count, MOST_POLES)
    turning = _of_terms(terms) if count < max(series) else _of_matrix(equation, count)
    with np.errstate(all="ignore"):
        z = _aberth(turning, _start(terms))
    # The zeros add up to −c₁: one that was found twice, or not, shows.
    if not abs(z.sum() + terms.get(1, 0.0)) <= 1e-6 * (1 + np.abs(z).sum()):
        raise LimitError(
            f"poles: the {count} poles could not all be told apart; ask for another period."
        )
    if count < max(series):
        z = _polished(equation, z)
    return np.concatenate([_paired(z), np.zeros(equation.order - count)])


def _polished(equation: DifferenceEquation, z: Complex) -> Complex:
    """Newton's steps by P where its rounding is small: the c_k know close zeros less well."""
    with np.errstate(all="ignore"):
        for _ in range(2):
            step, doubt = _newton(equation, z)
            good = np.isfinite(step) & (np.abs(step) < 1e-4) & (doubt < 1e-9)
            z = np.where(good, z * np.exp(-np.where(good, step, 0.0)), z)
    return z


Turning = Callable[[Complex], Complex]  #: z p′(z)/p(z) of the polynomial p = z^count Σ c_k z^{−k}


def _of_matrix(equation: DifferenceEquation, count: int) -> Turning:
    """z p′/p = count − n + tr(P⁻¹ z P′), from P itself."""

    def turning(z: Complex) -> Complex:
        P, slope = equation.characteristic(z)
        try:
            inverse = np.linalg.inv(P)
        except np.linalg.LinAlgError:
            return np.array([turning(point * (1 + 1e-15)) for point in z[:, None]])[:, 0]
        trace = np.einsum("kij,kji->k", inverse, slope)
        return count - equation.states + trace

    return turning


def _of_terms(terms: dict[int, float]) -> Turning:
    """z p′/p from the coefficients: where a delay is cancelled, P is full of its rounding."""
    powers, values = np.array(list(terms)), np.array(list(terms.values()))
    count = powers.max()

    def turning(z: Complex) -> Complex:
        parts = values * z[:, None] ** -powers
        return np.asarray(((count - powers) * parts).sum(1) / parts.sum(1), complex)

    return turning


def _start(terms: dict[int, float]) -> Complex:
    """Circles on which two terms balance: the upper hull of log |c_k| over k, after Bini."""
    hull: list[tuple[int, float]] = []
    for k, c in sorted(terms.items()):
        here = (k, float(np.log(abs(c))))
        while len(hull) > 1 and _below(hull[-2], hull[-1], here):
            hull.pop()
        hull.append(here)
    circles = []
    for (k, low), (end, high) in pairwise(hull):
        turn = 2 * np.pi * (np.arange(end - k) / (end - k) + k / hull[-1][0]) + 0.7
        circles.append(np.exp((high - low) / (end - k) + 1j * turn))
    return np.concatenate(circles) if circles else np.zeros(0, complex)


def _below(a: tuple[int, float], b: tuple[int, float], c: tuple[int, float]) -> bool:
    return (b[1] - a[1]) * (c[0] - a[0]) <= (c[1] - a[1]) * (b[0] - a[0])


def _aberth(turning: Turning, z: Complex) -> Complex:
    """Newton's steps, each of which is kept away from where all the other zeros are."""
    active = np.arange(len(z))
    last = np.full(len(z), np.inf)
    for _ in range(MOST_ROUNDS):
        if not len(active):
            break
        others = np.empty(len(active), complex)
        for part in range(0, len(active), 500):  # at most 500 × count numbers at a time
            here = active[part : part + 500]
            distance = z[here, None] - z
            distance[np.arange(len(here)), here] = np.inf
            others[part : part + 500] = (1 / distance).sum(axis=1)
        turned = turning(z[active])
        # So far inside that 1/z^d overflows, only the last term is left, which does not turn. On a
        # zero it is infinite, and the step 0.
        turned[np.isnan(turned) & ~np.isinf(turned)] = 0.0
        step = 1 / (turned - z[active] * others)
        step[~np.isfinite(step)] = 0.0
        size = np.abs(step)
        z[active] -= z[active] * step * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
        # Below √ε a step that no longer shrinks is rounding.
        done = (size < 1e-15) | ((size < 1e-7) & (size > 0.5 * last[active]))
        last[active] = size
        active = active[~done]
    return z


def _paired(z: Complex) -> Complex:
    """The same zeros as exact conjugates; a real polynomial has no others."""
    real = np.abs(z.imag) <= 1e-11 * np.abs(z)
    upper = z[~real & (z.imag > 0)]
    pairs = np.concatenate([z[real].real, upper, upper.conj()])
    return pairs if len(pairs) == len(z) else z


def _too_many(count: int, most: int) -> LimitError:
    return LimitError(
        f"poles: the registers hold {count} samples and {most} is the limit; "
        "ask for a longer period."
    )


@dataclass(frozen=True)
class Poles(Caching):
    """The poles of a difference equation, worked out once."""

    equation: DifferenceEquation

    @cached_property
    def all(self) -> Complex:
        """All of them, see `poles`."""
        return poles(self.equation)

    def poles(self, n: int | None = None) -> Complex:
        """The first n, the largest first, or all of them.

        Errors: `InputError` for what is no whole number of 1 or more.
        """
        if n is not None and not (is_whole(n) and n >= 1):
            raise InputError(
                f"poles: n = {quoted(n)} is not usable; give a whole number of 1 or more."
            )
        return self.all[:n].copy()
