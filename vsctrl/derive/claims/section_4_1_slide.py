"""Section 4.1: the slide along the cube, its developed forms and the numbers of the set-up.

Lengths are in m. The reference is derived by ``vsctrl.derive.references`` and compared with the
print; ds*/dt, which the paper never gives, is derived with it.
"""

from functools import cache

from sympy import Expr, Gt, ImmutableMatrix, Integer, Lt, Rational, Symbol, pi, sqrt, symbols

from vsctrl.derive.camera import PIXELS
from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.section_4_set_up import LEDS
from vsctrl.derive.features.points import Point
from vsctrl.derive.kinematics import motion
from vsctrl.derive.references.references import Reference, translation_reference
from vsctrl.symbols import F_x, F_y, V_x, V_y, V_z, t, x_0, y_0, z_0

p_0 = ImmutableMatrix([x_0, y_0, z_0])
_DEGREES = (Integer(2), Rational(42, 10), -Rational(2, 10))
PERIOD = Symbol("T_s", positive=True)


@cache
def slide() -> Reference:
    """The reference of section 4.1, an image point along V = (V_x, 0, 0)."""
    return translation_reference(Point(PIXELS), V=(V_x, 0, 0))


def printed_slide() -> ImmutableMatrix:
    """X* and Y* of section 4.1, with the coordinates at t₀."""
    return ImmutableMatrix([(x_0 - V_x * t) / z_0 * F_x, y_0 / z_0 * F_y])


def moving(formula: ImmutableMatrix, path: ImmutableMatrix) -> ImmutableMatrix:
    """A printed formula with x(t), y(t), z(t) on its right side taken at the time t."""
    return formula.subs(dict(zip(p_0, path, strict=True)), simultaneous=True)


def cited(point: ImmutableMatrix, printed: ImmutableMatrix) -> Evidence:
    """The x and y of a point, in m, less the printed X* and Y*, and its image less these."""
    image = ImmutableMatrix(PIXELS.image(point[0] / point[2], point[1] / point[2]))
    return Evidence(printed=ImmutableMatrix(point[:2]) - printed, corrected=image - printed)


def _euler(order: str) -> ImmutableMatrix:
    """The rotation by the printed angles about the axes of ``order`` in turn, camera to object."""
    units = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1)}
    angles = dict(zip("XYZ", _DEGREES, strict=True))
    R = ImmutableMatrix.eye(3)
    for letter in order:
        R = R * motion.rotation(units[letter], angles[letter] * pi / 180).T
    return R


@claim(
    "§4.1 x, y, z",
    "4.1",
    "x(t+Δt) = x(t) − V_x Δt, and the same for y and z, by (16)",
    r"\begin{cases} x(t + \Delta t) = x(t) - V_x\Delta t \\ y(t + \Delta t) = y(t) - V_y\Delta t"
    r"\\ z(t + \Delta t) = z(t) - V_z\Delta t\end{cases}",
    status="holds",
)
def slide_coordinates() -> Evidence:
    """The rows of (16), by ``motion.point_motion`` without turning."""
    V = ImmutableMatrix([V_x, V_y, V_z])
    return Evidence(printed=motion.point_motion(p_0, V, 0, (0, 1, 0), t) - (p_0 - V * t))


@claim(
    "§4.1 by (14)",
    "4.1",
    "the trajectory in image space is given by (14)",
    status="erratum",
    correction="by (16) and (15): (14) gives the point in m, and its projection is (15). One slip"
    " with §4.2 by (14), which cites it again",
)
def slide_citation() -> Evidence:
    """What (14) gives, x and y in m, less the printed X* and Y*; and what (15) makes of it."""
    return cited(motion.point_motion(p_0, (V_x, 0, 0), 0, (0, 1, 0), t), printed_slide())


@claim(
    "§4.1 X*",
    "4.1",
    "X*(t) = (x(t) − V_x Δt)/z(t) · F_x",
    r"X^*(t) = \frac{x(t) - V_x\Delta t}{z(t)}\cdot F_x",
    status="ambiguous",
    correction="X*(t) = (x(t₀) − V_x Δt)/z(t₀) · F_x with Δt = t − t₀",
)
def slide_x() -> Evidence:
    """Read with the coordinates at t₀ it is the projection of (16). Read as printed, with x(t) and
    Δt both running, the reference moves at twice the speed."""
    start = printed_slide()[0]
    running = moving(printed_slide(), slide().points[0])[0]
    return Evidence(readings={"x(t₀)": start, "x(t)": running}, corrected=slide().s[0] - start)


