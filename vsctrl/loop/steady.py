"""Steady tracking errors of any diagram in closed form, for any test signal.

A stable loop forgets how it began. What is left of the error after a polynomial is read off the
Laurent series of its transfer function at s = 0 (final-value theorem), and after a sine or an
exponential off that function at jω or at the rate. Delays stay exact.
"""

from functools import cache
from typing import Any

import sympy as sp

from vsctrl import checks as check
from vsctrl.diagram import Diagram, Exponential, Signal, Sine
from vsctrl.diagram.description.blocks import delays_as_symbols
from vsctrl.diagram.signals.elementary import Cosine, Power
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop import laurent
from vsctrl.loop.parameters import calibrated, exact, known, parameters
from vsctrl.symbols import s, tau

Series = tuple[int, tuple[sp.Expr, ...]]
SIGNALS = "a Step, Ramp, Parabola, Sine or Exponential"
_RATIO = "give what steady_error finds for a Sine"


@keywords
def steady_error(
    diagram: Diagram,
    signal: Signal,
    *,
    output: str | None = None,
    reference: str | None = None,
    source: str | None = None,
    **values: float | sp.Expr,
) -> sp.Expr:
    """The steady value of output − reference in closed form; negative is behind.

    With E(s) its transfer function from the input,

    - `Step`, `Ramp`, `Parabola`: lim s E(s) U(s) as s → 0, infinite with its sign where the error
      grows without end; a `Piecewise` where that depends on symbols, so that numbers put in later
      find their case;
    - `Sine` (and `Cosine`): the complex amplitude A E(jω); `amplitude_and_phase` takes it apart;
    - `Exponential` A e^{at}: A E(a), the factor of e^{at} that is left; the loop's own poles must
      be left of a.

    It holds where the loop is stable, which is not looked at here (`system.poles` does).
    `output` is the diagram's first output; `reference` a signal, S_star where there is one, else
    the first input; `source` the input that takes the signal (the first), which may be a
    disturbance: the other inputs are 0. `values` (SI, by the parameters' keywords) are put in, all
    at once (``lam=tau, tau=lam`` swaps them) and decimals exactly as they read; with ell and
    ell_hat in the diagram κ = ℓ/ℓ̂ stands for ell.
    Errors: `InputError` for a signal without a steady error, an unknown name, a value that cannot
    be, and a rate or a frequency that is a pole.

    >>> from vsctrl.symbols import v
    >>> vs.loop.steady_error(vs.figure1, vs.Ramp(v), kappa=1, k_ff=1)
    tau*v
    """
    transfer, series = _error(diagram, output, reference, source)
    substitution = known("steady_error", diagram, values)
    if isinstance(signal, Power):
        return _limit(transfer, series, substitution, signal.order, exact(signal.values[0]))
    if isinstance(signal, Sine | Cosine):
        return _at(transfer, substitution, sp.I * exact(signal.omega), exact(signal.amplitude))
    if isinstance(signal, Exponential):
        return _at(transfer, substitution, exact(signal.rate), exact(signal.amplitude))
    raise InputError(f"steady_error: {check.quoted(signal)} has no steady error; give {SIGNALS}.")


@keywords
def error_transfer(
    diagram: Diagram,
    output: str | None = None,
    reference: str | None = None,
    source: str | None = None,
) -> sp.Expr:
    """(output − reference)/source as a function of s, with κ for ℓ/ℓ̂, delays exact.

    Arguments as for `steady_error`. Errors: `InputError` for an unknown signal.

    >>> vs.loop.error_transfer(vs.loop.diagram("aligned"))
    s*(k_ff*kappa - 1)/(kappa*lambda*exp(-s*tau) + s)
    """
    return _error(diagram, output, reference, source)[0]


