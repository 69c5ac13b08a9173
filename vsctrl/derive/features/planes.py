"""Planes seen by a camera: 1/z = A x + B y + C, and how image points on them move.

A camera sees no depth, so curves and regions need the plane that they lie in. Every derivation
over such a plane starts here; ``curves`` and ``moments`` carry it on.
"""

from typing import Any

from sympy import Expr, ImmutableMatrix, symbols

from vsctrl.checks import quoted
from vsctrl.derive.camera import Camera
from vsctrl.derive.inputs import Vector, scalar, vector
from vsctrl.errors import InputError
from vsctrl.symbols import X, Y

#: 1/z = A x + B y + C in the normalised image coordinates x and y; each in 1/m.
A, B, C = symbols("A B C", real=True)

Plane = tuple[Expr, Expr, Expr]
PLANE: Plane = (A, B, C)


def plane_of(point: Vector, normal: Vector) -> Plane:
    """(A, B, C) in 1/m of the plane through a point (m) with this normal, of any length.

    n · p = n · p_0 with p = z (x, y, 1) is 1/z = n · (x, y, 1)/(n · p_0). The normal of a plane
    with directions d and e in it is d × e; the plane through a line that faces the camera most has
    d × (p × d). A plane through the camera's centre has no (A, B, C).
    Errors: `InputError` when a vector has not three entries, or n · p_0 is 0.

    >>> vs.derive.plane_of((0, 0, 2), (0, 0, 1))
    (0, 0, 1/2)
    """
    n = vector("normal", normal)
    distance = n.dot(vector("point", point))
    if distance.is_zero:
        raise InputError(
            f"The plane with normal {tuple(n)} goes through the centre of the camera, which sees "
            "it edge-on; give a point and a normal that are not perpendicular."
        )
    a, b, c = (entry / distance for entry in n)
    return a, b, c


def checked(name: str, plane: Any) -> Plane:
    """``plane`` as three expressions. Errors: `InputError` for anything else."""
    if not isinstance(plane, tuple | list) or len(plane) != 3:
        raise InputError(f"{name}: plane = {quoted(plane)} must be the three numbers A, B, C.")
    a, b, c = (scalar(f"{name}: plane[{i}]", entry) for i, entry in enumerate(plane))
    if {X, Y} & (a.free_symbols | b.free_symbols | c.free_symbols):
        raise InputError(
            f"{name}: plane = {quoted(plane)} depends on the image point; A, B and C must not."
        )
    return a, b, c


def velocity_on(plane: Plane, camera: Camera) -> ImmutableMatrix:
    """The 2×6 matrix of (X', Y') = … T on the plane: polynomials in X and Y as reported.

    Errors: `InputError` where the lens distorts.
    """
    x_n, y_n = camera.normalised(X, Y)
    a, b, c = plane
    inverse_depth = a * x_n + b * y_n + c
    return camera.velocity(X, Y, inverse_depth).applyfunc(lambda entry: entry.expand())
