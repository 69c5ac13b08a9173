"""Padé approximants of a delay in balanced state space, put into the delay channels.

    e^{−x} ≈ N(x)/D(x),   N = Σⱼ cⱼ(m) (−x)ʲ,  D = Σⱼ cⱼ(n) xʲ,
    cⱼ(p) = (m + n − j)! p! / ((m + n)! j! (p − j)!),   deg N = m ≤ n = deg D

Baker and Graves-Morris, Padé Approximants, Cambridge University Press 1996, section 1.2. Of equal
degrees the model is an all-pass; with m = n − 1 it has no direct term, with m < n − 2 it may be
unstable (Wanner, Hairer and Nørsett 1978).
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import zip_longest
from math import factorial

import numpy as np
from scipy.linalg import block_diag, matrix_balance

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.graphs import components
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.errors import InputError

Degrees = tuple[int, int]  #: of numerator and denominator
SINGULAR = 1e12  #: condition of a loop that has no solution but for rounding


class SingularLoopError(InputError):
    """A loop of delays that has no solution with Padé models of some degrees in it."""


Polynomial = list[Fraction]  #: coefficients from the lowest power up


def pade_delay(tau: float, degrees: Degrees) -> tuple[Array, Array, Array, Array]:
    """(A, B, C, D) of the Padé model of e^{−τs} of these degrees. `tau` in s, > 0.

    Errors: `InputError` for degrees whose model is unstable.
    """
    A, B, C, D = _unit_delay(*degrees)
    return A / tau, B / tau, C, D


@cache
def _unit_delay(m: int, n: int) -> tuple[Array, Array, Array, Array]:
    return _all_pass(n) if m == n else _of_unequal_degrees(m, n)


def _all_pass(n: int) -> tuple[Array, Array, Array, Array]:
    """With J skew, J[k, k+1] = 1/√((2k−1)(2k+1)) for k = 1, 2, …, and M = J + e₁e₁ᵀ:

    A = −2 M⁻¹, B = 2 M⁻¹e₁, C = 2e₁ᵀM⁻¹, D = (−1)ⁿ.
    """
    k = np.arange(1, n)
    above = 1 / np.sqrt((2.0 * k - 1) * (2.0 * k + 1))
    M = np.diag(above, 1) - np.diag(above, -1)
    M[0, 0] = 1.0
    e1 = np.eye(n)[:, :1]
    inverse = np.asarray(np.linalg.inv(M), float)
    return -2 * inverse, 2 * inverse @ e1, 2 * e1.T @ inverse, np.array([[(-1.0) ** n]])


def _of_unequal_degrees(m: int, n: int) -> tuple[Array, Array, Array, Array]:
    """In Schwarz's form, whose states are polynomials orthogonal on the axis, found in fractions.

    p₀ = 1, p₁ = x, pₖ = x pₖ₋₁ + bₖ pₖ₋₂ and D = pₙ + d pₙ₋₁, every bₖ > 0 and d > 0 if and only
    if D is stable. The states are pₖ₋₁ √(bₖ₊₁ … bₙ)/D, and N is a sum of these.
    """
    num = [(-1) ** j * c for j, c in enumerate(_coefficients(m, n, m))]
    den = _coefficients(m, n, n)
    num, den = ([c / den[-1] for c in side] for side in (num, den))
    damping = den[-2]
    upper = [c if (n - k) % 2 == 0 else Fraction(0) for k, c in enumerate(den)]
    lower = [c / damping if (n - k) % 2 else Fraction(0) for k, c in enumerate(den[:-1])]
    family, b = [lower, upper], []
    for k in range(n, 1, -1):
        rest = [a - c for a, c in zip_longest(family[1], [Fraction(0), *family[0]])][: k - 1]
        b.append(rest[-1])
        if rest[-1] <= 0:
            raise InputError(
                f"pade: order = ({m}, {n}) is not usable: its poles are not all stable; give a "
                f"numerator of degree {n - 2} to {n}."
            )
        family = [[c / rest[-1] for c in rest], *family]
    b.reverse()  # b₂ … bₙ
    root = np.sqrt(np.array(b, float))
    A = np.diag(root, 1) - np.diag(root, -1)
    A[-1, -1] = -float(damping)
    share = [Fraction(0)] * n
    for k in range(m, -1, -1):
        share[k] = num[k]
        num = [c - num[k] * p for c, p in zip(num[:k], family[k], strict=False)]
    size = np.append(np.cumprod(root[::-1])[::-1], 1.0)
    # A power of 2 keeps input and output alike in size.
    C = np.array(share, float) / size
    level = 2.0 ** np.round(np.log2(np.linalg.norm(C)) / 2)
    return A, level * np.eye(n)[:, -1:], C[None, :] / level, np.zeros((1, 1))


def _coefficients(m: int, n: int, p: int) -> Polynomial:
    """c₀(p) … c_p(p)."""
    whole = factorial(m + n)
    return [
        Fraction(factorial(m + n - j) * factorial(p), whole * factorial(j) * factorial(p - j))
        for j in range(p + 1)
    ]


def matrices(system: DelaySystem, degrees: Degrees) -> tuple[Array, Array, Array, Array]:
    """(A, B, C, D) of the delay system with each delay a Padé model, loops closed.

    Errors: `InputError` where what a loop lets through at once is 1 with the models in it.
    """
    r, p = system.inputs, system.outputs
    A, B, C, D = system.A, system.B[:, :r], system.C[:p], system.D[:p, :r]
    if not system.delays:
        return A, B, C, D
    parts = [pade_delay(float(tau), degrees) for tau in system.delays]
    Ad, Bd, Cd, Dd = (block_diag(*each) for each in zip(*parts, strict=True))
    Bw, Cz, Dzw = system.inner
    Dyw, Dzu = system.D[:p, r:], system.D[p:, :r]
    # w = Cd ξ + Dd z and z = Cz x + Dzu u + Dzw w, solved for z.
    through = Dzw @ Dd
    if _is_singular(through):
        m, n = degrees
        remedy = f"give {n + 1}, or ({n - 1}, {n})" if n > 1 else "give 2"
        raise SingularLoopError(
            f"pade: with models of order {n if m == n else degrees}, which let high frequencies "
            f"through with {'−' if n % 2 else ''}1, a loop becomes algebraic and singular; "
            f"{remedy} for their order."
        )
    K = np.linalg.inv(np.eye(len(through)) - through)
    zx, zxi, zu = K @ Cz, K @ Dzw @ Cd, K @ Dzu
    wx, wxi, wu = Dd @ zx, Cd + Dd @ zxi, Dd @ zu
    A = np.block([[A + Bw @ wx, Bw @ wxi], [Bd @ zx, Ad + Bd @ zxi]])
    C = np.hstack([C + Dyw @ wx, Dyw @ wxi])
    return A, np.vstack([B + Bw @ wu, Bd @ zu]), C, D + Dyw @ wu


def _is_singular(through: Array) -> bool:
    """Whether 1 minus this has no inverse, loop by loop and whatever the units of signals are."""
    loop = components(through)
    blocks = (through[np.ix_(loop == k, loop == k)] for k in range(loop.max(initial=-1) + 1))
    return any(
        np.linalg.cond(np.eye(len(block)) - matrix_balance(block)[0]) > SINGULAR for block in blocks
    )
