"""Section 4.2: the rotation about an edge of the cube, its developed forms and its numbers.

As in ``section_4_1_slide`` the reference is derived and compared with the print, ds*/dt with it.
"""

from functools import cache

from sympy import Eq, Gt, ImmutableMatrix, Integer, Lt, Rational, S, cos, sin

from vsctrl.derive.camera import PIXELS
from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.section_4_1_slide import PERIOD, cited, moving, p_0
from vsctrl.derive.claims.section_4_set_up import EDGE
from vsctrl.derive.features.points import Point
from vsctrl.derive.kinematics import motion
from vsctrl.derive.references.references import Reference, rotation_reference
from vsctrl.symbols import F_x, F_y, d_z, omega, t, x, x_0, y, y_0, z, z_0

p = ImmutableMatrix([x, y, z])
_ARM = ImmutableMatrix([x, y, z - d_z])
_PLACE = {t: 1, omega: Rational(4, 100)}


@cache
def turn() -> Reference:
    """The reference of section 4.2, an image point about the axis (0, 1, 0) at (0, 0, d)."""
    return rotation_reference(Point(PIXELS), d=(0, 0, d_z), omega=omega, r=(0, 1, 0))


def printed_path() -> ImmutableMatrix:
    """x, y, z of section 4.2, developed, with the coordinates at t₀."""
    C, D = cos(omega * t), sin(omega * t)
    return ImmutableMatrix([x_0 * C - (z_0 - d_z) * D, y_0, x_0 * D + (z_0 - d_z) * C + d_z])


def by_17(start: ImmutableMatrix) -> ImmutableMatrix:
    """What (17) makes of a point for r = (0, 1, 0) and an axis at (0, 0, d)."""
    return motion.rotation_about(start, (0, 0, d_z), omega, (0, 1, 0), t)


def printed_turn() -> ImmutableMatrix:
    """X* and Y* of section 4.2, with the coordinates at t₀."""
    x_t, y_t, z_t = printed_path()
    return ImmutableMatrix([x_t / z_t * F_x, y_t / z_t * F_y])


def _matrices() -> tuple[ImmutableMatrix, ImmutableMatrix]:
    """−sin ωΔt r̃ and (1 − cos ωΔt) r̃² as printed in section 4.2."""
    C, D = cos(omega * t), sin(omega * t)
    A = ImmutableMatrix([[0, 0, -D], [0, 0, 0], [D, 0, 0]])
    return A, ImmutableMatrix.diag(-1 + C, 0, -1 + C)


@claim(
    "§4.2 r̃, r̃²",
    "4.2",
    "r = (0, 1, 0): r̃ = (0 0 1; 0 0 0; −1 0 0), r̃² = diag(−1, 0, −1)",
    r"\widetilde{r} = \begin{pmatrix} 0 & 0 & 1 \\ 0 & 0 & 0 \\ -1 & 0 & 0\end{pmatrix}\quad"
    r"\widetilde{r}^2 = \begin{pmatrix} -1 & 0 & 0 \\ 0 & 0 & 0 \\ 0 & 0 & -1\end{pmatrix}",
    status="holds",
)
def axis_along_y() -> Evidence:
    """The printed matrices less those of the cross product with (0, 1, 0)."""
    r_tilde = motion.skew((0, 1, 0))
    printed = ImmutableMatrix([[0, 0, 1], [0, 0, 0], [-1, 0, 0]])
    return Evidence(printed=[r_tilde - printed, r_tilde**2 - ImmutableMatrix.diag(-1, 0, -1)])


