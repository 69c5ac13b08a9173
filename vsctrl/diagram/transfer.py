"""From wiring to formulas: the diagram solved once in symbols for its block gains.

Each block is one letter g₁…gₙ while the loop equations are solved, fraction-free; what the
letters stand for is put in afterwards. That keeps a fourteen-block diagram as quick to solve as its
loops are few, keeps each delay a symbol of its own until the very end, and gives numeric
evaluation a form that has not been multiplied out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from typing import Any, Protocol

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix

from vsctrl.diagram.blocks import Block, delay_symbol
from vsctrl.diagram.foreign import exact_number
from vsctrl.diagram.wiring import Wiring, resolve
from vsctrl.errors import InputError
from vsctrl.symbols import s

#: |log| of the numbers that are left to floats, which end at e^709: some room for products is kept
FARTHEST = 600.0

FIRST_DIGITS, MOST_DIGITS = 50, 12_800  #: decimal digits of `settled`


class GainForm:
    """Every channel of a diagram as N(g)/Δ(g), polynomials in its block gains g₁…gₙ."""

    def __init__(self, diagram: Wiring) -> None:
        self.diagram = diagram
        self.letters = sp.symbols(f"g1:{len(diagram.blocks) + 1}")
        self.ring = sp.ZZ[self.letters] if self.letters else sp.ZZ
        index = {block.output: i for i, block in enumerate(diagram.blocks)}
        n = len(index)
        rows = [[self.ring.zero] * n for _ in range(n)]
        drive: dict[str, list[Any]] = {u: [self.ring.zero] * n for u in diagram.inputs}
        for i, block in enumerate(diagram.blocks):
            rows[i][i] += self.ring.one
            gain = self.ring.from_sympy(self.letters[i])
            for leaf, factor in resolve(diagram, block.input).items():
                if leaf in index:
                    rows[i][index[leaf]] -= factor * gain
                else:
                    drive[leaf][i] += factor * gain
        self._index = index
        self._matrix = DomainMatrix(rows, (n, n), self.ring).to_sparse()
        self._drive = drive
        self.channel = cache(self._channel)
        self._solve = cache(self._solve_input)

    def _solve_input(self, source: str) -> tuple[list[Any], Any]:
        n = len(self._index)
        column = DomainMatrix([[g] for g in self._drive[source]], (n, 1), self.ring).to_sparse()
        try:
            numerators, determinant = self._matrix.solve_den(column)
        except sp.polys.matrices.exceptions.DMNonInvertibleMatrixError:  # pragma: no cover
            raise InputError(
                "Diagram: its loop equations have no unique solution; look for a loop of gain 1 "
                f"among {', '.join(block.name for block in self.diagram.blocks)}."
            ) from None
        return [row[0] for row in numerators.to_list()], determinant

    def _channel(self, source: str, target: str) -> tuple[sp.Expr, sp.Expr]:
        """(N, Δ) with target = N/Δ · source, common factors cancelled in the letters."""
        numerators, determinant = self._solve(source)
        total = self.ring.zero
        for leaf, factor in resolve(self.diagram, target).items():
            if leaf in self._index:
                total += factor * numerators[self._index[leaf]]
            elif leaf == source:
                total += factor * determinant
        num, den = total.cancel(determinant) if self.letters else (total, determinant)
        return self.ring.to_sympy(num), self.ring.to_sympy(den)


class Solved(Protocol):
    """A wiring that keeps its loop equations solved."""

    @property
    def gains(self) -> GainForm: ...
    @property
    def blocks(self) -> tuple[Block, ...]: ...
    @property
    def parameters(self) -> dict[str, sp.Symbol]: ...


def expression(diagram: Solved, source: str, target: str) -> sp.Expr:
    """The channel's transfer function in lowest terms, delays written back as exp(−τ s)."""
    num, den = polynomials(diagram, source, target)
    delays = {q: sp.exp(-tau * s) for b in diagram.blocks for q, tau in b.rational.delays.items()}
    return sp.factor_terms(num).xreplace(delays) / sp.factor_terms(den).xreplace(delays)


