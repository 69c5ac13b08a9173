"""The parameters of a diagram as closed forms take them: by keyword, with κ for ℓ/ℓ̂.

What the law believes of the image Jacobian matters only in relation to what it is.
"""

from collections.abc import Callable, Mapping
from typing import Any

import sympy as sp

from vsctrl import checks as check
from vsctrl.checks import decimal
from vsctrl.diagram import Diagram
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import ell, ell_hat, h, kappa, tau, tau_hat


def calibrated(diagram: Diagram, expr: sp.Expr) -> sp.Expr:
    """An expression with κℓ̂ for ℓ, where the diagram has ℓ and ℓ̂."""
    return expr.subs(ell, kappa * ell_hat) if _has_both(diagram) else expr


def parameters(diagram: Diagram) -> dict[str, sp.Symbol]:
    """Keyword → symbol, with kappa in the place of ell where the diagram has ℓ and ℓ̂.

    Errors: `InputError` for what is no diagram.
    """
    if not isinstance(diagram, Diagram):
        raise InputError(
            f"{check.quoted(diagram)} is no diagram; give one, like loop.diagram('aligned')."
        )
    names = dict(diagram.parameters)
    if _has_both(diagram):
        names = {k: a for k, a in names.items() if a != ell} | {"kappa": kappa}
    return dict(sorted(names.items()))


def known(caller: str, diagram: Diagram, values: Mapping[str, Any]) -> dict[sp.Symbol, sp.Expr]:
    """Symbol → value, decimals exactly as they read, so that what cancels is 0.

    Errors: `InputError` for an unknown keyword, and a value that cannot be.
    """
    names = parameters(diagram)
    for name, value in values.items():
        if name not in names:
            raise InputError(
                f"{caller}: there is no value {check.quoted(name)}{nearest(name, names, value)}; "
                f"give some of {', '.join(names)}."
            )
        if not check.is_symbolic(value):
            _check(names[name])(f"{caller}: {name}", value)
    return {names[name]: exact(value) for name, value in values.items()}


def exact(value: Any) -> sp.Expr:
    """An expression as it is, a number as the decimal that it prints as."""
    return value if isinstance(value, sp.Expr) else sp.Rational(decimal("value", value))


def _check(symbol: sp.Symbol) -> Callable[[str, Any], float]:
    if symbol in (tau, tau_hat, h):
        return check.delay
    return check.positive if symbol.is_positive else check.number


def _has_both(diagram: Diagram) -> bool:
    return {ell, ell_hat} <= set(diagram.parameters.values())
