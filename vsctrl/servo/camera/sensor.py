"""What the vision system tells of a pose: an image with its age, its noise and its gaps.

The true image of a pose is ``look``; what the law is shown of it is ``shown``. Everything that is
random is drawn beforehand from the seed, each kind from a stream of its own, so that one more kind
of disorder leaves the others as they were.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing
from vsctrl.servo.camera.camera import NEAREST, Camera
from vsctrl.servo.camera.lens import distorted
from vsctrl.servo.timing import late

if TYPE_CHECKING:
    from vsctrl.servo.scenario import Scenario
    from vsctrl.servo.scenario.experiment import VisionTable

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Sight(NamedTuple):
    """A true image: features (2p,) in px, depths (p,) in m, and which points it shows.

    visible is None where it shows all. A point that is not in front of the camera has the image
    that was given for it.
    """

    features: Array
    depths: Array
    visible: Mask | None


@dataclass(frozen=True, slots=True, eq=False)
class Eye:
    """Lens and image: which points of the object are seen from a pose, and where.

    camera: the true one; points: (p, 3) in m; k1: its distortion; half: (2,), half the image in
    px, or None where it has no border.
    """

    camera: Camera
    points: Array
    k1: float = 0.0
    half: Array | None = None

    @classmethod
    def of(cls, scenario: "Scenario") -> "Eye":
        """The eye of a scenario."""
        camera, size = scenario.camera, scenario.camera.size_px
        return cls(
            Camera(camera.Fx, camera.Fy),
            np.array(scenario.target.points),
            camera.k1,
            None if size is None else np.array(size) / 2,
        )

    def look(self, oTc: Array, before: Array) -> Sight:
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
        return Sight(features, z, visible)


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Which image the law is shown at each frame, and what was done to it.

    exposed: (n,), when it was taken, s. frame: (n,), the frame it was taken at where that is one,
    else −1. fresh: (n,), whether it is new. index: (n,), its number, which fixes its noise.
    noise: (n, 2p) in px by that number, or None.
    """

    exposed: Array
    frame: NDArray[np.int64]
    fresh: Mask
    index: NDArray[np.int64]
    noise: Array | None
    quantum: float

    @classmethod
    def of(cls, vision: "VisionTable", t: Array, points: int, age: float) -> "Schedule":
        """The schedule of the frames t (n,) in s, of images that are ``age`` periods old."""
        n, period = len(t), vision.period
        k = np.arange(n)
        exposed = late(t, period, age)
        full, share = timing.split(age)
        on_frame = not share
        if vision.jitter:
            draw = np.random.default_rng([vision.seed, 1]).standard_normal(n)
            ages = np.maximum(age * period + vision.jitter * draw, 0.0)
            # A newer image is never replaced by an older one.
            exposed = np.maximum.accumulate(np.maximum(t - ages, 0.0))
            on_frame = False
        fresh = np.ones(n, dtype=bool)
        if vision.missed:
            fresh = np.random.default_rng([vision.seed, 2]).random(n) >= vision.missed
            fresh[0] = True
        index = np.maximum(k - full, 0)
        if vision.jitter:
            index = np.searchsorted(exposed, exposed)
        # What is shown again is not new, and has the noise that it had.
        arrived = np.flatnonzero(fresh)
        fresh[arrived[1:][np.diff(exposed[arrived]) <= 0]] = False
        return cls(
            exposed=exposed,
            frame=index if on_frame else np.where(exposed == 0.0, 0, -1),
            fresh=fresh,
            index=index,
            noise=_noise(vision, n, points),
            quantum=vision.quantum_px,
        )

    def spoiled(self, features: Array, k: int) -> Array:
        """What the vision system makes of the true image (2p,) that it shows at frame k."""
        if self.noise is not None:
            features = features + self.noise[self.index[k]]
        if self.quantum:
            features = self.quantum * np.round(features / self.quantum)
        return features


def _noise(vision: "VisionTable", n: int, points: int) -> Array | None:
    """Noise of every image and mismatches of some points, (n, 2p) in px; None where there is none.

    A mismatch moves a point by a normal deviate in both coordinates, and stays for one image.
    """
    noise = None
    if vision.noise_px:
        draw = np.random.default_rng(vision.seed).standard_normal((n, 2 * points))
        noise = vision.noise_px * draw
    if vision.outliers and vision.outlier_px:
        stream = np.random.default_rng([vision.seed, 3])
        wrong = stream.random((n, points)) < vision.outliers
        moved = vision.outlier_px * stream.standard_normal((n, points, 2))
        mismatch = (moved * wrong[..., None]).reshape(n, 2 * points)
        noise = mismatch if noise is None else noise + mismatch
    return noise
