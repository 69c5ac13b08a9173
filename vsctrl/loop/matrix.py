"""The loop of figure 1 in six degrees of freedom: κ becomes the matrix M = L̂⁺L.

Near its reference the camera's lag ξ obeys ξ′ = T − T*, the image says e = Lξ, and the law answers
with L̂⁺, which has full column rank: L̂⁺L = M, L̂⁺L̂ = I. All other blocks are numbers, so that every
formula in κ holds with M in its place. For a constant twist T* this is the matrix law
ξ = τT* − (λM)⁻¹(I − k_ff M)T*.
"""

import math
from collections.abc import Iterable, Mapping
from functools import cache
from numbers import Real
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from vsctrl import checks as check
from vsctrl.arrays import Array
from vsctrl.diagram import Diagram, Ramp
from vsctrl.errors import InputError, nearest
from vsctrl.keywords import keywords
from vsctrl.loop.limits import gain_limit
from vsctrl.loop.parameters import exact, parameters
from vsctrl.loop.steady import error_transfer, steady_error
from vsctrl.symbols import F_x, F_y, ell_hat, kappa, z

SINGULAR = 1e12  #: condition number from which on a direction counts as not controlled
_SINGULAR_M = (
    "steady_lag: M is singular, so a direction is not controlled; see that the features determine "
    "all that the camera can do."
)
_RHO, _PHI = sp.symbols("rho phi", positive=True)


@keywords
def steady_lag(diagram: Diagram, M: Any, twist: Any, **values: Any) -> Any:
    """The steady lag ξ (twist from the reference to the camera) for a constant twist T* (6,).

    f(M)T*, where f(κ) is the diagram's steady error on a unit ramp; for figure 1
    τT* − (λM)⁻¹(I − k_ff M)T*, without τT* where the latency is aligned or in the actuator. M is
    L̂⁺L, square; `values` are those of `steady_error` but kappa. First order in the lag, and exact
    for a slide at constant depth. A NumPy array in m and rad where all are numbers, else a SymPy
    column. It holds where the loop is stable, see `matrix_gain_limit`.
    Errors: `InputError` for shapes that do not match, a singular M, and a diagram whose error is no
    function of κ = ℓ/ℓ̂.

    >>> M = vs.loop.depth_error_matrix(1.1)
    >>> lag = vs.loop.steady_lag(vs.figure1, M, [0.04, 0, 0, 0, 0, 0], lam=2.5, tau=0.08, k_ff=1)
    >>> print(1e3 * lag.round(7)[0])
    4.6545
    """
    if "kappa" in values:
        raise InputError("steady_lag: kappa is the matrix M here; leave it out.")
    if kappa not in parameters(diagram).values() or error_transfer(diagram).has(ell_hat):
        raise InputError(
            "steady_lag: the diagram's error is no function of κ = ℓ/ℓ̂; give one "
            "with both in its blocks, like loop.diagram()."
        )
    matrix, column = _square(M), _exact(twist, "twist")
    if column.cols != 1:
        raise InputError(
            f"steady_lag: the twist is {column.rows}×{column.cols}; give one twist, (Vx, Vy, Vz, "
            "Ωx, Ωy, Ωz), at a time."
        )
    if matrix.rows != column.rows:
        raise InputError(
            f"steady_lag: M is {matrix.rows}×{matrix.cols} and the twist has {column.rows} "
            "entries; give one as wide as the other is long."
        )
    sides = sp.fraction(sp.cancel(sp.together(steady_error(diagram, Ramp(1), **values))))
    coefficients = [sp.Poly(side, kappa).all_coeffs() for side in sides]
    numbers = [c for side in coefficients for c in side]
    if all(entry.is_number for entry in (*matrix, *column, *numbers)):
        return _numeric(matrix, column, coefficients)
    above, below = (_polynomial(side, matrix) for side in coefficients)
    if below.det(method="berkowitz").equals(0):
        raise InputError(_SINGULAR_M)
    return sp.ImmutableMatrix(below.LUsolve(above * column)).applyfunc(sp.factor)


@keywords
def matrix_gain_limit(M: ArrayLike, tau: float, period: float | None = None) -> float:
    """The gain λ (s⁻¹) at which the loop in six degrees of freedom begins to oscillate.

    The least over the eigenvalues μ of M = L̂⁺L: λ|μ|τ = π/2 − |arg μ|, and with the twist held
    over `period` λ|μ|Tₛ = 2 sin((π/2 − |arg μ|)/(2d + 1)); 0 where an eigenvalue is not in the
    right half-plane, since then no gain is stable. τ and Tₛ in s.
    Errors: `InputError` for what is no square matrix of numbers, and as `gain_limit`.

    >>> M = vs.loop.depth_error_matrix(2.0)
    >>> print(round(vs.loop.matrix_gain_limit(M, tau=0.08), 3))
    9.817
    """
    delay = check.delay("matrix_gain_limit: tau", tau)
    held = None if period is None else check.positive("matrix_gain_limit: period", period)
    matrix = _square(M)
    if not all(entry.is_number for entry in matrix):
        raise InputError("matrix_gain_limit: M holds symbols; put numbers in.")
    eigenvalues = np.linalg.eigvals(np.array(matrix.tolist(), dtype=float))
    return min(float(gain_limit(delay, period=held, kappa=complex(mu))) for mu in eigenvalues)


