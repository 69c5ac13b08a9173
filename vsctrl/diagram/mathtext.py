"""Transfer functions and signal names as typeset, measured lines of text.

A picture of a diagram must not depend on the fonts of the machine that draws it, so formulas are
set here from a small table of character widths: fractions one level deep with a bar, deeper ones
with a slash, scripts as raised or lowered runs. Where the text goes is left to `draw`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import sympy as sp

from vsctrl.symbols import s

SCRIPT = 0.72  #: size of a sub- or superscript, of the text it belongs to
THIN = "\u2009"
LONGEST = 11.0  #: em; a wider formula gives way to G_name(s)

_WIDE = {"m": 0.8, "w": 0.74, "M": 0.92, "W": 0.96, "ω": 0.72, "Ω": 0.8, "−": 0.6, "+": 0.6}
_WIDE |= dict.fromkeys("ijltfrI1,.;:'|!()[]/ -", 0.36) | {"1": 0.5, THIN: 0.2, "ℓ": 0.42, "ˆ": 0.34}
_LETTERS = """
alpha α beta β gamma γ delta δ epsilon ε zeta ζ eta η theta θ iota ι kappa κ lambda λ
mu μ nu ν xi ξ pi π rho ρ sigma σ tau τ upsilon υ phi φ chi χ psi ψ omega ω Gamma Γ Delta Δ Theta Θ
Lambda Λ Xi Ξ Pi Π Sigma Σ Phi Φ Psi Ψ Omega Ω ell ℓ"""
_GREEK = dict(re.findall(r"(\w+)\s(\w)", _LETTERS))


@dataclass(frozen=True)
class Run:
    """Text in one style; `size` and `rise` (of its baseline, upwards) are in em of the line."""

    text: str
    italic: bool = False
    size: float = 1.0
    rise: float = 0.0
    skip: float = 0.0  #: em to the right before the text

    @property
    def width(self) -> float:
        """Upper estimate for the usual serif faces, em."""
        return self.skip + self.size * sum(
            _WIDE.get(c, 0.76 if c.isupper() else 0.54) for c in self.text
        )

    def script(self, rise: float) -> Run:
        """The same text as a sub- or superscript."""
        return Run(
            self.text,
            self.italic,
            *(x * SCRIPT for x in (self.size, self.rise + rise / SCRIPT, self.skip)),
        )


@dataclass(frozen=True)
class Line:
    """Runs on one baseline; lengths in em."""

    runs: tuple[Run, ...]

    @property
    def width(self) -> float:
        """Sum of the runs' widths."""
        return sum(run.width for run in self.runs)


@dataclass(frozen=True)
class Fraction:
    """A line over a bar over a line."""

    num: Line
    den: Line

    @property
    def width(self) -> float:
        """The bar's length, a little longer than the wider line."""
        return max(self.num.width, self.den.width) + 0.3


Formula = tuple[Line | Fraction, ...]


def width(formula: Formula) -> float:
    """Width of a formula in em."""
    return sum(piece.width for piece in formula)


def words(text: str) -> Line:
    """Upright words; a lone letter with an index, like G_d or P11, as a symbol."""
    return symbol(text) if re.fullmatch(r"[A-Za-z](_\w+|\d+)", text) else Line((Run(text),))


@lru_cache(maxsize=4096)
def symbol(name: str) -> Line:
    """A signal or parameter by its name: S_ref → S with the subscript ref, ellhat → ℓ̂."""
    if name == "z_inv":
        return Line((Run("z", italic=True), Run("−1").script(0.4)))
    stem, _, below = name.strip("_").partition("_")
    if not below and (found := re.fullmatch(r"([^\W\d]+)(\d+)", stem)):
        stem, below = found.groups()
    hat = stem.endswith("hat") and len(stem) > 3
    if below == "hat":
        hat, below = True, ""
    stem = stem.removesuffix("hat") if hat else stem
    stem = _GREEK.get(stem, stem) or name
    runs = [*(_hat(stem) if hat else (Run(stem, italic=len(stem) == 1),))]
    if below:
        words = [word for word in below.split("_") if word]
        text = ", ".join(_GREEK.get(word, word) for word in words)
        runs.append(Run(text, italic=len(text) == 1 and text.isalpha()).script(-0.22))
    return Line(tuple(runs))


