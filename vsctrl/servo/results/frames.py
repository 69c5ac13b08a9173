"""The record of a simulation, frame by frame: what moved, what was seen, and how it ended."""

from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Array, Mask
from vsctrl.errors import InputError
from vsctrl.servo.results.status import Event, Status
from vsctrl.servo.scenario import Scenario

# A speed below this share of the greatest one is rest: its direction would be rounding.
STILL = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
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
    excitation: (n, p) without unit, of the depth observer (``estimation.depth_observer``), both of
    the image that the law was shown at the frame, which is as old as the latency.
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
    visible: Mask
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
        V = self.reference_velocity
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
        return along / np.linalg.norm(V, axis=1)

    @property
    def reference_velocity(self) -> Array:
        """Of the reference at the frames, in its camera frame, (n, 3) in m/s."""
        return self.scenario.reference.twist_at_frames(self.t)[:, :3]
