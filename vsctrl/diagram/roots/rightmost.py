"""Characteristic roots of a delay system: the rightmost ones, polished, none split from its pair.

`candidates` says where roots may be, `newton` goes there, `multiplicity` tells them apart.
"""

from __future__ import annotations

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.checks import is_whole, quoted
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.box import search_right_of
from vsctrl.diagram.roots.candidates import candidates
from vsctrl.diagram.roots.half_plane import count_without_roots
from vsctrl.diagram.roots.multiplicity import distinct
from vsctrl.diagram.roots.neutral import DifferenceOperator
from vsctrl.diagram.roots.newton import polished
from vsctrl.diagram.roots.order import first, ordered
from vsctrl.diagram.roots.visible import as_poles
from vsctrl.errors import InputError, LimitError


def rightmost(system: DelaySystem, n: int) -> Complex:
    """The n rightmost roots of det characteristic(s) = 0, by falling real part, with multiplicity.

    One more is given where the nth would be split from its conjugate; fewer where the system has
    no more. A neutral loop has chains of infinitely many roots that tend to a line, often without a
    rightmost one: of those the list holds what lies right of the line
    (`neutral.DifferenceOperator.spectral_abscissa`), then the slowest that is about as far right as
    any, then low frequencies first.

    Simple roots are right to about 1e-12 relative. Of m roots in one place each is known to ε^{1/m}
    only, whatever the method (1e-8 for a double root, 2e-3 for a sixfold one), as rounding the
    coefficients by ε parts them so far; their mean is better, and stands for all.
    """
    _check_number(n)
    return first(_found(system, n), n)


def _found(system: DelaySystem, n: int) -> Complex:
    """The n rightmost roots (rad/s) and what else was found, in order."""
    system = delays_in_loops(system)
    if not system.delays:
        roots = distinct(system, *polished(system, candidates(system, 0)))
        # There are as many as states: of a root so often multiple that none is told, eigenvalues.
        whole = len(roots) == len(system.A)
        return ordered(roots if whole else np.linalg.eigvals(system.A).astype(complex))
    # With the longest delay as the unit of time nothing depends on the user's units.
    unit = float(max(system.delays))
    system = system.scaled(unit)
    operator = DifferenceOperator.of(system)
    roots = np.zeros(0, complex)
    ends, steps = np.zeros(0, complex), np.zeros(0)
    for nodes in (20 + 3 * n, 40 + 6 * n, 80 + 12 * n):
        starts = candidates(system, nodes, not operator.is_identity)
        if operator.is_identity:
            starts = starts[np.argsort(-starts.real)][: 4 * n + 24 + 2 * len(system.A)]
        else:
            far = operator.zeros_near(operator.spectral_abscissa())
            starts = np.concatenate([starts, far[far.imag >= 0]])
        more, last = polished(system, starts)
        ends, steps = np.concatenate([ends, more]), np.concatenate([steps, last])
        roots = distinct(system, ends, steps)
        if not operator.is_identity:
            roots = _beside_chains(operator, roots, n)
        missing = _missing_right_of(system, operator, roots, n)
        if (len(roots) >= n and missing is None) or len(system.A) == 0:
            break
    else:
        if missing is not None:
            more = search_right_of(system, operator, missing, roots[roots.real > missing])
            roots = np.concatenate([more, roots[roots.real <= missing]])
    return ordered(roots) / unit


MOST_LOOKED_AT = 4_000  #: points along a line by which a list is checked
APART = 1e-3  #: relative, of two roots between which a line is drawn


def _missing_right_of(
    system: DelaySystem, operator: DifferenceOperator, roots: Complex, n: int
) -> float | None:
    """A line right of which there are not as many roots as listed; None where none shows.

    It is drawn behind the nth root or, where others are near it, at the next wide gap right of it;
    of a neutral loop right of its chains. The count is that of the argument principle, which is
    given up where the line is long beside 1/delay.
    """
    real = ordered(roots).real
    last = operator.spectral_abscissa() + NEAR
    real = np.append(real[real > last], max(last, real.min(initial=last) - 1.0))
    if not np.isfinite(real[-1]):
        real = real[:-1]
    gaps = real[:-1] - real[1:]
    wide = np.flatnonzero(gaps > APART * (np.abs(real[1:]) + APART))
    for k in wide[wide < n + 1][::-1][:1]:
        line = float(real[k] - 0.5 * gaps[k])
        count = count_without_roots(system, operator, line, MOST_LOOKED_AT)
        if count is not None and count > k + 1:
            return line
    return None


NEAR = 0.02  #: over the longest delay: roots this near to the rightmost show where a chain is


def _beside_chains(operator: DifferenceOperator, roots: Complex, n: int) -> Complex:
    """n roots of a neutral loop, or more: right of the line its chains tend to, then low ones.

    Of a chain, which has no rightmost root or none of low frequency, the slowest root that is as
    far right as any seen comes first, and the rest by frequency.
    """
    line = operator.spectral_abscissa()
    roots = roots[roots.imag >= 0]
    right = roots.real > line + 1e-9 * (1 + abs(line))
    rest = roots[~right]
    shows = rest.real > rest.real.max(initial=-np.inf) - NEAR
    left = rest.real < line - 2
    rank = np.where(shows & (np.abs(rest) == np.abs(rest[shows]).min(initial=np.inf)), 0, 1 + left)
    rest = rest[np.lexsort((rest.imag, rank))]
    out: list[complex] = []
    for root in roots[right]:
        out += [root, root.conjugate()] if root.imag else [root]
    for root in rest:
        if len(out) >= n and root != out[-1].conjugate() and root != out[-1]:
            break
        out += [root, root.conjugate()] if root.imag else [root]
    return np.array(out, complex)


def _check_number(n: object) -> None:
    if not is_whole(n) or n < 0:
        raise InputError(f"poles: n = {quoted(n)} is not usable; give a whole number of 0 or more.")


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
        every = roots = _found(system, n + hidden)
        asked = first(every, n + hidden)
        # A multiple root is judged whole.
        if len(asked):
            roots = roots[: len(asked) + int((roots[len(asked) :] == asked[-1]).sum())]
        shown = as_poles(system, roots, every)
        missing = min(n, len(roots)) - len(shown)
        # Of a channel that is 0 for all s every root is hidden, and there is no end of them.
        if missing <= 0 or len(roots) < n + hidden or hidden > 3 * n + MOST_HIDDEN:
            return first(shown, n)
        hidden += missing


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
