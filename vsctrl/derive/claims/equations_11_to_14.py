"""Section 3, equations 11 to 14: how a fixed point moves in the frame of a moving camera.

Each printed form is written here as the paper has it, in cross products and powers of r̃, and
compared with ``vsctrl.derive.kinematics.motion`` and with the differential equation (11), for every
axis r of unit length.
"""

from functools import cache

from sympy import Expr, ImmutableMatrix, S, Symbol, cos, eye, integrate, limit, sin, symbols

from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.kinematics import motion
from vsctrl.symbols import V_x, V_y, V_z, d_x, d_y, d_z, omega, r_x, r_y, r_z, t, x, y, z

p, V = ImmutableMatrix([x, y, z]), ImmutableMatrix([V_x, V_y, V_z])
r, d = ImmutableMatrix([r_x, r_y, r_z]), ImmutableMatrix([d_x, d_y, d_z])
#: r̃ as printed under (11).
r_tilde = ImmutableMatrix([[0, -r_z, r_y], [r_z, 0, -r_x], [-r_y, r_x, 0]])
UNIT_3 = ImmutableMatrix(eye(3))


def printed_rotation(angle: Expr) -> ImmutableMatrix:
    """The right side of (13), I₃ − sin θ r̃ + (1 − cos θ) r̃²."""
    return UNIT_3 - sin(angle) * r_tilde + (1 - cos(angle)) * r_tilde**2


def fractions() -> tuple[Expr, Expr]:
    """The two fractions of (14), which are 0/0 at ω = 0, with t for Δt."""
    angle = omega * t
    return (1 - cos(angle)) / angle, (angle - sin(angle)) / angle


def printed_drift(first: Expr, second: Expr) -> ImmutableMatrix:
    """The factor of V Δt in (14), I₃ − first r̃ + second r̃²."""
    return UNIT_3 - first * r_tilde + second * r_tilde**2


def printed_motion(velocity: ImmutableMatrix) -> ImmutableMatrix:
    """The right side of (14), with t for Δt."""
    return printed_rotation(omega * t) * p - printed_drift(*fractions()) * velocity * t


def against_11(path: ImmutableMatrix, velocity: ImmutableMatrix) -> ImmutableMatrix:
    """p' + V + ω r̃ p along a path, zero for a solution of (11)."""
    return path.diff(t) + velocity + omega * r_tilde * path


@cache
def along_screw() -> ImmutableMatrix:
    """p(t) by ``motion.point_motion`` for any point, screw and axis."""
    return motion.point_motion(p, V, omega, r, t)


@cache
def _exponential() -> tuple[ImmutableMatrix, list[ImmutableMatrix]]:
    """exp(−ω r̃ t) by ``motion``, and the residuals of X' = −ω r̃ X, X(0) = I, its definition."""
    X = motion.rotation(r, omega * t)
    return X, [X.diff(t) + omega * r_tilde * X, X.subs(t, 0) - UNIT_3]


@claim(
    "(11) kinematics",
    "3",
    "d/dt OM = −V(O) − Ω ∧ OM",
    r"\frac{d}{dt}\overrightarrow{OM} = -V(O) - \Omega\wedge\overrightarrow{OM}",
    status="holds",
)
def kinematic_equation() -> Evidence:
    """A camera whose frame at this instant is the frame of reference moves by V dt and turns by
    Ω dt: a fixed point M has the coordinates (I + Ω̃ dt)ᵀ(p − V dt), whose derivative is taken."""
    Omega = ImmutableMatrix(symbols("Omega_x Omega_y Omega_z", real=True))
    step = Symbol("dt", real=True)
    turned = UNIT_3 + step * motion.skew(Omega)
    seen = turned.T * (p - V * step)
    return Evidence(printed=seen.diff(step).subs(step, 0) + V + Omega.cross(p))


@claim(
    "(11)",
    "3",
    "dp/dt = −V − ω r̃ p",
    r"\frac{d}{dt}\underline{p} = -V - \omega\,\widetilde{r}\,\underline{p}",
    status="holds",
)
def eq_11() -> Evidence:
    """Ω = ω r is put into the kinematic equation: ω r̃ p with the printed matrix is ω r × p, and
    the printed matrix is that of the cross product in ``motion``. Any path that
    ``motion.point_motion`` gives satisfies it."""
    cross = r_tilde * p - r.cross(p)
    return Evidence(printed=[cross, r_tilde - motion.skew(r), against_11(along_screw(), V)])


@claim(
    "(11) ω r̃",
    "3",
    "ω r̃ ≡ r ∧",
    r"\omega\tilde{r} \equiv \vec{r}\wedge",
    status="erratum",
    correction="ω r̃ ≡ Ω ∧ with Ω = ω r, or r̃ ≡ r ∧",
)
def cross_product() -> Evidence:
    """Both sides are applied to any vector: the left one is ω times the right one."""
    left = omega * r_tilde * p
    return Evidence(printed=left - r.cross(p), corrected=left - (omega * r).cross(p))