@claim(
    "§4.1 Y*",
    "4.1",
    "Y*(t) = y(t)/z(t) · F_y",
    r"Y^*(t) = \frac{y(t)}{z(t)}\cdot F_y",
    status="holds",
)
def slide_y() -> Evidence:
    """The projection of (16). y and z do not change on the slide, so that it does not matter at
    which time they are taken."""
    start = printed_slide()[1]
    running = moving(printed_slide(), slide().points[0])[1]
    return Evidence(printed=[slide().s[1] - start, running - start])


@claim(
    "§4.1 ds*/dt",
    "4.1",
    "ds*(t)/dt is used in (10) and never given",
    r"\frac{d\underline{s}^*(t)}{dt}",
    status="ambiguous",
    correction="dX*/dt = −F_x V_x/z, dY*/dt = 0",
)
def slide_rate() -> Evidence:
    """The derivative of the derived reference, and of X* read with a running x(t), which is twice
    that. A difference quotient over any period gives the first exactly, as X* is linear."""
    rate = slide().s_dot
    running = moving(printed_slide(), slide().points[0]).diff(t)
    quotient = (slide().s.subs(t, t + PERIOD) - slide().s) / PERIOD
    return Evidence(
        readings={"x(t₀)": rate[0], "x(t)": running[0]},
        corrected=[rate - ImmutableMatrix([-F_x * V_x / z_0, 0]), quotient - rate],
    )


@claim(
    "§4.1 start",
    "4.1",
    "the sensor starts at (−0.174 m, 0.044 m, −0.077 m) in the object frame",
    status="erratum",
    correction="not from there, 48 mm behind the plane of the LEDs, z = −0.125 m: none is in front"
    " of the camera. Most likely z = −0.77 m, its decimal point moved, which is 0.645 m in front"
    " and sees them all",
)
def start() -> Evidence:
    """Depths of the four LEDs in the camera frame, Rᵀ(P − c), for the printed angles in either
    order and direction: a camera that sees them has them all positive."""

    def depths(height: Expr) -> list[Expr]:
        c = ImmutableMatrix([-Rational(174, 1000), Rational(44, 1000), height])
        turns = [_euler(order) for order in ("XYZ", "ZYX")]
        return [(R * (led - c))[2] for R in (*turns, *(R.T for R in turns)) for led in LEDS]

    printed, corrected = -Rational(77, 1000), -Rational(77, 100)
    plane = LEDS[0][2]
    return Evidence(
        printed=[Gt(depth, 0, evaluate=False) for depth in depths(printed)],
        corrected=[
            *(Gt(depth, 0) for depth in depths(corrected)),
            *(Lt(depth, 0) for depth in depths(printed)),
            plane - corrected - Rational(645, 1000),
            plane - printed + Rational(48, 1000),
        ],
    )


@claim(
    "§4.1 angles",
    "4.1",
    "the orientation is (2°, 4.2°, −0.2°)",
    status="ambiguous",
    correction="order and direction are not given; intrinsic XYZ of the camera in the object frame"
    " is what the presets take",
)
def angles() -> Evidence:
    """An entry of the rotation matrix for two orders, and for the opposite direction."""
    first, second = _euler("XYZ"), _euler("ZYX")
    readings = {"XYZ": first, "ZYX": second, "XYZ, object in camera": first.T}
    return Evidence(readings={name: R[0, 1].evalf(6) for name, R in readings.items()})


@claim(
    "§4.1 E",
    "4.1",
    "E = √(Σ_{i=1}^{4} (X_i − X_i*)² + (Y_i − Y_i*)²)",
    r"E = \sqrt{\sum_{i=1}^{i=4} (X_i - X_i^*)^2 + (Y_i - Y_i^*)^2}",
    status="erratum",
    correction="E = √(Σ_{i=1}^{4} [(X_i − X_i*)² + (Y_i − Y_i*)²]) = |s − s*|",
)
def norm_of_error() -> Evidence:
    """As printed the sum ends before the second square, whose i is then none; read at i = 4 it
    misses |s − s*| by the other three. With brackets it is the norm of the eight errors."""
    across, along = symbols("ΔX_1:5", real=True), symbols("ΔY_1:5", real=True)
    error = ImmutableMatrix([*across, *along])
    bracketed = sum(a**2 + b**2 for a, b in zip(across, along, strict=True))
    literal = sum(a**2 for a in across) + along[-1] ** 2
    return Evidence(
        printed=literal - error.dot(error),
        corrected=[bracketed - error.dot(error), sqrt(bracketed) - error.norm()],
    )
