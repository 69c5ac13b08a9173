"""The interaction matrix L of any feature: s' = L T for a still target.

The module holds the kinematics that every derivation starts from, how a point and a direction move
in the frame of a moving camera, and the chain rule over them. Features that are no functions of
points bring their own derivation: see ``curves`` and ``moments`` of ``features``.
"""

from collections.abc import Iterable, Sequence
from typing import Protocol

from sympy import (
    Abs,
    Derivative,
    DiracDelta,
    Expr,
    Heaviside,
    ImmutableMatrix,
    Max,
    Min,
    Subs,
    Symbol,
    sign,
)
from sympy.core.function import AppliedUndef

from vsctrl.checks import quoted
from vsctrl.derive.kinematics.motion import skew
from vsctrl.errors import InputError
from vsctrl.symbols import Omega_x, Omega_y, Omega_z, V_x, V_y, V_z

Coordinates = tuple[Symbol, Symbol, Symbol]

_V, _OMEGA = ImmutableMatrix([V_x, V_y, V_z]), ImmutableMatrix([Omega_x, Omega_y, Omega_z])


class VisualFeature(Protocol):
    """What has an interaction matrix, written in ``arguments``, which become those of its code."""

    @property
    def name(self) -> str:
        """An identifier, of which function names are made."""

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """The symbols in which L is written."""

    @property
    def interaction(self) -> ImmutableMatrix:
        """L, k×6."""


def interaction_matrix(feature: VisualFeature) -> ImmutableMatrix:
    """The k×6 matrix L of s' = L T for a still target, columns Vx Vy Vz Ωx Ωy Ωz.

    Rows are in the unit of s per m/s and per rad/s, written in ``feature.arguments``. It is derived
    once for each feature object. Source: eq. 3 (the paper writes Lᵀ for this same matrix).
    Errors: `InputError` for what is no feature.

    >>> vs.derive.interaction_matrix(vs.derive.Point())
    Matrix([
    [-1/z,    0, X/z,      X*Y, -X**2 - 1,  Y],
    [   0, -1/z, Y/z, Y**2 + 1,      -X*Y, -X]])
    """
    if not hasattr(feature, "interaction"):
        raise InputError(
            f"{quoted(feature)} is no feature; give one like derive.Point(), or a derive.Feature "
            "of your "
            "own."
        )
    return feature.interaction


def chain_rule(
    expressions: Sequence[Expr], points: Iterable[Coordinates], directions: Iterable[Coordinates]
) -> ImmutableMatrix:
    """L = Σ_points ∂s/∂p [−I₃ | p̃] + Σ_directions ∂s/∂d [0 | d̃], k×6, in the coordinates.

    Source: eq. 3 with the kinematic equation p' = −V − Ω × p above eq. 11; a direction does not
    feel V.
    """
    L = ImmutableMatrix.zeros(len(expressions), 6)
    for point in points:
        L += differentiated(expressions, point) * point_velocity(point)
    for direction in directions:
        L += differentiated(expressions, direction) * direction_velocity(direction)
    return L


def differentiated(expressions: Sequence[Expr], by: Sequence[Symbol]) -> ImmutableMatrix:
    """∂s/∂(coordinates), with quotients that are 0/0 at a kink, where SymPy has sign(0) = 0."""
    s = ImmutableMatrix(expressions)
    if s.has(Max, Min):  # (a + b ± |a − b|)/2, which every language has
        s = s.replace(lambda e: isinstance(e, Max | Min), lambda e: e.rewrite(Abs))
    gradient = s.jacobian(by)
    if gradient.has(sign):
        gradient = gradient.replace(sign, lambda u: u / Abs(u))
    if gradient.has(Heaviside):
        gradient = gradient.replace(Heaviside, lambda u, *_: (1 + u / Abs(u)) / 2)
    return gradient


def undifferentiated(matrix: ImmutableMatrix) -> Expr | None:
    """What SymPy leaves of the derivative of a function that has none, if there is such.

    That of an undefined function, f(x), has no other form and may stay.
    """
    unevaluated = matrix.atoms(Derivative, Subs, DiracDelta)
    return min((e for e in unevaluated if not e.atoms(AppliedUndef)), key=str, default=None)


def point_velocity(p: Sequence[Expr]) -> ImmutableMatrix:
    """The 3×6 matrix [−I₃ | p̃] of p' = −V − Ω × p, which is linear in the twist (V, Ω)."""
    return (-_V - skew(_OMEGA) * ImmutableMatrix(p)).jacobian([*_V, *_OMEGA])


def direction_velocity(d: Sequence[Expr]) -> ImmutableMatrix:
    """The 3×6 matrix [0 | d̃] of d' = −Ω × d, the difference of two points."""
    return (-skew(_OMEGA) * ImmutableMatrix(d)).jacobian([*_V, *_OMEGA])
