"""What a camera and its carrier may do: the limits that a reference is held against."""

import math
from dataclasses import dataclass, fields

from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.servo.camera.camera import NEAREST


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the camera's motion and view; those of the joints belong to the robot.

    speed: |V| in m/s; rate: |Ω| in rad/s (defaults: the AFMA6's caps). acceleration:
    ``|V' + Ω × V|`` in m/s², that of the camera's centre in space, which is felt on a circle at
    constant twist too (the simulator's robot.acceleration_limit bounds |V'| alone, of the twist's
    components in the camera frame); angular_acceleration: |Ω'| in rad/s² (no figures are
    published: the defaults reach full speed in 0.2 s). field_of_view: (half width, half height) of
    the image from the principal point, px, or None; nearest, farthest: depths of the target's
    points in m. math.inf is no limit.
    Raises InputError for a value that is no number above 0.

    >>> vs.servo.Limits(speed=0.1).speed
    0.1
    """

    speed: float = 0.2
    rate: float = 0.7
    acceleration: float = 1.0
    angular_acceleration: float = 3.5
    field_of_view: tuple[float, float] | None = None
    nearest: float = NEAREST
    farthest: float = math.inf

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self) if f.name != "field_of_view"):
            _check(name, getattr(self, name))
        if self.field_of_view is not None:
            if not isinstance(self.field_of_view, tuple | list) or len(self.field_of_view) != 2:
                raise InputError(
                    f"field_of_view: {quoted(self.field_of_view)} is no image; give (half width, "
                    "half "
                    "height) in px."
                )
            for value in self.field_of_view:
                _check("field_of_view", value)
        if not self.nearest < self.farthest:
            raise InputError(
                f"nearest: {self.nearest:g} m is not nearer than farthest, {self.farthest:g} m; "
                "exchange them."
            )


def _check(name: str, value: object) -> None:
    known = isinstance(value, float | int) and not isinstance(value, bool)
    if not known or not value > 0:  # type: ignore[operator]
        raise InputError(
            f"{name}: {quoted(value)} is no limit; give a number above 0, or math.inf for none."
        )