@claim(
    "§4.2 matrices",
    "4.2",
    "p(t+Δt) = p(t) + [A + B · (x(t), y(t), z(t) − d)ᵀ, with the matrices A of −sin ωΔt r̃ and B of"
    " (1 − cos ωΔt) r̃²",
    r"\begin{pmatrix} x \\ y \\ z\end{pmatrix} + \Bigl[\begin{pmatrix} 0 & 0 & -\sin(\omega\Delta"
    r" t) \\ 0 & 0 & 0 \\ \sin(\omega\Delta t) & 0 & 0\end{pmatrix} + \begin{pmatrix} -1 + "
    r"\cos(\omega\Delta t) & 0 & 0 \\ 0 & 0 & 0 \\ 0 & 0 & -1 + \cos(\omega\Delta t)\end{pmatrix}"
    r"\cdot\begin{pmatrix} x(t) \\ y(t) \\ z(t) - d\end{pmatrix}",
    status="erratum",
    correction="p(t) + [A + B] · (x(t), y(t), z(t) − d)ᵀ: the bracket that opens is never closed",
)
def two_matrices() -> Evidence:
    """As printed, A, 3×3, is added to B times a vector, 3×1. With the bracket closed before the
    product it is (17)."""
    A, B = _matrices()
    return Evidence(
        printed=Eq(Integer(A.cols), Integer((B * _ARM).cols), evaluate=False),
        corrected=p + (A + B) * _ARM - by_17(p),
    )


@claim(
    "§4.2 one matrix",
    "4.2",
    "the same with the two matrices added",
    r"\begin{pmatrix} x \\ y \\ z\end{pmatrix} + \begin{pmatrix} -1 + \cos(\omega\Delta t) & 0 & "
    r"-\sin(\omega\Delta t) \\ 0 & 0 & 0 \\ \sin(\omega\Delta t) & 0 & -1 + \cos(\omega\Delta t)"
    r"\end{pmatrix}\cdot\begin{pmatrix} x(t) \\ y(t) \\ z(t) - d\end{pmatrix}",
    status="holds",
)
def one_matrix() -> Evidence:
    """The printed sum of matrices times (x, y, z − d), less (17) by ``motion.rotation_about``."""
    C, D = cos(omega * t), sin(omega * t)
    printed = ImmutableMatrix([[-1 + C, 0, -D], [0, 0, 0], [D, 0, -1 + C]])
    return Evidence(printed=p + printed * _ARM - by_17(p))


@claim(
    "§4.2 x, y, z",
    "4.2",
    "x(t+Δt) = x cos ωΔt − (z − d) sin ωΔt, y(t+Δt) = y, z(t+Δt) = x sin ωΔt + (z − d) cos ωΔt + d",
    r"\begin{cases} x(t + \Delta t) = x(t)\cos(\omega\Delta t) - (z(t) - d)\sin(\omega\Delta t) \\"
    r"y(t + \Delta t) = y(t) \\ z(t + \Delta t) = x(t)\sin(\omega\Delta t) + (z(t) - d)"
    r"\cos(\omega\Delta t) + d\end{cases}",
    status="holds",
)
def turn_coordinates() -> Evidence:
    """The printed rows less (17) by ``motion.rotation_about`` for r = (0, 1, 0) and (0, 0, d)."""
    return Evidence(printed=printed_path() - by_17(p_0))


@claim(
    "§4.2 by (14)",
    "4.2",
    "using relation (14), we obtain X*(t) and Y*(t)",
    status="erratum",
    correction="using (17) and (15): (14) gives the point in m, and its projection is (15). One"
    " slip with §4.1 by (14), not another",
)
def turn_citation() -> Evidence:
    """What (14) gives for V = (−ωd, 0, 0), x and y in m, less the printed X* and Y*; and what (15)
    makes of it."""
    V = (-omega * d_z, 0, 0)
    return cited(motion.point_motion(p_0, V, omega, (0, 1, 0), t), printed_turn())


@claim(
    "§4.2 X*",
    "4.2",
    "X*(t) = F_x (x(t) cos ωΔt − (z(t) − d) sin ωΔt)/(x(t) sin ωΔt + (z(t) − d) cos ωΔt + d)",
    r"X^*(t) = \frac{x(t)\cos(\omega\Delta t) - (z(t) - d)\sin(\omega\Delta t)}"
    r"{x(t)\sin(\omega\Delta t) + (z(t) - d)\cos(\omega\Delta t) + d} F_x",
    status="ambiguous",
    correction="x(t), z(t) on the right are x(t₀), z(t₀), and Δt = t − t₀",
)
def turn_x() -> Evidence:
    """Read with the coordinates at t₀ it is the projection of (17). Read with x(t) and Δt both
    running it is the image after twice the angle."""
    running = moving(printed_turn(), turn().points[0])[0]
    return Evidence(
        readings={"x(t₀), z(t₀)": printed_turn()[0], "x(t), z(t)": running},
        corrected=[turn().s[0] - printed_turn()[0], running - turn().s[0].subs(t, 2 * t)],
        at=_PLACE,
    )


