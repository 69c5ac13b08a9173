"""What a set of features is: the same few quantities of every point, side or whole of a target.

The module exists so that a set brings its formulas and where they end, and nothing else. Which sets
there are is told by ``feature_sets``.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.arrays import Array, Mask
from vsctrl.servo.camera.camera import NEAREST, Camera

Places = NDArray[np.int64]

# A coordinate (px) whose third power is still a number, for moments.
_LARGEST = 1e100


class Quantity(NamedTuple):
    """One feature: its letter, its unit, and the angle after which it repeats, 0 if it does not."""

    letter: str
    unit: str
    turn: float = 0.0


@dataclass(frozen=True, slots=True)
class Measures(ABC):
    """A set of m features of the image of p points, part by part: a point, a segment or the whole.

    camera: that the law assumes, of which only L depends; points: p. ``quantities`` are the
    features of a part, ``least`` is the least p.
    """

    camera: Camera
    points: int

    quantities: ClassVar[tuple[Quantity, ...]]
    least: ClassVar[int] = 1

    @property
    def parts(self) -> Places:
        """Which points each part is made of: (parts, points of one), from 0."""
        return each(self.points)

    @property
    def labels(self) -> tuple[str, ...]:
        """A name for each of the m features, ``rho_1``, ``theta_1``, ``rho_2`` …"""
        count = len(self.parts)
        if count == 1:
            return tuple(quantity.letter for quantity in self.quantities)
        return tuple(f"{q.letter}_{i + 1}" for i in range(count) for q in self.quantities)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each of the m features."""
        return tuple(quantity.unit for quantity in self.quantities) * len(self.parts)

    def of(self, image: ArrayLike, depths: ArrayLike) -> Array:
        """Features (..., m) of images (..., 2p) in px with depths (..., p) in m.

        0 where there is no number; ``usable`` tells.
        """
        ends, z = self._ends(image, depths)
        with np.errstate(all="ignore"):
            s = self._of(ends, z)
        return _flat(np.where(np.isfinite(s), s, 0.0), 2)

    def interaction(self, image: ArrayLike, depths: ArrayLike) -> Array:
        """L (..., m, 6) of the same, s' = L T for a still target, per m/s and rad/s.

        Columns Vx Vy Vz Ωx Ωy Ωz. Rows of features that are not ``usable`` are 0.
        """
        ends, z = self._ends(image, depths)
        with np.errstate(all="ignore"):
            L, usable = self._interaction(ends, z), self._sound(ends, z)
        return _flat(np.where(usable[..., None], L, 0.0), 3)

    def usable(self, image: ArrayLike, depths: ArrayLike) -> Mask:
        """Which features (..., m) of the same exist and change smoothly.

        None of a point that is not in front of the camera or has no image; the rest as the set
        says.
        """
        ends, z = self._ends(image, depths)
        with np.errstate(all="ignore"):
            sound = self._sound(ends, z)
        whole = np.broadcast_to(sound, (*sound.shape[:-1], len(self.quantities)))
        return whole.reshape(*sound.shape[:-2], -1)

    def difference(self, s: ArrayLike, s_star: ArrayLike) -> Array:
        """s − s* (..., m), directions in (−π, π], those of an axis in (−π/2, π/2]."""
        e = np.asarray(s, dtype=np.float64) - np.asarray(s_star, dtype=np.float64)
        angle, turns = _angles(self.quantities, len(self.parts))
        if angle.size:
            e[..., angle] -= turns * np.ceil(e[..., angle] / turns - 0.5)
        return e

    def rows(self, visible: ArrayLike) -> Mask:
        """Which features (m,) the visible points alone determine; visible: (p,)."""
        seen = np.all(np.asarray(visible, dtype=bool)[self.parts], axis=-1)
        return np.repeat(seen, len(self.quantities))

    @abstractmethod
    def _of(self, ends: Array, z: Array) -> Array:
        """s (..., n, q) of n parts with k points each: ends (..., n, k, 2) in px, z (..., n, k)."""

    @abstractmethod
    def _interaction(self, ends: Array, z: Array) -> Array:
        """L (..., n, q, 6) of the same."""

    def _exists(self, ends: Array) -> Mask:
        """Which features of good images exist and change smoothly, (..., n, q) or (..., n, 1)."""
        return np.ones((*ends.shape[:-2], 1), dtype=bool)

    def _ends(self, image: ArrayLike, depths: ArrayLike) -> tuple[Array, Array]:
        image, depths = np.asarray(image, dtype=np.float64), np.asarray(depths, dtype=np.float64)
        points = image.reshape(*image.shape[:-1], self.points, 2)
        return points[..., self.parts, :], depths[..., self.parts]

    def _sound(self, ends: Array, z: Array) -> Mask:
        """Which features are usable, (..., n, q), or (..., n, 1) where they are all alike."""
        image = (np.abs(ends) < _LARGEST).all(axis=(-1, -2))
        depth = ((z > NEAREST) & (z < np.inf)).all(axis=-1)
        return np.asarray(image & depth)[..., None] & self._exists(ends)


@cache
def _angles(quantities: tuple[Quantity, ...], parts: int) -> tuple[Places, Array]:
    """Which of the features of so many parts are angles, and after which angle each repeats."""
    turns = np.array([quantity.turn for quantity in quantities] * parts)
    angle = np.flatnonzero(turns)
    return angle, turns[angle]


@cache
def each(p: int) -> Places:
    """(p, 1): 0, 1, … p − 1."""
    return np.arange(p)[:, None]


@cache
def sides(p: int) -> Places:
    """(p, 2): the corners at both ends of each side; of two points (1, 2)."""
    first = np.arange(p if p > 2 else 1)
    return np.stack([first, (first + 1) % p], axis=-1)


def _flat(values: Array, axes: int) -> Array:
    """Parts and their features in one axis: (..., n, q, *rest) → (..., n q, *rest)."""
    shape = values.shape
    first = len(shape) - axes
    return values.reshape(*shape[:first], -1, *shape[first + 2 :])
