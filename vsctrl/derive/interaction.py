"""The interaction matrix L of any feature, by the chain rule: s' = L T for a still target.

The module exists so that no Jacobian is typed by hand. Its batched source code is left to ``emit``.
"""

from sympy import Expr, ImmutableMatrix, cancel, expand

from vsctrl.derive.features import Feature
from vsctrl.derive.motion import skew
from vsctrl.symbols import Omega_x, Omega_y, Omega_z, V_x, V_y, V_z


def interaction_matrix(feature: Feature) -> ImmutableMatrix:
    """The k×6 matrix L = Σ_points ∂s/∂p [−I₃ | p̃], columns Vx Vy Vz Ωx Ωy Ωz.

    Rows are in the unit of s per m/s and per rad/s, written in ``feature.arguments``: in image
    coordinates where the feature declares measures. Source: eq. 3 with the kinematic equation
    p' = −V − Ω × p above eq. 11 (the paper writes Lᵀ for this same matrix).
    """
    s = ImmutableMatrix(feature.expressions)
    L = ImmutableMatrix.zeros(s.rows, 6)
    for point in feature.points:
        p = ImmutableMatrix(point)
        L += s.jacobian(p) * _point_velocity(p)
    return L.applyfunc(lambda entry: _written_in_measures(entry, feature))


def _point_velocity(p: ImmutableMatrix) -> ImmutableMatrix:
    """The 3×6 matrix [−I₃ | p̃] of p' = −V − Ω × p, which is linear in the twist (V, Ω)."""
    V = ImmutableMatrix([V_x, V_y, V_z])
    Omega = ImmutableMatrix([Omega_x, Omega_y, Omega_z])
    p_dot = -V - skew(Omega) * p
    return p_dot.jacobian(ImmutableMatrix([*V, *Omega]))


def _written_in_measures(entry: Expr, feature: Feature) -> Expr:
    """The entry as a sum of terms in the arguments of the feature."""
    return expand(cancel(entry.subs(feature.through_measures)))
