"""Every face of a diagram against every other, on the diagram's own parameters.

A diagram has one meaning and many computations. Here they are held to each other: the symbolic
transfer function to the compiled one and to the state space, characteristic roots to the
frequency response, the time response to the inverse transform, the Padé models and the sampled
twin to what they approximate. The result is a table that says pass, or where not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
from sympy import Add, expand, lambdify

from vsctrl.arrays import Array, Complex
from vsctrl.checks import quoted
from vsctrl.diagram.consistency import hidden_copies, margin_scan, sampled_limit
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.pade import order as pade_order
from vsctrl.diagram.pade.approximant import SingularLoopError
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.time import collocation
from vsctrl.errors import ImproperError, InputError, LimitError
from vsctrl.symbols import Expr, s
from vsctrl.tables import Numbers, Printed, html, text

LATE = 0.1  #: least of a transfer function that may be left when s is doubled
DIGITS = 50  #: with which formulas are evaluated
TINY = 1e-300


@dataclass(frozen=True)
class Check:
    """One comparison: the largest difference found, and the one that rounding explains."""

    channel: str
    faces: str
    difference: float
    allowed: float
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the difference is explained."""
        return self.difference <= self.allowed

    def row(self, note: str) -> tuple[str, ...]:
        """Its row in a table, the note as that text has it."""
        verdict = "pass" if self.passed else "FAIL"
        verdict += note.format(self.note) if self.note else ""
        return self.channel, self.faces, f"{self.difference:.1e}", f"{self.allowed:.0e}", verdict