def polynomials(diagram: Solved, source: str, target: str) -> tuple[sp.Expr, sp.Expr]:
    """Numerator and denominator of a channel, polynomials in s, delay symbols and parameters."""
    num, den = diagram.gains.channel(source, target)
    gains = dict(
        zip(
            diagram.gains.letters,
            (b.rational.num_expr / b.rational.den_expr for b in diagram.blocks),
            strict=True,
        )
    )
    bottom = sp.together(den.xreplace(gains))
    if bottom == 0:
        raise _singular(diagram)
    return sp.fraction(sp.cancel(sp.together(num.xreplace(gains)) / bottom))


def _singular(diagram: Solved) -> InputError:
    return InputError(
        f"transfer: the loop through {', '.join(block.name for block in diagram.blocks)} is "
        "singular (its return difference is zero); change one of the gains in it."
    )


def evaluator(diagram: Solved, source: str, target: str) -> Callable[..., Any]:
    """Compile a channel to ``f(s, *parameters)`` on NumPy arrays, common subexpressions shared."""
    num, den = diagram.gains.channel(source, target)
    gains = {g: above / below for g, (above, below) in _numeric_gains(diagram).items()}
    bottom = den.xreplace(gains)
    if bottom.is_zero:
        raise _singular(diagram)
    return _compiled(diagram, num.xreplace(gains) / bottom)


def pole_free_evaluator(
    diagram: Solved, source: str, target: str, modules: str = "numpy"
) -> Callable[..., Any]:
    """The same as (numerator, denominator), both finite where a block is infinite.

    N and Δ are linear in each gain g = n/d, so that multiplying both by every d leaves no division.
    It is slower than `evaluator` and serves the points where that one fails; with
    ``modules="mpmath"`` also those at which a float overflows.
    """
    gains = _numeric_gains(diagram)

    def cleared(expr: sp.Expr) -> sp.Expr:
        terms = sp.Poly(expr, *gains).terms() if gains else [((), expr)]
        return sp.Add(
            *(
                factor
                * sp.Mul(
                    *(
                        n if power else d
                        for power, (n, d) in zip(powers, gains.values(), strict=True)
                    )
                )
                for powers, factor in terms
            )
        )

    return _compiled(
        diagram, [cleared(side) for side in diagram.gains.channel(source, target)], modules
    )


def _numeric_gains(diagram: Solved) -> dict[sp.Symbol, tuple[sp.Expr, sp.Expr]]:
    """(numerator, denominator) of each block gain in s and parameters, delays as exp(−τ s)."""
    gains = {}
    for letter, block in zip(diagram.gains.letters, diagram.blocks, strict=True):
        delays = {q: sp.exp(-tau * s) for q, tau in block.rational.delays.items()}
        sides = (block.rational.num_expr, block.rational.den_expr)
        above, below = (sp.horner(x, s) if x.has(s) else x for x in sides)
        gains[letter] = above.xreplace(delays), below.xreplace(delays)
    return gains


def _compiled(diagram: Solved, expr: Any, modules: str = "numpy") -> Callable[..., Any]:
    return sp.lambdify([s, *diagram.parameters.values()], expr, modules=modules, cse=True)


def settled(value: Callable[[Any], Any], where: str) -> complex:
    """value(mp), mp an mpmath context, with as many digits as it takes; infinite at a pole.

    For points where floats overflow: far left e^{−sτ} leaves their range (e^709) and may cancel to
    any number of digits, as the plant's and the model's do in a Smith predictor. So digits are
    doubled until two values agree.
    Errors: `InputError` where `MOST_DIGITS` do not settle it.
    """
    import mpmath

    digits, before = FIRST_DIGITS, None
    while digits <= MOST_DIGITS:
        with mpmath.workdps(digits):
            try:
                now = value(mpmath.mp)
            except ZeroDivisionError:  # on a pole as far as these digits tell
                now = None
            if now is not None and before is not None and _agree(mpmath.mp, before, now):
                found = complex(now)
                return found if np.isfinite(found) else complex(np.inf)
        digits, before = 2 * digits, now
    if before is None:
        return complex(np.inf)
    raise InputError(
        f"channel: {where} lies so far out that {MOST_DIGITS} digits do not tell the value; "
        "give a point nearer to 0."
    )


def _agree(mp: Any, one: Any, other: Any) -> bool:
    return bool(abs(one - other) <= 1e-15 * abs(other))


