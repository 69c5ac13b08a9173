"""Features that the law may servo on, all computed from the image of the same points.

s is a function of pixels (and of depths in "points-and-depth"), so that images that are equal have
equal features whatever the law assumes of its camera; a wrong focal length enters L alone. The
formulas are in ``kernels``; here they are laid out over the points, and watched where they end: a
segment without length has no direction. Which depths are
assumed is left to ``control.depths``.

Lengths are in px, directions in rad. The rank of L says how many degrees of freedom a set controls;
a set of fewer than six is not refused.
"""

import math
from collections.abc import Callable
from types import MappingProxyType
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Mask
from vsctrl.checks import quoted
from vsctrl.errors import InputError, nearest
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.features.feature_set import Measures, Places, Quantity, each, sides
from vsctrl.servo.generated import kernels

__all__ = ["MEASURES", "ROUND", "SHORTEST", "Measures", "measures"]

# What is shorter than this (px) has no direction: no vision system tells a thousandth of a pixel.
SHORTEST = 1e-3
# Points of which the long axis is longer than the short one by less than this share have none.
ROUND = 1e-3
_TURN = 2 * math.pi


class Points(Measures):
    """(X, Y) of each point, as ``Camera`` has them. Rank 2, 4 and 6 of 1, 2 and 3 points."""

    quantities = (Quantity("X", "px"), Quantity("Y", "px"))

    def of(self, image: ArrayLike, depths: ArrayLike) -> Array:
        """The image itself, (..., 2p)."""
        return np.asarray(image, dtype=np.float64)

    def interaction(self, image: ArrayLike, depths: ArrayLike) -> Array:
        """``Camera.interaction``, (..., 2p, 6)."""
        image, depths = np.asarray(image, dtype=np.float64), np.asarray(depths, dtype=np.float64)
        return self.camera.interaction(image, depths)

    def _of(self, ends: Array, z: Array) -> Array:
        return ends[..., 0, :]

    def _interaction(self, ends: Array, z: Array) -> Array:
        return _points(self.camera, ends, z)[..., 0, :, :]


class PointsAndDepth(Measures):
    """(X, Y, log(z/1 m)) of each point, 2½-D. Rank 3, 5 and 6 of 1, 2 and 3 points.

    Here s depends on the depths that it is given; a common factor in them shifts s by a constant.
    """

    quantities = (Quantity("X", "px"), Quantity("Y", "px"), Quantity("log_z", "1"))

    def _of(self, ends: Array, z: Array) -> Array:
        shape = np.broadcast_shapes(ends.shape[:-1], z.shape)
        xy, logs = np.broadcast_to(ends, (*shape, 2)), np.broadcast_to(np.log(z), shape)
        return np.concatenate([xy[..., 0, :], logs], axis=-1)

    def _interaction(self, ends: Array, z: Array) -> Array:
        camera, X, Y = self.camera, ends[..., 0], ends[..., 1]
        depth = kernels.log_depth_interaction(X, Y, z, camera.Fx, camera.Fy, 1.0)
        return np.concatenate([_points(camera, ends, z), depth], axis=-2)[..., 0, :, :]


class Polar(Measures):
    """(ρ, θ) of each point about the principal point. Rank 2, 4 and 6 of 1, 2 and 3 points.

    Neither is usable where ρ < ``SHORTEST``: ρ has a kink there and θ no value.
    """

    quantities = (Quantity("rho", "px"), Quantity("theta", "rad", _TURN))

    def _of(self, ends: Array, z: Array) -> Array:
        return kernels.polar_point_image(ends[..., 0, 0], ends[..., 0, 1])

    def _interaction(self, ends: Array, z: Array) -> Array:
        rho, theta = _columns(self._of(ends, z))
        camera = self.camera
        return kernels.polar_point_interaction(rho, theta, z[..., 0], camera.Fx, camera.Fy)

    def _exists(self, ends: Array) -> Mask:
        return self._of(ends, ends)[..., :1] >= SHORTEST


class _Sides(Measures):
    """Features of the sides of the polygon: of 1 to 2, 2 to 3 … p to 1; 2 points have one side."""

    least = 2

    @property
    def parts(self) -> Places:
        """The two ends of each side, (sides, 2)."""
        return sides(self.points)


