"""The names of parameters in text: Greek letters, keywords, and the symbols that they mean."""

from __future__ import annotations

import unicodedata

import sympy as sp

from vsctrl import symbols
from vsctrl.symbols import KEYWORDS

_LETTERS = """
    α alpha β beta γ gamma δ delta ε epsilon ζ zeta η eta θ theta ι iota κ kappa λ lambda μ mu
    ν nu ξ xi π pi ρ rho σ sigma τ tau υ upsilon φ phi χ chi ψ psi ω omega ϕ phi ϑ theta
    Γ Gamma Δ Delta Θ Theta Λ Lambda Ξ Xi Π Pi Σ Sigma Φ Phi Ψ Psi Ω Omega ℓ ell µ mu
"""
GREEK = dict(zip(_LETTERS.split()[::2], _LETTERS.split()[1::2], strict=True))
HAT = "\u0302"  #: the combining circumflex of τ̂

#: The symbols of a loop that everyone shares, by keyword; all other names are symbols of their own.
SHARED: dict[str, sp.Symbol] = {
    name: getattr(symbols, name) for name in ("tau", "ell", "kappa", "k_ff", "T_i")
} | KEYWORDS


def ascii_name(name: str) -> str:
    """The keyword that a name means: λ is lam, τ̂ tau_hat, θ_1 theta_1; others as they are."""
    spelt = unicodedata.normalize("NFD", name).replace(HAT, "_hat")
    spelt = unicodedata.normalize("NFC", "".join(GREEK.get(c, c) for c in spelt))
    return {"lambda": "lam"}.get(spelt, spelt)


def symbol(name: str) -> sp.Symbol:
    """The symbol of a keyword; s is the Laplace variable."""
    if name == "s":
        return symbols.s
    return SHARED.get(name) or sp.Symbol(name)


def keyword(of: sp.Symbol) -> str:
    """The keyword by which a symbol is called, as `Wiring.parameters` has it."""
    words = {shared.name: word for word, shared in KEYWORDS.items()}
    return words.get(of.name, of.name)
