"""The bridge to python-control: every delay channel replaced by a Padé model of one order.

Each delay gets a balanced state-space Padé model of its own, put into its channel before the loop
is closed: that stays well conditioned at orders where polynomials have long lost their digits, and
needs as many states as there are, where L/(1 + L) on transfer functions doubles them. The order is
given, or it is the smallest that keeps to a tolerance: on the response, or on a loop's margins.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from vsctrl.checks import is_whole, quoted
from vsctrl.diagram.frequency.margins import Margins, margins
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.pade.approximant import Degrees, SingularLoopError, matrices, pade_delay
from vsctrl.diagram.pade.band import Band, checked_band
from vsctrl.errors import InputError, LimitError

if TYPE_CHECKING:
    from vsctrl.diagram.pade.model import PadeModel

Judgement = tuple[float, str]  #: (relative error, of what)

MOST = 40  #: the highest order


def model(channel: NumericChannel, order: object, tol: object, band: object) -> PadeModel:
    """The model of a channel of a given order, or of the smallest that keeps to `tol` over `band`.

    Errors: `InputError` for neither or both of `order` and `tol`, for one that is not usable, for
    a band that is none, and for a tolerance that no order up to 40 reaches.
    """
    _check_one_is_given(order, tol)
    limits = checked_band(channel, band)
    if tol is None:
        return _of_order(channel, _checked_order(order), limits)
    bound = _checked_tolerance(tol)
    if not channel.realisation.delays:
        return _of_order(channel, (1, 1), limits)

    def judge(candidate: PadeModel) -> Judgement:
        # A few frequencies are enough to see that most orders fail.
        error = candidate.roughly_worst()
        return (candidate.worst()[1] if error <= bound else error), "response"

    smallest, best, *_ = _smallest(channel, bound, limits, judge)
    if smallest is not None:
        return smallest
    omega, least = _of_order(channel, (best, best), limits).worst()
    raise InputError(
        f"pade: tol = {bound:g} is reached by no order up to {MOST} from {limits[0]:g} to "
        f"{limits[1]:g} rad/s; the best is order {best}, off by {least:.2g} at {omega:.4g} rad/s. "
        "Allow more, or give a band that ends lower."
    )


def model_for(
    loop: NumericChannel, exact: Callable[[], Margins], order: object, tol: object, band: object
) -> PadeModel:
    """The model of L of the smallest order whose margins and stability are those of the exact loop.

    Gain, phase and delay margin and peak sensitivity agree to `tol` relative to the exact values,
    and the model's loop is stable if and only if the exact one is, whose margins `exact` gives.
    Errors: `InputError` as for `model`, and for a band or an order.
    """
    _check_one_is_given(order, tol)
    if order is not None:
        raise InputError("pade: on='margins' looks for an order; give it a tol and no order.")
    if band is not None:
        raise InputError("pade: margins look at all frequencies; leave out band or on='margins'.")
    bound, limits = _checked_tolerance(tol), checked_band(loop, None)
    if not loop.realisation.delays:
        return _of_order(loop, (1, 1), limits)
    smallest, best, least, worst = _smallest(loop, bound, limits, partial(_disagreement, exact()))
    if smallest is not None:
        return smallest
    raise InputError(
        f"pade: tol = {bound:g} is reached on the margins by no order up to {MOST}; the best is "
        f"order {best}, whose {worst} is off by {least:.2g} of the exact loop's. Allow more."
    )


def _smallest(
    channel: NumericChannel, bound: float, band: Band, judge: Callable[[PadeModel], Judgement]
) -> tuple[PadeModel | None, int, float, str]:
    """The model of the smallest order whose error, as judged, keeps to a bound, if there is one.

    After it the order of least error, that error, and of what it is.
    """
    best, least, worst = 0, math.inf, ""
    for n in range(1, MOST + 1):
        try:
            candidate = _of_order(channel, (n, n), band)
        except SingularLoopError:
            continue
        error, which = judge(candidate)
        if error <= bound:
            return candidate, n, error, which
        if error < least or not best:
            best, least, worst = n, error, which
    if not best:
        raise InputError(
            "pade: with models of equal degrees, of any order, a loop becomes algebraic and "
            "singular; give order=(3, 4), the degrees of numerator and denominator."
        )
    return None, best, least, worst


def model_margins(model: PadeModel) -> Margins:
    """The margins of a model of L, read as the exact ones are but from the rational function."""
    system = model.exact.realisation
    rates = [np.abs(np.linalg.eigvals(system.A)), 1 / system.tau]
    rates += [np.abs(np.linalg.eigvals(pade_delay(tau, model.degrees)[0])) for tau in system.tau]
    closed = model.A - model.B @ model.C / (1 + model.D[0, 0])
    unstable = int((np.linalg.eigvals(closed).real > -1e-12).sum())
    return margins(model.values, np.concatenate(rates), 0.0, unstable)


def _disagreement(exact: Margins, model: PadeModel) -> Judgement:
    """The largest relative difference of the margins, and of which; infinite where L differs."""
    if model.D[0, 0] == -1:
        return math.inf, "algebraic loop"
    try:
        own = model_margins(model)
    except LimitError:
        return math.inf, "response"
    if own.stable != exact.stable:
        return math.inf, "stability"
    mine, theirs = _compared(own), _compared(exact)
    return max((_relative(mine[name], theirs[name]), name) for name in theirs)


def _compared(loop: Margins) -> dict[str, float]:
    """What a stable loop keeps; of an unstable one, of the two gain margins the nearer to 1."""
    above, below = loop.gain, loop.gain_down
    nearer = above if above * below <= 1 else below
    gains = {"gain margin": above, "lower gain margin": below}
    return (gains if loop.stable else {"gain margin": nearer}) | {
        "phase margin": loop.phase,
        "delay margin": loop.delay,
        "peak sensitivity": loop.peak_sensitivity,
    }


def _relative(value: float, exact: float) -> float:
    if value == exact:
        return 0.0
    if not (math.isfinite(value) and math.isfinite(exact) and exact):
        return math.inf
    return abs(value / exact - 1)


def _of_order(channel: NumericChannel, degrees: Degrees, band: Band) -> PadeModel:
    from vsctrl.diagram.pade.model import PadeModel

    A, B, C, D = matrices(channel.realisation, degrees)
    signed = A, B, channel.sign * C, channel.sign * D
    ends = {"inputs": [channel.source], "outputs": [channel.target]}
    return PadeModel(signed, channel, degrees, band, **ends)


def _check_one_is_given(order: object, tol: object) -> None:
    if (order is None) == (tol is None):
        raise InputError(
            f"pade: order = {quoted(order)} and tol = {quoted(tol)}; give one of the two, an "
            "order from "
            f"1 to {MOST} or a relative error as tol=1e-6."
        )


def _checked_order(order: object) -> Degrees:
    """The degrees of numerator and denominator, equal where one number is given."""
    pair = (order, order) if is_whole(order) else order
    if isinstance(pair, tuple | list) and len(pair) == 2:
        m, n = pair
        if is_whole(m) and is_whole(n) and 0 <= m <= n and 1 <= n <= MOST:
            return int(m), int(n)
    raise InputError(
        f"pade: order = {quoted(order)} is not usable; give a whole number 1 to {MOST}, or two as "
        "(3, 4), the degree of the numerator, at most that of the denominator, and of the latter."
    )


def _checked_tolerance(tol: object) -> float:
    if isinstance(tol, bool) or not isinstance(tol, Real) or not 0 < float(tol) < 1:
        raise InputError(
            f"pade: tol = {quoted(tol)} is no relative error; give a number between 0 and 1, as "
            "1e-6."
        )
    return float(tol)
