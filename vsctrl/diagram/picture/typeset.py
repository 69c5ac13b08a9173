"""Lines of text with scripts and bars, measured without any font.

A picture of a diagram must not depend on the fonts of the machine that draws it, so widths come
from a small table that is on the safe side for the usual serif faces. Lengths are in em.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache

SCRIPT = 0.72  #: size of a sub- or superscript, of the text it belongs to
THIN = "\u2009"

_WIDE = {"m": 0.8, "w": 0.74, "M": 0.92, "W": 0.96, "ω": 0.72, "Ω": 0.8, "−": 0.6, "+": 0.6}
_WIDE |= dict.fromkeys("ijltfrI1,.;:'|!()[]/ -", 0.36) | {"1": 0.5, THIN: 0.2, "ℓ": 0.42, "ˆ": 0.34}
_LETTERS = """
alpha α beta β gamma γ delta δ epsilon ε zeta ζ eta η theta θ iota ι kappa κ lambda λ
mu μ nu ν xi ξ pi π rho ρ sigma σ tau τ upsilon υ phi φ chi χ psi ψ omega ω Gamma Γ Delta Δ Theta Θ
Lambda Λ Xi Ξ Pi Π Sigma Σ Phi Φ Psi Ψ Omega Ω ell ℓ"""
_GREEK = dict(re.findall(r"(\w+)\s(\w)", _LETTERS))


def _width(c: str) -> float:
    return _WIDE.get(c) or (1.05 if c >= "\u2e80" else 0.76 if c.isupper() else 0.54)


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
        return self.skip + self.size * sum(map(_width, self.text))

    def script(self, rise: float) -> Run:
        """The same text as a sub- or superscript."""
        above = rise + self.rise * SCRIPT
        return Run(self.text, self.italic, self.size * SCRIPT, above, self.skip * SCRIPT)


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
    if not below and (match := re.fullmatch(r"([^\W\d]+)(\d+)", stem)):
        stem, below = match.groups()
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
    """An estimate: a letter, back to a hat above it, and on to the letter's end.

    A combining hat would be one character, but few fonts have one that fits an ℓ.
    """
    letter = Run(stem, italic=len(stem) == 1)
    tall = stem[0].isupper() or stem[0] in "bdfhklβδζθλξℓ"
    hat, end = Run("ˆ", rise=0.2 if tall else 0.02), Run(THIN)
    lead = (letter.width - hat.width) / 2 + 0.08  # italics lean to the right
    rest = letter.width - lead - hat.width - end.width
    return letter, replace(hat, skip=lead - letter.width), replace(end, skip=rest)
