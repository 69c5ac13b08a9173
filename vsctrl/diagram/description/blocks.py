"""The parts of a block diagram: blocks rational in s with constant delays, and sums.

A block's expression is read once, here, into polynomials in s and in one symbol per delay,
so that no later step has to take an ``exp`` apart again. Wiring them up is left to `wiring`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import sympy as sp

from vsctrl.checks import decimal, quoted
from vsctrl.diagram.description import cascade, control_systems
from vsctrl.errors import InputError
from vsctrl.symbols import s

LARGE = 10**15  #: integers beyond this are brought near 1

_SUM = re.compile(r"\s*(?P<out>\S+)\s*=\s*(?P<terms>.+)")
_TERM = re.compile(r"\s*(?P<sign>[+-])?\s*(?P<name>[^\s+-]+)\s*")
_ARROW = re.compile(r"\s*(?P<input>\S+)\s*->\s*(?P<output>\S+)\s*")


@dataclass(frozen=True)
class Sum:
    """A summing point, ``"e = S_ref - S_meas"``: its output is the signed sum of its inputs.

    Errors: `InputError` where the text is no such equation or a signal appears twice.

    >>> vs.Sum("e = r - y").terms
    ((1, 'r'), (-1, 'y'))
    """

    equation: str
    output: str = field(init=False)
    terms: tuple[tuple[int, str], ...] = field(init=False)  #: (±1, signal)

    def __post_init__(self) -> None:
        if not isinstance(self.equation, str) or not (match := _SUM.fullmatch(self.equation)):
            raise InputError(
                f"Sum: {quoted(self.equation)} is no equation; write it like 'e = S_ref - S_meas'."
            )
        terms: list[tuple[int, str]] = []
        rest = match["terms"]
        while rest:
            term = _TERM.match(rest)
            if not term or (terms and not term["sign"]):
                raise InputError(
                    f"Sum: cannot read {quoted(rest)} in {quoted(self.equation)}; "
                    "write signals joined by + or -, like 'e = S_ref - S_meas'."
                )
            terms.append(
                (-1 if term["sign"] == "-" else 1, signal_name(term["name"], self.equation))
            )
            rest = rest[term.end() :]
        names = [name for _, name in terms]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise InputError(
                f"Sum: signal {quoted(twice)} appears twice in {quoted(self.equation)}; "
                "put a Block with the gain you mean in front of the sum."
            )
        object.__setattr__(self, "output", signal_name(match["out"], self.equation))
        object.__setattr__(self, "terms", tuple(terms))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The signals that are summed."""
        return tuple(name for _, name in self.terms)

    def rewired(self, taken: Mapping[str, str], driven: Mapping[str, str]) -> Sum:
        """The same sum of other signals: those it takes and the one it drives, renamed."""
        terms = (f"{'+' if sign > 0 else '-'} {taken.get(n, n)}" for sign, n in self.terms)
        total = " ".join(terms).removeprefix("+ ")
        return Sum(f"{driven.get(self.output, self.output)} = {total}")

    def __str__(self) -> str:
        first, *rest = self.terms
        text = ("-" if first[0] < 0 else "") + first[1]
        for sign, name in rest:
            text += f" {'-' if sign < 0 else '+'} {name}"
        return f"{self.output} = {text}"


