"""Curves in the image: the interaction matrix of any implicit equation, and line and ellipse.

The module exists so that a curve brings its equation and nothing else. What a camera sees of a
line, circle or sphere in space, which references need, is left to ``outlines``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from sympy import (
    QQ,
    Dummy,
    Expr,
    Float,
    Function,
    ImmutableMatrix,
    Poly,
    Rational,
    Symbol,
    cancel,
    cos,
    count_ops,
    expand_trig,
    fraction,
    itermonomials,
    prime,
    sin,
    symbols,
)
from sympy.polys.matrices import DomainMatrix

from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.derive.camera import NORMALISED, Camera, checked_camera
from vsctrl.derive.features.feature import are_symbols
from vsctrl.derive.features.planes import PLANE, Plane, checked, velocity_on
from vsctrl.derive.inputs import symbols_in
from vsctrl.derive.simplify import shortest
from vsctrl.errors import InputError
from vsctrl.symbols import X, Y

rho, theta = symbols("rho theta", real=True)  #: distance from the origin; angle of the normal, rad
x_g, y_g = symbols("x_g y_g", real=True)  #: centre of gravity
n_20, n_11, n_02 = symbols("n_20 n_11 n_02", real=True)  #: centred moments over the area


@dataclass(frozen=True)
class Primitive(Caching):
    """A plane curve, seen as h(X, Y; s) = 0: ``equation`` is h and ``shape`` is s, k symbols.

    X and Y are the image coordinates that ``camera`` reports, 1/z = A x + B y + C the ``plane`` of
    the curve in normalised ones; A, B and C are symbols, numbers or expressions, in 1/m.
    ``parameters`` are the other symbols of h, which stay constant. h is a polynomial in X and Y,
    whose coefficients hold symbols and the sines and cosines of symbols.
    Errors: `InputError` when h does not hold X or Y, or is no such polynomial; when shape and
    parameters are not the other symbols of h; behind a lens that distorts; and from
    ``interaction``, when the camera's motion takes the curve out of its family.
    Source: Espiau, Chaumette and Rives, A new approach to visual servoing in robotics, IEEE
    Trans. Robotics and Automation 8 (1992) 313-326.

    >>> import sympy as sp
    >>> X, Y, c = sp.symbols("X Y c", real=True)
    >>> vs.derive.Primitive("height", Y - c, (c,)).shape
    (c,)
    """

    name: str
    equation: Expr
    shape: tuple[Symbol, ...]
    plane: Plane = PLANE
    parameters: tuple[Symbol, ...] = ()
    camera: Camera = NORMALISED

    def __post_init__(self) -> None:
        """Refuse what is no curve, before anything is derived from it."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InputError(f"The name {quoted(self.name)} of a primitive must be an identifier.")
        object.__setattr__(self, "plane", checked(f"Primitive {quoted(self.name)}", self.plane))
        checked_camera(self.camera).require_straight()
        self._check_symbols()
        self._check_equation()

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """The symbols in which L is written: shape, plane, parameters, camera."""
        return (*self.shape, *symbols_in(self.plane), *self.parameters, *self.camera.parameters)

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L, k×6: the s' with which h stays 0 on the curve while its points move.

        h' = Σ ∂h/∂s s' + ∂h/∂X X' + ∂h/∂Y Y' vanishes on the curve exactly when it is a multiple
        q h of h, q a polynomial in X and Y. Its coefficients are linear equations for s' and q.
        """
        h, plane, camera, floats = self._without_floats()
        moved = ImmutableMatrix([[h.diff(X), h.diff(Y)]]) * velocity_on(plane, camera)
        algebra = _Algebra([h, *moved])
        h_, *rest = (
            Poly(algebra.of(entry), X, Y)
            for entry in (h, *(h.diff(symbol) for symbol in self.shape), *-moved)
        )
        k = len(self.shape)
        degree = max(p.total_degree() for p in rest) - h_.total_degree()
        multiples = [-h_ * Poly(f, X, Y) for f in itermonomials([X, Y], max(degree, 0))]
        solved = self._solve([*rest[:k], *multiples], rest[k:], algebra)
        linear = symbols_in(plane)
        L = ImmutableMatrix(k, 6, lambda i, j: algebra.back(solved[i, j], linear))
        return L.xreplace(floats)

    def _without_floats(self) -> tuple[Expr, Plane, Camera, dict[Symbol, Expr]]:
        """Equation, plane and camera with a letter for each float: what is solved must be exact."""
        camera = self.camera
        entries = (*camera.focal, *camera.centre, camera.skew)
        held = (self.equation, *self.plane, *entries)
        floats = {f: Dummy("f") for f in set[Expr]().union(*(e.atoms(Float) for e in held))}
        h, a, b, c, *inside = (e.xreplace(floats) for e in held)
        exact = Camera(tuple(inside[:2]), tuple(inside[2:4]), inside[4])
        return expand_trig(h), (a, b, c), exact, {letter: f for f, letter in floats.items()}

    def _solve(
        self, unknowns: Sequence[Poly], right: Sequence[Poly], algebra: "_Algebra"
    ) -> ImmutableMatrix:
        """The solution of the linear system, proved on all of its equations."""
        monomials = sorted({m for p in (*unknowns, *right) for m in p.monoms()}, reverse=True)

        def coefficients(polynomials: Sequence[Poly]) -> DomainMatrix:
            table = [[p.coeff_monomial(m) for p in polynomials] for m in monomials]
            return algebra.matrix(table)

        M, R = coefficients(unknowns), coefficients(right)
        rows = algebra.independent_rows(M)
        if len(rows) < len(unknowns):
            raise InputError(
                f"The shape of primitive {quoted(self.name)} is not determined by its curve: "
                "different "
                f"values of {', '.join(map(str, self.shape))} give the same one; fix one of them."
            )
        square = M.extract(rows, range(M.shape[1]))
        solution = square.lu_solve(R.extract(rows, range(R.shape[1])))
        if not algebra.vanishes(M * solution - R):
            raise InputError(
                f"The shape does not follow the motion: a moving camera sees primitive "
                f"{quoted(self.name)} as a curve outside its family; give it more shape symbols."
            )
        return solution.to_Matrix().as_immutable()

    def _check_symbols(self) -> None:
        for field in ("shape", "parameters"):
            entries = getattr(self, field)
            if not are_symbols(entries):
                raise InputError(
                    f"{field} of primitive {quoted(self.name)} must be a tuple of symbols whose "
                    "names "
                    f"are identifiers; got {quoted(entries)}."
                )
        if not self.shape:
            raise InputError(
                f"Primitive {quoted(self.name)} needs at least one symbol in its shape."
            )
        names = [symbol.name for symbol in (X, Y, *self.arguments)]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(
                f"Primitive {quoted(self.name)} uses {', '.join(twice)} for two things; shape, "
                "plane, "
                "parameters and camera need distinct names, and X and Y are the image point."
            )

    def _check_equation(self) -> None:
        h = self.equation
        if not isinstance(h, Expr) or not h.free_symbols & {X, Y}:
            raise InputError(
                f"The equation {quoted(h)} of primitive {quoted(self.name)} must be a SymPy "
                "expression in the "
                "image point, X and Y of vsctrl.symbols; it is 0 on the curve."
            )
        missing = [str(symbol) for symbol in self.shape if not h.has(symbol)]
        if missing:
            raise InputError(
                f"The equation of primitive {quoted(self.name)} does not hold "
                f"{', '.join(missing)}; use "
                "the whole shape."
            )
        known = {X, Y, *self.shape, *self.parameters}
        unknown = sorted(str(symbol) for symbol in h.free_symbols - known)
        if unknown:
            raise InputError(
                f"The equation of primitive {quoted(self.name)} uses {', '.join(unknown)} without "
                "declaring it; add it to shape or parameters."
            )
        waves = expand_trig(h).atoms(Function)
        letters = expand_trig(h).xreplace({wave: Dummy() for wave in waves})
        rational = letters.is_rational_function(*letters.free_symbols)
        if not (h.is_polynomial(X, Y) and rational and all(map(_is_plain, waves))):
            raise InputError(
                f"The equation {h} of primitive {quoted(self.name)} must be a polynomial in X "
                "and Y with "
                "coefficients of symbols and their sines and cosines, such as "
                "X cos θ + Y sin θ − ρ."
            )


def Line(camera: Camera = NORMALISED, plane: Plane = PLANE) -> Primitive:
    """A straight line s = (ρ, θ): X cos θ + Y sin θ = ρ, in the unit of the image and rad.

    (ρ, θ) and (−ρ, θ + π) are one line; follow θ without jumps. ρ = 0, a line through the origin,
    is not singular. Any plane through the line will do, but none through the camera's centre.
    Source: ViSP's vpFeatureLine, whose plane is A x + B y + C z + D = 0: ours times −1/D.

    >>> vs.derive.Line().shape
    (rho, theta)
    """
    equation = X * cos(theta) + Y * sin(theta) - rho
    return Primitive("line", equation, (rho, theta), plane, camera=camera)


def Ellipse(camera: Camera = NORMALISED, plane: Plane = PLANE) -> Primitive:
    """An ellipse s = (x_g, y_g, n_20, n_11, n_02), what is seen of an ellipse, circle or sphere.

    Centre and moments of the region inside: n_ij = μ_ij/a is a quarter of the matrix N of
    (p − g)ᵀ N⁻¹ (p − g) = 4. For a sphere the plane is that of its outline, see ``outlines``.
    Singular where n_20 n_02 = n_11²: a region seen edge-on. A circle in the image is not singular.
    Source: ViSP's vpFeatureEllipse since 3.4; before, its μ_ij were 4 n_ij.

    >>> vs.derive.Ellipse().shape
    (x_g, y_g, n_20, n_11, n_02)
    """
    u, v = X - x_g, Y - y_g
    equation = n_02 * u**2 + n_20 * v**2 - 2 * n_11 * u * v + 4 * (n_11**2 - n_20 * n_02)
    return Primitive("ellipse", equation, (x_g, y_g, n_20, n_11, n_02), plane, camera=camera)


class _Algebra:
    """Expressions in symbols, sines and cosines as rational functions, where c² + s² = 1."""

    def __init__(self, expressions: Sequence[Expr]) -> None:
        waves = set[Expr]().union(*(e.atoms(Function) for e in expressions))
        angles = sorted({wave.args[0] for wave in waves}, key=str)
        self.circles = [(Dummy("c"), Dummy("s")) for _ in angles]
        self.names: dict[Expr, Symbol] = {}
        for angle, (c, s) in zip(angles, self.circles, strict=True):
            self.names |= {cos(angle): c, sin(angle): s}
        free = set[Symbol]().union(*(self.of(e).free_symbols for e in expressions)) - {X, Y}
        free = free.union(*self.circles)
        self.symbols = sorted(free, key=str)
        self.field = QQ.frac_field(*self.symbols)

    def of(self, expression: Expr) -> Expr:
        """The expression in letters; sines and cosines are letters too."""
        return expression.xreplace(self.names).expand()

    def matrix(self, table: Sequence[Sequence[Expr]]) -> DomainMatrix:
        """A table of expressions in letters as a matrix of rational functions."""
        rows = [[self.field.from_sympy(entry) for entry in row] for row in table]
        return DomainMatrix(rows, (len(rows), len(rows[0])), self.field)

    def independent_rows(self, matrix: DomainMatrix) -> list[int]:
        """The first rows that are a basis of all, at a place in general position on the circles."""
        place = {symbol: Rational(prime(10 + i), 16) for i, symbol in enumerate(self.symbols)}
        for c, s in self.circles:
            half = place[s]
            place |= {c: (1 - half**2) / (1 + half**2), s: 2 * half / (1 + half**2)}
        there = matrix.to_Matrix().subs(place, simultaneous=True)
        _, pivots = DomainMatrix.from_Matrix(there.T).to_field().rref()
        return list(pivots)

    def vanishes(self, matrix: DomainMatrix) -> bool:
        """Whether every entry is 0 on the circles."""
        swaps = [(s, c) for c, s in self.circles]
        return all(_on_circles(entry, swaps) == 0 for entry in matrix.to_Matrix())

    def back(self, entry: Expr, linear: Sequence[Symbol]) -> Expr:
        """The entry in sines and cosines, in the shortest of the forms it has on the circles."""
        swaps = [(s, c) for c, s in self.circles]
        forms = [_on_circles(entry, pairs) for pairs in ([], swaps, self.circles)]
        form = shortest(cancel(min(forms, key=count_ops)), linear)
        return form.xreplace({letter: wave for wave, letter in self.names.items()})


def _on_circles(entry: Expr, pairs: Sequence[tuple[Symbol, Symbol]]) -> Expr:
    """A rational function without the squares of the first letters, where p² + q² = 1."""
    above, below = fraction(entry)
    for p, q in pairs:
        above, below = (_without_square(part, p, q) for part in (above, below))
    return above / below


def _without_square(polynomial: Expr, p: Symbol, q: Symbol) -> Expr:
    terms = Poly(polynomial, p).terms()
    return sum(c * p ** (n % 2) * (1 - q**2) ** (n // 2) for (n,), c in terms).expand()


def _is_plain(function: Expr) -> bool:
    """Whether this is the sine or cosine of a symbol."""
    return isinstance(function, sin | cos) and function.args[0].is_Symbol
