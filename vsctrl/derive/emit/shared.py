"""What every language prints: L if it can be computed, shared subexpressions, powers as products.

The module exists because ``pow`` takes longer than all the rest of an interaction matrix: here each
power other than −1, 1 and ±1/2 becomes one of a symbol, which printers write as a product.
"""

from collections.abc import Collection, Sequence
from itertools import count
from typing import Any

from sympy import Expr, I, ImmutableMatrix, Integer, Symbol, cse, nan, oo, sqrt, zoo

from vsctrl.checks import quoted
from vsctrl.derive.kinematics.interaction import VisualFeature, interaction_matrix
from vsctrl.errors import InputError

Shared = list[tuple[Symbol, Expr]]

_MOST = 64  #: factors of a product; beyond that ``pow`` is shorter


def computable(feature: VisualFeature) -> ImmutableMatrix:
    """L of a feature, once it is certain that numbers for its arguments give real numbers.

    Errors: `InputError` for an L that is not finite or not real anywhere, or holds symbols that are
    no arguments, and for two arguments of one name.
    """
    L, name = interaction_matrix(feature), feature.name
    unknown = sorted(map(str, L.free_symbols - set(feature.arguments)))
    if unknown:
        raise InputError(
            f"L of feature {quoted(name)} is written in {', '.join(unknown)}, which its "
            "arguments leave "
            "out; add them to its arguments."
        )
    if len({symbol.name for symbol in feature.arguments}) < len(feature.arguments):
        raise InputError(f"Two arguments of feature {quoted(name)} have the same name; rename one.")
    for i in range(L.rows):
        for kind, words in ((I, "real"), ((nan, oo, -oo, zoo), "finite")):
            if L[i, :].has(*(kind if isinstance(kind, tuple) else (kind,))):
                raise InputError(
                    f"L of feature {quoted(name)} is not {words} in row {i}; check its expressions."
                )
    return L


def common(entries: Sequence[Expr], taken: Collection[str] = ()) -> tuple[Shared, list[Expr]]:
    """(pairs (symbol, expression) in order of use, the entries in them and in what they held).

    The symbols are c0, c1, … without the names that are ``taken``.
    """
    fresh = (Symbol(f"c{i}") for i in count() if f"c{i}" not in taken)
    repeated, reduced = cse(list(entries), symbols=fresh, order="canonical")
    shared: Shared = []
    known: dict[Expr, Symbol] = {}

    def visit(entry: Any) -> Any:
        if not entry.args:
            return entry
        args = [visit(argument) for argument in entry.args]
        if any(new is not old for new, old in zip(args, entry.args, strict=True)):
            entry = entry.func(*args)
        if not entry.is_Pow or not _is_product(entry):
            return entry
        root = entry.base if entry.exp.is_Integer else sqrt(entry.base)
        if root not in known:
            known[root] = next(fresh)
            shared.append((known[root], root))
        return known[root] ** (entry.exp if entry.exp.is_Integer else 2 * entry.exp)

    for symbol, value in repeated:
        shared.append((symbol, visit(value)))
        known.setdefault(value, symbol)
    reduced = [visit(entry) for entry in reduced]
    return _renumbered(shared, reduced, taken) if len(shared) > len(repeated) else (shared, reduced)


def factors(entry: Expr) -> int | None:
    """How many factors the product has that stands for an integer power of a symbol, or None."""
    plain = entry.base.is_Symbol and entry.exp.is_Integer and abs(entry.exp) <= _MOST
    return abs(int(entry.exp)) if plain else None


def _is_product(power: Expr) -> bool:
    """Whether a power is worth a name for its base: x^(3/2), (x + 1)^−2, not x² nor 1/(x + 1)."""
    twice = 2 * power.exp
    if not isinstance(twice, Integer) or abs(twice) > 2 * _MOST:
        return False
    return abs(twice) > 1 and power.exp != -1 and not (power.base.is_Symbol and twice % 2 == 0)


def _renumbered(
    shared: Shared, reduced: list[Expr], taken: Collection[str]
) -> tuple[Shared, list[Expr]]:
    """The same with the symbols numbered as they come."""
    fresh = (Symbol(f"c{i}") for i in count() if f"c{i}" not in taken)
    names = {symbol: new for (symbol, _), new in zip(shared, fresh, strict=False)}
    pairs = [(names[symbol], value.xreplace(names)) for symbol, value in shared]
    return pairs, [entry.xreplace(names) for entry in reduced]
