"""Blocks by their parameters: ``pid = { K = 2.5, T_i = "5 min" }`` and the formula that it means.

Each has the field's usual form. Parameters are numbers, numbers with a unit, or formulas of the
loop's parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from vsctrl.checks import decimal, is_number
from vsctrl.diagram.document.formula import parse
from vsctrl.diagram.document.units import has_unit, quantity
from vsctrl.problems import remedy, show
from vsctrl.symbols import s


@dataclass(frozen=True)
class Template:
    """A block: its formula, the parameters that it takes, and the defaults of some of them."""

    formula: str
    names: tuple[str, ...]
    defaults: Mapping[str, float]
    meaning: str


def _template(formula: str, names: str, meaning: str, **defaults: float) -> Template:
    return Template(formula, tuple(names.split()), defaults, meaning)


TEMPLATES: dict[str, Template] = {
    "gain": _template("K", "K", "K"),
    "integrator": _template("K/s", "K", "K/s", K=1),
    "delay": _template("exp(-theta*s)", "theta", "dead time e^(-theta s), theta in s"),
    "fopdt": _template(
        "K*exp(-theta*s)/(T*s + 1)", "K T theta", "first order plus dead time, T and theta in s",
        theta=0,
    ),
    "sopdt": _template(
        "K*exp(-theta*s)/((T_1*s + 1)*(T_2*s + 1))", "K T_1 T_2 theta",
        "second order plus dead time, T_1, T_2 and theta in s", theta=0,
    ),
    "pid": _template(
        "K*(1 + 1/(T_i*s) + T_d*s/(T_d/N*s + 1))", "K T_i T_d N",
        "K(1 + 1/(T_i s) + T_d s/(T_d s/N + 1)), T_i and T_d in s; without T_i no integral part",
        T_i=0, T_d=0, N=10,
    ),
    "lead": _template(
        "K*(T*s + 1)/(alpha*T*s + 1)", "K T alpha",
        "K(T s + 1)/(alpha T s + 1), alpha below 1, T in s", K=1,
    ),
    "lag": _template("K/(T*s + 1)", "K T", "K/(T s + 1), T in s", K=1),
    "notch": _template(
        "(s^2 + 2*zeta_z*omega*s + omega^2)/(s^2 + 2*zeta_p*omega*s + omega^2)",
        "omega zeta_z zeta_p", "notch at omega (rad/s), damped by zeta_z above, zeta_p below",
        zeta_z=0, zeta_p=1,
    ),
}  # fmt: skip


def expression(kind: str, value: object) -> sp.Expr:
    """The formula of a block by its parameters. Raises ValueError with the rest of a sentence."""
    template = TEMPLATES[kind]
    if not isinstance(value, Mapping):
        if len(template.names) > 1:
            example = ", ".join(f"{name} = …" for name in template.names)
            raise ValueError(f"{show(value)} is no table; write {kind} = {{ {example} }}")
        value = {template.names[0]: value}
    for name in value:
        if name not in template.names:
            raise ValueError(f"unknown key {show(name)}{remedy(str(name), template.names)}")
    given = {**template.defaults, **value}
    missing = [name for name in template.names if name not in given]
    if missing:
        raise ValueError(f"has no {missing[0]}; give it, as in {kind} = {{ {missing[0]} = 1 }}")
    return _formula(kind, {name: number_or_formula(name, given[name]) for name in template.names})


def _formula(kind: str, values: dict[str, sp.Expr]) -> sp.Expr:
    if kind != "pid":
        # Names of the template are no names of the loop: put in at once, none is taken for another.
        inside = {_symbol(name): value for name, value in values.items()}
        return parse(TEMPLATES[kind].formula).xreplace(inside)
    K, T_i, T_d, N = (values[name] for name in TEMPLATES[kind].names)
    integral = 1 / (T_i * s) if T_i != 0 else sp.Integer(0)
    derivative = T_d * s / (T_d / N * s + 1) if T_d != 0 else sp.Integer(0)
    return K * (1 + integral + derivative)


def _symbol(name: str) -> sp.Symbol:
    (symbol,) = parse(name).free_symbols
    return symbol


def number_or_formula(name: str, value: object) -> sp.Expr:
    """A number, a number with its unit, or a formula of parameters without s."""
    if is_number(value) or has_unit(value):
        try:
            return sp.Rational(decimal(name, quantity(value).value))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    try:
        expr = parse(value)
    except ValueError as error:
        raise ValueError(f"{name}: {show(value)} {error}") from None
    if expr.has(s):
        raise ValueError(f'{name}: {show(value)} holds s; write such a block as transfer = "…"')
    return expr
