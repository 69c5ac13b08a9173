"""The exact value of an expression at a place, and how far rounding may take a program from it.

Running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, section 3.3): each
operation rounds by at most u times its result, and carries on the errors of its operands. The sum
of n terms is bounded for every order of addition, so that programs may group as they like.
"""

from functools import cache

import mpmath
from sympy import Piecewise, sinc

UNIT = 2.0**-53
_FUNCTION = (
    4  # roundings of a library's function, whose argument is scaled: sin(π (x/π)) of np.sinc
)


def exact_and_bound(matrix, arguments, values):
    """(L, first-order bound of its rounding errors), two lists of rows, at one place."""
    place = {a: mpmath.mpf(float(v)) for a, v in zip(arguments, values, strict=True)}
    with mpmath.workdps(50):

        @cache
        def of(e):
            return _operation(e, of, place)

        found = [[of(e) for e in row] for row in matrix.tolist()]
        rows = [[float(value) for value, _ in row] for row in found]
        return rows, [[float(error * UNIT) for _, error in row] for row in found]


def _operation(e, of, place):
    """(value, error in units of u)."""
    if e.is_Symbol:
        return place[e], mpmath.mpf(0)
    if e.is_number:
        return mpmath.mpmathify(e.evalf(50)), abs(mpmath.mpmathify(e.evalf(50)))
    if isinstance(e, Piecewise):
        for branch, condition in e.args:
            if condition == True or bool(condition.subs(place)):  # noqa: E712
                return of(branch)
    parts = [of(a) for a in e.args]
    if e.is_Add:
        value, sizes = sum(v for v, _ in parts), sum(abs(v) for v, _ in parts)
        return value, sum(error for _, error in parts) + (len(parts) - 1) * sizes
    if e.is_Mul:
        value = mpmath.fprod(v for v, _ in parts)
        carried = sum(
            error * abs(mpmath.fprod(v for j, (v, _) in enumerate(parts) if j != i))
            for i, (_, error) in enumerate(parts)
        )
        return value, carried + (len(parts) - 1) * abs(value)
    if e.is_Pow:
        (base, error), power = parts[0], mpmath.mpmathify(e.exp.evalf(50))
        value = base**power
        return value, abs(power * base ** (power - 1)) * error + (abs(power) + 2) * abs(value)
    f = mpmath.sinc if isinstance(e, sinc) else getattr(mpmath, e.func.__name__)
    slope = abs(mpmath.diff(f, parts[0][0]))
    scaled = abs(parts[0][0]) * slope if isinstance(e, sinc) else 0
    return f(parts[0][0]), slope * parts[0][1] + _FUNCTION * (abs(f(parts[0][0])) + scaled)
