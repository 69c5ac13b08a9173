"""Section 2, equations 1 to 5: the chain rule and the task function.

Names that do not commute stand for matrices of any size, so what is proved with them holds for any
number of features.
"""

from functools import cache

from sympy import Expr, Function, ImmutableMatrix, Rational, Symbol, eye, symbols

from vsctrl.derive.camera import PIXELS
from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.features.points import Point
from vsctrl.derive.kinematics import interaction, motion
from vsctrl.symbols import Omega_x, Omega_y, Omega_z, V_x, V_y, V_z, X, Y, t, x, y, z

# Matrices of any size: C the combination of (4), L the interaction matrix, T the screw.
C, L, T = symbols("C L T", commutative=False)
s_ref = Function("s*", commutative=False)
_TWIST = ImmutableMatrix([V_x, V_y, V_z, Omega_x, Omega_y, Omega_z])
_DRIFT = ImmutableMatrix(symbols("w_x w_y w_z", real=True))  # the target's velocity, camera frame


def composed(inner: list[Expr], extra: tuple[Expr, ...]) -> tuple[Expr, Expr]:
    """d/dt of s(inner(t), extra), and the sum of partial derivatives that it should be."""
    feature = Function("s")
    places = symbols(f"a:{len(inner) + len(extra)}")
    there = dict(zip(places, (*inner, *extra), strict=True))
    parts = [feature(*places).diff(a) * value.diff(t) for a, value in there.items()]
    return feature(*there.values()).diff(t), sum(parts).subs(there, simultaneous=True).doit()


@claim(
    "(1)",
    "2",
    "ds(q(t), t)/dt = ∂s/∂q · dq/dt + ∂s/∂t",
    r"\frac{d\underline{s}(\underline{q}(t),t)}{dt} = \frac{\partial\underline{s}}{\partial q}"
    r"\cdot\frac{dq}{dt} + \frac{\partial\underline{s}}{\partial t}",
    status="holds",
)
def eq_1() -> Evidence:
    """The chain rule for any function s of six joint coordinates and of the time."""
    joints = [Function(f"q_{i}")(t) for i in range(1, 7)]
    total, parts = composed(joints, (t,))
    return Evidence(printed=total - parts)


@claim(
    "(1) ∂s/∂t",
    "2",
    "the term ∂s/∂t denotes the velocity of the target",
    status="erratum",
    correction="∂s/∂t = ∂s/∂p · w, the image velocity that a target velocity w causes",
)
def target_velocity() -> Evidence:
    """An image point of a target that moves at w while the camera stands still is projected and
    differentiated: the derivative is w seen through ∂s/∂p, in pixels per second, and is not w."""
    image, p = ImmutableMatrix(Point(PIXELS).expressions), ImmutableMatrix([x, y, z])
    moved = p + _DRIFT * t
    seen = image.subs(dict(zip(p, moved, strict=True)), simultaneous=True).diff(t).subs(t, 0)
    return Evidence(
        printed=seen - ImmutableMatrix(_DRIFT[:2]), corrected=seen - image.jacobian(p) * _DRIFT
    )


@claim(
    "(2)",
    "2",
    "∂s/∂q · dq/dt = ∂s/∂r · dr/dq · dq/dt",
    r"\frac{\partial\underline{s}}{\partial q}\cdot\frac{d\underline{q}}{dt} ="
    r"\frac{\partial\underline{s}}{\partial\underline{r}}\cdot\frac{d\underline{r}}{dq}\cdot"
    r"\frac{d\underline{q}}{dt}",
    status="holds",
)
def eq_2() -> Evidence:
    """The chain rule for any function of the pose, in any six coordinates r of it that depend on
    the joints; two joints stand for all, as the sum has a term each. The text below writes ∂r/∂q
    for the dr/dq of the print."""
    joints = symbols("q_1 q_2")
    speeds = symbols("q'_1 q'_2")
    poses = symbols("r_1:7")
    feature, pose = Function("s"), [Function(f"r_{i}")(*joints) for i in range(1, 7)]
    there = dict(zip(poses, pose, strict=True))
    left = sum(feature(*pose).diff(q) * v for q, v in zip(joints, speeds, strict=True))
    right = sum(
        feature(*poses).diff(a).subs(there, simultaneous=True).doit() * r_i.diff(q) * v
        for a, r_i in there.items()
        for q, v in zip(joints, speeds, strict=True)
    )
    return Evidence(printed=left - right)


@claim(
    "(3)",
    "2",
    "ds(r(t), t)/dt = ∂s/∂r · ∂r/∂t = Lᵀ T",
    r"\frac{d\underline{s}(\underline{r}(t),t)}{dt} = \frac{\partial\underline{s}}{\partial r}"
    r"\cdot\frac{\partial\underline{r}}{dt}",
    status="conditional",
    correction="for a motionless target, as the paper says; else + ∂s/∂t. The printed ∂r/dt is"
    " dr/dt, and the interaction matrix Lᵀ is called L here: s' = L T",
)
def eq_3() -> Evidence:
    """An image point moves by p' = −V − Ω × p + w, where w is the velocity of the target. The
    derivative of its image less L T is ∂s/∂p w, and zero when w is."""
    feature = Point(PIXELS)
    image, p = ImmutableMatrix(feature.expressions), ImmutableMatrix([x, y, z])
    V, Omega = ImmutableMatrix(_TWIST[:3]), ImmutableMatrix(_TWIST[3:])
    velocity = -V - Omega.cross(p) + _DRIFT
    measured = {X: image[0], Y: image[1]}
    predicted = interaction.interaction_matrix(feature).subs(measured) * _TWIST
    residual = image.jacobian(p) * velocity - predicted
    return Evidence(printed=residual, under=residual.subs(dict.fromkeys(_DRIFT, 0)))


