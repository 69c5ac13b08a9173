"""Functions of the moments of a point set, by the image of one of its points.

The module exists because a simulator's points need not lie in a plane: ``moments`` writes L in the
plane of the object, while the gradient by each point, times L of that point, sums to the L of any
set of points.
"""

from functools import cache

from sympy import Expr, ImmutableMatrix, S, Symbol, sqrt, symbols

from vsctrl.derive.camera import PIXELS
from vsctrl.derive.features.curves import x_g, y_g
from vsctrl.derive.features.moments import Moments, Orientation, a, m, mu

u, v = symbols("u v", real=True)  #: point from the centre of gravity, (X − x_g, Y − y_g)

_n = m(0, 0)  # number of points
_a = mu(2, 0) + mu(0, 2)
_ORDERS = [(order - j, j) for order in (2, 3) for j in range(order + 1)]

#: What a function of moments up to the third order is written in.
PARAMETERS: tuple[Symbol, ...] = (x_g, y_g, *(mu(i, j) for i, j in _ORDERS))


@cache
def six_moments() -> Moments:
    """Six functions of the moments of a point set, one for each degree of freedom.

    s = (x_g/√a, y_g/√a, 1/√a, (μ_30 + μ_12)/a^(3/2), (μ_21 + μ_03)/a^(3/2), α) with
    a = μ_20 + μ_02. The first three are ``NormalisedMoments`` with Z* √a* = 1; the next two are the
    skewness as a vector, which turns with the image and does not feel its shift or scale; α is
    ``Orientation``. Singular at a = 0, and in α as ``Orientation``.
    Source: Tahri and Chaumette, IEEE Trans. Robotics 21 (2005) 1116-1127, for the first three and
    α, and for invariants of third moments, of which these are the simplest.
    """
    skewness = ((mu(3, 0) + mu(1, 2)) / sqrt(a) ** 3, (mu(2, 1) + mu(0, 3)) / sqrt(a) ** 3)
    (alpha,) = Orientation(dense=False, camera=PIXELS).expressions
    s = (x_g / sqrt(a), y_g / sqrt(a), 1 / sqrt(a), *skewness, alpha)
    return Moments("moments", s, dense=False, camera=PIXELS)


def values(moments: Moments) -> ImmutableMatrix:
    """s, k×1, in ``PARAMETERS``."""
    return ImmutableMatrix(moments.expressions).xreplace({a: _a})


def gradient(moments: Moments) -> ImmutableMatrix:
    """∂s/∂(X, Y) of one point of the set, k×2, in ``ARGUMENTS``.

    ∂x_g/∂X = 1/m_00 and ∂μ_ij/∂X = i (u^(i−1) v^j − μ_(i−1)j/m_00) with m_00 points, of which this
    one is (u, v) away from the centre; the second term is there because the centre moves along.
    """
    return values(moments).jacobian(PARAMETERS) * ImmutableMatrix(
        [[1 / _n, 0], [0, 1 / _n], *([_by_X(i, j), _by_Y(i, j)] for i, j in _ORDERS)]
    )


#: What the gradient is written in.
ARGUMENTS: tuple[Symbol, ...] = (u, v, *PARAMETERS, _n)


def _by_X(i: int, j: int) -> Expr:
    return S.Zero if i == 0 else i * (_power(i - 1, j) - _mean(i - 1, j))


def _by_Y(i: int, j: int) -> Expr:
    return S.Zero if j == 0 else j * (_power(i, j - 1) - _mean(i, j - 1))


def _power(i: int, j: int) -> Expr:
    return u**i * v**j


def _mean(i: int, j: int) -> Expr:
    """μ_ij/m_00, where μ_10 = μ_01 = 0."""
    return S.Zero if i + j == 1 else mu(i, j) / _n
