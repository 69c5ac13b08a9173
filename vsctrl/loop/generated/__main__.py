"""``python -m vsctrl.loop.generated``: ``vsctrl/loop/generated/closed_forms.py`` anew, printed."""

import sys

import sympy as sp
from sympy.printing.str import StrPrinter

from vsctrl import symbols
from vsctrl.loop import criteria  # noqa: F401 - it and what it imports hold the derivations
from vsctrl.loop.generated import DERIVATIONS
from vsctrl.loop.generated.closed_forms import FORMS

NAMES = {value: name for name, value in vars(symbols).items() if isinstance(value, sp.Symbol)}
HEAD = '''"""Closed forms, printed by ``python -m vsctrl.loop.generated``: do not edit."""

from typing import Any

from sympy import LambertW, Rational, Symbol, acos, cos, exp, pi, sin, sqrt, tan

from vsctrl.symbols import T_s, d, kappa, lam, tau, z_plane

alpha = Symbol("alpha", nonnegative=True)
u, x, zeta = (Symbol(name, positive=True) for name in ("u", "x", "zeta"))
# fmt: off
FORMS: dict[str, Any] = {
'''


class _Source(StrPrinter):
    """Expressions as Python that makes them again."""

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return NAMES.get(expr, expr.name)

    def _print_Mul(self, expr: sp.Mul) -> str:
        # A number that stands before a sum would be multiplied into it, so it comes last.
        number, rest = expr.as_coeff_Mul()
        if number == 1 or not any(f.as_base_exp()[0].is_Add for f in sp.Mul.make_args(rest)):
            return str(super()._print_Mul(expr))
        return f"{self._print(rest)}*Rational({number.p}, {number.q})"


def source() -> str:
    """The module `closed_forms`, from derivations that start without any printed form."""
    FORMS.clear()
    found = [(name, DERIVATIONS[name]()) for name in sorted(DERIVATIONS)]
    return HEAD + "".join(f'    "{name}": {_Source().doprint(f)},\n' for name, f in found) + "}\n"


if __name__ == "__main__":
    sys.stdout.write(source())
