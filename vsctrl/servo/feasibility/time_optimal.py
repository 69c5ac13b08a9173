"""The fastest pace along a path: time-optimal path parametrisation in the phase plane.

With the path parameter σ, its rate squared ``x = σ'²`` and ``u = σ'' = x'(σ)/2``, whatever moves
has the velocity ``v √x`` and the acceleration ``a x + v u``, so that all limits are convex in
(x, u). On every cell of a grid u is constant: the limits, taken at five points of the cell, are
``α x₀² + 2β x₀ x₁ + γ x₁² ≤ 1`` in x at its two ends. Backwards the largest x from which the end
can still be reached is found, forwards the largest within it.

Since limits are the same to and fro, rest (0, 0) is always allowed, and no part of the phase plane
is a trap. Limits on the length of a vector are taken as they are, not as boxes.

Source: Pham, Pham, A new approach to time-optimal path parameterization based on reachability
analysis (IEEE Transactions on Robotics 2018); its collocation at both ends of a cell is extended to
points inside.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.feasibility.demands import Moving
from vsctrl.servo.feasibility.golden_section import golden_section

BETWEEN = np.linspace(0.0, 1.0, 9)  # where in a cell the limits are verified
WITHIN = BETWEEN[::2]  # where they are taken
CLOSELY = np.linspace(0.0, 1.0, 201)  # where they are verified in the worst cells
WORST = 20
# What the last verification may still miss: the ends of a cell, and the squared spacing of a peak.
HAIR = 1e-7
# How far inside a cell, as a share of it, its ends are looked at: on this side of a knot.
INSIDE = 1e-10
# Share of x kept back: at its very tip the allowed region would leave no choice of what follows.
BACK_OFF = 1e-8
# A jump of an acceleration below this share of its limit (at the path's own pace) is let be.
LEAST_JUMP = 1e-3
# A rate of the path this many times the uniform one is no limit: it is met where nothing moves.
MOST_RATE = 1e3


class Cells(NamedTuple):
    """The limits on every cell: (cells, limits) each, ``δ = |P × Q|²`` (see ``_cells``)."""

    alpha: Array
    beta: Array
    gamma: Array
    delta: Array

    def turned(self) -> "Cells":
        """The same with the two ends of every cell exchanged."""
        return Cells(self.gamma, self.beta, self.alpha, self.delta)

    def tightened(self, share: Array) -> "Cells":
        """The same with the limits of every cell divided by its share, (cells,)."""
        s = share[:, None]
        return Cells(self.alpha * s**2, self.beta * s**2, self.gamma * s**2, self.delta * s**4)


def fastest_pace(
    moving: Callable[[Array], Moving], sigma: Array, stop: tuple[bool, bool]
) -> Array | None:
    """The largest x = σ'² at the nodes of a piece of path, (n + 1,), or None where nothing moves.

    moving: demands at parameters (n,); sigma: (n + 1,) nodes; stop: whether σ' must be 0 at start
    and end.
    """
    h = np.diff(sigma)
    between = _at(moving, sigma, BETWEEN)
    asked = Moving(*(part[:, :, ::2] for part in between))
    # At x = 1/uniform some limit is met: of speed, of an even pace, or of gathering speed.
    gathering = _size(asked.v_acceleration).max() / (sigma[-1] - sigma[0])
    uniform = max(_size(asked.v_speed).max() ** 2, _size(asked.a_acceleration).max(), gathering)
    if not uniform > 0:
        return None
    most = MOST_RATE**2 / uniform
    cells = _cells(asked, h)
    tight = np.ones(len(h))
    for _ in range(4):
        x = _solve(cells.tightened(tight), most, stop)
        share = _shares(between, BETWEEN, np.stack([x[:-1], x[1:]]), h)
        if share.max() <= 1 + HAIR:
            break
        # What bends between the points of a cell is met by tightening that cell alone.
        tight = tight * np.maximum(share, 1.0)
    worst = np.argsort(-share)[:WORST]
    closely = _at(moving, np.stack([sigma[worst], sigma[worst + 1]]), CLOSELY)
    share = _shares(closely, CLOSELY, np.stack([x[worst], x[worst + 1]]), h[worst])
    return x / (max(1.0, float(share.max())) * (1 + HAIR))


def knots(moving: Callable[[Array], Moving], sigma: Array) -> Array:
    """Parameters at which an acceleration jumps, found by halving the cells that hold a jump.

    moving: demands at parameters (n,); sigma: (n + 1,) nodes. A jump keeps its height while the
    cell around it shrinks; a mere slope does not.
    """
    low, high = sigma[:-1], sigma[1:]
    first, last = moving(low).a_acceleration, moving(high).a_acceleration
    height = _size(last - first).max(axis=0)
    for _ in range(45):
        holds = height > LEAST_JUMP
        low, high, height = low[holds], high[holds], height[holds]
        first, last = first[:, holds], last[:, holds]
        if not low.size:
            break
        middle = (low + high) / 2
        half = moving(middle).a_acceleration
        below = _size(half - first).max(axis=0) >= _size(last - half).max(axis=0)
        low, high = np.where(below, low, middle), np.where(below, middle, high)
        first = np.where(below[None, :, None], first, half)
        last = np.where(below[None, :, None], half, last)
        height = _size(last - first).max(axis=0)
    return high


def _solve(cells: Cells, most: float, stop: tuple[bool, bool]) -> Array:
    n = len(cells.alpha)
    widest = _widest(cells, most)
    back = np.empty(n + 1)
    back[n] = 0.0 if stop[1] else most
    for k in reversed(range(n)):
        y = min(float(back[k + 1]), float(widest[k]))
        back[k] = min(max(float(_upper(_row(cells, k), y)), 0.0), most) * (1 - BACK_OFF)
    x = np.empty(n + 1)
    x[0] = 0.0 if stop[0] else back[0]
    ahead = cells.turned()
    for k in range(n):
        x[k + 1] = min(max(float(_upper(_row(ahead, k), x[k])), 0.0), float(back[k + 1]))
    return x


def _row(cells: Cells, k: int) -> Cells:
    return Cells(*(part[k] for part in cells))


def _upper(cells: Cells, y: float | Array) -> Array:
    """Largest x₀ that the limits allow at x₁ = y: (..., limits) → (...,)."""
    return np.asarray(_roots(cells, np.asarray(y)[..., None])[1].min(axis=-1))


def _roots(cells: Cells, y: Array) -> tuple[Array, Array, Array]:
    """Least and largest x₀ at x₁ = y of each limit, and whether there are any.

    Each root from the form in which nothing cancels; ``β² − αγ = −δ`` for the same reason.
    """
    by, rest = cells.beta * y, 1 - cells.gamma * y * y
    square = cells.alpha - cells.delta * y * y
    root = np.sqrt(np.maximum(square, 0.0))
    size = np.abs(by) + root
    free = cells.alpha <= 0
    far = np.where(free, np.inf, size / np.where(free, 1.0, cells.alpha))
    near = np.where(size > 0, rest / np.where(size > 0, size, 1.0), np.inf)
    low = np.where(by < 0, -near, -far)
    high = np.where(by < 0, far, near)
    return low, high, np.where(free, rest >= 0, square >= 0)


def _widest(cells: Cells, most: float) -> Array:
    """The x₁ in [0, most] at which the largest x₀ is greatest: (cells,), golden section.

    The allowed (x₀, x₁) are convex, so that this is the top of a concave function.
    """

    def reach(y: Array) -> Array:
        low, high, some = _roots(cells, y[:, None])
        lowest, highest = low.max(axis=1), high.min(axis=1)
        return np.where(some.all(axis=1) & (lowest <= highest), np.minimum(highest, most), -np.inf)

    n = len(cells.alpha)
    return golden_section(reach, np.zeros(n), np.full(n, most), 100)


def _cells(asked: Moving, h: Array) -> Cells:
    """Limits of all cells from demands (m, cells, points, 3).

    ``a x + v u = P x₀ + Q x₁`` with ``P = (1 − θ) a − v/(2h)``, ``Q = θ a + v/(2h)``; for a speed
    ``|v|² x ≤ 1``, P and Q are the numbers ``(1 − θ)|v|²`` and ``θ |v|²``.
    """
    theta = WITHIN[:, None]
    slope = asked.v_acceleration / (2 * h[:, None, None])
    P = (1 - theta) * asked.a_acceleration - slope
    Q = theta * asked.a_acceleration + slope
    square = _size(asked.v_speed) ** 2
    p, q = (1 - WITHIN) * square, WITHIN * square
    parts = (
        (np.sum(P * P, axis=-1), p * p),
        (np.sum(P * Q, axis=-1), p * q),
        (np.sum(Q * Q, axis=-1), q * q),
        (np.sum(np.cross(P, Q) ** 2, axis=-1), np.zeros_like(p)),
    )
    flat = [np.concatenate([np.moveaxis(x, 0, -1) for x in pair], axis=-1) for pair in parts]
    return Cells(*(x.reshape(len(h), -1) for x in flat))


def _shares(asked: Moving, places: Array, x: Array, h: Array) -> Array:
    """Largest share of a limit in every cell, of acceleration or speed squared: (cells,).

    asked: demands (m, cells, places, 3); x: (2, cells), at the ends of the cells.
    """
    inside = x[0][:, None] + (x[1] - x[0])[:, None] * places
    u = ((x[1] - x[0]) / (2 * h))[:, None, None]
    speed = _size(asked.v_speed) ** 2 * inside
    acceleration = _size(asked.a_acceleration * inside[..., None] + asked.v_acceleration * u)
    return np.maximum(_tops(speed), _tops(acceleration)).max(axis=0)


def _tops(values: Array) -> Array:
    """Largest value in each cell, between the places too, by parabolas: (m, cells, places) → -1."""
    before, here, after = values[..., :-2], values[..., 1:-1], values[..., 2:]
    bend = 2 * here - before - after
    crest = (bend > 0) & (np.abs(after - before) <= 2 * bend)  # within the three
    rise = np.where(crest, (after - before) ** 2 / (8 * np.where(crest, bend, 1.0)), 0.0)
    return np.maximum(values.max(axis=-1), (here + rise).max(axis=-1))


def _at(moving: Callable[[Array], Moving], sigma: Array, places: Array) -> Moving:
    """Demands at places in cells, (m, cells, places, 3); sigma: nodes (n + 1,) or ends (2, n)."""
    low, high = (sigma[:-1], sigma[1:]) if sigma.ndim == 1 else sigma
    points = low[:, None] + (high - low)[:, None] * np.clip(places, INSIDE, 1 - INSIDE)
    flat = moving(points.ravel())
    return Moving(*(x.reshape(len(x), *points.shape, 3) for x in flat))


def _size(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=-1)
