"""A channel compiled to a function of s and the parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from vsctrl.diagram.symbolic.transfer_function import Solved, singular_loop
from vsctrl.errors import InputError
from vsctrl.symbols import s

#: |log| of the numbers that are left to floats, which end at e^709: some room for products is kept
FARTHEST = 600.0

FIRST_DIGITS, MOST_DIGITS = 50, 12_800  #: decimal digits of `to_agreement`


def evaluator(diagram: Solved, source: str, target: str) -> Callable[..., Any]:
    """Compile a channel to ``f(s, *parameters)`` on NumPy arrays, common subexpressions shared."""
    num, den = diagram.gains.channel(source, target)
    gains = {g: above / below for g, (above, below) in _numeric_gains(diagram).items()}
    bottom = den.xreplace(gains)
    if bottom.is_zero:
        raise singular_loop(diagram)
    return _compiled(diagram, num.xreplace(gains) / bottom)


def pole_free_evaluator(
    diagram: Solved, source: str, target: str, modules: str = "numpy"
) -> Callable[..., Any]:
    """The same as (numerator, denominator), both finite where a block is infinite.

    N and Δ are linear in each gain g = n/d, so that multiplying both by every d leaves no division.
    It is slower than `evaluator` and serves the points where that one fails; with
    ``modules="mpmath"`` also those at which a float overflows.
    """
    gains = _numeric_gains(diagram)

    def cleared(expr: sp.Expr) -> sp.Expr:
        products = []
        for powers, factor in sp.Poly(expr, *gains).terms() if gains else [((), expr)]:
            sides = zip(powers, gains.values(), strict=True)
            products.append(factor * sp.Mul(*(n if power else d for power, (n, d) in sides)))
        return sp.Add(*products)

    sides = [cleared(side) for side in diagram.gains.channel(source, target)]
    return _compiled(diagram, sides, modules)


def _numeric_gains(diagram: Solved) -> dict[sp.Symbol, tuple[sp.Expr, sp.Expr]]:
    """(numerator, denominator) of each block gain in s and parameters, delays as exp(−τ s)."""
    gains = {}
    for letter, block in zip(diagram.gains.letters, diagram.blocks, strict=True):
        delays = {q: sp.exp(-tau * s) for q, tau in block.rational.delays.items()}
        pairs = zip(*block.rational.factors, strict=True)
        above, below = (sp.Mul(*(sp.horner(x, s) if x.has(s) else x for x in p)) for p in pairs)
        gains[letter] = above.xreplace(delays), below.xreplace(delays)
    return gains


def _compiled(diagram: Solved, expr: Any, modules: str = "numpy") -> Callable[..., Any]:
    return sp.lambdify([s, *diagram.parameters.values()], expr, modules=modules, cse=True)


def to_agreement(value: Callable[[Any], Any], where: str) -> complex:
    """value(mp), mp an mpmath context, with as many digits as it takes; infinite at a pole.

    For points where floats overflow: far left e^{−sτ} leaves their range (e^709) and may cancel to
    any number of digits, as the plant's and the model's do in a Smith predictor. So digits are
    doubled until two values agree.
    Errors: `InputError` where `MOST_DIGITS` do not settle it.
    """
    import mpmath

    digits, before = FIRST_DIGITS, None
    while digits <= MOST_DIGITS:
        with mpmath.workdps(digits):
            try:
                result = value(mpmath.mp)
            except ZeroDivisionError:  # on a pole as far as these digits tell
                result = None
            both = result is not None and before is not None
            if both and abs(before - result) <= 1e-15 * abs(result):
                return complex(result) if np.isfinite(complex(result)) else complex(np.inf)
        digits, before = 2 * digits, result
    if before is None:
        return complex(np.inf)
    raise InputError(
        f"channel: {where} lies so far out that {MOST_DIGITS} digits do not tell the value; "
        "give a point nearer to 0."
    )