@keywords
def calibration_matrix(
    feature: Any, believed: Mapping[sp.Symbol, Any], common: Iterable[sp.Symbol] = ()
) -> sp.ImmutableMatrix:
    """M = L̂⁺L of any number of features of a kind, if it is the same wherever they are seen.

    `believed` is what the law takes for some arguments of the feature, ``{z: rho * z}`` for depths;
    `common` lists arguments that are the same for all features seen (parameters of the feature
    always are). Found from L̂ = L N identically in all other arguments, so that M = N⁻¹ as soon as L
    has full column rank; N is unique.
    Errors: `InputError` where there is no such N, or more than one, for a feature that is not
    rational in its arguments, for symbols that are no arguments of it, and for what is believed
    where that leaves no finite L̂ or no M.

    >>> import sympy as sp
    >>> from vsctrl.symbols import z
    >>> rho = sp.Symbol("rho", positive=True)
    >>> vs.loop.calibration_matrix(vs.derive.Point(), {z: rho * z}, common=[z])[0, 0]
    rho
    """
    from vsctrl.derive import interaction_matrix

    L = interaction_matrix(feature)
    shared = _shared(common, feature.arguments)
    fixed = {*shared, *getattr(feature, "parameters", ())}
    seen = [a for a in feature.arguments if a not in fixed]
    modelled = L.xreplace(_believed(believed, feature.arguments))
    if modelled.has(sp.nan, sp.zoo, sp.oo):
        raise InputError(
            f"calibration_matrix: with believed = {check.quoted(believed)} the interaction matrix "
            "is not finite; believe values at which the feature is not singular."
        )
    columns = [_combination(L, modelled[:, j], seen) for j in range(L.cols)]
    if any(column is None for column in columns):
        raise InputError(
            "calibration_matrix: M is not the same wherever the features are seen; list in common "
            "what they share, such as a depth, or evaluate L̂⁺L numerically."
        )
    N = sp.Matrix.hstack(*columns)
    if N.det(method="berkowitz").equals(0):
        raise InputError(
            f"calibration_matrix: with believed = {check.quoted(believed)} the law sees less than "
            "the feature shows, so that there is no M; believe values that are not 0."
        )
    return sp.ImmutableMatrix(N.inv()).applyfunc(sp.factor)


@keywords
def depth_error_matrix(rho: Any = _RHO) -> Any:
    """M = diag(ρ, ρ, ρ, 1, 1, 1) of points whose depths are all believed to be Ẑ = ρZ.

    Exact for any depths and any three points or more that see all six directions: translations are
    answered ρ times as strongly, rotations as they should be. A NumPy array for a number ρ, else a
    SymPy matrix. Errors: `InputError` for ρ not above 0.

    >>> print(vs.loop.depth_error_matrix(1.1).diagonal())
    [1.1 1.1 1.1 1.  1.  1. ]
    """
    return _put_in(_depth_error(), {"rho": (_RHO, rho)}, "depth_error_matrix")


@keywords
def focal_error_matrix(phi: Any = _PHI, depth: Any = z) -> Any:
    """M of image points in pixels whose focal lengths are believed to be F̂ = φF.

    diag(1/φ, 1/φ, 1, φ, φ, 1) with (φ − 1/φ)Z at (Vy, Ωx) and −(φ − 1/φ)Z at (Vx, Ωy): no scalar,
    since a wrong focal length takes a rotation partly for a translation. Exact for points at one
    depth Z (m) in the camera frame, wherever they are in the image, and for no other plane. Its
    columns of translation and of Ωz hold at any depths. With wrong depths too M is
    ``depth_error_matrix(rho) @ focal_error_matrix(phi, depth)``.
    A NumPy array for numbers, else a SymPy matrix. Errors: `InputError` for values not above 0.

    >>> print(vs.loop.focal_error_matrix(1.1, 0.8).shape)
    (6, 6)
    """
    arguments = {"phi": (_PHI, phi), "depth": (z, depth)}
    return _put_in(_focal_error(), arguments, "focal_error_matrix")


@cache
def _depth_error() -> sp.ImmutableMatrix:
    from vsctrl.derive import Point

    return calibration_matrix(Point(), {z: _RHO * z})


@cache
def _focal_error() -> sp.ImmutableMatrix:
    from vsctrl.derive import PIXELS, Point

    return calibration_matrix(Point(PIXELS), {F_x: _PHI * F_x, F_y: _PHI * F_y}, common=[z])


def _believed(believed: Any, arguments: tuple[sp.Symbol, ...]) -> dict[sp.Symbol, sp.Expr]:
    """Symbol → what the law takes for it, decimals exactly as they read."""
    if not isinstance(believed, Mapping):
        raise InputError(
            f"calibration_matrix: believed = {check.quoted(believed)} is no mapping; give symbols "
            "and what stands in their place, like {z: rho * z}."
        )
    substitution: dict[sp.Symbol, sp.Expr] = {}
    for symbol, value in believed.items():
        _require_argument(symbol, "believed", arguments)
        real = not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
        finite = isinstance(value, sp.Expr) and not value.has(sp.nan, sp.zoo, sp.oo, -sp.oo)
        if not (real or finite):
            raise InputError(
                f"calibration_matrix: believed {symbol}: {check.quoted(value)} is not usable; give "
                "symbols and what stands in their place, like {z: rho * z}."
            )
        substitution[symbol] = exact(value)
    return substitution