def _hat(stem: str) -> tuple[Run, ...]:
    """An estimate: the hat is set first and the letter moved back under it.

    A combining hat would be one character, but few fonts have one that fits an ℓ.
    """
    letter = Run(stem, italic=len(stem) == 1)
    tall = stem[0].isupper() or stem[0] in "bdfhklβδζθλξℓ"
    hat = Run("ˆ", rise=0.2 if tall else 0.02)
    lead = (letter.width - hat.width) / 2 + 0.08  # italics lean to the right
    return replace(hat, skip=lead), replace(letter, skip=-lead - hat.width)


def formula(expr: sp.Expr, name: str) -> Formula:
    """A block's transfer function, or G_name(s) where it is too long."""
    pieces = _pieces(expr)
    if width(pieces) > LONGEST:
        head = symbol(name).runs if len(name) < 4 else (Run("G", True), _shortened(name))
        pieces = (Line((*head, Run("("), Run("s", italic=True), Run(")"))),)
    return pieces


def _shortened(name: str) -> Run:
    return Run(name if len(name) <= 16 else name[:15].rstrip() + "…").script(-0.22)


def _pieces(expr: sp.Expr) -> Formula:
    """The formula with its outermost fractions stacked: one piece for each line or fraction."""
    if not expr.is_Add:
        return _stacked(expr, lead=True)
    pieces: list[Any] = []
    for i, term in enumerate(_terms(expr)):
        for piece in _stacked(term, lead=i == 0):
            if pieces and isinstance(piece, Line) and isinstance(pieces[-1], Line):
                piece = Line(pieces.pop().runs + piece.runs)
            pieces.append(piece)
    return tuple(pieces)


def _stacked(term: sp.Expr, lead: bool) -> Formula:
    negative, num, den = _split(term)
    sign = _sign(negative, lead)
    if not den:
        return (Line((*sign, *_product(num))),)
    sign = (Run("−" + THIN),) if lead and negative else sign  # else it would lengthen the bar
    bar = Fraction(Line(_product(num)), Line(_product(den)))
    return (Line(sign), bar) if sign else (bar,)


def _sign(negative: bool, lead: bool) -> tuple[Run, ...]:
    if lead:
        return (Run("−"),) if negative else ()
    return (Run(THIN + ("−" if negative else "+") + THIN),)


def _inline(expr: sp.Expr) -> tuple[Run, ...]:
    """The expression on one line, fractions with a slash."""
    runs: list[Run] = []
    for i, term in enumerate(_terms(expr) if expr.is_Add else [expr]):
        negative, num, den = _split(term)
        runs += [*_sign(negative, lead=i == 0), *_product(num, alone=not den)]
        if den:
            below = _product(den, alone=len(den) == 1 and not _is_sum(den[0]))
            runs += [Run("/"), *(below if len(den) == 1 else _bracketed(below))]
    return tuple(runs)


def _product(factors: list[sp.Expr | str], alone: bool = True) -> tuple[Run, ...]:
    if not factors:
        return (Run("1"),)
    runs: list[Run] = []
    root = False
    for factor in factors:
        part = _factor(factor, brackets=len(factors) > 1 or not alone)
        digits = part[0].text[0].isdigit() and runs
        apart = runs and (runs[-1].rise < 0 or len(runs[-1].text) > 1 < len(part[0].text))
        if digits or apart or root:
            runs.append(Run("·" if digits else THIN))
        root = part[0].text == "√"
        runs += part
    return tuple(runs)


