"""Following the curve on which a characteristic root lies on the imaginary axis.

In the space of two parameters and the frequency, F(jω; x, y) = 0 is two real equations for three
unknowns: a curve. From one point on it a step along the tangent and Newton's method across it lead
to the next (pseudo-arclength continuation; Keller, 1977), round folds and past crossings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.stability_chart.characteristic import Determinant

LONGEST = 0.012  #: longest step, of the rectangle's side
SHORTEST = 1e-7
SHARPEST = 0.12  #: largest turn between steps (rad)
MOST_POINTS = 20_000
DIFFERENCE = 1e-6  #: step of the central differences; Newton needs no better slope
SINGULAR = 1e9  #: condition number above which Newton's equations decide nothing


@dataclass(frozen=True)
class RootOnAxis:
    """The curve F(jω; u, v) = 0 in z = (u, v, ω/unit), for pairs of roots or a root at 0."""

    F: Determinant
    pair: bool

    def residual(self, z: Array) -> Array:
        """(Re F, Im F/ω), even in ω and regular at 0, or for a root at 0 (F(0), ω); (k, 3) → 2."""
        u, v, w = z.T
        if not self.pair:
            return np.stack([self.F(np.zeros(len(z), complex), u, v).real, w], axis=-1)
        # F is real on the real axis, so that Im F/ω is F'(0) where ω is small.
        w = np.where(np.abs(w) < 1e-9, 1e-9, w)
        value = self.F(1j * w * self.F.unit, u, v)
        return np.stack([value.real, value.imag / w], axis=-1)

    def slopes(self, z: Array, scale: float) -> tuple[Array, Array]:
        """The residual (2,) at one point and its Jacobian (2, 3) in (u, v, w/scale)."""
        steps = DIFFERENCE * np.diag([1.0, 1.0, scale])
        values = self.residual(np.vstack([z[None], z + steps, z - steps]))
        return values[0], (values[1:4] - values[4:]).T / (2 * DIFFERENCE)

    def corrected(self, z: Array, along: Array, scale: float) -> tuple[Array, Array] | None:
        """Newton from z in the plane across `along`: the point and the unit tangent there.

        None where it does not converge, or where the equations are singular.
        """
        start, last = z, np.inf
        for _ in range(14):
            value, slope = self.slopes(z, scale)
            size = np.abs(slope).max(axis=1, keepdims=True)
            if not (np.isfinite(slope).all() and (size > 0).all()):
                return None
            matrix = np.vstack([slope / size, along])
            across = along @ ((z - start) / [1.0, 1.0, scale])
            if np.linalg.cond(matrix) > SINGULAR:
                return None
            step = -np.linalg.solve(matrix, [*(value / size[:, 0]), across])
            z = z + step * [1.0, 1.0, scale]
            length = float(np.linalg.norm(step))
            # Near rounding the steps stop shrinking: no further digit can be had.
            if length < 1e-14 or (length < 1e-10 and length > 0.3 * last):
                tangent = np.cross(*(slope / size))
                return z, tangent / np.linalg.norm(tangent)
            if length > 0.5 or length > 4 * last:
                return None
            last = length
        return None


@dataclass(frozen=True)
class TracedCurve:
    """The points (k, 3) of a traced curve, and whether its last is its first again."""

    points: Array
    closed: bool


def trace(curve: RootOnAxis, start: Array) -> TracedCurve:
    """Both ways from a point, to the rectangle's edge, to ω = 0, or round to where it began."""
    z, closed = _march(curve, start, 1.0)
    if closed:
        return TracedCurve(z, True)
    back, _ = _march(curve, start, -1.0)
    return TracedCurve(np.vstack([back[:0:-1], z]), False)


