"""A response from its beginning until nothing of it is left, as polynomials on pieces of time.

How long that takes the poles tell. Where a slow mode lives on thousands of times longer than the
fast ones, which no solution can follow step by step, the response is continued by the residues of
the slow poles, and held to the solution where both are known.
"""

from __future__ import annotations

import math

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.numerics.chebyshev import tables
from vsctrl.diagram.performance.decay import Decay
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.elementary import Exponential, Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.time.collocation import Trajectory, solve
from vsctrl.errors import LimitError

LIVES = 40.0  #: time constants after which e^{−t/T} is 4e-18
MOST_SWINGS = 5000  #: of one mode until it is at rest: a damping ratio of 1/800
STEPS = 2e4  #: fastest time constants up to which the whole is solved step by step
POINTS = 64  #: on the circle round a pole that its residue is taken from
ORDERS = 4  #: of a pole at most
NOISE = 1e-12  #: of what goes into a residue, below which it is rounding
AGREES = 1e-9  #: of the response, how far residues and solution may differ


def course(system: DelaySystem, signal: Signal, decay: Decay) -> Trajectory:
    """The response of a stable one-input, one-output system until it is at rest.

    Errors: `LimitError` where it swings too often until then.
    """
    last = max((float(start) for start, _ in signal.primitives), default=0.0)
    lag = last + float(system.tau.sum())
    fastest = float(np.abs(np.linalg.eigvals(system.A)).max(initial=0.0))
    horizon = lag + LIVES / min(decay.rate, *rates(signal), math.inf)
    horizon = 1.1 * horizon if horizon else 1.0
    _check_swings(decay.poles)
    if horizon * fastest > STEPS and isinstance(signal, Step):
        solved, slow = _cheapest(decay.poles, lag, horizon, fastest)
        if len(slow):
            return _continued(system, signal, solve(system, signal, solved), slow, horizon)
    return solve(system, signal, horizon)


def _check_swings(poles: Complex) -> None:
    """Refuse what swings so often before it is at rest that it is not worth waiting for."""
    swings = LIVES * np.abs(poles.imag) / (2 * math.pi * np.abs(poles.real))
    worst = int(swings.argmax()) if len(poles) else 0
    if len(poles) and swings[worst] > MOST_SWINGS:
        pole = complex(poles[worst])
        raise LimitError(
            f"response: with a pole at {pole.real:.3g} ± {abs(pole.imag):.3g}j rad/s it swings "
            f"{swings[worst]:.0f} times before it is at rest, and {MOST_SWINGS} is the limit; give "
            "it more damping."
        )


def rates(signal: Signal) -> list[float]:
    """Those (1/s) at which parts of a signal itself die out."""
    parts = [part for _, part in signal.primitives]
    return [-part.rate for part in parts if isinstance(part, Exponential) and part.rate < 0]


def _cheapest(poles: Complex, lag: float, horizon: float, fastest: float) -> tuple[float, Complex]:
    """Up to when (s) to solve, and the poles whose residues carry on from there; maybe none."""
    best = horizon * fastest, horizon, poles[:0]
    for k in range(1, len(poles)):
        slow, next_ = poles[:k], poles[k]
        if next_.real > 0.5 * slow[-1].real * (1 + 1e-9) or next_ == slow[-1].conjugate():
            continue
        until = lag + LIVES / -next_.real
        cost = until * fastest + (horizon - until) * float(np.abs(slow).max())
        if 2 * next_.real < slow[-1].real and cost < best[0]:
            best = cost, until, slow
    return best[1], best[2]


def _continued(
    system: DelaySystem, signal: Step, start: Trajectory, slow: Complex, horizon: float
) -> Trajectory:
    """The solution, and after its end final + Σ Res e^{pt} on pieces of the slow modes."""
    until = float(start.ends[-1])
    modes = _Modes(system, signal.amplitude, slow)
    nodes, to_coefficients, _ = tables(start.coefficients.shape[1] - 1)
    a, b = start.ends[-2:]
    both = np.polynomial.chebyshev.chebval(nodes, start.coefficients[-1, :, 0])
    scale = max(float(np.abs(start.coefficients).sum(axis=1).max()), modes.size)
    off = np.abs(both - modes((a + b) / 2 + (b - a) / 2 * nodes)).max()
    if off > AGREES * scale:
        raise LimitError(
            f"response: its slow modes, still there after {until:.4g} s, cannot be told from the "
            "fast ones; give time constants that lie closer together."
        )
    pieces = math.ceil((horizon - until) * float(np.abs(slow).max()) / 3)
    ends = np.linspace(until, horizon, pieces + 1)
    t = ends[:-1, None] + np.diff(ends)[:, None] * (nodes + 1) / 2
    more = modes(t) @ to_coefficients.T
    return Trajectory(
        np.concatenate([start.ends, ends[1:]]),
        np.concatenate([start.coefficients, more[:, :, None]]),
    )


class _Modes:
    """H(0) a + Σ over slow poles of what their residues in a H(s)/s make of the step response.

    Of a pole p each is e^{pt} Σ c_k t^{k−1}/(k − 1)!, c_k = (1/2πj) ∮ (s − p)^{k−1} a H(s)/s ds
    round it, of whatever order up to ORDERS; p needs only to be inside. Pulled out of the integral
    e^{pt} does not grow on the circle, however long the pole lives.
    """

    def __init__(self, system: DelaySystem, amplitude: float, slow: Complex) -> None:
        self.poles = np.unique(slow[slow.imag >= 0])
        known = np.append(slow, 0.0)
        turn = np.exp(2j * np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        radius = np.array([0.4 * np.abs(known - p)[known != p].min() for p in self.poles])
        s = self.poles[:, None] + radius[:, None] * turn
        values = amplitude * system.transfer(s)[..., 0, 0] / s
        pair = np.where(self.poles.imag == 0, 1.0, 2.0)
        k = np.arange(1, ORDERS + 1)
        # In units of the circle's radius, in which what is rounding is seen to be.
        moments = (values[:, None, :] * turn ** k[:, None]).mean(axis=-1)
        moments[np.abs(moments) < NOISE * np.abs(values).max(axis=1, keepdims=True)] = 0.0
        self.weights = pair[:, None] * moments * radius[:, None] ** k
        # H(0) as a mean round 0, where blocks may have a pole that the channel does not show.
        about = system.transfer(0.4 * np.abs(slow).min() * turn)
        self.final: float = amplitude * float(about[..., 0, 0].mean().real)

    @property
    def size(self) -> float:
        """The largest of what it is made of, whose rounding it has."""
        return max(abs(self.final), float(np.abs(self.weights[:, 0]).sum()))

    def __call__(self, t: Array) -> Array:
        total = np.full(np.shape(t), self.final)
        for p, weights in zip(self.poles, self.weights, strict=True):
            rising = sum(c * t**k / math.factorial(k) for k, c in enumerate(weights))
            total += (np.exp(p * t) * rising).real
        return total