@claim(
    "(3) T",
    "2",
    "dr/dt = T = (V, Ω)",
    r"\frac{\partial\underline{r}}{dt} = \mathbf{T} = (\overrightarrow{V},\overrightarrow{\Omega})",
    status="conditional",
    correction="where the coordinates r start at the present pose; elsewhere dr/dt = J(r) T, and"
    " ∂s/∂r in (2) is then L J(r)⁻¹",
)
def twist() -> Evidence:
    """A pose of position c and Euler angles turns and moves: V = Rᵀc' and Ω̃ = RᵀR' in the camera
    frame are compared with (c', angles'). They agree where the angles are zero, and not at other
    poses: T is the derivative of these coordinates at that pose only."""
    position = [Function(f"c_{i}")(t) for i in "xyz"]
    angles = [Function(name)(t) for name in ("alpha", "beta", "gamma")]
    R = eye(3)
    for unit, angle in zip(((1, 0, 0), (0, 1, 0), (0, 0, 1)), angles, strict=True):
        R = R * motion.rotation(unit, angle).T
    turning = R.T * R.diff(t)
    V = R.T * ImmutableMatrix(position).diff(t)
    Omega = ImmutableMatrix([turning[2, 1], turning[0, 2], turning[1, 0]])
    rates = ImmutableMatrix([*position, *angles]).diff(t)
    residual = rates - ImmutableMatrix([*V, *Omega])
    plain = {value.diff(t): Symbol(f"{value.func}'") for value in (*position, *angles)}
    plain |= {value: Symbol(str(value.func)) for value in (*position, *angles)}
    residual = residual.subs(plain)
    upright = dict.fromkeys(symbols("alpha beta gamma"), 0)
    return Evidence(printed=residual, under=residual.subs(upright))


@cache
def four_points() -> ImmutableMatrix:
    """L, 8×6, of the paper's four LEDs 0.645 m in front of the camera, normalised coordinates."""
    feature = Point()
    depth = Rational(645, 1000)
    places = [(Rational(a, 8), Rational(3 * b, 40)) for a in (-1, 1) for b in (-1, 1)]
    rows = [feature.interaction.subs({X: a / depth, Y: b / depth, z: depth}) for a, b in places]
    return ImmutableMatrix.vstack(*rows)


@cache
def left_inverse() -> ImmutableMatrix:
    """L⁺ = (LᵀL)⁻¹Lᵀ, 6×8, of these four points."""
    full = four_points()
    return (full.T * full).inv() * full.T


@claim(
    "(4)",
    "2",
    "e = C[s − s*], and e = 0 means that the image s* is reached",
    r"\underline{e}(\underline{r},t) = C[\underline{s}(\underline{r},t) - \underline{s}^*]",
    status="conditional",
    correction="only for s − s* = L ξ, what a motion of the camera can cause: with more than six"
    " measurements C has a kernel",
)
def eq_4() -> Evidence:
    """With C = L⁺ of the four LEDs, 6×8, there are errors δ ≠ 0 with C δ = 0: the task is done
    and the image is not s*. Where s − s* = L ξ for some twist ξ, C gives back ξ exactly."""
    matrix = four_points()
    combination = left_inverse()
    missed = matrix.T.nullspace()[0]
    xi = ImmutableMatrix(symbols("xi_1:7"))
    return Evidence(printed=missed, under=[combination * missed, combination * (matrix * xi) - xi])


@claim(
    "(4) C",
    "2",
    "C is a constant matrix, and C = L̂ᵀ⁺",
    status="ambiguous",
    correction="L̂⁺ moves with s, s*(t) and depth: L is taken at `current`, `desired`, `mean` or"
    " `initial`, a choice of the law",
)
def constant_c() -> Evidence:
    """For one point in lateral motion ℓ = ∂X'/∂V_x depends on depth, so C = 1/ℓ differs between the
    image that is seen, the one that is desired, and their mean."""
    ell = interaction.interaction_matrix(Point(PIXELS))[0, 0]
    wanted = ell.subs(z, Symbol("z*", positive=True))
    return Evidence(
        readings={"current": 1 / ell, "desired": 1 / wanted, "mean": 2 / (ell + wanted)}
    )


@claim(
    "(5)",
    "2",
    "e = C[s − s*(t)], from whose derivative (9) is obtained",
    r"e(r,t) = C[s(r,t) - s^*(t)]",
    status="conditional",
    correction="the derivative, which is not printed here, is C(Lᵀ T − ds*/dt) for a constant C;"
    " else + dC/dt (s − s*)",
)
def eq_5() -> Evidence:
    """The product is differentiated with s' = L T. What a varying C adds vanishes with the error,
    so it changes the way there and not the place."""
    signal = Function("s", commutative=False)(t)
    varying = Function("C", commutative=False)(t)

    def residual(combination: Expr) -> Expr:
        whole = (combination * (signal - s_ref(t))).diff(t)
        return whole.subs(signal.diff(t), L * T) - combination * (L * T - s_ref(t).diff(t))

    rate, gap = symbols("dC/dt (s−s*)", commutative=False)
    difference = residual(varying) - varying.diff(t) * (signal - s_ref(t))
    return Evidence(printed=rate * gap, under=[difference.expand(), residual(C)])