def _march(curve: RootOnAxis, start: Array, sense: float) -> tuple[Array, bool]:
    z, scale = start, _scale(start)
    first = curve.corrected(z, _across(curve, z, scale), scale)
    if first is None:
        return start[None], False
    points, tangent, step = [start], sense * first[1], LONGEST / 4
    for _ in range(MOST_POINTS):
        if step < SHORTEST:
            break
        scale = _scale(z)
        corrected = curve.corrected(z + step * tangent * [1.0, 1.0, scale], tangent, scale)
        if corrected is None or not _follows(z, tangent, corrected, step, scale):
            step /= 2
            continue
        new, direction = corrected
        direction = direction * np.sign(direction @ tangent)
        end = _end(curve, z, new, scale)
        if end is not None:
            points += [end] if np.abs(end - z).max() > 1e-12 else []
            break
        if len(points) > 3 and _passes(z, new, start, scale):
            return np.array([*points, start]), True
        points.append(new)
        turn = _angle(tangent, direction)
        step = min(LONGEST, step * (1.6 if turn < SHARPEST / 3 else 1.0))
        # The frequency is measured in its own size, which moves with the point.
        scaled = direction * [1.0, 1.0, scale / _scale(new)]
        z, tangent = new, scaled / np.linalg.norm(scaled)
    return np.array(points), False


def _scale(z: Array) -> float:
    return max(abs(float(z[2])), 0.05)


def _across(curve: RootOnAxis, z: Array, scale: float) -> Array:
    """A direction along the curve at z: any that makes Newton's equations regular."""
    _, slope = curve.slopes(z, scale)
    tangent = np.cross(*(slope / np.abs(slope).max(axis=1, keepdims=True)))
    return tangent / max(float(np.linalg.norm(tangent)), 1e-300)


def _angle(a: Array, b: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)))


def _follows(
    z: Array, tangent: Array, corrected: tuple[Array, Array], step: float, scale: float
) -> bool:
    """Whether the corrected point lies where the tangent pointed and the curve turned little."""
    new, direction = corrected
    direction = direction * np.sign(direction @ tangent)
    off = np.linalg.norm((new - z) / [1.0, 1.0, scale] - step * tangent)
    if off > 0.2 * step or _angle(tangent, direction) > SHARPEST:
        return False
    flat, flat_new = np.append(tangent[:2], 0), np.append(direction[:2], 0)
    seen = min(np.linalg.norm(flat), np.linalg.norm(flat_new)) > 0.05
    return not seen or step < 1e-4 or _angle(flat, flat_new) < 1.5 * SHARPEST


def _end(curve: RootOnAxis, z: Array, new: Array, scale: float) -> Array | None:
    """The point between two at which the curve leaves the rectangle or its frequency becomes 0."""
    ends = [(i, b) for i in (0, 1) for b in (0.0, 1.0) if (new[i] - b) * (2 * b - 1) > 1e-12]
    ends += [(2, 0.0)] if curve.pair and z[2] * new[2] <= 0 else []
    if not ends:
        return None

    def fraction(end: tuple[int, float]) -> float:
        i, bound = end
        return float((bound - z[i]) / (new[i] - z[i])) if new[i] != z[i] else 1.0

    i, bound = min(ends, key=fraction)
    guess = z + np.clip(fraction((i, bound)), 0, 1) * (new - z)
    guess[i] = bound
    corrected = curve.corrected(guess, np.eye(3)[i], scale)
    if corrected is None:
        return z
    corrected[0][i] = bound
    return corrected[0]


def _passes(z: Array, new: Array, start: Array, scale: float) -> bool:
    """Whether the step from z to new went through the starting point."""
    unit = np.array([1.0, 1.0, scale])
    way, there = (new - z) / unit, (start - z) / unit
    along = float(there @ way) / float(way @ way)
    return 0 < along <= 1 and bool(np.linalg.norm(there - along * way) < 0.1 * np.linalg.norm(way))


def split_where(points: Array, turning: Callable[[Array], Array], curve: RootOnAxis) -> list[Array]:
    """A curve of roots at 0 cut where a second root joins the first (F' = 0, `turning` changes).

    There a pair leaves along the axis, and the roots move the other way beyond.
    """
    sign = np.sign(turning(points))
    pieces, begin = [], points[:1]
    for k in range(1, len(points)):
        if sign[k] * sign[k - 1] < 0:
            middle = (points[k] + points[k - 1]) / 2
            corrected = curve.corrected(middle, np.eye(3)[2], 1.0)
            joint = middle if corrected is None else corrected[0] * [1.0, 1.0, 0.0]
            pieces.append(np.vstack([begin, joint]))
            begin = joint[None]
        begin = np.vstack([begin, points[k]])
    return [*pieces, begin]
