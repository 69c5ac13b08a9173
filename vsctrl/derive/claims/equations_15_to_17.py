"""Section 3, equations 15 to 17: projection, translation and rotation about an axis.

The printed forms are compared with ``vsctrl.derive.kinematics.motion`` and with the differential
equation (11), for every axis r of unit length.
"""

from sympy import ImmutableMatrix, limit, symbols

from vsctrl.derive.camera import PIXELS, Camera
from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.equations_11_to_14 import (
    UNIT_3,
    V,
    against_11,
    along_screw,
    d,
    p,
    printed_motion,
    printed_rotation,
    r,
    r_tilde,
)
from vsctrl.derive.kinematics import motion
from vsctrl.symbols import F_x, F_y, omega, t, x, y, z


def printed_turn(about: ImmutableMatrix) -> ImmutableMatrix:
    """The right side of (17) about a point, p + (−sin ωt r̃ + (1 − cos ωt) r̃²)(p − d)."""
    return p + (printed_rotation(omega * t) - UNIT_3) * (p - about)


def axis_motion(arm: ImmutableMatrix) -> ImmutableMatrix:
    """−ω r̃ d, the velocity of a camera that turns about an axis at d."""
    return -omega * r_tilde * arm


@claim(
    "(15)",
    "3.1",
    "X = x/z · F_x and Y = y/z · F_y",
    r"X = \frac{x}{z}\cdot F_x \quad\text{and}\quad Y = \frac{y}{z}\cdot F_y",
    status="holds",
)
def eq_15() -> Evidence:
    """The ray from O to M meets the image plane at the distance f; pixels are counted per length,
    k_x and k_y, F_x = f k_x, F_y = f k_y. A point in front has z > 0."""
    f, k_x, k_y, scale = symbols("f k_x k_y m", positive=True)
    # m OM lies in the plane: m z = f.
    hit = (scale * p).subs(scale, f / z)
    focal = {F_x: f * k_x, F_y: f * k_y}
    printed = ImmutableMatrix([x / z * F_x, y / z * F_y])
    ours = ImmutableMatrix(PIXELS.image(x / z, y / z))
    pixels = ImmutableMatrix([hit[0] * k_x, hit[1] * k_y])
    return Evidence(printed=[hit[2] - f, printed.subs(focal) - pixels, printed - ours])


@claim(
    "(15) F",
    "3.1",
    "F_x and F_y are the intrinsic parameters of the camera",
    status="conditional",
    correction="for image coordinates counted from the principal point, without skew or distortion",
)
def intrinsics() -> Evidence:
    """The image of a point by a camera with principal point (u₀, v₀), skew and distortion less
    (15); zero where these are."""
    u_0, v_0, skew, k_1 = symbols("u_0 v_0 skew k_1", real=True)
    camera = Camera((F_x, F_y), (u_0, v_0), skew, (k_1,))
    residual = ImmutableMatrix(camera.image(x / z, y / z))
    residual -= ImmutableMatrix([x / z * F_x, y / z * F_y])
    plain = dict.fromkeys((u_0, v_0, skew, k_1), 0)
    return Evidence(printed=residual, under=residual.subs(plain))


@claim(
    "(16)",
    "3.1",
    "p(t + Δt) = p(t) − V Δt, from (14) where ω = 0",
    r"\underline{p}(t + \Delta t) = \underline{p}(t) - \underline{V}\Delta t",
    status="holds",
)
def eq_16() -> Evidence:
    """The limit of (14) as ω → 0, entry by entry; ``motion.point_motion`` at ω = 0; and the
    solution of (11) without turning."""
    path = p - V * t
    slow = along_screw().applyfunc(lambda entry: limit(entry, omega, 0))
    straight = motion.point_motion(p, V, 0, r, t)
    return Evidence(printed=[slow - path, straight - path, path.diff(t) + V, path.subs(t, 0) - p])


@claim(
    "(17) V",
    "3.2",
    "V = ω r̃ d",
    r"\underline{V} = \omega\,\widetilde{r}\,\underline{d}",
    status="erratum",
    correction="V = −ω r̃ d, d from the camera to the axis, as (17) and d = (0, 0, d) in section 4.2"
    " have it; T* = (−ωd, 0, 0, 0, ω, 0) there",
)
def axis_velocity() -> Evidence:
    """(14) with this V less (17). The printed sign belongs to a radius from the axis to the
    camera, and turns about the opposite point: it gives p + G(p + d). With the other sign (14) is
    (17)."""
    return Evidence(
        printed=printed_motion(omega * r_tilde * d) - printed_turn(d),
        corrected=[
            printed_motion(axis_motion(d)) - printed_turn(d),
            printed_motion(omega * r_tilde * d) - printed_turn(-d),
        ],
    )


@claim(
    "(17)",
    "3.2",
    "OM(t + Δt) = OM(t) + (−sin(ωΔt) r̃ + (1 − cos(ωΔt)) r̃²)(OM(t) − d)",
    r"\overrightarrow{OM}(t + \Delta t) = \overrightarrow{OM}(t) + \left(-\sin(\omega\Delta t)\,"
    r"\tilde{r} + (1 - \cos(\omega\Delta t))\,\tilde{r}^2\right)\left(\overrightarrow{OM}(t) - "
    r"\underline{d}\right)",
    status="holds",
)
def eq_17() -> Evidence:
    """A turn about the axis takes p − d to exp(−ω r̃ Δt)(p − d). The printed form is that, equals
    ``motion.rotation_about``, and satisfies (11) with V = −ω r̃ d from p(t)."""
    printed = printed_turn(d)
    turned = d + motion.rotation(r, omega * t) * (p - d)
    return Evidence(
        printed=[
            printed - turned,
            printed - motion.rotation_about(p, d, omega, r, t),
            against_11(printed, axis_motion(d)),
            printed.subs(t, 0) - p,
        ]
    )


@claim(
    "(17) constant d",
    "3.2",
    "d is constant in the frame ℵ (case of angular motion)",
    status="conditional",
    correction="ℵ is the camera frame ℜ; d is constant for V = −ω r̃ d: the axis is at rest",
)
def constant_arm() -> Evidence:
    """The axis is a fixed object, so the point of it that d leads to moves by (11): d' = −V − ω r̃ d
    for any V, which is zero for the stated one only."""
    drift = -V - omega * r_tilde * d
    return Evidence(printed=drift, under=drift.subs(dict(zip(V, axis_motion(d), strict=True))))
