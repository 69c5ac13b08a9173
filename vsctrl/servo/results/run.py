"""The record of a simulation: what moved, what was seen, and how it ended.

A run carries the scenario that made it. It only holds and summarises; ``simulate`` makes it. What
one does with it is done elsewhere: files in ``archive``, datasets in ``dataset``, the notebook's
picture in ``sketch``, numbers and sentences in ``outcome``, figures in ``vsctrl.report.plots``.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError
from vsctrl.servo.results.columns import measured_in_pixels
from vsctrl.servo.scenario import Scenario
from vsctrl.tables import html

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
# A speed below this share of the greatest one is rest: its direction would be rounding.
STILL = 1e-9

Kind = Literal[
    "completed",
    "target behind camera",
    "too few points",
    "all points lost",
    "rank loss",
    "pose not found",
    "joint limit",
    "diverged",
]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that a run went on in spite of: what, from which frame on, in how many frames."""

    kind: str
    frame: int
    frames: int
    sentence: str


@dataclass(frozen=True, slots=True)
class Status:
    """How a run ended.

    ok: every frame was computed; kind: what happened; frame: the last frame of a completed run,
    else the frame that failed; sentence: the same for a reader, with the remedy.
    """

    ok: bool
    kind: Kind
    frame: int
    sentence: str


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What happened in n frames; read-only arrays of finite numbers, whatever the status.

    scenario: what was run. t: (n,) in s. pose, reference_pose: (n, 4, 4), oTc and oTc* in the
    frame of the object, where that is at each time. features, reference: (n, 2p) in px, the images
    s of the points and the s* that the law is given. error: (n, 2p) in px, the true ``s(t_k) −
    s*(t_k)``. measured_error: (n, m), what the law was shown (delayed, with noise), in the
    features of the law. command: (n, 6) in m/s and rad/s, the law's. twist: (n, 6), the camera's
    in the mean over [t_k, t_k+1]. lag: (n, 6) in m and rad, ``ξ_k = log(oTc*⁻¹ oTc)``. depths:
    (n, p) in m. visible: (n, p), which points the image shows; the image of a point behind the
    camera is kept from when it was last in front. status: how it ended; events: what it went on
    in spite of. joints: (n, 6) in m and rad, of a gantry. depth_estimate: (n, p) in m, and
    excitation: (n, p) without unit, of the depth observer (see ``control.observer``), both of the
    image that the law was shown at the frame, which is as old as the latency.
    """

    scenario: Scenario
    t: Array
    pose: Array
    reference_pose: Array
    features: Array
    reference: Array
    error: Array
    measured_error: Array
    command: Array
    twist: Array
    lag: Array
    depths: Array
    visible: NDArray[np.bool_]
    status: Status
    events: tuple[Event, ...] = ()
    joints: Array | None = None
    depth_estimate: Array | None = None
    excitation: Array | None = None

    @property
    def lag_along_motion(self) -> Array:
        """The lag's translation along the reference velocity, (n,) in m; negative is behind.

        ``v_k · V_k/|V_k|`` with V_k the velocity of the reference at frame k, in the camera frame
        like the lag; so it changes sign where the motion turns back. A frame at rest takes the
        direction of the last frame before it that moves, else of the first one.
        Raises InputError when the reference does not translate.
        """
        V = self._reference_velocity
        size = np.abs(V).max(axis=1)
        moving = np.flatnonzero(size > STILL * size.max())
        if not moving.size:
            field = "motion.V" if self.scenario.motion.kind == "screw" else "motion"
            raise InputError(
                f"{field}: the reference has no velocity, so there is no direction to lag along; "
                "use run.lag, or give the motion a velocity."
            )
        before = np.searchsorted(moving, np.arange(len(V)), side="right") - 1
        chosen = moving[np.maximum(before, 0)]
        V = V[chosen] / size[chosen, None]  # so that the square of a tiny velocity does not vanish
        along = np.sum(self.lag[:, :3] * V, axis=1)
        out: Array = along / np.linalg.norm(V, axis=1)
        return out

    @property
    def _reference_velocity(self) -> Array:
        """Of the reference at the frames of the run, in its camera frame, (n, 3) in m/s."""
        return self.scenario.reference.twist_at_frames(self.t)[:, :3]

    def save(self, path: str | Path) -> None:
        """Write the run to exactly this path as a NumPy archive: all of it or nothing.

        ``np.load`` opens it too; see ``archive`` for what is in it. Equal runs give equal bytes.
        Raises InputError when the file cannot be written.
        """
        from vsctrl.servo.results import archive

        archive.save(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """The run in a file that ``save`` wrote, exactly; everything in it is checked.

        Raises InputError, a sentence that begins with the path.
        """
        from vsctrl.servo.results import archive

        return archive.load(cls, Path(path))

    def to_xarray(self) -> "xarray.Dataset":
        """All arrays with named dimensions, units and meanings; needs ``vsctrl[scale]``.

        Dimensions: frame (with the time t in s), feature (X1, Y1, …), component (Vx … Ωz), row and
        column of poses, point, joint. Attributes: the scenario as TOML, its digest, status, events.
        Raises InputError when xarray is not installed.
        """
        from vsctrl.servo.results.dataset import dataset

        return dataset(self)

    def __repr__(self) -> str:
        """One line, whatever the number of frames."""
        name, end = self.scenario.name, self.t[-1] if len(self.t) else 0.0
        return (
            f"<Run of {name} ({self.scenario.digest}): {len(self.t)} frames to t = {end:g} s, "
            f"{self.status.kind}>"
        )

    def _repr_html_(self) -> str:
        """A small table of the run's end and a picture of its course, for notebooks."""
        from vsctrl.servo.results.notebook_svg import sketch
        from vsctrl.servo.results.outcome import number

        rows = [
            ("scenario", f"{self.scenario.name} ({self.scenario.digest})"),
            ("status", f"{self.status.kind}: {self.status.sentence}"),
            ("frames", f"{len(self.t)} (to t = {self.t[-1]:g} s)"),
        ]
        if self._reference_velocity.any():
            rows.append(("final lag along motion", f"{number(1e3 * self.lag_along_motion[-1])} mm"))
        rows.append(("final true error", f"{number(float(np.linalg.norm(self.error[-1])))} px"))
        unit = "px" if measured_in_pixels(self.scenario) else "in the law's features"
        seen = np.linalg.norm(self.measured_error[-1])
        rows.append(("final measured error", f"{number(float(seen))} {unit}"))
        rows += [("event", event.sentence) for event in self.events]
        return f"{html(rows, labels=True, left=2)}{sketch(self)}"
