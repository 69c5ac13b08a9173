"""Section 2, equations 6 to 10: from the exponential decrease to the control law.

Names that do not commute stand for matrices of any size. Here M = ∂e/∂r, which is L̂⁺ L for the
C = L̂⁺ of the paper. The loop of figure 1 is left to ``figure_1``.
"""

from sympy import Expr, Function, ImmutableMatrix, Rational, Symbol, exp, eye, limit, oo, symbols

from vsctrl.derive.camera import PIXELS
from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.equations_1_to_5 import composed, four_points, left_inverse, s_ref
from vsctrl.derive.features.points import Point
from vsctrl.derive.kinematics import interaction
from vsctrl.symbols import lam, t, z

# Matrices of any size: M = ∂e/∂r and its pseudo-inverse, C the combination of (4), L⁺ as printed.
M, M_plus, C, L_plus, T_ref = symbols("M M⁺ C L⁺ T*", commutative=False)
e, e_t, s, s_still, s_rate = symbols("e ∂e/∂t s s* ds*/dt", commutative=False)


@claim(
    "(6)",
    "2",
    "e' = −λ e: an exponential decay of all components",
    r"\dot{\underline{e}}(\underline{r},t) = -\lambda\underline{e}(\underline{r},t)",
    status="holds",
)
def eq_6() -> Evidence:
    """e(0) exp(−λt) satisfies it and starts at e(0), so it is the solution; for λ > 0 it tends to
    zero, each component by itself."""
    start = Symbol("e_0", real=True)
    decay = start * exp(-lam * t)
    return Evidence(
        printed=[decay.diff(t) + lam * decay, decay.subs(t, 0) - start, limit(decay, t, oo)]
    )


@claim(
    "(6) e'",
    "2",
    "e' = ∂e/∂r · ∂r/∂t + ∂e/∂t",
    r"\dot{\underline{e}}(\underline{r},t) = \frac{\partial\underline{e}}{\partial r}\cdot"
    r"\frac{\partial\underline{r}}{\partial t} + \frac{\partial\underline{e}}{\partial t}",
    status="holds",
)
def derivative_of_e() -> Evidence:
    """The chain rule once more, for six pose coordinates. As r depends on t alone, the printed
    ∂r/∂t, the ∂r/dt of (3) and the dr/dt of (7) are the same."""
    total, parts = composed([Function(f"r_{i}")(t) for i in range(1, 7)], (t,))
    return Evidence(printed=total - parts)


@claim(
    "(7)",
    "2",
    "dr/dt = (∂e/∂r)⁺ · (−λ e − ∂e/∂t)",
    r"\frac{d\underline{r}}{dt} = \left(\frac{\partial\underline{e}}{\partial r}\right)^{+}\cdot"
    r"\left(-\lambda\underline{e} - \frac{\partial\underline{e}}{\partial t}\right)",
    status="conditional",
    correction="where M = ∂e/∂r has full row rank, so that M M⁺ = I; else (6) is met by its part in"
    " the range of M only",
)
def eq_7() -> Evidence:
    """Put into e' = M dr/dt + ∂e/∂t, it leaves (M M⁺ − I)(−λe − ∂e/∂t) of (6). That is zero for an
    invertible M, and not where rank is lost, as at M = M⁺ = 0."""

    def residual(inverse: Expr) -> Expr:
        return (M * inverse * (-lam * e - e_t) + e_t + lam * e).expand()

    return Evidence(printed=residual(M_plus), under=residual(M**-1), at={M: 0, M_plus: 0})


@claim(
    "(7) C",
    "2",
    "(∂e/∂r)⁺ is the identity, which means to choose C = L̂ᵀ⁺",
    r"\left(\frac{\partial\underline{e}}{\partial\underline{r}}\right)^+ = I,"
    r"\quad C = \widehat{L}^{T+}",
    status="conditional",
    correction="where M = L̂⁺ L = I: L̂ = L of rank 6. A uniform depth error Ẑ = ρ z gives"
    " M = diag(ρ I₃, I₃) for points",
)
def identity() -> Evidence:
    """With all depths taken as ρ z, L of a point is L̂ diag(ρ I₃, I₃), so M = L̂⁺L is that diagonal
    wherever L̂⁺L̂ = I. The four LEDs have rank 6, so for them it is."""
    rho = Symbol("rho", positive=True)
    true = interaction.interaction_matrix(Point(PIXELS))
    believed = true.subs(z, rho * z)
    diagonal = ImmutableMatrix.diag(*[rho] * 3, 1, 1, 1)
    factored = (true - believed * diagonal).expand()
    recovered = left_inverse() * four_points()
    return Evidence(
        printed=diagonal - eye(6),
        under=[factored, recovered - eye(6), diagonal.subs(rho, 1) - eye(6)],
    )