@claim(
    "§4.2 Y*",
    "4.2",
    "Y*(t) = F_y y(t)/(x(t) sin ωΔt + (z(t) − d) cos ωΔt + d)",
    r"Y^*(t) = \frac{y(t)}{x(t)\sin(\omega\Delta t) + (z(t) - d)\cos(\omega\Delta t) + d} F_y",
    status="ambiguous",
    correction="x(t), y(t), z(t) on the right are those at t₀, and Δt = t − t₀",
)
def turn_y() -> Evidence:
    """As for X*: the depth in the denominator depends on the reading."""
    running = moving(printed_turn(), turn().points[0])[1]
    return Evidence(
        readings={"x(t₀), z(t₀)": printed_turn()[1], "x(t), z(t)": running},
        corrected=turn().s[1] - printed_turn()[1],
        at=_PLACE,
    )


@claim(
    "§4.2 ds*/dt",
    "4.2",
    "ds*(t)/dt is used in (10) and never given",
    r"\frac{d\underline{s}^*(t)}{dt}",
    status="ambiguous",
    correction="dX*/dt = −F_x ω (x*² + z*² − d z*)/z*², dY*/dt = −F_y ω y* x*/z*², with the"
    " reference coordinates x*, y*, z* at t",
)
def turn_rate() -> Evidence:
    """The derivative of the derived reference, written in the coordinates at t, is the stated one.
    A difference quotient over one video period, the other thing to compute, is not."""
    rate = turn().s_dot
    x_t, y_t, z_t = turn().points[0]
    along = -F_x * omega * (x_t**2 + z_t**2 - d_z * z_t) / z_t**2
    stated = ImmutableMatrix([along, -F_y * omega * y_t * x_t / z_t**2])
    quotient = (turn().s.subs(t, t + PERIOD) - turn().s) / PERIOD
    return Evidence(
        readings={"derivative": rate[1], "difference over T_s": quotient[1]},
        corrected=rate - stated,
        at={**_PLACE, PERIOD: Rational(4, 100)},
    )


@claim(
    "§4.2 distance",
    "4.2",
    "the distance between the sensor and the rotation axis, a cube edge, is"
    " 0.8 m; the sensor starts at (−0.154 m, 0.014 m, −0.811 m)",
    status="ambiguous",
    correction="0.687 m or 0.741 m to the front edges, 0.825 m to the axis through the centre: axis"
    " and distance are parameters, d = 0.8 m by default",
)
def distance() -> Evidence:
    """Distances in the plane across y from the printed start to each edge parallel to y and to the
    centre. None is 0.8 m; the nearest are those in the correction."""
    place = ImmutableMatrix([-Rational(154, 1000), -Rational(811, 1000)])
    half = EDGE / 2
    axes = {"front left": (-half, -half), "front right": (half, -half), "centre": (S.Zero, S.Zero)}
    axes |= {"back left": (-half, half), "back right": (half, half)}
    distances = {name: (ImmutableMatrix(axis) - place).norm() for name, axis in axes.items()}
    stated = {"front left": 687, "front right": 741, "centre": 825}
    rounded = [Lt(abs(1000 * distances[name] - mm), 1) for name, mm in stated.items()]
    missed = [Gt(abs(length - Rational(8, 10)), Rational(2, 100)) for length in distances.values()]
    return Evidence(
        readings={name: length.evalf(3) for name, length in distances.items()},
        corrected=[*rounded, *missed],
    )


@claim(
    "§4.2 twist",
    "4.2",
    "the task combines a translation along the x axis and a rotation around the y axis",
    status="holds",
)
def combined() -> Evidence:
    """The screw of the reference, T* = (−ωd, 0, 0, 0, ω, 0): −32 mm/s and 0.04 rad/s."""
    twist = turn().twist
    speed = twist[0].subs({omega: Rational(4, 100), d_z: Rational(8, 10)})
    expected = ImmutableMatrix([-omega * d_z, 0, 0, 0, omega, 0])
    return Evidence(printed=[twist - expected, speed + Rational(32, 1000)])