class Segments(_Sides):
    """Middle, length and direction of each side of the polygon (x_c, y_c, l, α).

    α is the direction from the second end to the first. Rank 4 of 2 points, which have one side,
    and 6 of 3. Where l < ``SHORTEST``, l and α are not usable.
    """

    quantities = (
        Quantity("x_c", "px"),
        Quantity("y_c", "px"),
        Quantity("l", "px"),
        Quantity("alpha", "rad", _TURN),
    )
    _image: ClassVar[Callable[..., Array]] = staticmethod(kernels.segment_image)
    _L: ClassVar[Callable[..., Array]] = staticmethod(kernels.segment_interaction)

    def _of(self, ends: Array, z: Array) -> Array:
        (X_1, Y_1), (X_2, Y_2) = _ends(ends)
        return self._image(X_1, Y_1, X_2, Y_2)

    def _interaction(self, ends: Array, z: Array) -> Array:
        (x, y, l, alpha), (z_1, z_2) = _columns(self._of(ends, z)), _columns(z)
        return self._L(x, y, l, alpha, z_1, z_2, self.camera.Fx, self.camera.Fy)

    def _exists(self, ends: Array) -> Mask:
        out = np.ones((*ends.shape[:-2], 4), dtype=bool)
        out[..., 2:] = _long(ends)
        return out


class NormalisedSegments(Segments):
    """(x_c/l, y_c/l, 1/l, α) of the sides of the polygon, see ``Segments``; same ranks.

    Of a side that is parallel to the image the first three do not couple the translations: those
    columns are a constant diagonal matrix where Fx = Fy. Nothing is usable where l < ``SHORTEST``.
    """

    quantities = (
        Quantity("x_n", "1"),
        Quantity("y_n", "1"),
        Quantity("l_n", "1/px"),
        Quantity("alpha", "rad", _TURN),
    )
    _image = staticmethod(kernels.normalised_segment_image)
    _L = staticmethod(kernels.normalised_segment_interaction)

    def _exists(self, ends: Array) -> Mask:
        return _long(ends)


class Lines(_Sides):
    """(ρ, θ) of the lines through the sides of the polygon: X cos θ + Y sin θ = ρ.

    θ is that of p × q for a side from p to q, so that it does not jump as ρ goes through 0. The
    plane that L is written in contains the line and, in the image, runs on level at right angles to
    it; L is the same for every other plane through the line. Rank 2 of 2 points, 6 of 3. Nothing is
    usable where the side is shorter than ``SHORTEST``.
    """

    quantities = (Quantity("rho", "px"), Quantity("theta", "rad", _TURN))

    def _of(self, ends: Array, z: Array) -> Array:
        (X_1, Y_1), (X_2, Y_2) = _ends(ends)
        return kernels.line_image(X_1, Y_1, X_2, Y_2)

    def _interaction(self, ends: Array, z: Array) -> Array:
        Fx, Fy = self.camera.Fx, self.camera.Fy
        x = ends / [Fx, Fy]
        along, near = x[..., 0, :] - x[..., 1, :], 1 / z
        # 1/z = A x + B y + C with (A, B) along the line and the right 1/z at both ends.
        slope = (near[..., 0] - near[..., 1]) / np.sum(along * along, axis=-1)
        AB = slope[..., None] * along
        C = near[..., 0] - np.sum(AB * x[..., 0, :], axis=-1)
        (rho, theta), (A, B) = _columns(self._of(ends, z)), _columns(AB)
        return kernels.line_interaction(rho, theta, A, B, C, Fx, Fy)

    def _exists(self, ends: Array) -> Mask:
        return _long(ends)


