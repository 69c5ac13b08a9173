"""Features of pose-based servoing: the rotation θu and the translation that are left to the goal.

Frames are named as in ViSP: c is the camera now, cd the camera at the goal, o the object; cdRc
takes coordinates in c into coordinates in cd. All are still but c, so seen from c the axes of the
others move as directions do and their origins as points.
"""

from dataclasses import dataclass
from functools import cache, cached_property

from sympy import (
    Dummy,
    Expr,
    Float,
    ImmutableMatrix,
    Piecewise,
    Symbol,
    atan2,
    cancel,
    collect,
    cos,
    diff,
    expand,
    sin,
    sinc,
    sqrt,
    symbols,
)

from vsctrl.checks import quoted
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.kinematics.interaction import Coordinates, chain_rule
from vsctrl.derive.kinematics.motion import rotation as turn
from vsctrl.derive.simplify import shortened
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import r_x, r_y, r_z

_ROTATIONS = ("cdRc", "cRcd")
_FRAMES = ("cdtc", "ctcd", "cto")

_THETA_U: Coordinates = symbols("thetau_x thetau_y thetau_z", real=True)
_T: Coordinates = symbols("t_x t_y t_z", real=True)
_U: Coordinates = (r_x, r_y, r_z)
_theta = Dummy("theta", positive=True)
# sinc θ, sinc(θ/2) and 1 − sinc θ/sinc²(θ/2), by which all is regular at θ = 0.
_whole, _half, _k = Dummy("sinc"), Dummy("sinc_half"), Dummy("k")


