"""The features that have a name of their own, as the command line calls them.

The module exists so that there is one list of what is derived: the command line offers it, the
tests go through it in every language, the benchmark times it.
"""

import inspect
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from vsctrl.checks import quoted
from vsctrl.derive.camera import PIXELS
from vsctrl.derive.emit import emit
from vsctrl.derive.emit.mathematics import as_text
from vsctrl.derive.emit.meanings import COLUMNS, meaning
from vsctrl.derive.features import curves, moments, points, poses
from vsctrl.derive.kinematics.interaction import VisualFeature, interaction_matrix
from vsctrl.errors import InputError, nearest


def _of(
    make: Callable[..., VisualFeature], summary: str, **fixed: Any
) -> Callable[..., VisualFeature]:
    """``make`` with some arguments given and a summary of its own; the other arguments stay."""

    def made(**others: Any) -> VisualFeature:
        return make(**fixed, **others)

    made.__doc__ = summary
    signature = inspect.signature(make)
    free = [p for name, p in signature.parameters.items() if name not in fixed]
    made.__signature__ = signature.replace(parameters=free)  # type: ignore[attr-defined]
    return made


#: Name → what makes the feature; those with a parameter ``camera`` may be had in pixels.
FEATURES: Mapping[str, Callable[..., VisualFeature]] = MappingProxyType(
    {
        "point": points.Point,
        "polar-point": points.PolarPoint,
        "point-3d": points.Point3D,
        "depth": points.Depth,
        "log-depth": points.LogDepth,
        "segment": points.Segment,
        "normalised-segment": _of(
            points.Segment,
            "The segment between two image points, s = (x_c/l, y_c/l, 1/l, α).",
            normalised=True,
        ),
        "line": curves.Line,
        "vanishing-point": points.VanishingPoint,
        "vanishing-point-inverse": _of(
            points.VanishingPoint, "A vanishing point far away or not, s = (1/ρ, α).", form="1/rho"
        ),
        "vanishing-point-angle": _of(
            points.VanishingPoint,
            "A vanishing point far away or not, s = (atan(1/ρ), α).",
            form="atan",
        ),
        "ellipse": curves.Ellipse,
        "sphere": points.Sphere,
        "moment-20": _of(moments.Moment, "The raw moment m_20 of a region.", i=2, j=0),
        "centred-moment-11": _of(
            moments.CentredMoment, "The centred moment μ_11 of a region.", i=1, j=1
        ),
        "area": moments.Area,
        "gravity-centre": moments.GravityCentre,
        "normalised-moments": moments.NormalisedMoments,
        "orientation": moments.Orientation,
        "theta-u": poses.ThetaU,
        "theta-u-inverse": _of(
            poses.ThetaU,
            "The axis times the angle of the inverse rotation, of cRcd.",
            rotation="cRcd",
        ),
        "translation": poses.Translation,
        "translation-goal": _of(
            poses.Translation,
            "Where the goal is in the frame of the camera, s = ctcd.",
            frame="ctcd",
        ),
        "translation-object": _of(
            poses.Translation,
            "Where the object is in the frame of the camera, s = cto.",
            frame="cto",
        ),
    }
)


def named(name: str, *, pixels: bool = False) -> VisualFeature:
    """A feature by its name; with ``pixels`` in pixels from the principal point, as in eq. 15.

    Errors: `InputError` for an unknown name, which lists the known ones, and for pixels of a
    feature that is not measured in the image or is normalised by nature.
    """
    if name not in FEATURES:
        raise InputError(
            f"feature: {quoted(name)} is not known{nearest(name, FEATURES)}; choose one of "
            f"{', '.join(FEATURES)}."
        )
    make = FEATURES[name]
    if not pixels:
        return make()
    if "camera" not in inspect.signature(make).parameters:
        raise InputError(f"pixels: feature {quoted(name)} takes no camera; leave pixels out.")
    return make(camera=PIXELS)


def summary(name: str) -> str:
    """What the feature is, in the first sentence of its own documentation."""
    return inspect.getdoc(FEATURES[name]).splitlines()[0]  # type: ignore[union-attr]


def names_text() -> str:
    """All names with what they are, a line each."""
    room = max(map(len, FEATURES))
    return "".join(f"{name:{room}}  {summary(name)}\n" for name in FEATURES)


def names_data() -> list[dict[str, str]]:
    """The same for a program."""
    return [{"feature": name, "summary": summary(name)} for name in FEATURES]


def feature_text(name: str, language: str | None = None, *, pixels: bool = False) -> str:
    """A named feature for the terminal: arguments and L, or its source in a language of ``emit``.

    Errors: as ``named`` and ``emit``.
    """
    feature = named(name, pixels=pixels)
    return as_text(feature) if language is None else emit(feature, language)


def feature_data(name: str, language: str | None = None, *, pixels: bool = False) -> dict[str, Any]:
    """The same for a program: L as rows of SymPy's text, and the source if one was asked for."""
    feature = named(name, pixels=pixels)
    L = interaction_matrix(feature)
    data: dict[str, Any] = {
        "feature": name,
        "pixels": pixels,
        "name": feature.name,
        "arguments": [
            {"name": symbol.name, "meaning": meaning(symbol, feature.arguments)}
            for symbol in feature.arguments
        ],
        "columns": list(COLUMNS),
        "interaction": [[str(L[i, j]) for j in range(L.cols)] for i in range(L.rows)],
    }
    if language is not None:
        data |= {"language": language, "source": emit(feature, language)}
    return data


def ledger_text() -> str:
    """What became of the paper's equations, as a table."""
    from vsctrl.derive import claims

    return f"{claims.as_text(claims.ledger())}\n"


def ledger_data() -> list[dict[str, str]]:
    """The same for a program."""
    from vsctrl.derive import claims

    kept = ("equation", "section", "status", "statement", "correction", "formula", "explanation")
    return [{field: getattr(row, field) for field in kept} for row in claims.ledger()]
