"""Feature sets: several features as one, of the same or of different points.

The module exists because a target is seldom one point: four image points, or a point, its depth and
a rotation, are one s with one L. What is stacked is derived once; L of the set is the L of its
parts, one below the other.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from sympy import Expr, ImmutableMatrix, Symbol

from vsctrl.checks import quoted
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.kinematics.interaction import Coordinates
from vsctrl.errors import InputError

_Pairs = tuple[tuple[Symbol, Expr], ...]


@dataclass(frozen=True)
class FeatureSet(Feature):
    """A feature whose L is that of its ``parts``, in the measures of all; see ``together``.

    >>> vs.derive.copies(vs.derive.Point(), 4).parts[0].name
    'point_1'
    """

    parts: tuple[Feature, ...] = ()

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L, Σk×6."""
        # What one part leaves as a coordinate may be measured by another.
        stacked = ImmutableMatrix.vstack(*(part.interaction for part in self.parts))
        return stacked.xreplace(self.through_measures)


@dataclass(frozen=True)
class _Renamed(Feature):
    """A feature in other symbols, whose L is that of the ``original``."""

    original: Feature | None = None
    names: tuple[tuple[Symbol, Symbol], ...] = ()

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        assert self.original is not None
        return self.original.interaction.xreplace(dict(self.names))


def together(name: str, *features: Feature) -> FeatureSet:
    """Several features as one, s and L one below the other, for L, references and source code.

    Features may share points and directions, which are then one: ``together("half", Point(),
    LogDepth(), ThetaU())`` are the 2½-D features of a point. Arguments: all measures, what is left
    of the coordinates, parameters.
    Errors: `InputError` for what is no function of points and directions, and where two features
    use one symbol for two things; ``copies`` gives each its own.

    >>> len(vs.derive.together("both", vs.derive.Point(), vs.derive.Depth()).expressions)
    3
    """
    for feature in features:
        _require_feature(feature)
    if not features:
        raise InputError(f"The feature set {quoted(name)} is empty; give at least one feature.")
    measures = _merged(name, "measure", (f.measures for f in features))
    places = _merged(name, "place", (tuple(f.through_measures.items()) for f in features))
    measured = {symbol for symbol, _ in measures}
    parameters = dict.fromkeys(chain.from_iterable(f.parameters for f in features))
    return FeatureSet(
        name,
        tuple(chain.from_iterable(f.expressions for f in features)),
        points=tuple(dict.fromkeys(chain.from_iterable(f.points for f in features))),
        directions=tuple(dict.fromkeys(chain.from_iterable(f.directions for f in features))),
        # What is a parameter of one feature may be measured by another, as θu by ThetaU.
        parameters=tuple(symbol for symbol in parameters if symbol not in measured),
        measures=measures,
        places=places,
        parts=features,
    )


def copies(feature: Feature, n: int, own: tuple[Symbol, ...] = ()) -> FeatureSet:
    """The same feature n times, of n points: s = (s_1, …, s_n), of 4 image points (X_1, Y_1, …).

    Coordinates and measures get the numbers 1 … n, x_1 for x; parameters, such as those of the
    camera, are shared but for those in ``own``, such as the radius of each of n spheres.
    Errors: `InputError` unless n is an integer above 0, as ``together``, and where a numbered name
    is a parameter.

    >>> len(vs.derive.copies(vs.derive.Point(), 4).expressions)
    8
    """
    if isinstance(n, bool) or not isinstance(n, int) or n < 1:
        raise InputError(f"n = {quoted(n)} copies of a feature must be an integer, 1 or more.")
    _require_feature(feature)
    if not isinstance(own, tuple) or not set(own) <= set(feature.parameters):
        raise InputError(
            f"own = {quoted(own)} must be a tuple of parameters of feature "
            f"{quoted(feature.name)}, which are "
            f"{feature.parameters}."
        )
    return together(f"{feature.name}_x{n}", *(_numbered(feature, i, own) for i in range(1, n + 1)))


def _require_feature(feature: object) -> None:
    if not isinstance(feature, Feature):
        raise InputError(
            f"{quoted(getattr(feature, 'name', feature))} is no function of points and "
            "directions; give "
            "features like derive.Point(), or for curves derive.SeenLine()."
        )


def _numbered(feature: Feature, i: int, own: tuple[Symbol, ...]) -> Feature:
    measured = [symbol for symbol, _ in feature.measures]
    varied = dict.fromkeys((*feature.coordinates, *measured, *own))
    names = {symbol: Symbol(f"{symbol.name}_{i}", **symbol.assumptions0) for symbol in varied}

    def pairs(originals: Iterable[tuple[Symbol, Expr]]) -> _Pairs:
        return tuple((names.get(symbol, symbol), e.xreplace(names)) for symbol, e in originals)

    def triples(vectors: tuple[Coordinates, ...]) -> tuple[Coordinates, ...]:
        return tuple((names[a], names[b], names[c]) for a, b, c in vectors)

    return _Renamed(
        f"{feature.name}_{i}",
        tuple(expression.xreplace(names) for expression in feature.expressions),
        points=triples(feature.points),
        directions=triples(feature.directions),
        parameters=tuple(names.get(symbol, symbol) for symbol in feature.parameters),
        measures=pairs(feature.measures),
        places=pairs(feature.through_measures.items()),
        original=feature,
        names=tuple(names.items()),
    )


def _merged(name: str, kind: str, parts: Iterable[_Pairs]) -> _Pairs:
    """The pairs of all features; each symbol must mean one thing."""
    merged: dict[Symbol, Expr] = {}
    for symbol, expression in chain.from_iterable(parts):
        if merged.setdefault(symbol, expression) != expression:
            raise InputError(
                f"In the feature set {quoted(name)}, two features have the {kind} {symbol} for "
                "different "
                "expressions; take features of one camera and one convention, or rename one."
            )
    return tuple(merged.items())