@dataclass(frozen=True)
class PoseFeature(Feature):
    """A feature of a rotation with L, k×6, as ``_theta_u_interaction`` has it, regular at θ = 0.

    ``rotation`` says of which. The chain rule over the axes would divide by sin θ.

    >>> isinstance(vs.derive.ThetaU(), vs.derive.PoseFeature)
    True
    """

    rotation: str = "cdRc"

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L in θu, 3×6."""
        return _theta_u_interaction(self.rotation)


def ThetaU(rotation: str = "cdRc") -> PoseFeature:
    """The axis times the angle of the rotation left to the goal, s = θu, with s* = 0.

    L = [0 | L_ω], L_ω = ±I + (θ/2)[u]× ± (1 − sinc θ/sinc²(θ/2))[u]×², the upper sign for
    ``rotation`` "cdRc", the lower for "cRcd". Arguments thetau_x, thetau_y, thetau_z (rad). Regular
    at θ = 0, where L_ω = ±I, and at θ = π, where u may jump to −u; singular at θ = 2π. Of the axes
    of cd seen from c, which a reference is written in, s is the axial vector of R over sinc θ, with
    sin θ its length and cos θ = (tr R − 1)/2; there ds*/dt is singular at θ = 0 and π.
    Errors: `InputError` for another rotation. Source: ViSP's vpFeatureThetaU; Malis, Chaumette and
    Boudet, 2½-D visual servoing, 1999.

    >>> theta_u = vs.derive.ThetaU()
    >>> vs.derive.evaluate(theta_u, **{a.name: 0.0 for a in theta_u.arguments})[0]
    array([0., 0., 0., 1., 0., 0.])
    """
    _require("rotation", rotation, _ROTATIONS)
    axes = _axes()
    cosine, *axial = _cos_and_axial(axes, rotation)
    sine = sqrt(sum(entry**2 for entry in axial))
    s = tuple(entry / sinc(atan2(sine, cosine)) for entry in axial)
    solved = _rodrigues() if rotation == "cdRc" else _rodrigues().T
    return PoseFeature(
        f"theta_u_{rotation}",
        s,
        directions=axes,
        measures=tuple(zip(_THETA_U, s, strict=True)),
        places=_axis_places(axes, solved),
        rotation=rotation,
    )


def Translation(frame: str = "cdtc") -> Feature:
    """The translation left to the goal or to an object, s = t, with s* = 0 in the first two.

    ``frame`` "cdtc": where the camera is in the goal's frame, L = [cdRc | 0]; "ctcd" and "cto":
    where the goal or the object is in the camera's, L = [−I₃ | t̃]. Arguments t_x, t_y, t_z (m), of
    which the first L does not depend, and for it θu of cdRc, thetau_x, thetau_y, thetau_z (rad), as
    in ``ThetaU``. Nowhere singular.
    Errors: `InputError` for another frame. Source: ViSP's vpFeatureTranslation.

    >>> len(vs.derive.Translation().expressions)
    3
    """
    _require("frame", frame, _FRAMES)
    if frame != "cdtc":
        return Feature(f"translation_{frame}", _T, points=(_T,))
    # cdtc = −cdRc ctcd; the rows of cdRc are the axes of cd seen from c.
    origin: Coordinates = symbols("o_x o_y o_z", real=True)
    cdRc, axes = _rodrigues(), _axes()
    solved = zip(origin, -cdRc.T * ImmutableMatrix(_T), strict=True)
    s = tuple(-ImmutableMatrix(axis).dot(ImmutableMatrix(origin)) for axis in axes)
    return Feature(
        "translation_cdtc",
        s,
        points=(origin,),
        directions=axes,
        parameters=_THETA_U,
        measures=tuple(zip(_T, s, strict=True)),
        places=(*_axis_places(axes, cdRc), *solved),
    )


def _require(name: str, value: object, known: tuple[str, ...]) -> None:
    if value not in known:
        choices = ", ".join(map(repr, known))
        raise InputError(
            f"{name} = {quoted(value)} is no {name} of a pose feature{nearest(value, known)}; "
            "choose one "
            f"of {choices}."
        )


def _axes() -> tuple[Coordinates, ...]:
    """The axes of cd seen from c."""
    return tuple(symbols(f"a_{i}x a_{i}y a_{i}z", real=True) for i in "xyz")


def _axis_places(
    axes: tuple[Coordinates, ...], cdRc: ImmutableMatrix
) -> tuple[tuple[Symbol, Expr], ...]:
    """The axes as the rows of cdRc."""
    return tuple((axes[i][j], cdRc[i, j]) for i in range(3) for j in range(3))


def _cos_and_axial(axes: tuple[Coordinates, ...], rotation: str) -> tuple[Expr, Expr, Expr, Expr]:
    """cos θ = (tr R − 1)/2 and sin θ u, the axial vector of R, of cdRc or cRcd."""
    cdRc = ImmutableMatrix(axes)
    R = cdRc if rotation == "cdRc" else cdRc.T
    a, b, c = ((R[i, j] - R[j, i]) / 2 for i, j in ((2, 1), (0, 2), (1, 0)))
    return (R.trace() - 1) / 2, a, b, c


@cache
def _theta_u_interaction(rotation: str) -> ImmutableMatrix:
    """L by the chain rule from cos θ and v = sin θ u, the axial vector of R.

    θu is θ/sin θ times the second, so (θu)' = (θ/sin θ) v' + (θ/sin θ)' sin θ u.
    """
    axes, turned = _axes(), turn(_U, -_theta)
    solved = turned if rotation == "cdRc" else turned.T
    rates = chain_rule(_cos_and_axial(axes, rotation), (), axes).subs(
        dict(_axis_places(axes, solved))
    )
    ratio = _theta / sin(_theta)
    theta_rate = -rates[0, :] / sin(_theta)
    L = ratio * rates[1:, :]
    L += diff(ratio, _theta) * sin(_theta) * ImmutableMatrix(_U) * theta_rate
    # Row i without u_i² = 1 − (the other two)²; then each entry is a + b (1 − sinc θ/sinc²(θ/2)).
    unit = [1 - sum(u**2 for u in _U) + u**2 for u in _U]
    return ImmutableMatrix(
        3, 6, lambda i, j: _regular(shortened(L[i, j]).subs(_U[i] ** 2, unit[i]))
    )


def _regular(entry: Expr) -> Expr:
    """An entry in u, cos θ and sin θ written in θu so that θ = 0 divides nothing by zero."""
    # 1/sin θ is 0/0 at π next to 1 + cos θ: sin θ/(1 − cos θ) stands for their product.
    entry = entry.subs(1 / sin(_theta), sin(_theta) / (1 - cos(_theta) ** 2))
    entry = cancel(_in_sinc(cancel(entry)))
    entry = cancel(entry.subs(_whole, (1 - _k) * _half**2))
    entry = expand(_in_theta_u(entry))
    square = sum(s**2 for s in _THETA_U)
    # Where θ² is 0 or divides to infinity, what stands over it is 0, so anything else may do there.
    safe = square + Piecewise((1, square < Float("1e-300")), (0, True))
    theta = sqrt(square)
    entry = collect(entry, _k).subs(_theta, sqrt(safe))
    return entry.subs(_k, 1 - sinc(theta) / sinc(theta / 2) ** 2)


def _in_sinc(entry: Expr) -> Expr:
    return entry.subs({sin(_theta): _theta * _whole, cos(_theta): 1 - _theta**2 * _half**2 / 2})


def _in_theta_u(entry: Expr) -> Expr:
    return entry.subs({u: s / _theta for u, s in zip(_U, _THETA_U, strict=True)})


@cache
def _rodrigues() -> ImmutableMatrix:
    """R = I + sinc θ [θu]× + ½ sinc²(θ/2) [θu]×², 3×3, regular everywhere."""
    R = turn(_U, -_theta).applyfunc(lambda entry: expand(_in_theta_u(_in_sinc(entry))))
    theta = sqrt(sum(s**2 for s in _THETA_U))
    return R.subs({_whole: sinc(theta), _half: sinc(theta / 2)})
