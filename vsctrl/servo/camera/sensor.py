"""The camera as a sensor: what a pose shows, and what the law measures of it, when and how wrong.

The true image of a pose is ``CameraSensor.look``; what the law is given of it is
``Schedule.corrupted``. Everything random is drawn beforehand from the seed, each kind from a stream
of its own, so that one more kind of disorder leaves the others as they were.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing
from vsctrl.arrays import Array, Mask
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.camera.lens import distorted
from vsctrl.servo.timing import delayed

# Numbers beyond this are whole, in double precision.
_WHOLE = 2.0**52


class TrueImage(NamedTuple):
    """An image without errors: features (2p,) in px, depths (p,) in m, and which points it shows.

    visible is None where it shows all. A point that is not in front of the camera has the image
    that was given for it.
    """

    features: Array
    depths: Array
    visible: Mask | None


@dataclass(frozen=True, slots=True, eq=False)
class CameraSensor:
    """Lens and image: which points of the object are seen from a pose, and where.

    camera: the true one; points: (p, 3) in m; k1: its distortion; half: (2,), half the image in
    px, or None where it has no border.
    """

    camera: Camera
    points: Array
    k1: float = 0.0
    half: Array | None = None

    def look(self, oTc: Array, before: Array) -> TrueImage:
        """The image from oTc (4, 4); before: (2p,), what to show of points behind the camera."""
        p = self.camera.points(oTc, self.points)
        z = p[:, 2]
        front = z > NEAREST
        visible: Mask | None = None
        if front.all():
            features = self.camera.features(p)
        else:
            features = np.where(
                np.repeat(front, 2), self.camera.features(np.where(front[:, None], p, 1.0)), before
            )
            visible = front
        if self.k1:
            seen = distorted(self.camera, features, self.k1)
            features = seen if visible is None else np.where(np.repeat(front, 2), seen, before)
        if self.half is not None:
            inside = np.all(np.abs(features.reshape(-1, 2)) <= self.half, axis=1)
            if not inside.all():
                visible = inside if visible is None else inside & visible
        return TrueImage(features, z, visible)


@dataclass(frozen=True, slots=True)
class MeasurementErrors:
    """What is wrong with measurements, as [vision] of a scenario has it; units as there."""

    jitter: float = 0.0
    missed: float = 0.0
    noise_px: float = 0.0
    quantum_px: float = 0.0
    outliers: float = 0.0
    outlier_px: float = 0.0
    seed: int = 0

    def noise(self, n: int, points: int) -> Array | None:
        """Noise of n images and mismatches of some points, (n, 2p) in px; None if there is none.

        A mismatch moves a point by a normal deviate in both coordinates, and stays for one image.
        """
        noise = None
        if self.noise_px:
            draw = np.random.default_rng(self.seed).standard_normal((n, 2 * points))
            noise = self.noise_px * draw
        if self.outliers and self.outlier_px:
            stream = np.random.default_rng([self.seed, 3])
            wrong = stream.random((n, points)) < self.outliers
            moved = self.outlier_px * stream.standard_normal((n, points, 2))
            mismatch = (moved * wrong[..., None]).reshape(n, 2 * points)
            noise = mismatch if noise is None else noise + mismatch
        return noise


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Which image the law is given at each frame, and what was done to it.

    exposed: (n,), when it was taken, s. frame: (n,), the frame it was taken at where that is one,
    else −1. fresh: (n,), whether it is new. index: (n,), its number, which fixes its noise.
    noise: (n, 2p) in px by that number, or None. quantum: px to which coordinates are rounded.
    """

    exposed: Array
    frame: NDArray[np.int64]
    fresh: Mask
    index: NDArray[np.int64]
    noise: Array | None
    quantum: float

    @classmethod
    def of(
        cls, errors: MeasurementErrors, t: Array, period: float, points: int, age: float
    ) -> "Schedule":
        """The schedule of the frames t (n,) and a period in s, of images ``age`` periods old."""
        n = len(t)
        k = np.arange(n)
        exposed = delayed(t, period, age)
        full, fraction = timing.split(age)
        on_frame = not fraction
        if errors.jitter:
            draw = np.random.default_rng([errors.seed, 1]).standard_normal(n)
            ages = np.maximum(age * period + errors.jitter * draw, 0.0)
            # A newer image is never replaced by an older one.
            exposed = np.maximum.accumulate(np.maximum(t - ages, 0.0))
            on_frame = False
        fresh = np.ones(n, dtype=bool)
        if errors.missed:
            fresh = np.random.default_rng([errors.seed, 2]).random(n) >= errors.missed
            fresh[0] = True
        index = np.maximum(k - full, 0)
        if errors.jitter:
            index = np.searchsorted(exposed, exposed)
        # What is shown again is not new, and has the noise that it had.
        arrived = np.flatnonzero(fresh)
        fresh[arrived[1:][np.diff(exposed[arrived]) <= 0]] = False
        return cls(
            exposed=exposed,
            frame=index if on_frame else np.where(exposed == 0.0, 0, -1),
            fresh=fresh,
            index=index,
            noise=errors.noise(n, points),
            quantum=errors.quantum_px,
        )

    def corrupted(self, features: Array, k: int) -> Array:
        """What the sensor makes of the true image (2p,) that the law is given at frame k, px."""
        if self.noise is not None:
            features = features + self.noise[self.index[k]]
        return rounded(features, self.quantum) if self.quantum else features


def rounded(features: Array, quantum: float) -> Array:
    """Coordinates in px to whole multiples of a quantum above 0, px.

    What is finer than their last digit, as the smallest of all numbers is, leaves them as they are.
    """
    with np.errstate(over="ignore"):
        count = features / quantum
    return np.where(np.abs(count) < _WHOLE, quantum * np.round(count), features)
