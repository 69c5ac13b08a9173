"""A Kalman filter on the image: where a moving target is now, and how fast it moves by itself.

The image moves because the camera does and because the target does, ``s' = L T + ∂s/∂t``. The
camera's share is known, so that it is taken off the image and only the rest is filtered: the path
``y = s − ∫ L̂ T dt`` is what a target would draw that is seen from a camera at rest. An image that
is ``d`` periods old corrects the state of *its* time, from which the estimate is carried on to the
present with the camera's motion since; so a delay costs accuracy but makes no bias. Every
coordinate is filtered by itself; which of them are seen and what L̂ T is are the caller's to know.

Features must live on a line: an angle that jumps from π to −π is not handled.

Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation
(2001), chapters 5 (filter, start from differences) and 6 (white-noise acceleration and jerk).
"""

import math
from collections import deque
from typing import Literal, NamedTuple

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array, Mask
from vsctrl.servo import checks

Model = Literal["velocity", "acceleration"]

ORDER: dict[Model, int] = {"velocity": 2, "acceleration": 3}

# What the first image leaves open: standard deviations of the rate, in measurement deviations per
# period, and of the acceleration, per period squared. Both are far above anything seen, so that
# two images make the first rate and three the first acceleration, as differences would; the
# acceleration's is the smaller one, so that the second image is read as a rate.
_UNKNOWN = (1.0, 1e5, 1e3)


class Estimate(NamedTuple):
    """Image s (m,) in px at the present frame, and its ∂s/∂t (m,) in px/s by the target alone."""

    s: Array
    rate: Array


def transition(order: int, dt: float) -> Array:
    """Chain of integrators over a time dt: ``F_ij = dt^(j−i)/(j−i)!`` for j ≥ i.

    order: 2 for (s, v), 3 for (s, v, a); dt in s. Returns (order, order).
    """
    F = np.eye(order)
    for i in range(order):
        for j in range(i + 1, order):
            F[i, j] = dt ** (j - i) / math.factorial(j - i)
    return F


def process_covariance(order: int, dt: float) -> Array:
    """Covariance that white noise of unit intensity at the chain's end makes within dt.

    ``Q_ij = dt^n / ((q−1−i)! (q−1−j)! n)`` with ``n = 2q − 1 − i − j`` and q the order: the exact
    discrete white-noise acceleration (q = 2) and jerk (q = 3) models.

    dt in s. Returns (order, order).
    """
    Q = np.empty((order, order))
    for i in range(order):
        for j in range(order):
            n = 2 * order - 1 - i - j
            share = math.factorial(order - 1 - i) * math.factorial(order - 1 - j)
            Q[i, j] = dt**n / (share * n)
    return Q


