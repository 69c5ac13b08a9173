"""Image moments of planar regions and point sets: one derivation for every order.

Chaumette, Image moments: a general and useful set of features for visual servoing, IEEE Trans.
Robotics 20 (2004) 713-723, and Tahri and Chaumette, Point-based and region-based image moments for
visual servoing of planar objects, IEEE Trans. Robotics 21 (2005) 1116-1127, give the matrices that
come out here; their implementation is ViSP's vpFeatureMoment….
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

from sympy import Expr, ImmutableMatrix, Poly, S, Symbol, atan2, cancel, nan, oo, sqrt, symbols, zoo
from sympy.core.function import AppliedUndef

from vsctrl.caching import Caching
from vsctrl.checks import quoted
from vsctrl.derive.camera import NORMALISED, Camera, checked_camera
from vsctrl.derive.features.curves import x_g, y_g
from vsctrl.derive.features.feature import are_symbols, is_pair
from vsctrl.derive.features.planes import PLANE, Plane, checked, velocity_on
from vsctrl.derive.inputs import symbols_in
from vsctrl.derive.kinematics.interaction import differentiated, undifferentiated
from vsctrl.derive.simplify import contracted, is_long, shortest
from vsctrl.errors import InputError
from vsctrl.symbols import X, Y

a = Symbol("a", positive=True)  #: area; μ_20 + μ_02 of a point set
a_star, Z_star = symbols("a_star Z_star", positive=True)  #: area and depth (m) wanted, a*, Z*
a_n = Symbol("a_n", positive=True)  #: normalised area Z* √(a*/a), m

#: The highest order i + j of a moment.
MOST = 24


def m(i: int, j: int) -> Symbol:
    """The raw moment m_ij = ∬ X^i Y^j dX dY, or Σ X^i Y^j of a point set.

    Errors: `InputError` unless i and j are integers ≥ 0 and i + j ≤ 24.

    >>> vs.derive.m(1, 0)
    m_10
    """
    return _symbol("m", i, j)


def mu(i: int, j: int) -> Symbol:
    """The centred moment μ_ij = ∬ (X − x_g)^i (Y − y_g)^j dX dY, or the same sum.

    Errors: as ``m``.

    >>> vs.derive.mu(2, 0)
    mu_20
    """
    return _symbol("mu", i, j)


@dataclass(frozen=True)
class Moments(Caching):
    """A feature s = ``expressions``, k functions of image moments, of a plane object.

    The expressions hold the symbols ``m(i, j)``, ``mu(i, j)``, x_g, y_g, a and ``parameters``.
    ``dense`` is a region of the plane 1/z = A x + B y + C, of density 1 in the image that
    ``camera`` reports; otherwise a set of points in it, where a stands for μ_20 + μ_02, since
    their number m_00 does not move. ``places`` are pairs (symbol, expression) that L is written
    with in the end, such as (Z_star, a_n √(a/a*)). Arguments are the symbols of L: new ones in
    places, a, x_g, y_g, moments by their order, parameters, plane, camera. Where L holds no a but
    in n_ij = μ_ij/a, it is written in these (μ_ij/m_00 of a point set).
    Errors: `InputError` for symbols that are undeclared or mean two things, a feature that no
    motion changes, an expression that is not finite or not differentiable, and a lens that
    distorts.

    >>> vs.derive.Moments("two", (vs.derive.m(1, 0), vs.derive.m(0, 1))).expressions
    (m_10, m_01)
    """

    name: str
    expressions: tuple[Expr, ...]
    dense: bool = True
    camera: Camera = NORMALISED
    plane: Plane = PLANE
    parameters: tuple[Symbol, ...] = ()
    places: tuple[tuple[Symbol, Expr], ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is no function of moments, before anything is derived from it."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InputError(f"The name {quoted(self.name)} of a feature must be an identifier.")
        if not isinstance(self.dense, bool):
            raise InputError(
                f"dense = {quoted(self.dense)} of feature {quoted(self.name)} must be a bool."
            )
        object.__setattr__(self, "plane", checked(f"Moments {quoted(self.name)}", self.plane))
        checked_camera(self.camera).require_straight()
        self._check_symbols()
        self._check_expressions()

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """The symbols in which L is written."""
        here = self.interaction.free_symbols
        new = set[Symbol]().union(*(place.free_symbols for _, place in self.places))
        first = sorted(new - {a, x_g, y_g, *_table(), *self.parameters}, key=str)
        known = (*first, a, x_g, y_g, *_table())
        used = [symbol for symbol in (*known, *self.parameters) if symbol in here]
        return (*used, *symbols_in(self.plane), *self.camera.parameters)

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L, k×6, by the chain rule over the moments that s depends on."""
        s = ImmutableMatrix(self.expressions)
        used = sorted(s.free_symbols - set(self.parameters), key=str)
        rates = _Rates(velocity_on(self.plane, self.camera), self.dense)
        gradient = differentiated(s, used)
        velocities = ImmutableMatrix.vstack(*(rates.of(symbol) for symbol in used))
        size = a if self.dense else m(0, 0)
        ratios = {mu_ij: size * n_ij for mu_ij, n_ij in _ratios().items()}

        def written(matrix: ImmutableMatrix) -> ImmutableMatrix:
            matrix = matrix.xreplace(dict(self.places))
            if not self.dense:
                matrix = matrix.xreplace({a: mu(2, 0) + mu(0, 2)})
            return matrix.xreplace({mu(0, 0): size, mu(1, 0): S.Zero, mu(0, 1): S.Zero})

        if is_long(gradient):
            # Of what the size of all moments does not change, each side has it once.
            slopes, rows = written(gradient) * size, written(velocities) / size
            linear = symbols_in(self.plane)
            L = contracted(slopes.xreplace(ratios), rows.xreplace(ratios), linear)
            return contracted(slopes, rows, linear) if L.has(size) else L
        L = written(gradient * velocities)
        by_size = L.xreplace(ratios)
        # Expanded first: cancel may take minutes over quotients nested in a sum.
        by_size = by_size.applyfunc(lambda entry: cancel(entry.expand()))
        L = L.applyfunc(cancel) if by_size.has(size) else by_size
        return L.applyfunc(lambda entry: shortest(entry, symbols_in(self.plane)))

    def _check_symbols(self) -> None:
        """Every name must mean one thing: moments, parameters, plane and camera share no symbol."""
        if not are_symbols(self.parameters):
            raise InputError(
                f"parameters of feature {quoted(self.name)} must be a tuple of symbols whose "
                "names are "
                f"identifiers; got {quoted(self.parameters)}."
            )
        if not isinstance(self.places, tuple) or not all(map(is_pair, self.places)):
            raise InputError(
                f"places of feature {quoted(self.name)} must be pairs (symbol, expression); "
                f"got {quoted(self.places)}."
            )
        own = (X, Y, a, x_g, y_g, *_table())
        others = (*self.parameters, *symbols_in(self.plane), *self.camera.parameters)
        new = set[Symbol]().union(*(place.free_symbols for _, place in self.places))
        names = [symbol.name for symbol in (*own, *others, *(new - {*own, *others}))]
        twice = sorted({name for name, times in Counter(names).items() if times > 1})
        if twice:
            raise InputError(
                f"Feature {quoted(self.name)} uses {', '.join(twice)} for two things; moments, "
                "a, x_g, "
                "y_g, parameters, plane and camera need distinct names, and X and Y are the image "
                "point."
            )

    def _check_expressions(self) -> None:
        if not isinstance(self.expressions, tuple) or not self.expressions:
            raise InputError(
                f"expressions of feature {quoted(self.name)} must be a tuple, not empty."
            )
        known = {a, x_g, y_g, *_table()} - set(_ratios().values())
        fixed = {mu(1, 0), mu(0, 1)} | (set() if self.dense else {m(0, 0), mu(0, 0)})
        for expression in self.expressions:
            if not isinstance(expression, Expr):
                raise InputError(
                    f"{quoted(expression)} of feature {quoted(self.name)} is no SymPy "
                    "expression; write it "
                    "with m(i, j) and mu(i, j) of vsctrl.derive, and x_g, y_g and a of "
                    "vsctrl.derive.features.moments."
                )
            free = expression.free_symbols
            unknown = sorted(str(s) for s in free - known - set(self.parameters))
            if unknown:
                raise InputError(
                    f"Feature {quoted(self.name)} uses {', '.join(unknown)}, which is no moment; "
                    "take "
                    "m(i, j), mu(i, j), x_g, y_g or a, or add it to parameters."
                )
            if not free & (known - fixed):
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} never changes: "
                    "μ_10 and "
                    "μ_01 are 0, and m_00 = μ_00 of a point set is the number of its points."
                )
            there = expression.xreplace({mu(1, 0): S.Zero, mu(0, 1): S.Zero})
            if any(e.has(nan, oo, -oo, zoo) for e in (expression, there)):
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} is not finite "
                    "wherever "
                    "the object is; μ_10 and μ_01 are 0."
                )
            rough = undifferentiated(differentiated([expression], sorted(free & known, key=str)))
            rough = rough or next(iter(expression.atoms(AppliedUndef)), None)
            if rough is not None:
                raise InputError(
                    f"The expression {expression} of feature {quoted(self.name)} is not "
                    "differentiable: "
                    f"its derivative holds {rough}; write it with smooth functions of the moments."
                )


