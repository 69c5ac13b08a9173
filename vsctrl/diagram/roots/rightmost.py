"""Characteristic roots of a delay system: the rightmost ones, polished, none split from its pair.

`candidates` says where roots may be, `newton` goes there, `multiplicity` tells them apart.
"""

from __future__ import annotations

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.checks import is_whole
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.candidates import candidates
from vsctrl.diagram.roots.multiplicity import distinct
from vsctrl.diagram.roots.newton import polished
from vsctrl.diagram.roots.visible import as_poles
from vsctrl.errors import InputError, LimitError


def rightmost(system: DelaySystem, n: int) -> Complex:
    """The n rightmost roots of det characteristic(s) = 0, by falling real part, with multiplicity.

    One more is given where the nth would be split from its conjugate; fewer where the system has
    no more. Simple roots are right to about 1e-12 relative; of m roots in one place each is known
    to ε^{1/m} only, whatever the method (1e-8 for a double root, 2e-3 for a sixfold one), as
    rounding the coefficients by ε parts them so far; their mean is better, and stands for all.
    """
    _check_number(n)
    system = delays_in_loops(system)
    if not system.delays:
        found = distinct(system, *polished(system, np.linalg.eigvals(system.A).astype(complex)))
        return _first(found, n)
    # With the longest delay as the unit of time nothing depends on the user's units.
    unit = float(max(system.delays))
    system = system.scaled(unit)
    roots = np.zeros(0, complex)
    for nodes in (20 + 3 * n, 40 + 6 * n, 80 + 12 * n):
        starts = _ordered(candidates(system, nodes))[: 4 * n + 12 + 2 * len(system.A)]
        roots = distinct(system, *polished(system, starts))
        if len(roots) >= n or len(system.A) == 0:
            break
    return _first(roots, n) / unit


def _check_number(n: object) -> None:
    if not is_whole(n) or n < 0:
        raise InputError(f"poles: n = {n!r} is not usable; give a whole number of 0 or more.")


MOST_HIDDEN = 20  #: roots in a row, more than thrice as many as asked for, that cancel


def poles(system: DelaySystem, n: int) -> Complex:
    """The n rightmost poles of a one-input, one-output system: those roots that its response shows.

    A root that cancels against a zero, as the plant's own in a perfect Smith predictor, leaves no
    residue, see `visible`. Accuracy: see `rightmost`; a pole of order m is known to ε^{1/m}.
    Errors: `LimitError` for more than can be worked out.
    """
    check_roots(system, n)
    _check_number(n)
    hidden = 0
    while True:
        roots = rightmost(system, n + hidden)
        shown = as_poles(system, roots)
        missing = min(n, len(roots)) - len(shown)
        # Of a channel that is 0 for all s every root is hidden, and there is no end of them.
        if missing <= 0 or len(roots) < n + hidden or hidden > 3 * n + MOST_HIDDEN:
            return _first(shown, n)
        hidden += missing


def _ordered(roots: Complex) -> Complex:
    return roots[np.lexsort((roots.imag, np.abs(roots.imag).round(9), -roots.real.round(9)))]


def _first(roots: Complex, n: int) -> Complex:
    roots = _ordered(roots)
    if 0 < n < len(roots) and roots[n - 1].imag < 0:
        pair = np.abs(roots[n] - roots[n - 1].conj()) < 1e-6 * (1 + np.abs(roots[n]))
        n += int(pair)
    return roots[:n]


#: delays times roots beyond which their matrix, of 12 times that, takes minutes and gigabytes
MOST_ROOTS = 2000


def check_roots(system: DelaySystem, n: object) -> None:
    """Refuse a number of roots whose discretised matrix would not fit the machine.

    What is no number of roots is left to `rightmost`. Errors: `LimitError`.
    """
    count = len(delays_in_loops(system).delays)
    if is_whole(n) and count and n * count > MOST_ROOTS:
        many = f"{n}" if n < 10**9 else "more than 10⁹"
        raise LimitError(
            f"poles: n = {many} roots of a loop with {count} delay{'s' if count > 1 else ''} are "
            f"too many to work out; ask for {MOST_ROOTS // count} or fewer."
        )