@dataclass(frozen=True, repr=False)
class CrossCheck(Printed, Numbers):
    """All comparisons of one system; `passed` if every one of them did."""

    lines: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether every face agrees with every other."""
        return all(line.passed for line in self.lines)

    def __str__(self) -> str:
        return text(self._rows(" ({})"), "{:24}{:44}{:>11}{:>9}  {}")

    def _repr_html_(self) -> str:
        return html(self._rows(", {}"))

    def _rows(self, note: str) -> list[tuple[str, ...]]:
        head = ("channel", "faces", "difference", "allowed", "")
        return [head, *(line.row(note) for line in self.lines)]


def crosscheck(system: Numeric) -> CrossCheck:
    """Hold all faces of every channel from an input to an output to each other."""
    pairs = product(system.diagram.inputs, system.diagram.outputs)
    channels = [NumericChannel(system, *pair) for pair in pairs]
    lines = [check for channel in channels for check in _channel(channel)]
    lines += [check for loop in margin_scan.loops(system) for check in _loop(loop)]
    notes = [copied.sentence for copied in hidden_copies.unstable_copies(system)]
    lines += [Check("whole diagram", "hidden unstable copies", 0.0, 0.0, note) for note in notes]
    return CrossCheck(tuple(lines))


def _channel(channel: NumericChannel) -> list[Check]:
    name = f"{channel.source} → {channel.target}"
    # On and off the axis, two decades round the channel's own, but not at a round ratio to it.
    omega = np.geomspace(0.047, 4.7, 7) / _unit(channel)
    points = np.concatenate([1j * omega, (0.3 + 1j) * omega[:4]])
    exact = channel(points)
    scale = 1 + np.abs(exact)
    expr = channel.system.transfer(channel.source, channel.target)
    symbolic = channel.sign * np.array(_values(expr, points.tolist(), DIGITS))
    faces, allowed = "compiled against symbolic, 50 digits", _phase_rounding(channel, points)
    compiled = Check(name, faces, _largest(exact - symbolic, scale), 1e-12 * allowed)
    try:
        realised = channel.realisation.transfer(points)[:, 0, 0] * channel.sign
    except ImproperError as error:  # any other refusal is the user's to see
        return [compiled, Check(name, "state space", 0.0, 0.0, f"left out: {error}")]
    return [
        compiled,
        Check(name, "state space against compiled", _largest(realised - exact, scale), 1e-9),
        _at_zero(channel, name, expr),
        _roots(channel, name, expr),
        _time(channel, name),
        *_pade(channel, name, points),
        *_sampled(channel, name),
    ]


def _loop(loop: NumericChannel) -> list[Check]:
    """Crossings and the peak of sensitivity against a dense scan; the verdict against poles."""
    name, out = f"L at {loop.target}", []
    for faces, difference in (
        ("margins against a scan", margin_scan.missed),
        ("verdict against poles", margin_scan.misjudged),
    ):
        try:
            out.append(Check(name, faces, difference(loop), 1e-6))
        except (InputError, LimitError) as error:  # what the margins refuse is theirs to say
            out.append(Check(name, faces, 0.0, 0.0, f"left out: {error}"))
    return out


def _at_zero(channel: NumericChannel, name: str, expr: Expr) -> Check:
    """H(0), a limit where blocks are infinite, against the symbolic H so near to 0 that it is it.

    At s = 1e-60 rad/s times the channel's own rate with 400 digits H differs from its limit by
    rounding only, and a pole of first order is 1e60.
    """
    faces = "H(0) against symbolic, s → 0"
    point = Fraction(1 / _unit(channel)) / 10**60
    near = channel.sign * _values(expr, [point], 400)[0]
    value = complex(channel(0.0))
    if math.isinf(abs(value)):
        return Check(name, faces, 1 / (1 + abs(near)), 1e-9)
    return Check(name, faces, _largest(np.array([value - near]), 1 + abs(near)), 1e-9)


def _time(channel: NumericChannel, name: str) -> Check:
    """The Laplace transform of the computed step response against H(s)/s, right of all poles."""
    growth = max((root.real for root in rightmost.poles(channel.realisation, 1)), default=-1.0)
    right, unit = max(growth, 0.0), _unit(channel)
    for _ in range(8):
        # What rises late, behind many lags, weighs little at a large σ: less than its own tail.
        sigma = right + 4 / unit
        if abs(channel(sigma)) >= LATE * abs(channel(right + 2 / unit)):
            break
        unit *= 2
    # With Re s = σ the tail beyond `end` weighs e^(−(σ − right) end) = 1e-14.
    end = 32 / (sigma - right)
    trajectory = collocation.solve(channel.realisation, Step(), end)
    points = sigma + 1j * np.array([0.0, 1.0, 3.0]) / unit
    transform = channel.sign * _transform(trajectory, points)
    exact = channel(points) / points
    # A channel that is zero has no size but that of what cancels in it.
    rest = 1e-5 * _uncancelled(channel, points) / np.abs(points)
    scale = np.abs(exact) + unit * np.abs(channel(sigma)) + rest + TINY
    difference = _largest(transform - exact, scale)
    return Check(name, "step response against inverse transform", difference, 1e-9)


def _uncancelled(channel: NumericChannel, points: Complex) -> Array:
    """Σ |terms| of the output at complex points, whose rounding is left where they cancel."""
    system = channel.realisation
    n, m, r, p = len(system.A), len(system.delays), system.inputs, system.outputs
    all_signals = replace(
        system,
        C=np.vstack([np.eye(n + m, n), system.C[p:]]),
        D=np.vstack([np.zeros((n, r + m)), np.eye(m, r + m, r), system.D[p:]]),
    )
    signals = np.abs(all_signals.transfer(points)[..., 0])
    weights = np.abs(np.concatenate([system.C[0], system.D[0, r:]]))
    return np.asarray(signals @ weights + abs(system.D[0, 0]))


def _transform(trajectory: collocation.Trajectory, points: Complex) -> Complex:
    """∫ y(t) e^{−st} dt piece by piece, by Gauss quadrature on pieces no longer than 1/|s|."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    out = np.zeros(len(points), complex)
    for a, b in zip(trajectory.ends[:-1], trajectory.ends[1:], strict=True):
        parts = max(1, math.ceil((b - a) * float(np.abs(points).max()) / 4))
        edges = np.linspace(a, b, parts + 1)
        t = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * nodes
        w = np.diff(edges)[:, None] / 2 * weights
        y = trajectory(t.ravel())[:, 0]
        out += np.exp(-np.outer(points, t.ravel())) @ (w.ravel() * y)
    return out


