"""What a camera makes of a direction: from normalised image coordinates to those it reports.

Features are derived in the coordinates that their camera reports, so that pixels, skew and lens
distortion come in by the chain rule and nowhere else.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sympy import Dummy, Expr, ImmutableMatrix, S, Symbol

from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.derive.inputs import decimals, scalar, symbols_in
from vsctrl.derive.kinematics.interaction import point_velocity
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, X, Y, x, y, z


@dataclass(frozen=True)
class Camera(Caching):
    """X = F_x x_d + skew y_d + u_0, Y = F_y y_d + v_0 of the normalised image point (x, y).

    ``focal`` (F_x, F_y), ``centre`` (u_0, v_0) and ``skew`` in pixels; ``distortion`` (k_1, k_2, …)
    of (x_d, y_d) = (x, y)(1 + k_1 ρ² + k_2 ρ⁴ + …), ρ² = x² + y². Numbers or symbols; floats are
    kept exactly as the decimals that they print as, 812.3 as 8123/10. Without arguments pixels from
    the principal point, as in eq. 15.
    Errors: `InputError` for a focal length of 0 and for what is no number or expression.

    >>> vs.derive.Point(vs.derive.Camera(focal=(600, 600))).expressions
    (600*x/z, 600*y/z)
    """

    focal: tuple[Expr, Expr] = (F_x, F_y)
    centre: tuple[Expr, Expr] = (S.Zero, S.Zero)
    skew: Expr = S.Zero
    distortion: tuple[Expr, ...] = ()

    def __post_init__(self) -> None:
        for field, size in (("focal", 2), ("centre", 2), ("distortion", None)):
            numbers = getattr(self, field)
            if not isinstance(numbers, tuple | list) or (size and len(numbers) != size):
                raise InputError(f"Camera: {field} = {quoted(numbers)} must be a pair of numbers.")
            entries = (scalar(f"Camera: {field}[{i}]", e) for i, e in enumerate(numbers))
            object.__setattr__(self, field, tuple(map(decimals, entries)))
        object.__setattr__(self, "skew", decimals(scalar("Camera: skew", self.skew)))
        if any(length.is_zero for length in self.focal):
            raise InputError(f"Camera: focal = {self.focal} has a zero; give lengths in pixels.")

    @cached_property
    def parameters(self) -> tuple[Symbol, ...]:
        """The symbols among its numbers, in the order focal, centre, skew, distortion."""
        return symbols_in((*self.focal, *self.centre, self.skew, *self.distortion))

    def image(self, x_n: Expr, y_n: Expr) -> tuple[Expr, Expr]:
        """(X, Y) as reported, of the normalised image point."""
        square = x_n**2 + y_n**2
        factor = 1 + sum(k * square ** (i + 1) for i, k in enumerate(self.distortion))
        x_d, y_d = factor * x_n, factor * y_n
        (f_x, f_y), (u_0, v_0) = self.focal, self.centre
        return f_x * x_d + self.skew * y_d + u_0, f_y * y_d + v_0

    def normalised(self, u: Expr, v: Expr) -> tuple[Expr, Expr]:
        """(x, y) of an image point as reported. Errors: `InputError` where the lens distorts."""
        self.require_straight()
        (f_x, f_y), (u_0, v_0) = self.focal, self.centre
        y_n = (v - v_0) / f_y
        return (u - u_0 - self.skew * y_n) / f_x, y_n

    def require_straight(self) -> None:
        """Refuse a lens that bends straight lines. Errors: `InputError`."""
        if any(not k.is_zero for k in self.distortion):
            raise InputError(
                "This feature needs a camera that maps lines to lines; undistort the image first, "
                "or leave the distortion out."
            )

    def velocity(self, u: Expr = X, v: Expr = Y, inverse_depth: Expr = 1 / z) -> ImmutableMatrix:
        """The 2×6 matrix of (X', Y') = … T for an image point, in (X, Y) as reported and 1/z."""
        p = (x, y, z)
        moved = ImmutableMatrix(self.image(x / z, y / z)).jacobian(p) * point_velocity(p)
        x_n, y_n = self.normalised(u, v)
        depth = Dummy("depth", positive=True)
        moved = moved.subs({x: x_n * z, y: y_n * z}, simultaneous=True).subs(z, depth)
        return moved.applyfunc(lambda entry: entry.expand().subs(depth, 1 / inverse_depth))


def checked_camera(camera: Any) -> Camera:
    """The camera itself. Errors: `InputError` for what is none."""
    if not isinstance(camera, Camera):
        raise InputError(
            f"camera = {quoted(camera)} is no camera; give derive.PIXELS or "
            "derive.Camera(focal=(…, …), centre=(…, …)), or leave it out for normalised "
            "coordinates."
        )
    return camera


NORMALISED = Camera(focal=(S.One, S.One))
PIXELS = Camera()
