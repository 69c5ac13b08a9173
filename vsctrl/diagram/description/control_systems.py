"""Systems of python-control as formulas, their floats as the decimals that they print.

python-control is not imported here: only one who has made a system of it can hand one over.
"""

from __future__ import annotations

import sys
from typing import Any

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from vsctrl.checks import decimal, quoted
from vsctrl.errors import InputError
from vsctrl.symbols import s


def expression(value: Any, name: str) -> Any:
    """The transfer function of a python-control system as a formula; all else as it is.

    Errors: `InputError` for a system with several inputs or outputs, in discrete time, or that is
    known by its frequency response only.
    """
    control = sys.modules.get("control")
    if control is None or not isinstance(value, control.InputOutputSystem):
        return value
    if not isinstance(value, control.TransferFunction | control.StateSpace):
        raise InputError(
            f"Block {quoted(name)}: a {type(value).__name__} is no transfer function; "
            "give a TransferFunction or a StateSpace."
        )
    if value.ninputs != 1 or value.noutputs != 1:
        raise InputError(
            f"Block {quoted(name)}: the system has {value.ninputs} inputs and {value.noutputs} "
            "outputs, "
            "and a block has one of each; wire its equations from integrators and gains, which "
            "share its states. Blocks for its channels, like system[0, 1], hold a copy of all "
            "states each, and copies of an unstable one part, whatever is fed back."
        )
    if value.dt:
        raise InputError(
            f"Block {quoted(name)}: the system is in discrete time, dt = {value.dt}; give one in "
            "continuous time and sample the diagram with at(…).sampled(…)."
        )
    if isinstance(value, control.StateSpace):
        return _from_states(value, name)
    sides = ([_exact(c, name) for c in side[0][0]] for side in (value.num, value.den))
    num, den = (sp.Poly(coefficients, s).as_expr() for coefficients in sides)
    return num / den


def _from_states(system: Any, name: str) -> sp.Expr:
    """D + C adj(sI − A) B/det(sI − A) in rationals, as det(sI − A + BC) − det(sI − A) has it."""
    A, B, C, D = (
        sp.Matrix(*matrix.shape, [_exact(x, name) for x in matrix.ravel()])
        for matrix in (system.A, system.B, system.C, system.D)
    )
    if not len(A):
        return D[0, 0]
    below, closed = (
        sp.Poly(DomainMatrix.from_Matrix(M).to_field().charpoly(), s).as_expr()
        for M in (A, A - B * C)
    )
    return D[0, 0] + (closed - below) / below


def _exact(value: float, name: str) -> sp.Rational:
    return sp.Rational(decimal(f"Block {quoted(name)}", value))