@dataclass(frozen=True)
class Block:
    """A linear block ``output = G(s) · input``, with G rational in s and in delays ``exp(-τ s)``.

    `expr` is a number, a SymPy expression in ``s`` and any parameters, or a python-control
    ``TransferFunction`` or ``StateSpace`` in continuous time with one input and one output (of
    which the transfer function is taken, decimals exactly as they print); `wiring` is
    ``"input -> output"``. Time is in seconds, so s is in rad/s.
    Errors: `InputError` for a factor that is neither rational in s nor a constant delay, for a
    prediction ``exp(+τ s)``, or for text in place of an expression.

    >>> from vsctrl.symbols import s
    >>> vs.Block("lag", 1 / (s + 1), "u -> y").expr
    1/(s + 1)
    """

    name: str
    expr: sp.Expr
    wiring: str
    input: str = field(init=False)
    output: str = field(init=False)
    rational: Rational = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InputError(
                f"Block: the name {quoted(self.name)} is empty; give every block a name."
            )
        expr = _expression(control_systems.expression(self.expr, self.name), self.name)
        if not isinstance(self.wiring, str) or not (match := _ARROW.fullmatch(self.wiring)):
            raise InputError(
                f"Block {quoted(self.name)}: the wiring {quoted(self.wiring)} is not understood; "
                "write it like 'u -> y'."
            )
        object.__setattr__(self, "expr", expr)
        object.__setattr__(self, "input", signal_name(match["input"], self.wiring))
        object.__setattr__(self, "output", signal_name(match["output"], self.wiring))
        object.__setattr__(self, "rational", Rational.of(expr, self.name))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The block's input signal, as a tuple like that of a `Sum`."""
        return (self.input,)

    def rewired(self, taken: Mapping[str, str], driven: Mapping[str, str]) -> Block:
        """The same block between other signals: the one it takes and the one it drives, renamed."""
        ends = taken.get(self.input, self.input), driven.get(self.output, self.output)
        return Block(self.name, self.expr, " -> ".join(ends))

    def __str__(self) -> str:
        return f"{self.output} = [{self.expr}] {self.input}"


@dataclass(frozen=True)
class Subdiagram(Block):
    """A block that is a diagram; `parts` are what is in it, wired to what is around it.

    `inner_names` maps its further inputs and outputs to what they are called inside.
    """

    parts: tuple[Any, ...] = ()
    inner_names: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)


Part = Block | Sum


#: (power of s, ((delay symbol, power), …)) → a coefficient free of s
Terms = dict[tuple[int, tuple[tuple[sp.Symbol, int], ...]], sp.Expr]


@dataclass(frozen=True)
class Rational:
    """A block's transfer function as numerator and denominator, polynomials in s and in delays.

    `delays` maps each delay symbol qᵢ = exp(−τᵢ s) to τᵢ (s). `num` and `den` map
    (power of s, ((qᵢ, power), …)) to a coefficient free of s.
    """

    num_expr: sp.Expr
    den_expr: sp.Expr
    delays: dict[sp.Symbol, sp.Expr]
    num: Terms
    den: Terms

    @classmethod
    def of(cls, expr: sp.Expr, name: str) -> Rational:
        """Read a block's expression; errors name the block."""
        plain, delays = delays_as_symbols(expr, name)
        num, den = _levelled(*sp.fraction(sp.cancel(sp.together(plain))))
        if den == 0 or not (num.is_finite is not False and den.is_finite is not False):
            raise InputError(
                f"Block {quoted(name)}: {expr} is infinite; check the division by zero."
            )
        gens = (s, *delays)
        return cls(num, den, delays, _terms(num, gens, name), _terms(den, gens, name))

    @property
    def factors(self) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
        """(numerator, denominator) of sections in series, more than one where the order is high."""
        return cascade.sections(self.num_expr, self.den_expr)

    @property
    def sections(self) -> tuple[tuple[Terms, Terms], ...]:
        """The same with its coefficients, as `num` and `den` have them."""
        if len(self.factors) == 1:
            return ((self.num, self.den),)
        gens = (s, *self.delays)
        terms = (tuple(_terms(side, gens, "") for side in pair) for pair in self.factors)
        return tuple((num, den) for num, den in terms)