@claim(
    "(11) unitary",
    "3",
    "r̃ is the unitary antisymmetric matrix",
    r"\widetilde{r}=\begin{pmatrix} 0 & -r_z & r_y \\ r_z & 0 & -r_x \\ -r_y & r_x & 0"
    r"\end{pmatrix}",
    status="erratum",
    correction="the antisymmetric matrix of the unit vector r; r̃ᵀr̃ = I − r rᵀ is singular",
)
def unitary() -> Evidence:
    """A unitary matrix has r̃ᵀr̃ = I. This one is antisymmetric, has determinant 0, and maps r to
    zero."""
    square = r_tilde.T * r_tilde
    return Evidence(
        printed=square - UNIT_3,
        corrected=[square - UNIT_3 + r * r.T, r_tilde + r_tilde.T, r_tilde.det(), r_tilde * r],
    )


@claim(
    "(12)",
    "3",
    "p(t) = exp(−ω r̃ Δt) p(t₀) − exp(−ω r̃ Δt) ∫₀^Δt exp(ω r̃ τ) dτ V",
    r"\underline{p}(t) = \exp(-\omega\widetilde{r}\Delta t)\,\underline{p}(t_o) - "
    r"\exp(-\omega\widetilde{r}\Delta t)\int_0^{\Delta t}\exp(\omega\widetilde{r}\tau)\,d\tau\,"
    r"\underline{V}",
    status="holds",
)
def eq_12() -> Evidence:
    """The exponential is that of ``motion.rotation``, which satisfies X' = −ω r̃ X and X(0) = I; the
    integral is taken entry by entry. The sum satisfies (11), starts at p(t₀), and is what
    ``motion.point_motion`` gives."""
    past = Symbol("u", real=True)
    X, definition = _exponential()
    forward = X.subs(t, -past)
    integral = forward.applyfunc(lambda entry: integrate(entry.expand(), (past, 0, t)))
    path = X * p - X * integral * V
    start = path.subs(t, 0) - p
    return Evidence(printed=[definition, against_11(path, V), start, path - along_screw()])


@claim(
    "(12) constant",
    "3",
    "(12) solves (11) as long as V and ω r̃ are constant in the camera frame",
    status="holds",
)
def constant_screw() -> Evidence:
    """With entries of V and r that are constants of the camera frame, (11) is met along
    ``motion.point_motion``: the camera may turn, and its velocity with it."""
    return Evidence(printed=against_11(along_screw(), V))


@claim(
    "(13) r̃³",
    "3",
    "r̃³ = −r̃",
    r"\tilde{r}^3 = -\tilde{r}",
    status="holds",
)
def cube_of_r() -> Evidence:
    """In general r̃³ = −(r·r) r̃, which is −r̃ for the unit vector that r is."""
    return Evidence(printed=[r_tilde**3 + r.dot(r) * r_tilde, r_tilde**3 + r_tilde])


@claim(
    "(13)",
    "3",
    "exp(−ω r̃ Δt) = I₃ − sin(ωΔt) r̃ + (1 − cos(ωΔt)) r̃²  (Rodrigues)",
    r"\exp(-\omega\,\tilde{r}\,\Delta t) = I_3 - \sin(\omega\Delta t)\,\tilde{r} + "
    r"(1 - \cos(\omega\Delta t))\,\tilde{r}^2",
    status="holds",
)
def eq_13() -> Evidence:
    """The printed polynomial in r̃ equals ``motion.rotation``, found by interpolation on the
    spectrum of r̃, and satisfies X' = −ω r̃ X, X(0) = I by itself. It is a rotation:
    XᵀX = I, det X = 1."""
    printed = printed_rotation(omega * t)
    return Evidence(
        printed=[
            printed - motion.rotation(r, omega * t),
            printed.diff(t) + omega * r_tilde * printed,
            printed.subs(t, 0) - UNIT_3,
            printed.T * printed - UNIT_3,
            printed.det() - 1,
        ]
    )


@claim(
    "(14)",
    "3",
    "p(t) = (I₃ − sin(ωΔt) r̃ + (1 − cos(ωΔt)) r̃²) p(t₀)"
    " − (I₃ − (1 − cos(ωΔt))/(ωΔt) r̃ + (ωΔt − sin(ωΔt))/(ωΔt) r̃²) V Δt",
    r"\underline{p}(t) = \left(I_3 - \sin(\omega\Delta t)\,\tilde{r} + (1 - \cos(\omega\Delta t))"
    r"\,\tilde{r}^2\right)\underline{p}(t_o) - \left(I_3 - \frac{1 - \cos(\omega\Delta t)}"
    r"{\omega\Delta t}\,\tilde{r} + \frac{\omega\Delta t - \sin(\omega\Delta t)}{\omega\Delta t}"
    r"\,\tilde{r}^2\right)\underline{V}\Delta t",
    status="conditional",
    correction="for ωΔt ≠ 0; at 0 it is 0/0, and its limit is (16)",
)
def eq_14() -> Evidence:
    """The printed form satisfies (11), starts at p(t₀) in the limit Δt → 0, and equals
    ``motion.point_motion``. At ω = 0 its fractions are 0/0; in the limit they are 0, which leaves
    p − V Δt."""
    path = printed_motion(V)
    start = path.applyfunc(lambda entry: limit(entry, t, 0))
    flat = [limit(fraction, omega, 0) for fraction in fractions()]
    straight = printed_rotation(S.Zero) * p - printed_drift(*flat) * V * t
    return Evidence(
        printed=path.subs(omega, 0),
        under=[
            against_11(path, V),
            path - along_screw(),
            start - p,
            straight - (p - V * t),
        ],
    )
