"""Error constants of an opened loop, and sensitivities of the steady error to its parameters.

The classic constants K_p, K_v and K_a give the steady error that the parameters as known lead to;
the sensitivities tell which of these have to be known well.
"""

from dataclasses import dataclass
from typing import Any

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.diagram import Diagram, Signal
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop import laurent
from vsctrl.loop.parameters import calibrated, known, parameters
from vsctrl.loop.steady import error_transfer, steady_error
from vsctrl.tables import Numbers

_WHERE = ("output", "reference", "source")


@dataclass(frozen=True)
class ErrorConstants(Numbers):
    """K_p = lim L(s), K_v = lim s L(s) and K_a = lim s² L(s) as s → 0 of a loop of a given type.

    With unit feedback a step leaves 1/(1 + K_p) of itself, a ramp 1/K_v and a parabola 1/K_a per
    unit. Units: 1, s⁻¹, s⁻².

    >>> vs.loop.error_constants(vs.figure1, "S_meas").type
    1
    """

    type: int  #: integrators in L; negative where L is 0 at s = 0
    position: sp.Expr
    velocity: sp.Expr
    acceleration: sp.Expr


@keywords
def error_constants(diagram: Diagram, signal: str, **values: float | sp.Expr) -> ErrorConstants:
    """Type and error constants of the loop opened at a signal, symbolic, with exact delay.

    L is minus the transfer function from the cut to the signal, so that 1 + L is the return
    difference. `values` as for `steady_error`. Errors: `InputError` where no loop runs through the
    signal, for an unknown signal or parameter and for values that cannot be.

    >>> vs.loop.error_constants(vs.figure1, "S_meas").velocity
    kappa*lambda
    """
    substitution = known("error_constants", diagram, values)
    opened = diagram.open(signal)
    L = calibrated(diagram, -opened.transfer(f"{signal}__cut", signal)).xreplace(substitution)
    order, (leading, *_) = laurent.laurent(L, -99)
    if leading == 0:
        raise InputError(
            f"error_constants: no loop runs through {quoted(signal)}; open a signal of the loop."
        )
    endless, leading = sp.oo * sp.sign(leading), sp.factor(leading)
    limits = (
        endless if order + k < 0 else leading if order + k == 0 else sp.S.Zero for k in (0, 1, 2)
    )
    return ErrorConstants(-order, *limits)


@keywords
def error_sensitivities(
    diagram: Diagram, signal: Signal, *, relative: bool = False, **options: Any
) -> dict[str, sp.Expr]:
    """∂E/∂p of the steady error E for each parameter p that the error's transfer function has.

    Keyword → closed form. With ``relative`` the logarithmic ones, (p/E) ∂E/∂p: by how many per cent
    E changes for one per cent of p; infinite where E is 0. `options` are those of `steady_error`;
    values are put in after the derivative is taken. Of a sine E is complex, and so are they.
    Errors: as `steady_error`, and `InputError` for an error that is infinite, or that is 0 whatever
    the parameters are where relative ones are asked for.

    >>> from vsctrl.symbols import v
    >>> sorted(vs.loop.error_sensitivities(vs.figure1, vs.Ramp(v)))
    ['k_ff', 'kappa', 'lam', 'tau']
    """
    where = {name: value for name, value in options.items() if name in _WHERE}
    rest = {name: value for name, value in options.items() if name not in _WHERE}
    substitution = known("error_sensitivities", diagram, rest)
    error = steady_error(diagram, signal, **where)
    if error.has(sp.oo, sp.zoo) or (relative and error == 0):
        raise InputError(
            f"error_sensitivities: {quoted(signal)} leaves the error {error}, which has no such "
            "sensitivity; give a signal that leaves a finite one."
        )
    present = error_transfer(diagram, **where).free_symbols
    sensitivities: dict[str, sp.Expr] = {}
    for name, symbol in parameters(diagram).items():
        if symbol in present:
            slope = sp.diff(error, symbol) * (symbol / error if relative else 1)
            sensitivities[name] = sp.factor(slope).xreplace(substitution)
    return sensitivities