def _shared(common: Any, arguments: tuple[sp.Symbol, ...]) -> list[sp.Symbol]:
    if isinstance(common, str | sp.Basic) or not isinstance(common, Iterable):
        raise InputError(
            f"calibration_matrix: common = {check.quoted(common)} is no list; give symbols, like "
            "common=[z]."
        )
    listed = list(common)
    for symbol in listed:
        _require_argument(symbol, "common", arguments)
    return listed


def _require_argument(symbol: Any, field: str, arguments: tuple[sp.Symbol, ...]) -> None:
    if symbol not in arguments:
        names = [argument.name for argument in arguments]
        # A symbol made anew has the name of the argument, but not what is assumed of it.
        near = " (the one of its name is another symbol)" if str(symbol) in names else ""
        raise InputError(
            f"calibration_matrix: {field} has {check.quoted(symbol)}, which is no argument of the "
            f"feature{near or nearest(symbol, names)}; take symbols of feature.arguments, "
            f"{', '.join(names)}."
        )


def _combination(L: sp.Matrix, wanted: sp.Matrix, seen: list[sp.Symbol]) -> sp.Matrix | None:
    """n of wanted = L n for all values of the symbols seen, None where there is none."""
    unknowns = sp.symbols(f"n:{L.cols}")
    equations: list[sp.Expr] = []
    for residual in L * sp.Matrix(unknowns) - wanted:
        above = sp.fraction(sp.cancel(sp.together(residual)))[0]
        try:
            equations += sp.Poly(above, *seen).coeffs()
        except sp.PolynomialError:
            raise InputError(
                "calibration_matrix: the interaction matrix is not rational in "
                f"{', '.join(map(str, seen))}; evaluate L̂⁺L numerically."
            ) from None
    solutions = sp.linsolve(equations, *unknowns)
    if not solutions:
        return None
    [solution] = solutions
    if set(unknowns) & set().union(*(e.free_symbols for e in solution)):
        raise InputError(
            "calibration_matrix: features of this kind never see all directions, so that L̂⁺ has "
            "a null space; give one that does, such as Point()."
        )
    return sp.Matrix(solution)


def _put_in(
    matrix: sp.ImmutableMatrix, arguments: dict[str, tuple[sp.Symbol, Any]], caller: str
) -> Any:
    for name, (_, value) in arguments.items():
        if not check.is_symbolic(value):
            check.positive(f"{caller}: {name}", value)
    result = matrix.subs(dict(arguments.values()), simultaneous=True)
    return result if result.free_symbols else np.array(result.tolist(), dtype=float)


def _numeric(matrix: sp.Matrix, column: sp.Matrix, coefficients: list[list[sp.Expr]]) -> Array:
    """den(M)⁻¹ num(M) T* in floats."""
    M, T = (np.array(side.tolist(), dtype=float) for side in (matrix, column))
    sides = [
        sum(
            (float(c) * np.linalg.matrix_power(M, len(side) - 1 - k) for k, c in enumerate(side)),
            np.zeros_like(M),
        )
        for side in coefficients
    ]
    if np.linalg.cond(sides[1]) > SINGULAR:
        raise InputError(_SINGULAR_M)
    return np.asarray(np.linalg.solve(sides[1], sides[0] @ T[:, 0]))


def _polynomial(coefficients: list[sp.Expr], matrix: sp.Matrix) -> sp.Matrix:
    total = sp.zeros(*matrix.shape)
    for c in coefficients:
        total = total * matrix + c * sp.eye(matrix.rows)
    return total


def _square(M: Any) -> sp.Matrix:
    matrix = _exact(M, "M")
    if matrix.rows != matrix.cols:
        raise InputError(f"M is {matrix.rows}×{matrix.cols}; give the square matrix L̂⁺L, 6×6.")
    return matrix


def _exact(value: Any, name: str) -> sp.Matrix:
    """A matrix of numbers and expressions; text is refused, never read."""
    entries: Any = np.asarray(value, dtype=object) if not isinstance(value, str) else np.zeros(0)
    usable = entries.ndim in (1, 2) and entries.size > 0
    for entry in entries.flat:
        symbolic = isinstance(entry, sp.Expr) and entry.is_finite is not False
        # What a robot and its image do is real.
        symbolic = symbolic and (bool(entry.free_symbols) or complex(entry).imag == 0)
        real = isinstance(entry, Real) and math.isfinite(entry)
        usable = usable and entry is not sp.nan and (symbolic or real)
    if not usable:
        raise InputError(
            f"{name} = {check.quoted(value)} is not usable; give finite real numbers or "
            "expressions, in rows of one length."
        )
    return sp.Matrix(entries.tolist())