def _factor(factor: sp.Expr | str, brackets: bool) -> tuple[Run, ...]:
    if isinstance(factor, str):
        return (Run(factor),)
    if factor.is_Symbol:
        return symbol(factor.name).runs
    if isinstance(factor, sp.exp):
        return _power((Run("e", italic=True),), factor.exp)
    if factor.is_Add:
        return _bracketed(_inline(factor)) if brackets else _inline(factor)
    if factor.is_Pow:
        base, exponent = factor.as_base_exp()
        if exponent == sp.Rational(1, 2):
            return (Run("√"), *_atom(base))
        return _power(_atom(base), exponent)
    if factor.is_Function:
        inside = [run for arg in factor.args for run in (Run(", "), *_inline(arg))][1:]
        return (Run(factor.func.__name__), *_bracketed(inside))
    if factor.is_Mul:
        return _bracketed(_inline(factor))
    return (Run(str(factor)),)


def _atom(base: sp.Expr) -> tuple[Run, ...]:
    runs = _inline(base)
    return runs if base.is_Symbol or base.is_Integer else _bracketed(runs)


def _power(base: Iterable[Run], exponent: sp.Expr) -> tuple[Run, ...]:
    return (*base, *(run.script(0.4) for run in _inline(exponent)))


def _bracketed(runs: Iterable[Run]) -> tuple[Run, ...]:
    return (Run("("), *runs, Run(")"))


def _is_sum(factor: sp.Expr | str) -> bool:
    return not isinstance(factor, str) and bool(factor.is_Add)


def _split(expr: sp.Expr) -> tuple[bool, list[sp.Expr | str], list[sp.Expr | str]]:
    """(negative, factors above the bar, factors below it); e^{−τs} stays above."""
    negative = False
    above: list[sp.Expr | str] = []
    below: list[sp.Expr | str] = []
    for factor in sp.Mul.make_args(expr):
        if factor.is_Rational:
            negative ^= bool(factor < 0)
            num, den = _number(abs(factor))
            above[:0] = [num] if num != "1" else []
            below[:0] = [den] if den != "1" else []
        elif factor.is_Pow and factor.exp.could_extract_minus_sign():
            below.append(factor.base**-factor.exp)
        else:
            above.append(factor)
    return negative, sorted(above, key=_rank), sorted(below, key=_rank)


def _number(value: sp.Rational) -> tuple[str, str]:
    """Numerator and denominator; a short finite decimal is one number, 0.08 and not 2/25."""
    p, q = int(value.p), int(value.q)
    if q != 1 and (p != 1 or q > 9) and (10**6 % q == 0) and len(f"{p / q:.6g}") <= 7:
        return f"{p / q:.6g}", "1"
    return str(p), str(q)


def _rank(factor: sp.Expr | str) -> tuple[int, str]:
    """Order of factors as one writes them: numbers, parameters, s, sums, delays."""
    if isinstance(factor, str):
        return 0, ""
    if isinstance(factor, sp.exp):
        return 5, str(factor)
    if factor.is_Add:
        return 4, str(factor)
    if factor.has(s):
        return 3, str(factor)
    indexed = factor.is_Symbol and "_" in factor.name  # 2ζω₀ rather than 2ω₀ζ
    return 1 + indexed, factor.name if factor.is_Symbol else str(factor)


def _terms(expr: sp.Expr) -> list[sp.Expr]:
    """Terms of a sum, highest power of s first; a positive one leads where there is one."""

    def key(term: sp.Expr) -> tuple[bool, int]:
        power = sum(int(e) for b, e in map(_base_power, sp.Mul.make_args(term)) if b == s)
        return False, -power

    terms = sorted(expr.as_ordered_terms(), key=key)
    first = next((t for t in terms if not t.could_extract_minus_sign()), terms[0])
    return [first, *(t for t in terms if t is not first)]


def _base_power(factor: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    base, power = factor.as_base_exp()
    return base, power if power.is_Integer else sp.Integer(0)
