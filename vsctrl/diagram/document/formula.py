"""Transfer functions as text: a small grammar of our own, exact in its decimals and never run.

    sum     = product {(+ | −) product}
    product = sign {(* | /) sign}
    sign    = {+ | −} power
    power   = atom [(^ | **) sign]
    atom    = number | name | function "(" sum ")" | "(" sum ")"

A text is bounded in length, depth and in the size of what it expands to, so that whatever a file
holds is read in a moment or refused in a sentence. What a block may be is left to `blocks`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import NoReturn

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.diagram.document import size, tokens
from vsctrl.diagram.document.names import symbol
from vsctrl.diagram.document.size import Size
from vsctrl.diagram.document.tokens import Token
from vsctrl.errors import nearest

LONGEST = 20_000  #: characters of a formula
DEEPEST = 50  #: brackets, signs and powers within each other
LARGEST_ARGUMENT = 700  #: of exp(number); e^709 is the largest float

FUNCTIONS = {
    "exp": sp.exp,
    "sqrt": sp.sqrt,
    "log": sp.log,
    "sin": sp.sin,
    "cos": sp.cos,
    "tan": sp.tan,
    "abs": sp.Abs,
}
CONSTANTS = {"pi": sp.pi}
RESERVED = {*FUNCTIONS, *CONSTANTS}  #: names that no parameter can have


@dataclass(frozen=True)
class Formula:
    """What a text means: the expression, and how large it is once multiplied out."""

    expr: sp.Expr
    size: Size


def parse(text: object) -> sp.Expr:
    """The expression that a text means, ``"K*(1 + 1/(T_i*s))*exp(-theta*s)"``.

    s is the Laplace variable, every other name a parameter; decimals are exact. Greek letters are
    names. Raises ValueError with the second half of a sentence.
    """
    if not isinstance(text, str):
        raise ValueError('is no text; write a formula in quotes, like "K/(T*s + 1)"')
    if len(text) > LONGEST:
        raise ValueError(f"has {len(text)} characters; write one of at most {LONGEST}")
    reader = _Reader(tokens.read(text))
    formula = reader.sum(0)
    reader.end()
    return formula.expr


class _Reader:
    """The grammar, one method a rule; each returns what the tokens that it takes mean."""

    def __init__(self, found: list[Token]) -> None:
        self.tokens = found
        self.at = 0

    @property
    def next(self) -> Token:
        """The token that comes."""
        return self.tokens[self.at]

    def take(self, *kinds: str) -> Token | None:
        """The token that comes, if it is one of these, and past it."""
        token = self.next
        if token.kind not in kinds:
            return None
        self.at += 1
        return token

    def sum(self, depth: int) -> Formula:
        """Products with signs between."""
        total = self.product(depth)
        while sign := self.take("+", "-"):
            term = self.product(depth)
            expr = total.expr + term.expr if sign.kind == "+" else total.expr - term.expr
            total = Formula(expr, size.total(total.size, term.size))
        return total

    def product(self, depth: int) -> Formula:
        """Factors and divisors."""
        total = self.sign(depth)
        while sign := self.take("*", "/"):
            factor = self.sign(depth)
            if sign.kind == "/":
                if factor.expr.is_zero:
                    _fail("this divides by zero", sign, "give another divisor")
                factor = Formula(1 / factor.expr, size.inverse(factor.size))
            grown = size.product(total.size, factor.size)
            total = Formula(total.expr * factor.expr, grown)
        return total

    def sign(self, depth: int) -> Formula:
        """A power with signs before it, which bind less: −a^2 is −(a^2)."""
        minus = False
        while sign := self.take("+", "-"):
            minus ^= sign.kind == "-"
        power = self.power(depth)
        return Formula(-power.expr, power.size) if minus else power

    def power(self, depth: int) -> Formula:
        """An atom to an exponent, which may have a sign and an exponent itself."""
        base = self.atom(depth)
        token = self.take("^")
        if token is None:
            return base
        exponent = self.sign(_deeper(depth, token))
        if base.expr.is_zero and not exponent.expr.is_positive:
            _fail("0 to a power that is not above 0 is no number", token, "give another one")
        grown = size.power(base.size, base.expr, exponent.expr, token)
        return Formula(base.expr**exponent.expr, grown)

    def atom(self, depth: int) -> Formula:
        """A number, a name, a function, or a formula in parentheses."""
        token = self.next
        if token.kind == "number":
            self.at += 1
            value = Fraction(token.text)
            self.no_factor_follows(token)
            return Formula(sp.Rational(value.numerator, value.denominator), size.of_number(value))
        if token.kind == "name":
            self.at += 1
            return self.name(token, depth)
        if opening := self.take("("):
            inner = self.sum(_deeper(depth, opening))
            self.close(opening)
            return inner
        if token.kind == "end":
            raise ValueError("ends too early; write a number, a name or (…) there")
        return _fail(
            f"{quoted(token.text)} stands where a number or a name should", token, "write one"
        )

    def name(self, token: Token, depth: int) -> Formula:
        """s, a parameter, a constant, or a function with its argument."""
        text = token.text
        if self.next.kind == "(":
            if text in FUNCTIONS:
                return self.function(token, depth)
            known = nearest(text, FUNCTIONS)
            remedy = f"write {text}*(…), or one of {', '.join(FUNCTIONS)}{known}"
            _fail(f"{quoted(text)} before a parenthesis is no function", token, remedy)
        if text in FUNCTIONS:
            _fail(f"the function {text} has no argument", token, f"write {text}(…)")
        self.no_factor_follows(token)
        if text in CONSTANTS:
            return Formula(CONSTANTS[text], size.of_name(text))
        return Formula(symbol(text), size.of_name(text))

    def function(self, token: Token, depth: int) -> Formula:
        """A function of one argument; an exponent is a delay and holds no exponential itself."""
        opening = self.take("(")
        assert opening is not None
        argument = self.sum(_deeper(depth, opening))
        self.close(opening)
        x, exponential = argument.expr, token.text == "exp"
        if exponential and argument.size.exponential:
            _fail("exp(…) holds an exp itself", token, "write it without")
        if exponential and x.is_number and not abs(x) <= LARGEST_ARGUMENT:
            _fail(f"exp of a number beyond ±{LARGEST_ARGUMENT}", token, "give a smaller one")
        value = FUNCTIONS[token.text](x)
        if value.has(sp.zoo, sp.oo, sp.nan):
            _fail(f"{token.text}({x}) is infinite", token, "give another argument")
        return Formula(value, size.function(f"{token.text}({x})", argument.size, exponential))

    def close(self, opening: Token) -> None:
        """Past the parenthesis that closes."""
        if not self.take(")"):
            if self.next.kind == "end":
                _fail("'(' is never closed", opening, "write ')' where it should end")
            _fail(
                f"{quoted(self.next.text)} stands where ')' or an operator should",
                self.next,
                _WRITE,
            )
        self.no_factor_follows(opening)

    def no_factor_follows(self, before: Token) -> None:
        """Refuse what reads like a product without its sign."""
        if self.next.kind in {"number", "name", "("}:
            left = ")" if before.kind == "(" else before.text
            meant = f"{left}*{self.next.text}"
            words = f"there is no sign between {quoted(left)} and {quoted(self.next.text)}"
            _fail(words, self.next, f"write {meant} for a product")

    def end(self) -> None:
        """Refuse what is left over."""
        if self.next.kind != "end":
            _fail(
                f"{quoted(self.next.text)} stands where the formula should end", self.next, _WRITE
            )


_WRITE = "write + - * / ^ between numbers, names and (…)"


def _deeper(depth: int, token: Token) -> int:
    if depth >= DEEPEST:
        _fail(f"more than {DEEPEST} brackets or powers stand within each other", token,
              "split it into several blocks")  # fmt: skip
    return depth + 1


def _fail(problem: str, token: Token, remedy: str) -> NoReturn:
    raise ValueError(f"character {token.place}: {problem}; {remedy}")