def _levelled(num: sp.Expr, den: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Both divided by the power of 2 that leaves integers in den which floats can hold.

    Decimals make integers of 16 digits each of a denominator, and a product of many is no float.
    """
    numbers = [abs(int(a)) for side in (num, den) for a in side.atoms(sp.Integer)]
    if max(numbers, default=0) < LARGE:
        return num, den
    size = max(abs(int(a)) for a in den.atoms(sp.Integer)) if den.atoms(sp.Integer) else 1
    unit = sp.Integer(2) ** size.bit_length()
    return sp.expand(num / unit), sp.expand(den / unit)


def delay_symbol(delay: sp.Expr) -> sp.Symbol:
    """The symbol that stands for exp(−delay·s); equal delays share it."""
    return sp.Symbol(f"q[{delay}]")


def delays_as_symbols(expr: sp.Expr, name: str) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]]:
    """Replace each ``exp(a − τ s)`` by ``exp(a) q``, with one symbol q per delay τ.

    A sum of delays becomes a product of symbols and an integer multiple a power, so that
    exp(−2τs) and exp(−τs)² are one thing whatever SymPy has merged.
    """
    delays: dict[sp.Symbol, sp.Expr] = {}

    def replace(exponent: sp.Expr) -> sp.Expr:
        exponent = sp.expand(exponent)
        if not exponent.has(s):
            return sp.exp(exponent)
        slope = sp.expand(exponent.coeff(s, 1))
        rest = sp.expand(exponent - slope * s)
        if rest.has(s) or slope.has(s):
            raise InputError(
                f"Block {quoted(name)}: exp({exponent}) is no constant delay; "
                "its exponent must be linear in s, like exp(-tau*s)."
            )
        product = sp.exp(rest)
        delay = -slope
        if delay.is_negative:
            raise InputError(
                f"Block {quoted(name)}: exp({exponent}) predicts the future; "
                "a delay of tau seconds is written exp(-tau*s)."
            )
        terms = sp.Add.make_args(delay)
        # A difference of delays may be one; only its value, in `at`, can tell.
        for term in [delay] if any(term.is_negative for term in terms) else terms:
            factor, base = term.as_coeff_Mul()
            if not (factor.is_Integer and factor > 0 and not base.is_number):
                factor, base = sp.Integer(1), term
            symbol = delay_symbol(base)
            delays[symbol] = base
            product *= symbol**factor
        return product

    plain = expr.replace(lambda e: isinstance(e, sp.exp), lambda e: replace(e.exp))
    return plain, {q: delays[q] for q in sorted(delays, key=str)}


def _terms(expr: sp.Expr, gens: tuple[sp.Symbol, ...], name: str) -> dict[Any, sp.Expr]:
    try:
        poly = sp.Poly(expr, *gens)
    except sp.PolynomialError:
        poly = None
    hidden = poly is not None and any(c.has(*gens) for c in poly.coeffs())
    if poly is None or poly.free_symbols_in_domain & set(gens) or hidden:
        raise InputError(
            f"Block {quoted(name)}: {expr} is neither rational in s nor a delay exp(-tau*s); "
            "approximate other functions of s by a rational one."
        )
    return {
        (powers[0], tuple((q, n) for q, n in zip(gens[1:], powers[1:], strict=True) if n)): c
        for powers, c in poly.terms()
    }


def _expression(value: Any, name: str) -> sp.Expr:
    """A block's gain as a SymPy expression in our s; numbers are taken exactly as they read."""
    if isinstance(value, bool | str) or not isinstance(value, sp.Expr | int | float | Fraction):
        try:
            if not hasattr(value, "__float__") or isinstance(value, bool | str):
                raise TypeError
            value = float(value)
        except (TypeError, ValueError):
            raise InputError(
                f"Block {quoted(name)}: {quoted(value)} is no transfer function; "
                "give a number or a SymPy expression in s."
            ) from None
    if isinstance(value, float):
        value = decimal(f"Block {quoted(name)}", value)
    expr = sp.Rational(value) if isinstance(value, int | Fraction) else value
    if expr.has(sp.nan):
        raise InputError(f"Block {quoted(name)}: {expr} is no number; give a finite one.")
    # A second symbol called "s" with other assumptions would silently become a parameter.
    exact = {a: s for a in expr.free_symbols if a.name == "s" and a != s}
    exact |= {
        a: sp.Rational(decimal(f"Block {quoted(name)}", float(a))) for a in expr.atoms(sp.Float)
    }
    return expr.xreplace(exact)


def signal_name(name: str, where: str) -> str:
    """The name, if it can be that of a signal; else a sentence."""
    if not name.isidentifier():
        raise InputError(
            f"{quoted(where)}: {quoted(name)} is no signal name; use letters, digits and _, like "
            "S_meas."
        )
    return name