def Moment(
    i: int, j: int, dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE
) -> Moments:
    """The raw moment m_ij, in raw moments up to order i + j + 1, in the unit of the image.

    Errors: `InputError` unless i and j are integers ≥ 0 with i + j ≤ 24, for m_00 of a point set,
    and for a lens that distorts. Source: ViSP's vpFeatureMomentBasic.

    >>> vs.derive.Moment(1, 0).expressions
    (m_10,)
    """
    return Moments(m(i, j).name, (m(i, j),), dense, camera, plane)


def CentredMoment(
    i: int, j: int, dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE
) -> Moments:
    """The centred moment μ_ij, i + j ≥ 2, in a (or m_00), x_g, y_g and μ_ij.

    Errors: as ``Moment``, and for μ_10 and μ_01, which are 0. Source: vpFeatureMomentCentered.

    >>> vs.derive.CentredMoment(2, 0).expressions
    (mu_20,)
    """
    return Moments(mu(i, j).name, (mu(i, j),), dense, camera, plane)


def Area(dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE) -> Moments:
    """The area a of a region, or a = μ_20 + μ_02 of a point set, in the unit of the image squared.

    Arguments of a region: a, x_g, y_g. Far away a row is near 0; the area in ``NormalisedMoments``
    is not. Source: vpFeatureMomentArea, where a of a point set is the number of points.

    >>> vs.derive.interaction_matrix(vs.derive.Area())[2]
    a*(3*A*x_g + 3*B*y_g + 2*C)
    """
    return Moments("area", (a,), dense, camera, plane)