class ImageFilter:
    """Image and its own rate at the present frame, from images that are ``latency`` old.

    ``s' = L̂ T + v`` with ``v' = w`` (model "velocity") or ``v' = a, a' = w`` ("acceleration"),
    w white.

    period: between frames, s; latency: age of an image when it arrives, s, of any size;
    process: √ of the spectral density of w: px/s² per √Hz for "velocity", px/s³ per √Hz for
    "acceleration" (a rate wanders by process·√t in a time t, resp. an acceleration);
    measurement: standard deviation of a coordinate in an image, px.
    Raises InputError for a value out of its range.

    >>> filter = vs.servo.ImageFilter("velocity", 0.04, 0.08, process=100, measurement=0.5)
    """

    def __init__(
        self, model: Model, period: float, latency: float, process: float, measurement: float
    ) -> None:
        known = isinstance(model, str) and model in ORDER
        checks.require(known, "model", model, "is none; choose 'velocity' or 'acceleration'.")
        checks.positive("period", period, "a time above 0 s")
        if not isinstance(latency, int | float) or latency != 0:
            checks.positive("latency", latency, "a time of 0 s or more")
        checks.positive(
            "process", process, "an intensity above 0, for with 0 the filter stops to follow"
        )
        checks.positive("measurement", measurement, "a standard deviation above 0 px")
        self._order = ORDER[model]
        self._period = float(period)
        self._process = float(process)
        self._variance = float(measurement) ** 2
        self._delay = timing.in_periods(latency, period)
        self._frame = -1
        self._motion = self._over(1.0)
        self._horizon, self._ahead = 0.0, self._over(0.0)
        # ∫ L̂ T dt at the last frames, as far back as the oldest image can be.
        self._path: deque[Array] = deque(maxlen=math.floor(self._delay) + 2)
        self._begin(0)

    @property
    def known(self) -> Mask:
        """Coordinates (m,) that an image has shown already; the others are estimated as 0."""
        return self._last > -np.inf

    @property
    def covariance(self) -> Array:
        """Covariance (m, q, q) of (s, v[, a]) at the present frame; ∞ where nothing is known."""
        F, Q = self._ahead
        out = F @ self._P @ F.T + Q
        out[~self.known] = np.diag(np.full(self._order, np.inf))
        return out

    def update(self, s_measured: Array, fresh: bool, visible: Mask, camera_rate: Array) -> Estimate:
        """Take in frame k = 0, 1, 2, … and return the estimate at ``t_k``.

        The image is of ``max(0, t_k − latency)``. An image of a time that was taken in before (the
        first one, repeated until the second arrives) says nothing new and is left out; so is one
        that is not fresh, and a coordinate that is not visible or not finite.

        s_measured: (m,) in px; fresh: whether this image is a new one; visible: (m,);
        camera_rate: (m,), the finite L̂ T that the camera's twist caused over [t_k−1, t_k], px/s
        (no matter at k = 0). Returns Estimate.
        """
        before = max(0.0, self._frame - self._delay)
        self._frame += 1
        if self._frame == 0:
            self._begin(len(s_measured))
        else:
            self._path.append(self._path[-1] + self._period * camera_rate)
        now = max(0.0, self._frame - self._delay)
        self._advance(now - before)
        if self._frame - now != self._horizon:
            self._horizon, self._ahead = self._frame - now, self._over(self._frame - now)
        if fresh:
            use = visible & np.isfinite(s_measured) & (self._last < now)
            own = np.where(use, s_measured - self._moved(self._horizon), 0.0)
            self._correct(own, use)
            self._last[use] = now
        ahead = self._x @ self._ahead[0].T
        return Estimate(np.where(self.known, ahead[:, 0] + self._path[-1], 0.0), ahead[:, 1])

    def _begin(self, m: int) -> None:
        self._x = np.zeros((m, self._order))
        self._P = np.zeros((m, self._order, self._order))
        self._last = np.full(m, -np.inf)  # time of the last image taken in, in periods
        self._path.clear()
        self._path.append(np.zeros(m))

    def _over(self, periods: float) -> tuple[Array, Array]:
        """Transition and process noise over a time; the two that every frame needs are kept."""
        dt = periods * self._period
        noise = self._process**2 * process_covariance(self._order, dt)
        return transition(self._order, dt), noise

    def _moved(self, age: float) -> Array:
        """``∫ L̂ T dt`` up to ``age`` periods ago; L̂ T is constant between frames."""
        whole = math.floor(age)
        part = age - whole
        later = self._path[-1 - whole]
        return later if part == 0 else (1 - part) * later + part * self._path[-2 - whole]

    def _advance(self, periods: float) -> None:
        """Let time pass for the state at the image's time."""
        if periods == 0:
            return
        F, Q = self._motion if periods == 1 else self._over(periods)
        self._x = self._x @ F.T
        self._P = F @ self._P @ F.T + Q

    def _correct(self, own: Array, use: Mask) -> None:
        """Take in an image, less the camera's share, of the coordinates to use."""
        first = use & ~self.known
        if first.any():
            scale = [u / self._period**i for i, u in enumerate(_UNKNOWN)]
            self._P[first] = self._variance * np.diag(np.square(scale[: self._order]))
            self._x[first, 0] = own[first]
        again = use & ~first
        gain = self._P[:, :, 0] / (self._P[:, :1, 0] + self._variance)
        gain[~again] = 0.0
        self._x = self._x + gain * (own - self._x[:, 0])[:, None]
        # Joseph's form keeps the covariance positive through the huge one of the start.
        kept = np.eye(self._order) - gain[:, :, None] * np.eye(self._order)[0]
        noise = self._variance * gain[:, :, None] * gain[:, None, :]
        self._P = kept @ self._P @ kept.transpose(0, 2, 1) + noise
