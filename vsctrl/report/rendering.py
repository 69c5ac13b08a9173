"""Templates and formulas: how words, numbers and mathematics become elements of a page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from itertools import groupby
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

from vsctrl.report.section import Part, Picture, Scripted, Table, Verbatim
from vsctrl.tables import visible

if TYPE_CHECKING:
    from vsctrl.symbols import Expr


def render(template: str, **values: Any) -> str:
    """A template's text with values in it."""
    return _environment().get_template(template).render(**values)


def fragment(template: str, **values: Any) -> Markup:
    """A template as an element of a page."""
    return Markup(render(template, **values))


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vsctrl.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"grouped": _grouped}
    environment.tests |= {
        "table": lambda part: isinstance(part, Table),
        "picture": lambda part: isinstance(part, Picture),
        "scripted": lambda part: isinstance(part, Scripted),
        "verbatim": lambda part: isinstance(part, Verbatim),
        "markup": lambda part: isinstance(part, Markup),
    }
    return environment


def _shown(value: Any) -> Any:
    """A value of the template; text of the user's that no page can hold is replaced."""
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _grouped(parts: Sequence[Part]) -> list[list[Part]]:
    """Figures that follow each other together, which paper shows side by side."""
    runs = groupby(parts, key=lambda part: isinstance(part, Picture) and bool(part.narrow))
    return [group for pictures, run in runs for group in _one_or_all(list(run), pictures)]


def _one_or_all(run: list[Part], together: bool) -> list[list[Part]]:
    return [run] if together else [[part] for part in run]


def mathml(expr: Expr | str, display: bool = False) -> Markup:
    """A formula as MathML, by way of SymPy's LaTeX, which keeps the case of every name."""
    import latex2mathml.converter
    import sympy as sp

    latex = expr if isinstance(expr, str) else sp.latex(expr, fold_frac_powers=True)
    text = latex2mathml.converter.convert(latex, display="block" if display else "inline")
    # Fractions in running text are kept at full size.
    text = text.replace('display="inline"', 'display="inline" displaystyle="true"')
    return Markup(re.sub(r' xmlns="[^"]*"', "", text))


def equations(*lines: tuple[str, Expr]) -> Markup:
    """Named formulas, one below the other."""
    import sympy as sp

    shown = [mathml(f"{name} = {sp.latex(expr)}", display=True) for name, expr in lines]
    return Markup('<div class="equations">{}</div>').format(Markup("\n").join(shown))


def drawn(svg: str) -> Markup:
    """An SVG of the diagram as an element of a page."""
    return Markup(re.sub(r' xmlns="[^"]*"', "", svg))
