"""What s is: a feature as expressions of camera-frame coordinates of points and directions.

The module exists so that everything else (interaction matrix, reference, source code) is derived
from one declaration, and holds for any feature. The features that people use are declared in
``points``, ``outlines`` and ``poses``; ``curves`` and ``moments`` have kinds of their own.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from sympy import Expr, Float, ImmutableMatrix, Symbol, nan, oo, solve, zoo

from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.derive.inputs import vanishes
from vsctrl.derive.kinematics.interaction import (
    Coordinates,
    chain_rule,
    differentiated,
    undifferentiated,
)
from vsctrl.derive.simplify import shortened
from vsctrl.errors import InputError


@dataclass(frozen=True)
class Feature(Caching):
    """A visual feature s = ``expressions``, k functions of coordinates of points and directions.

    ``points`` are the coordinates (x, y, z) of each point in the camera frame, in m, z > 0;
    ``directions`` those of vectors that turn with the object and do not feel translation, such as
    the direction of a line. ``parameters`` are the other symbols that s uses, such as focal
    lengths. ``measures``, if given, are pairs (symbol, expression): what is measured in the image
    and stands for coordinates wherever a result is written out. ``places`` are the pairs
    (coordinate, expression in measures, remaining coordinates and parameters) that say how; with
    two measures for each point they may be left out, and SymPy solves for its x and y. The name
    becomes part of function names.
    Errors: `InputError` when an expression depends on no point and no direction, one of those on
    no expression, a symbol is undeclared, an expression is not finite or not differentiable, or
    measures and places do not belong together. At a kink, as of |x| at 0, L is not finite.
    Source: s of eq. 1 and 15.

    >>> import sympy as sp
    >>> x, y = sp.symbols("x y", real=True)
    >>> z = sp.Symbol("z", positive=True)
    >>> ratio = vs.derive.Feature("ratio", (x / z,), points=((x, y, z),))
    >>> vs.derive.interaction_matrix(ratio)
    Matrix([[-1/z, 0, x/z**2, x*y/z**2, -x**2/z**2 - 1, y/z]])
    """

    name: str
    expressions: tuple[Expr, ...]
    points: tuple[Coordinates, ...] = ()
    parameters: tuple[Symbol, ...] = ()
    measures: tuple[tuple[Symbol, Expr], ...] = ()
    directions: tuple[Coordinates, ...] = ()
    places: tuple[tuple[Symbol, Expr], ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is not a feature, before anything is derived from it."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InputError(
                f"The feature name {quoted(self.name)} must be an identifier, like 'point'."
            )
        self._check_shapes()
        self._check_dependence()
        self._check_smoothness()
        if self.measures:
            self._check_places()

    @property
    def coordinates(self) -> tuple[Symbol, ...]:
        """All coordinates in one row: points first, x, y, z of the first point first."""
        return tuple(chain.from_iterable((*self.points, *self.directions)))

    @cached_property
    def through_measures(self) -> dict[Symbol, Expr]:
        """The coordinates that follow from the measures, the other coordinates and parameters.

        For an image point this inverts eq. 15: x = X z/F_x, y = Y z/F_y. Empty without measures.
        """
        if self.places or not self.measures:
            return dict(self.places)
        unknowns = [coordinate for point in self.points for coordinate in point[:2]]
        equations = [expression - measure for measure, expression in self.measures]
        solutions = solve(equations, unknowns, dict=True)
        if len(solutions) != 1 or set(solutions[0]) != set(unknowns):
            raise InputError(
                f"The measures of feature {quoted(self.name)} do not determine x and y of its "
                "points "
                "uniquely; give two independent measures for each point, or none."
            )
        return dict(solutions[0])

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """The symbols in which results are written: places or points in turn, then parameters.

        A point is (X, Y, z) where two measures stand for its x and y, and (x, y, z) without.
        """
        symbols = [symbol for symbol, _ in self.measures]
        if self.places:
            placed = dict(self.places)
            remaining = [c for c in self.coordinates if c not in placed]
            return (*symbols, *remaining, *self.parameters)
        if not symbols:
            return self.coordinates + self.parameters
        points = [
            (*symbols[2 * i : 2 * i + 2], depth) for i, (_, _, depth) in enumerate(self.points)
        ]
        return tuple(chain.from_iterable(points)) + self.parameters

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L by the chain rule, k×6, in the arguments: ∂s/∂(coordinates) times their L."""
        gradient = differentiated(self.expressions, self.coordinates)
        rates = chain_rule(self.coordinates, self.points, self.directions)
        # Written in the arguments, the factors are far shorter than their product.
        gradient, rates = (m.xreplace(self.through_measures) for m in (gradient, rates))
        return (gradient.applyfunc(shortened) * rates).applyfunc(shortened)

    def _check_shapes(self) -> None:
        for field in ("expressions", "points", "parameters", "measures", "directions", "places"):
            if not isinstance(getattr(self, field), tuple):
                raise InputError(f"{field} of feature {quoted(self.name)} must be a tuple.")
        if not self.expressions or not all(isinstance(e, Expr) for e in self.expressions):
            raise InputError(
                f"Feature {quoted(self.name)} needs at least one SymPy expression in its "
                "expressions."
            )
        vectors = (*self.points, *self.directions)
        if not vectors or not all(isinstance(v, tuple) and len(v) == 3 for v in vectors):
            raise InputError(
                f"points and directions of feature {quoted(self.name)} must be triples of "
                "coordinates "
                f"(x, y, z) and at least one; got {quoted(vectors)}."
            )
        declared = self.coordinates + self.parameters
        # The names become arguments of printed functions, so they must be distinct and plain.
        names = {s.name for s in declared if isinstance(s, Symbol) and s.name.isidentifier()}
        if len(names) < len(declared):
            raise InputError(
                f"Coordinates and parameters of feature {quoted(self.name)} must be symbols with "
                f"distinct names that are identifiers; got {quoted(declared)}."
            )
        for field in ("measures", "places"):
            if not all(is_pair(pair) for pair in getattr(self, field)):
                raise InputError(
                    f"{field} of feature {quoted(self.name)} must be pairs (symbol, expression); "
                    f"got {quoted(getattr(self, field))}."
                )
        if not self.places and len(self.measures) not in (0, 2 * len(self.points)):
            raise InputError(
                f"measures of feature {quoted(self.name)} must be two pairs (symbol, expression) "
                "for "
                "each of its points, or say in places what they stand for; got "
                f"{quoted(self.measures)}."
            )

    def _check_dependence(self) -> None:
        coordinates = set(self.coordinates)
        for expression in self.expressions:
            if expression.has(nan, oo, -oo, zoo):
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} is not finite; it "
                    "divides by zero wherever the points are."
                )
            if not expression.free_symbols & coordinates:
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} depends on no "
                    "point; "
                    "write it with the coordinates that the feature declares in points."
                )
        used = set[Symbol]().union(*(e.free_symbols for e in self.expressions))
        for vector in (*self.points, *self.directions):
            if not used & set(vector):
                raise InputError(
                    f"No expression of feature {quoted(self.name)} depends on its point "
                    f"{vector}; use "
                    "the point or leave it out."
                )
        used = used.union(*(expression.free_symbols for _, expression in self.measures))
        unknown = sorted(map(str, used - coordinates - set(self.parameters)))
        if unknown:
            raise InputError(
                f"Feature {quoted(self.name)} uses {', '.join(unknown)} without declaring it; "
                "add it to "
                "parameters or points."
            )

    def _check_smoothness(self) -> None:
        for expression in self.expressions:
            rough = undifferentiated(differentiated([expression], self.coordinates))
            if rough is not None:
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} is not "
                    "differentiable: "
                    f"its derivative holds {rough}; write it with smooth functions of the "
                    "coordinates."
                )

    def _check_places(self) -> None:
        """The places must give back the measures, and use nothing that is not known."""
        measured = [symbol.name for symbol, _ in self.measures]
        others = {symbol.name for symbol in (*self.coordinates, *self.parameters)}
        twice = sorted({n for n in measured if n in others or measured.count(n) > 1})
        if twice:
            raise InputError(
                f"Feature {quoted(self.name)} uses {', '.join(twice)} for a measure and for "
                "something "
                "else; measures, coordinates and parameters need distinct names."
            )
        placed = self.through_measures
        foreign = set(placed) - set(self.coordinates)
        used = set[Symbol]().union(*(e.free_symbols for e in placed.values()))
        known = set(self.arguments) - set(placed)
        if foreign or used - known:
            names = ", ".join(sorted(map(str, foreign or used - known)))
            raise InputError(
                f"places of feature {quoted(self.name)} must give coordinates by measures, other "
                f"coordinates and parameters; {names} is none of these."
            )
        for measure, expression in self.measures:
            if not vanishes(expression - measure, placed, within=_tolerance(expression, placed)):
                raise InputError(
                    f"With its places, feature {quoted(self.name)} does not give back its measure "
                    f"{measure}; check the expressions of both."
                )


def _tolerance(expression: Expr, placed: dict[Symbol, Expr]) -> str:
    """What counts as zero: floats give a measure back to rounding errors of the largest of them."""
    floats = {abs(f) for e in (expression, *placed.values()) for f in e.atoms(Float)}
    return "1e-20" if not floats else str(1e-13 * max(1.0, *map(float, floats)))


def is_pair(pair: object) -> bool:
    """Whether this is (symbol with a plain name, expression)."""
    return (
        isinstance(pair, tuple)
        and len(pair) == 2
        and are_symbols(pair[:1])
        and isinstance(pair[1], Expr)
    )


def are_symbols(entries: object) -> bool:
    """Whether this is a tuple of symbols whose names are identifiers."""
    return isinstance(entries, tuple) and all(
        isinstance(entry, Symbol) and entry.name.isidentifier() for entry in entries
    )
