"""The phase of a channel as a continuous function of ω, never unwrapped from a grid.

H(jω) = N(jω)/Δ(jω), and how far the argument of each side turns between two frequencies is followed
in steps so short that |Q(jω′) − Q(jω)| < |Q(jω)| is certain all the way: then the shorter way round
is the way that was gone. Where one term of Q outweighs all others, the argument is that of the term
but for less than a quarter of a turn, however far out.

The path is a hair right of the axis, so that a zero on it adds π and a pole takes π away, as those
do that lie just left of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.frequency.at_zero import leading
from vsctrl.diagram.frequency.corners import corners
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.symbolic.quasi_polynomial import QuasiPolynomial, sides
from vsctrl.errors import InputError, LimitError

BESIDE = 1e-9  #: of ω, how far right of the axis the path lies
CLOSE = 1e-3  #: how near H is to K sⁿ where the path begins
MOST_STEPS = 2_000_000
AT_ONCE = 20_000
MOST_FREQUENCIES = 200_000
TURN = 0.45 * math.pi  #: rad, the most between two neighbours of a grid
JUMP = 1e-6  #: of ω, how near neighbours of a grid come to a zero or a pole on the axis


def phase(channel: NumericChannel, omega: Array) -> Array:
    """arg H(jω) (rad) at frequencies ω ≥ 0 (rad/s), continuous from n π/2 of K sⁿ at ω = 0.

    A negative K counts as −π. Errors: `InputError` where H is 0 throughout; `LimitError` where it
    turns too often.
    """
    power, size = leading(channel)
    if not size:
        raise InputError(
            f"phase: the channel from {channel.source} to {channel.target} is 0 for all s, and 0 "
            "has no phase; look at its wiring and its gains."
        )
    base = power * math.pi / 2 - (math.pi if size < 0 else 0.0)
    low = _beginning(channel, power, size, omega)
    at = np.unique(np.r_[low, omega[omega > low]])
    terms = channel.system.diagram.terms(channel.source, channel.target)
    num, den = sides(terms, channel.system.blocks)
    followed = base + _turned(num, at) - _turned(den, at)
    found = np.interp(omega, at, followed)  # each of ω is one of them, or below them all
    return _with_all_digits(channel, omega, found)


def frequency_grid(channel: NumericChannel, low: float, high: float, number: int) -> Array:
    """Frequencies (rad/s) from low to high, `number` at even steps of log ω and more between.

    No two neighbours are further apart in phase than a quarter of a turn, but for jumps of half a
    turn at zeros and poles on the axis. Errors: `LimitError` for more than `MOST_FREQUENCIES`.
    """
    grid = np.geomspace(low, high, number)
    grid[[0, -1]] = low, high
    while True:
        turn = np.abs(np.diff(phase(channel, grid)))
        rough = np.flatnonzero((turn > TURN) & (np.diff(grid) > JUMP * grid[1:]))
        if not len(rough):
            return grid
        parts = 1 + np.clip(np.ceil(turn[rough] / TURN), 2, MOST_FREQUENCIES).astype(int)
        if len(grid) + parts.sum() > MOST_FREQUENCIES:
            raise LimitError(
                f"frequency_grid: up to {high:g} rad/s the phase turns by {turn.sum():.4g} rad, "
                f"too often for {MOST_FREQUENCIES} frequencies; end lower."
            )
        ends = zip(grid[rough], grid[rough + 1], parts, strict=True)
        grid = np.unique(np.concatenate([grid, *(np.linspace(*end) for end in ends)]))


def group_delay(channel: NumericChannel, omega: Array) -> Array:
    """−d arg H(jω)/dω (s) = Re(Δ′/Δ − N′/N) at s = jω, NaN-free: infinite on a zero or a pole."""
    terms = channel.system.diagram.terms(channel.source, channel.target)
    num, den = sides(terms, channel.system.blocks)
    s = 1j * omega
    with np.errstate(all="ignore"):
        found = (den.derivative()(s) / den(s) - num.derivative()(s) / num(s)).real
    return np.where(np.isfinite(found), found, math.inf)


def _beginning(channel: NumericChannel, power: int, size: float, omega: Array) -> float:
    """A frequency (rad/s) up to which H is K sⁿ, as good as."""
    rates = np.append(corners(channel.system.blocks), omega[omega > 0])
    low = 1e-2 * float(rates.min(initial=1.0))
    for _ in range(60):
        s = 1j * low * np.array([1.0, 0.03, 1e-3])
        with np.errstate(all="ignore"):
            ratio = channel(s) / (size * s**power)
        if (np.abs(ratio - 1) < CLOSE).all():
            return low
        low *= 1e-2
    raise LimitError(
        f"phase: however low the frequency, down to {low:.3g} rad/s, the channel does not come "
        "near to a power of s, from which its phase is counted; give it rates nearer to 1 rad/s."
    )


def _with_all_digits(channel: NumericChannel, omega: Array, found: Array) -> Array:
    """The followed phase with the digits of H itself, but at a zero or a pole on the axis."""
    values: Complex = np.asarray(channel(1j * omega), complex)
    usable = np.isfinite(values) & (values != 0) & (omega > 0)
    off = np.angle(np.where(usable, values, 1.0)) - found
    off -= 2 * math.pi * np.round(off / (2 * math.pi))
    return np.where(usable & (np.abs(off) < 0.1), found + off, found)


def _turned(side: QuasiPolynomial, at: Array) -> Array:
    """How far arg Q turns (rad) from the first of rising frequencies (rad/s) to each."""
    common = side.least_delay
    path = _Path(side.advanced(common))
    turned = np.zeros(len(at) - 1)
    waiting = [(at[:-1], at[1:], np.arange(len(turned)))]
    steps = 0
    while waiting:
        a, b, owner = waiting.pop()
        if len(a) > AT_ONCE:
            waiting += [(x[AT_ONCE:], y[AT_ONCE:], k[AT_ONCE:]) for x, y, k in [(a, b, owner)]]
            a, b, owner = a[:AT_ONCE], b[:AT_ONCE], owner[:AT_ONCE]
        turn, sure = path.turn(a, b)
        np.add.at(turned, owner[sure], turn[sure])
        a, b, owner = a[~sure], b[~sure], owner[~sure]
        steps += len(turn)
        if steps > MOST_STEPS or (len(a) and (b - a < 1e-15 * b).any()):
            raise LimitError(
                f"phase: up to {at[-1]:g} rad/s it turns too often to follow; end lower."
            )
        if len(a):
            middle = np.where(b > 2 * a, np.sqrt(a) * np.sqrt(b), (a + b) / 2)
            waiting.append((np.r_[a, middle], np.r_[middle, b], np.r_[owner, owner]))
    return np.concatenate([[0.0], np.cumsum(turned)]) - float(common) * (at - at[0])


class _Path:
    """Q along s = (BESIDE + j) ω: how far it turns in a step, and where that is certain."""

    def __init__(self, side: QuasiPolynomial) -> None:
        self.k, self.tau, c = side.columns
        self.log = np.log(np.abs(c))
        self.unit = np.sign(c) * (BESIDE + 1j) ** self.k

    def turn(self, a: Array, b: Array) -> tuple[Array, NDArray[np.bool_]]:
        """The turn (rad) of steps from a to b (rad/s), and which are certain.

        Beside t, the largest term in the step, Q/t = Σ R. All R being powers of ω that turn, a sum
        of the others below 1 at both ends is so between, and R changes by no more than its size
        does, plus its size times the least of 2 and the change of its angle.
        """
        logs = [self.log + self.k * np.log(omega)[:, None] for omega in (a, b)]
        top = np.argmax(logs[0] + logs[1], axis=1)
        rows = np.arange(len(a))
        late = self.tau - self.tau[top][:, None]
        with np.errstate(over="ignore"):
            sizes = [np.exp(log - log[rows, top][:, None]) for log in logs]
        first, last = (
            size
            * (self.unit / self.unit[top][:, None])
            * np.exp(-(BESIDE + 1j) * w[:, None] * late)
            for size, w in zip(sizes, (a, b), strict=True)
        )
        start, end = first.sum(axis=1), last.sum(axis=1)
        lesser = [size.sum(axis=1) - 1 < 1 - 1e-9 for size in sizes]
        change = np.abs(sizes[1] - sizes[0])
        change += np.maximum(*sizes) * np.minimum(2.0, np.abs(late) * (b - a)[:, None] * (1 + 1e-6))
        near = change.sum(axis=1) < 0.99 * np.maximum(np.abs(start), np.abs(end))
        with np.errstate(all="ignore"):
            turn = np.angle(end / start) - self.tau[top] * (b - a)
        sure = ((lesser[0] & lesser[1]) | near) & np.isfinite(turn)
        return turn, sure