@keywords
def amplitude_and_phase(ratio: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """A complex amplitude, of real parameters, as (its absolute value, its argument in rad).

    The error to A sin ωt is then |E| sin(ωt + φ), with φ in (−π, π], and 0 where the amplitude is
    0. Errors: `InputError` for what is no finite expression.

    >>> from sympy import I
    >>> vs.loop.amplitude_and_phase(1 + I)
    (sqrt(2), pi/4)
    """
    if not isinstance(ratio, sp.Expr | int | float | complex) or isinstance(ratio, bool):
        raise InputError(f"amplitude_and_phase: {check.quoted(ratio)} is no expression; {_RATIO}.")
    ratio = sp.sympify(ratio, strict=True)
    if ratio.has(sp.nan, sp.zoo, sp.oo):
        raise InputError(f"amplitude_and_phase: {ratio} is not finite; {_RATIO}.")
    if ratio.equals(0):
        return sp.S.Zero, sp.S.Zero
    real = {a: sp.Dummy(a.name, real=True) for a in ratio.free_symbols if not a.is_real}
    sides = [sp.expand(part.xreplace(real), complex=True) for part in sp.fraction(ratio)]
    num, den = ([sp.re(side), sp.im(side)] for side in sides)
    size = sp.sqrt(_square(num) / _square(den))
    along = num[0] * den[0] + num[1] * den[1]
    ahead = num[1] * den[0] - num[0] * den[1]
    phase = sp.atan2(*(sp.trigsimp(sp.expand(part)) for part in (ahead, along)))
    back = {dummy: symbol for symbol, dummy in real.items()}
    return size.xreplace(back), phase.xreplace(back)


# Transfer functions ----------------------------------------------------------------------------
def _error(
    diagram: Diagram, output: str | None, reference: str | None, source: str | None
) -> tuple[sp.Expr, Series]:
    parameters(diagram)  # refuses what is no diagram
    reference = "S_star" if reference is None and "S_star" in diagram.signals else reference
    output = _first("output", diagram.outputs) if output is None else output
    reference = _first("reference", diagram.inputs) if reference is None else reference
    source = _first("source", diagram.inputs) if source is None else source
    for name in (output, reference):
        diagram.require(name)
    return _derived(diagram, output, reference, source)


def _first(argument: str, names: tuple[str, ...]) -> str:
    if not names:
        kind = "output" if argument == "output" else "input"
        raise InputError(
            f'steady_error: the diagram has no {kind} to take; name a signal, as in {argument}="y".'
        )
    return names[0]


@cache
def _derived(diagram: Diagram, output: str, reference: str, source: str) -> tuple[sp.Expr, Series]:
    """The error transfer function in lowest terms, and its series at s = 0 up to s²."""
    error = diagram.transfer(source, output) - diagram.transfer(source, reference)
    plain, delays = delays_as_symbols(calibrated(diagram, error), "transfer")
    num, den = sp.fraction(sp.cancel(sp.together(plain)))
    exponentials = {q: sp.exp(-delay * s) for q, delay in delays.items()}
    # SymPy merges products of exponentials, and two spellings of one delay are one function.
    transfer = sp.collect(num, s).xreplace(exponentials) / den.xreplace(exponentials)
    first, coefficients = laurent.laurent(transfer, 2)
    return transfer, (first, tuple(_latency_apart(c) for c in coefficients))


# Values ----------------------------------------------------------------------------------------
def _limit(
    transfer: sp.Expr, series: Series, values: dict[Any, Any], order: int, size: Any
) -> sp.Expr:
    """Σ c_k sᵏ times size/s^{order + 1}: the first c_k that is not 0 decides up to k = order."""

    def constants(series: Series) -> list[sp.Expr]:
        powers = range(min(series[0], 0), order + 1)
        return [laurent.coefficient(series, k).xreplace(values) for k in powers]

    coefficients = constants(series)
    if any(c.has(sp.nan, sp.zoo) for c in coefficients):  # these values change the poles at s = 0
        coefficients = constants(laurent.laurent(transfer.xreplace(values), order))
    cases: list[tuple[sp.Expr, Any]] = []
    for below in coefficients[:-1]:
        if sp.simplify(below) == 0:
            continue
        # A lower constant makes the error grow without end, unless the symbols make it 0.
        endless, above = sp.oo * sp.sign(below * size), sp.fraction(sp.together(below))[0]
        if above.is_number or above.is_nonzero:
            return sp.Piecewise(*cases, (endless, True))
        cases.append((endless, sp.Ne(above, 0)))
    return sp.Piecewise(*cases, (coefficients[-1] * size, True))


def _at(transfer: sp.Expr, values: dict[Any, Any], point: sp.Expr, size: sp.Expr) -> sp.Expr:
    ratio = transfer.xreplace({**values, s: point})
    if ratio.has(sp.zoo, sp.nan, sp.oo):
        raise InputError(
            f"steady_error: s = {point} is a pole of the loop, so the error never settles; give "
            "another rate or frequency."
        )
    return ratio * size


def _latency_apart(error: sp.Expr) -> sp.Expr:
    """τ-terms in front and the rest as one fraction, as a reader would write it."""
    if not error.is_polynomial(tau) or sp.degree(error, tau) != 1:
        return sp.factor(error)
    latency = error.coeff(tau) * tau
    return latency + sp.factor(error - latency)


def _square(pair: list[sp.Expr]) -> sp.Expr:
    return sp.trigsimp(sp.expand(pair[0] ** 2 + pair[1] ** 2))