def GravityCentre(dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE) -> Moments:
    """The centre of gravity s = (x_g, y_g), in x_g, y_g and n_ij = μ_ij/a (or /m_00).

    Nowhere singular while the object is in front of the camera and a > 0. Source:
    vpFeatureMomentGravityCenter.

    >>> vs.derive.GravityCentre().expressions
    (x_g, y_g)
    """
    return Moments("gravity_centre", (x_g, y_g), dense, camera, plane)


def NormalisedMoments(
    dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE
) -> Moments:
    """s = (x_n, y_n, a_n) = (a_n x_g, a_n y_g, a_n) with a_n = Z* √(a*/a), in m.

    a* and Z* are the area and the depth where the camera should be, a is μ_20 + μ_02 of a point
    set. Facing the object in a normalised image, a_n = 1/C is its depth and the columns of V are
    −I₃. L is written in a_n, x_g, y_g and n_ij; a* and Z* drop out. Singular at a = 0.
    Source: vpFeatureMomentGravityCenterNormalized and vpFeatureMomentAreaNormalized.

    >>> len(vs.derive.NormalisedMoments().expressions)
    3
    """
    area = Z_star * sqrt(a_star / a)
    return Moments(
        "normalised_moments",
        (area * x_g, area * y_g, area),
        dense,
        camera,
        plane,
        parameters=(Z_star, a_star),
        places=((Z_star, a_n * sqrt(a / a_star)),),
    )


