"""What goes into the controller and what comes out of it at a frame."""

from collections.abc import Callable
from typing import NamedTuple

from vsctrl.arrays import Array, Mask


class Measurement(NamedTuple):
    """What the law is given at a frame.

    frame: k; features: (2p,) in px as measured; depths: (p,) in m, the true ones of that image;
    visible: which points it shows, None if all; fresh: whether the image is new; odometry: gives
    the pose of the nominal camera in the world when the image was taken, (4, 4); rows: (m,),
    which features of the law it shows, None if all (the controller's to fill).
    """

    frame: int
    features: Array
    depths: Array
    visible: Mask | None
    fresh: bool
    odometry: Callable[[], Array]
    rows: Mask | None = None


class ControlAction(NamedTuple):
    """Twist (6,) in m/s and rad/s, rank of L̂, and the error (m,) that the law was given."""

    T: Array
    rank: int
    e: Array
