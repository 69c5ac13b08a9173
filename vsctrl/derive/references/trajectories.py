"""Any trajectory of a camera, as a pose that is a function of time, and the twist along it.

The module exists so that a pose is checked once to be one; what moves along it is left to
``references``. A constant screw needs none of this: eq. 14 in ``motion`` is its solution.
"""

from typing import Any

from sympy import Derivative, Dummy, ImmutableMatrix, Rational, Symbol
from sympy.core.function import AppliedUndef

from vsctrl.checks import quoted
from vsctrl.derive.inputs import scalar, vanishes
from vsctrl.derive.kinematics.interaction import undifferentiated
from vsctrl.derive.simplify import shortened
from vsctrl.errors import InputError
from vsctrl.symbols import r_x, r_y, r_z

# Axes of length 1 without a root, for r_x, r_y, r_z, which are of unit length by definition.
_AXES = tuple(
    dict(zip((r_x, r_y, r_z), (Rational(n, length) for n in entries), strict=True))
    for entries, length in (((2, 3, 6), 7), ((8, -1, 4), 9))
)
# A rotation in doubles misses orthonormality by a few rounding errors; typed digits miss more.
_TOLERANCE = "1e-12"


def pose_at(name: str, pose: Any, t: Symbol) -> ImmutableMatrix:
    """``pose`` as a 4×4 matrix [R, p; 0, 1] whose entries are smooth in t, with RᵀR = I, det R = 1.

    Symbols r_x, r_y, r_z of ``vsctrl.symbols`` are a unit axis. RᵀR = I is tried at places in
    general position, to 1e-12.
    Errors: `InputError` when it is not that, and when it holds another symbol that is called t.
    """
    try:
        rows = [list(row) for row in (pose.tolist() if hasattr(pose, "tolist") else pose)]
    except TypeError:
        rows = []
    if len(rows) != 4 or any(len(row) != 4 for row in rows):
        raise InputError(
            f"{name} must be a 4×4 matrix, the pose oTc(t) of the camera; got {quoted(pose)}."
        )
    T = ImmutableMatrix(4, 4, lambda i, j: scalar(f"{name}[{i}, {j}]", rows[i][j]))
    if any(symbol.name == t.name and symbol != t for symbol in T.free_symbols):
        raise InputError(
            f"{name} holds a symbol {t.name} other than the time; write it with vsctrl.symbols.t, "
            "or give your own as t=."
        )
    if any(not (entry - last).is_zero for entry, last in zip(T[3, :], (0, 0, 0, 1), strict=True)):
        raise InputError(
            f"The last row of {name} is {tuple(T[3, :])}; of a pose it is (0, 0, 0, 1)."
        )
    R = T[:3, :3]
    if not _all_vanish(R.T * R - ImmutableMatrix.eye(3)):
        raise InputError(
            f"The upper left 3×3 of {name} is no rotation, as RᵀR is not I; build it of cos and "
            "sin of one angle for each turn, or by derive.rotation(r, θ).T."
        )
    if not _all_vanish(ImmutableMatrix([[R.det() - 1]])):
        raise InputError(
            f"The upper left 3×3 of {name} mirrors, as its determinant is −1; turn one axis round."
        )
    return T


def twist_of(oTc: ImmutableMatrix, t: Symbol) -> ImmutableMatrix:
    """(V, Ω), 6×1 in the camera frame, of a camera with this pose: hat(T) = oTc⁻¹ d(oTc)/dt.

    V = Rᵀ dp/dt in m/s, and Ω in rad/s is the axial vector of Rᵀ dR/dt.
    Errors: `InputError` for a pose that is not smooth in t.
    """
    R, rate = oTc[:3, :3], oTc.diff(t).doit()
    rough = undifferentiated(rate)
    if rough is not None:
        raise InputError(
            f"The pose is not smooth in {t}: its derivative holds {rough}; give smooth functions."
        )
    V, spin = R.T * rate[:3, 3], R.T * rate[:3, :3]
    # Skew where RᵀR = I, which the entries need not show: half the difference is so in any case.
    Omega = [(spin[i, j] - spin[j, i]) / 2 for i, j in ((2, 1), (0, 2), (1, 0))]
    return ImmutableMatrix([shortened(entry) for entry in (*V, *Omega)])


def _all_vanish(matrix: ImmutableMatrix) -> bool:
    """Whether all entries are 0, whatever the functions in them that are not defined."""
    unknown = {u: Dummy(real=True) for u in matrix.atoms(AppliedUndef, Derivative)}
    return all(
        vanishes(entry.xreplace(unknown).xreplace(axes), within=_TOLERANCE)
        for entry in matrix
        for axes in _AXES
    )