class Moments(Measures):
    """Six moments of the point set: one row for each degree of freedom, however many points.

    (x_g/√a, y_g/√a, 1/√a, (μ_30 + μ_12)/a^(3/2), (μ_21 + μ_03)/a^(3/2), α) with centre of gravity
    (x_g, y_g), a = μ_20 + μ_02 and α the direction of the long axis. The points need not lie in a
    plane. Rank 6 of 3 or more points in general position, 4 of 2, whose third moments are always 0
    and not usable. Nothing is usable where √a < ``SHORTEST``, and α not where the points are as
    wide as long, as the corners of a square (``ROUND``).
    """

    quantities = (
        Quantity("x_n", "1"),
        Quantity("y_n", "1"),
        Quantity("a_n", "1/px"),
        Quantity("skew_x", "1"),
        Quantity("skew_y", "1"),
        Quantity("alpha", "rad", math.pi),
    )
    least = 2

    @property
    def parts(self) -> Places:
        """All points, (1, p)."""
        return each(self.points).T

    def _of(self, ends: Array, z: Array) -> Array:
        return kernels.moments_image(*_moments(ends))

    def _interaction(self, ends: Array, z: Array) -> Array:
        known = _Sums(*(moment[..., None] for moment in _moments(ends)))
        u, v = ends[..., 0] - known.x_g, ends[..., 1] - known.y_g
        by_point = kernels.moments_gradient(u, v, *known, float(self.points))
        # The chain rule: what each point contributes, summed over the points.
        return np.sum(by_point @ _points(self.camera, ends, z), axis=-3)

    def _exists(self, ends: Array) -> Mask:
        # Of all moments the second ones alone are needed.
        centre = ends.sum(axis=-2) / ends.shape[-2]
        u, v = _columns(ends - centre[..., None, :])
        uu, vv = u * u, v * v
        a, difference, mu_11 = np.array((uu + vv, uu - vv, u * v)).sum(axis=-1)
        spread = np.sqrt(a) >= SHORTEST
        out = np.empty((*spread.shape, 6), dtype=bool)
        out[..., :3] = spread[..., None]
        out[..., 3:5] = (spread & (self.points > 2))[..., None]
        out[..., 5] = spread & (np.hypot(difference, 2 * mu_11) >= ROUND * a)
        return out


#: Name → set of features.
MEASURES: MappingProxyType[str, type[Measures]] = MappingProxyType(
    {
        "points": Points,
        "polar": Polar,
        "segments": Segments,
        "normalised-segments": NormalisedSegments,
        "lines": Lines,
        "moments": Moments,
        "points-and-depth": PointsAndDepth,
    }
)


def measures(name: str, camera: Camera, points: int) -> Measures:
    """The set of features of that name, of so many points seen by that camera.

    Raises InputError for an unknown name, and for fewer points than the set needs.
    """
    if name not in MEASURES:
        raise InputError(
            f"features: {quoted(name)} is not known{nearest(name, MEASURES)}; choose one of "
            f"{', '.join(MEASURES)}."
        )
    kind = MEASURES[name]
    if points < kind.least:
        raise InputError(
            f"features: {quoted(name)} needs a target of {kind.least} points or more, and this "
            "one has "
            f"{points}; add points or take other features, like 'points'."
        )
    return kind(camera, points)


def _points(camera: Camera, ends: Array, z: Array) -> Array:
    """L of every point, (..., n, k, 2, 6)."""
    return kernels.point_interaction(ends[..., 0], ends[..., 1], z, camera.Fx, camera.Fy)


class _Sums(NamedTuple):
    """Centre of gravity and centred moments, each (..., n)."""

    x_g: Array
    y_g: Array
    mu_20: Array
    mu_11: Array
    mu_02: Array
    mu_30: Array
    mu_21: Array
    mu_12: Array
    mu_03: Array


def _moments(ends: Array) -> _Sums:
    centre = ends.sum(axis=-2) / ends.shape[-2]
    u, v = _columns(ends - centre[..., None, :])
    uu, vv = u * u, v * v
    terms = np.array((uu, u * v, vv, uu * u, uu * v, u * vv, vv * v))
    return _Sums(*_columns(centre), *terms.sum(axis=-1))


def _columns(values: Array) -> list[Array]:
    """The places of the last axis, for unpacking."""
    return [values[..., i] for i in range(values.shape[-1])]


def _ends(ends: Array) -> list[list[Array]]:
    """X and Y of the first end, then of the second, for unpacking."""
    return [_columns(ends[..., i, :]) for i in range(ends.shape[-2])]


def _long(ends: Array) -> Mask:
    """Which sides have a direction, (..., n, 1)."""
    X, Y = _columns(ends[..., 0, :] - ends[..., 1, :])
    return np.asarray(np.hypot(X, Y) >= SHORTEST)[..., None]