@claim(
    "(8)",
    "2",
    "T = −λ e − ∂e/∂t",
    r"T = -\lambda\underline{e} - \frac{\partial\underline{e}}{\partial t}",
    status="conditional",
    correction="gives (6) where M = L̂⁺ L = I; in general e' = −λ M e + (I − M) ∂e/∂t",
)
def eq_8() -> Evidence:
    """Put into e' = M T + ∂e/∂t with any M. The part (I − M) ∂e/∂t drives the error as long as the
    reference moves."""
    law = -lam * e - e_t
    closed = M * law + e_t
    general = closed - (-lam * M * e + (1 - M) * e_t)
    residual = (closed + lam * e).expand()
    return Evidence(printed=residual, under=[general.expand(), residual.subs(M, 1).expand()])


@claim(
    "(9)",
    "2",
    "∂e/∂t = C(∂s(r, t)/∂t − ds*(t)/dt)",
    r"\left(\frac{\partial\underline{e}}{\partial t}\right) = C\cdot\left("
    r"\frac{\partial\underline{s}(\underline{r},t)}{\partial t} - "
    r"\frac{d\underline{s}^*(t)}{dt}\right)",
    status="conditional",
    correction="where C does not depend on the time by itself, as L̂⁺ taken at s*(t) does; else"
    " + ∂C/∂t (s − s*)",
)
def eq_9() -> Evidence:
    """(5) is differentiated at a fixed pose. With L̂ taken at the current image C depends on the
    pose only, and the term goes to ∂e/∂r instead."""
    pose = Symbol("r", real=True)
    signal = Function("s", commutative=False)(pose, t)
    varying = Function("C", commutative=False)(pose, t)
    still = Function("C", commutative=False)(pose)

    def residual(combination: Expr) -> Expr:
        whole = (combination * (signal - s_ref(t))).diff(t)
        return (whole - combination * (signal.diff(t) - s_ref(t).diff(t))).expand()

    rate, gap = symbols("∂C/∂t (s−s*)", commutative=False)
    difference = residual(varying) - varying.diff(t) * (signal - s_ref(t))
    return Evidence(printed=rate * gap, under=[difference.expand(), residual(still)])


@claim(
    "(9) still",
    "2",
    "∂e/∂t = −C ds*(t)/dt for a motionless target",
    r"\left(\frac{\partial\underline{e}}{\partial t}\right) = -C\frac{d\underline{s}^*(t)}{dt}",
    status="holds",
)
def motionless() -> Evidence:
    """The same derivative where s depends on the pose only, with the C of (9)."""
    pose = Symbol("r", real=True)
    error = C * (Function("s", commutative=False)(pose) - s_ref(t))
    return Evidence(printed=(error.diff(t) + C * s_ref(t).diff(t)).expand())


@claim(
    "(10)",
    "2",
    "T = −λ Lᵀ⁺ (s − s*(t)) + Lᵀ⁺ ds*(t)/dt",
    r"T = -\lambda L^{T+}\cdot(\underline{s}(\underline{r},t) - \underline{s}^*(t)) + L^{T+}"
    r"\frac{d\underline{s}^*(t)}{dt}",
    status="erratum",
    correction="T = −λ L̂⁺ (s − s*(t)) + L̂⁺ ds*(t)/dt: C = L̂ᵀ⁺ is the model's, and its hat is lost",
)
def eq_10() -> Evidence:
    """(5) and (9) are put into (8), whose C is L̂⁺. The printed law differs from the result by
    (L̂⁺ − L⁺)(…), which is all that calibration errors do."""
    error = C * (s - s_ref(t))
    law = (-lam * error - error.diff(t)).expand()
    plain = {s_ref(t).diff(t): s_rate, s_ref(t): s_still}

    def residual(inverse: Expr) -> Expr:
        printed = -lam * inverse * (s - s_ref(t)) + inverse * s_ref(t).diff(t)
        return (law - printed).expand().subs(plain)

    return Evidence(printed=residual(L_plus), corrected=residual(C))


@claim(
    "(10) law",
    "2",
    "the control law (10) ensures the trajectory generation",
    status="conditional",
    correction="e' = −λ e where L̂⁺ L = I, without latency; in general a constant reference twist T*"
    " leaves the lag ξ = −(λM)⁻¹(I − M) T*",
)
def ensured() -> Evidence:
    """With s − s* = L ξ and ds*/dt = L T*, the law gives ξ' = −λ M ξ + (M − I) T*. At the stated ξ
    that is zero; with M = I it is ξ' = −λ ξ, and the lag tends to zero."""
    xi = Symbol("xi", commutative=False)
    rate = (-lam * M * xi + M * T_ref) - T_ref
    steady = -(M**-1) * (1 - M) * T_ref / lam
    lag = rate.subs(xi, steady).expand()
    return Evidence(
        printed=(rate + lam * xi).expand(),
        under=[lag, (rate + lam * xi).subs(M, 1).expand()],
        at={M: Rational(1, 2)},
    )
