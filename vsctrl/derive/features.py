"""What s is: a feature as expressions of the camera-frame coordinates of one or more points.

The module exists so that everything else (interaction matrix, reference, source code) is derived
from one declaration, and holds for any feature. How s changes is left to ``interaction`` and
``references``.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from sympy import Expr, Symbol, solve

from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, X, Y, x, y, z

Coordinates = tuple[Symbol, Symbol, Symbol]


@dataclass(frozen=True)
class Feature:
    """A visual feature s = ``expressions``, k functions of the coordinates of its points.

    ``points`` are the coordinates (x, y, z) of each point in the camera frame, in m, z > 0;
    ``parameters`` the other symbols that s uses, such as focal lengths; ``measures``, if given, two
    pairs (symbol, expression) for each point: image measures that stand for its x and y wherever a
    result is written out, solved for by SymPy. The name becomes part of function names.
    Raises InputError when an expression depends on no point, a point on no expression, a symbol is
    undeclared, or the measures do not determine x and y. Source: s of eq. 1 and 15.
    """

    name: str
    expressions: tuple[Expr, ...]
    points: tuple[Coordinates, ...]
    parameters: tuple[Symbol, ...] = ()
    measures: tuple[tuple[Symbol, Expr], ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is not a feature, before anything is derived from it."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InputError(f"The feature name {self.name!r} must be an identifier, like 'point'.")
        self._check_shapes()
        self._check_dependence()
        if self.measures:
            _ = self.through_measures

    @property
    def coordinates(self) -> tuple[Symbol, ...]:
        """The coordinates of all points in one row, x, y, z of the first point first."""
        return tuple(chain.from_iterable(self.points))

    @cached_property
    def through_measures(self) -> dict[Symbol, Expr]:
        """Each x and y as an expression of the measures, the depths and the parameters.

        For an image point this inverts eq. 15: x = X z/F_x, y = Y z/F_y. Empty without measures.
        """
        if not self.measures:
            return {}
        unknowns = [coordinate for point in self.points for coordinate in point[:2]]
        equations = [expression - measure for measure, expression in self.measures]
        solutions = solve(equations, unknowns, dict=True)
        if len(solutions) != 1 or set(solutions[0]) != set(unknowns):
            raise InputError(
                f"The measures of feature {self.name!r} do not determine x and y of its points "
                "uniquely; give two independent measures for each point, or none."
            )
        return dict(solutions[0])

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """The symbols in which results are written: point by point, then the parameters.

        A point is (X, Y, z) with measures and (x, y, z) without.
        """
        if not self.measures:
            return self.coordinates + self.parameters
        symbols = [symbol for symbol, _ in self.measures]
        points = [
            (*symbols[2 * i : 2 * i + 2], depth) for i, (_, _, depth) in enumerate(self.points)
        ]
        return tuple(chain.from_iterable(points)) + self.parameters

    def _check_shapes(self) -> None:
        for field in ("expressions", "points", "parameters", "measures"):
            if not isinstance(getattr(self, field), tuple):
                raise InputError(f"{field} of feature {self.name!r} must be a tuple.")
        if not self.expressions or not all(isinstance(e, Expr) for e in self.expressions):
            raise InputError(
                f"Feature {self.name!r} needs at least one SymPy expression in its expressions."
            )
        triples = all(isinstance(point, tuple) and len(point) == 3 for point in self.points)
        if not triples or not self.points:
            raise InputError(
                f"points of feature {self.name!r} must be triples of coordinates (x, y, z) and at "
                f"least one; got {self.points!r}."
            )
        declared = self.coordinates + self.parameters
        # The names become arguments of printed functions, so they must be distinct and plain.
        names = {s.name for s in declared if isinstance(s, Symbol) and s.name.isidentifier()}
        if len(names) < len(declared):
            raise InputError(
                f"Coordinates and parameters of feature {self.name!r} must be symbols with "
                f"distinct names that are identifiers; got {declared!r}."
            )
        pairs = all(
            isinstance(pair, tuple)
            and len(pair) == 2
            and isinstance(pair[0], Symbol)
            and pair[0].name.isidentifier()
            and isinstance(pair[1], Expr)
            for pair in self.measures
        )
        if not pairs or len(self.measures) not in (0, 2 * len(self.points)):
            raise InputError(
                f"measures of feature {self.name!r} must be two pairs (symbol, expression) for "
                f"each of its points, or none; got {self.measures!r}."
            )

    def _check_dependence(self) -> None:
        coordinates = set(self.coordinates)
        for expression in self.expressions:
            if not expression.free_symbols & coordinates:
                raise InputError(
                    f"The expression {expression} of feature {self.name!r} depends on no point; "
                    "write it with the coordinates that the feature declares in points."
                )
        used = set[Symbol]().union(*(e.free_symbols for e in self.expressions))
        for point in self.points:
            if not used & set(point):
                raise InputError(
                    f"No expression of feature {self.name!r} depends on its point {point}; use "
                    "the point or leave it out."
                )
        used = used.union(*(expression.free_symbols for _, expression in self.measures))
        unknown = sorted(map(str, used - coordinates - set(self.parameters)))
        if unknown:
            raise InputError(
                f"Feature {self.name!r} uses {', '.join(unknown)} without declaring it; add it to "
                "parameters or points."
            )


def Point() -> Feature:
    """An image point in pixels from the principal point, s = (F_x x/z, F_y y/z).

    F_x, F_y in pixels; x, y, z in m. Source: eq. 15.
    """
    image = (F_x * x / z, F_y * y / z)
    return Feature(
        name="point",
        expressions=image,
        points=((x, y, z),),
        parameters=(F_x, F_y),
        measures=((X, image[0]), (Y, image[1])),
    )