def _pade(channel: NumericChannel, name: str, points: Complex) -> list[Check]:
    """Padé models converge: order 8 is nearer than order 4, below the frequency both can follow."""
    delay_s = sum(channel.realisation.tau.tolist())
    low = points[np.abs(points) * delay_s < 3]
    if not delay_s or not len(low):
        return []
    reference = channel(low)
    try:
        models = [pade_order.model(channel, order, None, None) for order in (4, 8)]
    except SingularLoopError:  # which models that let nothing through at once never have
        models = [pade_order.model(channel, (n - 1, n), None, None) for n in (4, 8)]
    errors = [_largest(np.array([m(point) for point in low]) - reference, 1.0) for m in models]
    size = 1 + float(np.abs(reference).max())
    return [
        Check(
            name,
            f"Padé {models[1].order} against exact, ωτ < 3",
            errors[1],
            max(1e-9 * size, errors[0] / 10),
        )
    ]


def _sampled(channel: NumericChannel, name: str) -> list[Check]:
    """The sampled twin nears the continuous channel with first order as its period shrinks."""
    faces = "sampled against continuous, T → 0"
    try:
        errors = sampled_limit.approach(channel, _unit(channel))
    except (InputError, LimitError) as error:  # not every diagram has a twin, and check() asks all
        return [Check(name, faces, 0.0, 0.0, f"left out: {error}")]
    note = f"{quoted(errors.hold)} held, T = {errors.period / 4:.2g} s"
    halved, rest = sampled_limit.HALVED * errors.half, sampled_limit.LEFT * errors.quarter
    return [
        Check(name, faces, errors.quarter, max(1e-9, halved), note),
        Check(name, "sampled, extrapolated to T = 0", errors.extrapolated, max(1e-9, rest)),
    ]


def _roots(channel: NumericChannel, name: str, expr: Expr) -> Check:
    """Each pole against the symbolic denominator D: D⁽ᵏ⁾ beside what its terms add up to.

    A pole listed m times is a zero of D, …, D⁽ᵐ⁻¹⁾, so that different poles taken for a multiple
    one show; rounding of the coefficients moves D by ε of the sum of its terms' moduli.
    """
    faces = "poles against symbolic denominator"
    above, below = expr.as_numer_denom()
    if above == 0:
        return Check(name, faces, 0.0, 1e-9, "the channel is 0")
    poles = rightmost.poles(channel.realisation, 4)
    different, listed = np.unique(poles, return_counts=True)
    terms = list(Add.make_args(expand(below)))
    parts = np.abs(_values(terms, different.tolist(), DIGITS))
    size = parts.reshape(len(different), len(terms)).sum(axis=1)
    worst, derivative = 0.0, below
    for k in range(int(listed.max(initial=0))):
        at = listed > k
        values = np.abs(_values(derivative, different[at].tolist(), DIGITS))
        # D is moved by ε^{(m − k)/m} of its size over a length of the order of |s|.
        values *= np.abs(different[at]) ** k / math.factorial(k)
        worst = max(worst, float((values / (size[at] + TINY)).max()))
        derivative = derivative.diff(s)
    note = "" if len(poles) else "no poles"
    return Check(name, faces, worst, 1e-9, note)


def _values(expr: Any, points: Iterable[complex | Fraction], digits: int) -> list[Any]:
    """A formula in s, or a list of them, at some points, with so many digits."""
    import mpmath

    formula = lambdify(s, expr, "mpmath")
    with mpmath.workdps(digits):
        exact = (
            mpmath.mpf(p.numerator) / p.denominator if isinstance(p, Fraction) else mpmath.mpc(p)
            for p in points
        )
        found = [formula(point) for point in exact]
    many = isinstance(expr, list)
    return [[complex(x) for x in each] if many else complex(each) for each in found]


def _unit(channel: NumericChannel) -> float:
    """The channel's own unit of time, s: its longest delay or slowest open rate."""
    try:
        system = channel.realisation
    except InputError:
        return 1.0
    rates = np.abs(np.linalg.eigvals(system.A)) if len(system.A) else np.zeros(0)
    times = [*system.tau.tolist(), *(1 / rate for rate in rates if rate > 1e-9)]
    return max(times, default=1.0)


def _phase_rounding(channel: NumericChannel, points: Complex) -> float:
    """How much the rounding of sτ adds: e^{−sτ} is known to |s| τ ε."""
    try:
        delay_s = sum(channel.realisation.tau.tolist())
    except InputError:
        return 1.0
    return 1 + delay_s * float(np.abs(points).max())


def _largest(difference: Complex, scale: Array | float) -> float:
    worst = float((np.abs(difference) / scale).max(initial=0.0))
    return worst if math.isfinite(worst) else math.inf