@dataclass(frozen=True)
class BlockCoefficients:
    """One block in numbers: (power of s, delay in seconds) → coefficient, for num and den."""

    name: str
    num: dict[tuple[int, Fraction], float]
    den: dict[tuple[int, Fraction], float]


class Coefficients:
    """Every coefficient and delay of a diagram as one compiled function of its parameters."""

    def __init__(self, diagram: Wiring, flat: Callable[..., Any], delays: list[sp.Expr]) -> None:
        self._diagram = diagram
        self._flat = flat
        self._delays = delays

    @classmethod
    def compile(cls, diagram: Wiring) -> Coefficients:
        """Compile the flat list of all coefficients and all delays of a diagram."""
        delays = list(
            {q: tau for b in diagram.blocks for q, tau in b.rational.delays.items()}.values()
        )
        flat = [
            c
            for b in diagram.blocks
            for side in (b.rational.num, b.rational.den)
            for c in side.values()
        ]
        function = sp.lambdify(
            list(diagram.parameters.values()), [*delays, *flat], modules="math", cse=True
        )
        return cls(diagram, function, delays)

    @cached_property
    def delay_names(self) -> list[str]:
        """How each delay reads in the diagram, for messages."""
        return [str(delay) for delay in self._delays]

    def __call__(self, values: dict[str, float]) -> list[BlockCoefficients]:
        """The blocks in numbers; errors name the delay or block that has no finite value."""
        try:
            numbers = [float(x) for x in self._flat(*values.values())]
        except (ZeroDivisionError, OverflowError, ValueError, TypeError):
            raise InputError(
                f"at: a block has no finite real value{_shown(values)}; "
                "look for a division by zero or the root or logarithm of a negative number."
            ) from None
        delays = {}
        for expr, name, number in zip(self._delays, self.delay_names, numbers, strict=False):
            if number < 0:
                raise InputError(
                    f"at: the delay {name} = {number:g} s is negative, which would predict the "
                    "future; give a delay of 0 or more."
                )
            delays[delay_symbol(expr)] = exact_number(number, f"at: delay {name}")
        rest = iter(numbers[len(self._delays) :])
        blocks = []
        for block in self._diagram.blocks:
            num = self._side(block.rational.num, rest, delays, block.name)
            den = self._side(block.rational.den, rest, delays, block.name)
            _check_causal(block.name, den)
            blocks.append(_levelled(BlockCoefficients(block.name, num, den)))
        return blocks

    def _side(
        self, side: dict[Any, sp.Expr], rest: Any, delays: dict[sp.Symbol, Fraction], name: str
    ) -> dict[tuple[int, Fraction], float]:
        out: dict[tuple[int, Fraction], float] = {}
        for power, monomial in side:
            key = power, sum((n * delays[q] for q, n in monomial), Fraction(0))
            out[key] = out.get(key, 0.0) + next(rest)
        if not np.isfinite(list(out.values())).all():
            raise InputError(f"at: block {name!r} is not finite; check the values given.")
        return {key: value for key, value in out.items() if value}


def _levelled(block: BlockCoefficients) -> BlockCoefficients:
    """The block with numerator and denominator divided by the power of 2 that leaves den near 1.

    Cancelling decimals leaves numbers like 10¹⁷ on both sides, which the states would inherit.
    """
    shift = -math.frexp(max(abs(c) for c in block.den.values()))[1]
    try:
        num, den = (
            {key: math.ldexp(c, shift) for key, c in side.items()}
            for side in (block.num, block.den)
        )
    except OverflowError:  # a gain beyond 1e308 is left for those who use it to refuse
        return block
    return BlockCoefficients(block.name, num, den)


def _shown(values: dict[str, float]) -> str:
    pairs = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    return f" at {pairs}" if pairs else ""


def _check_causal(name: str, den: dict[tuple[int, Fraction], float]) -> None:
    if not den:
        raise InputError(
            f"at: block {name!r} divides by zero at these values; "
            "give its denominator a value other than 0."
        )
    top = max(k for k, _ in den)
    if (top, Fraction(0)) not in den:
        raise InputError(
            f"at: block {name!r} predicts the future: the highest power of s in its "
            "denominator is delayed; multiply numerator and denominator so that it is not."
        )
