"""A derived matrix as a reader sees it: LaTeX, MathML, and rows in a terminal.

The module exists because SymPy takes RHO for ρ and Xbar for x̄: here a name is printed as it was
given, letter for letter, and only a name that is Greek in its own case is a Greek letter.
"""

import re
from collections.abc import Sequence
from shutil import get_terminal_size

from sympy import Expr, ImmutableMatrix, Symbol, latex, pretty

from vsctrl.derive.emit.meanings import COLUMNS, described
from vsctrl.derive.emit.shared import common
from vsctrl.derive.kinematics.interaction import VisualFeature, interaction_matrix

_SMALL = """
    alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau
    upsilon phi chi psi omega
"""
_CAPITAL = "Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
_GREEK = {name: f"\\{name}" for name in (_SMALL + _CAPITAL).split()}
_SPECIAL = {"thetau": r"(\theta u)", "inverse_rho": r"\rho^{-1}", "ell": r"\ell"}


def as_latex(feature: VisualFeature) -> str:
    r"""L as ``\begin{bmatrix} … \end{bmatrix}``, a row a line, without dollars."""
    L = interaction_matrix(feature)
    names = latex_names(feature.arguments)
    rows = [" & ".join(_latex(L[i, j], names) for j in range(L.cols)) for i in range(L.rows)]
    return "\\begin{bmatrix}\n" + " \\\\\n".join(rows) + "\n\\end{bmatrix}\n"


def as_mathml(feature: VisualFeature) -> str:
    """L as a ``<math>`` element."""
    import latex2mathml.converter

    return f"{latex2mathml.converter.convert(as_latex(feature), display='block')}\n"


def latex_names(symbols: Sequence[Symbol]) -> dict[Symbol, str]:
    """LaTeX for each name, different for different names."""
    names: dict[Symbol, str] = {}
    for symbol in symbols:
        name = _name(symbol.name)
        if name in names.values():
            name = _upright(symbol.name)
        names[symbol] = name
    return names


def as_text(feature: VisualFeature, width: int | None = None) -> str:
    """Name, arguments and L in Unicode: as a matrix where it fits the terminal, else by entries.

    Entries too long for a line are written with what they have in common, c0, c1, ….
    """
    L = interaction_matrix(feature)
    lines = [f"{feature.name}: s' = L T, columns {' '.join(COLUMNS)}"]
    lines += [f"  {line}" for line in described(feature.arguments)]
    room = width or get_terminal_size((100, 24)).columns
    drawn = [line.rstrip() for line in pretty(L, wrap_line=False, use_unicode=True).splitlines()]
    if max(map(len, drawn)) > room:
        drawn = _listed(L)
        if max(map(len, drawn)) > room:
            shared, entries = common(list(L), [symbol.name for symbol in feature.arguments])
            drawn = _listed(ImmutableMatrix(*L.shape, entries))
            drawn += ["with", *(f"  {symbol} = {value}" for symbol, value in shared)]
    return "\n".join([*lines, "", *drawn]) + "\n"


def _listed(L: ImmutableMatrix) -> list[str]:
    lines = []
    for i in range(L.rows):
        lines.append(f"row {i}")
        lines += [f"  {COLUMNS[j]}  {L[i, j]}" for j in range(6) if not L[i, j].is_zero]
    return lines


def _latex(entry: Expr, names: dict[Symbol, str]) -> str:
    return str(latex(entry, symbol_names=names))


def _name(name: str) -> str:
    if name in _SPECIAL:
        return _SPECIAL[name]
    base, *below = name.split("_")
    if not base or not all(below):
        return _upright(name)
    starred = below[-1:] == ["star"]
    below = below[:-1] if starred else below
    if not below and (numbered := re.fullmatch(r"([A-Za-z]+)(\d+)", base)):
        base, below = numbered[1], [numbered[2]]
    text = _word(base)
    if below:
        text += "_{" + " ".join(_word(part) for part in below) + "}"
    return text + "^{*}" if starred else text


def _word(word: str) -> str:
    """A Greek letter, a single letter or number as it is, or an upright word."""
    special = _SPECIAL.get(word) or _GREEK.get(word)
    if special:
        return special
    return word if len(word) == 1 or word.isdigit() else _upright(word)


def _upright(name: str) -> str:
    return "\\mathrm{" + name.replace("_", r"\_") + "}"