def Orientation(dense: bool = True, camera: Camera = NORMALISED, plane: Plane = PLANE) -> Moments:
    """α = ½ atan2(2 μ_11, μ_20 − μ_02), the angle of the long axis, in (−π/2, π/2] rad.

    In x_g, y_g and n_ij, of which only ratios count. Singular at μ_20 = μ_02, μ_11 = 0, where no
    axis is the long one, as of a circle or a square, and L grows as 1/((n_20 − n_02)² + 4 n_11²)
    near it. In e, take α − α* into (−π/2, π/2]. Source: vpFeatureMomentAlpha.

    >>> vs.derive.Orientation().expressions
    (atan2(2*mu_11, -mu_02 + mu_20)/2,)
    """
    alpha = atan2(2 * mu(1, 1), mu(2, 0) - mu(0, 2)) / 2
    return Moments("orientation", (alpha,), dense, camera, plane)


class _Rates:
    """The L, 1×6, of every moment, by how the image flows.

    A region carries ∬ f along: d/dt ∬ f = ∬ (∂f/∂X X' + ∂f/∂Y Y' + f (∂X'/∂X + ∂Y'/∂Y)) by the
    theorem of Green, a point set Σ f without the last term. With f = X^i Y^j and X', Y' of second
    degree this is linear in moments.
    """

    def __init__(self, velocity: ImmutableMatrix, dense: bool) -> None:
        self.dense = dense
        self.size = a if dense else m(0, 0)
        self.fixed = velocity
        # As seen from the centre of gravity; its own motion is taken off where it is known.
        self.centred = velocity.xreplace({X: X + x_g, Y: Y + y_g})
        # μ_10' = 0 = ∬ (X' − x_g') says how the centre moves.
        self.centre = [
            self._carried(k, self.centred, self._about_centre) / self.size for k in ((1, 0), (0, 1))
        ]

    def of(self, symbol: Symbol) -> ImmutableMatrix:
        """L of m_ij, μ_ij, x_g, y_g or a."""
        if symbol in (x_g, y_g):
            return self.centre[(x_g, y_g).index(symbol)]
        if symbol == a and not self.dense:
            return self.of(mu(2, 0)) + self.of(mu(0, 2))
        i, j = (0, 0) if symbol == a else _table()[symbol]
        if symbol == m(i, j):
            return self._carried((i, j), self.fixed, lambda i, j: _named("m", i, j))
        L = self._carried((i, j), self.centred, self._about_centre)
        for power, where, L_g in ((i, (i - 1, j), self.centre[0]), (j, (i, j - 1), self.centre[1])):
            if power:
                L -= power * self._about_centre(*where) * L_g
        return L

    def _carried(
        self, powers: tuple[int, int], velocity: ImmutableMatrix, moment: Callable[[int, int], Expr]
    ) -> ImmutableMatrix:
        f = X ** powers[0] * Y ** powers[1]
        rate = ImmutableMatrix([[f.diff(X), f.diff(Y)]]) * velocity
        if self.dense:
            rate += f * (velocity[0, :].diff(X) + velocity[1, :].diff(Y))
        return rate.applyfunc(
            lambda entry: sum(
                (c * moment(i, j) for (i, j), c in Poly(entry, X, Y).terms()), start=S.Zero
            )
        )

    def _about_centre(self, i: int, j: int) -> Expr:
        if i + j == 1:
            return S.Zero
        return self.size if i + j == 0 else _named("mu", i, j)


def _symbol(letter: str, i: int, j: int) -> Symbol:
    for name, power in (("i", i), ("j", j)):
        if isinstance(power, bool) or not isinstance(power, int) or power < 0:
            raise InputError(
                f"{name} = {quoted(power)} of the moment {letter}_ij must be an integer, 0 or more."
            )
    if i + j > MOST:
        raise InputError(
            f"The moment {letter}_ij with i = {i}, j = {j} is of order {i + j}; at most {MOST}."
        )
    return _named(letter, i, j)


def _named(letter: str, i: int, j: int) -> Symbol:
    between = "_" if max(i, j) > 9 else ""
    return Symbol(f"{letter}_{i}{between}{j}", real=True)


@cache
def _table() -> dict[Symbol, tuple[int, int]]:
    """m_ij, then μ_ij, then n_ij to their powers, of the order MOST + 1 that L may hold at most."""
    powers = [(order - j, j) for order in range(MOST + 2) for j in range(order + 1)]
    return {_named(letter, i, j): (i, j) for letter in ("m", "mu", "n") for i, j in powers}


@cache
def _ratios() -> dict[Symbol, Symbol]:
    """μ_ij → n_ij of the same powers."""
    return {_named("mu", i, j): _named("n", i, j) for i, j in _table().values() if i + j > 1}
