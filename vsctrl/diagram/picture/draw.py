"""A block diagram as an SVG, the same to the byte wherever it is drawn.

Inside a page the picture takes the page's text colour; on its own it follows the reader's light or
dark scheme. Where things stand is decided in `place`, `grid`, `route` and `layout`.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache

from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.picture import mathtext, typeset
from vsctrl.diagram.picture.grid import Grid, build
from vsctrl.diagram.picture.layout import RADIUS, Box, Label, Path, Picture, Size, arrange
from vsctrl.diagram.picture.place import Graph
from vsctrl.diagram.picture.route import route
from vsctrl.tables import escaped

MATH, NAME, SIGNAL = 17.0, 11.5, 15.0  #: font sizes, px
_BAR = 0.5  #: em from a fraction's bar to the ink beside it

_STYLE = """\
#{id}{{fill:none;stroke:currentColor;stroke-width:1.3}}
#{id}{{max-width:100%;height:auto}}
#{id}:root{{color:#1c2128}}
@media (prefers-color-scheme:dark){{#{id}:root{{color:#dfe4ea}}}}
#{id} text{{font:17px "Times New Roman","Nimbus Roman","Liberation Serif",Times,serif;\
fill:currentColor;stroke:none;text-anchor:middle}}
#{id} .name{{font:11.5px Helvetica,Arial,"Liberation Sans",sans-serif;fill-opacity:.7}}
#{id} .signal{{font-size:15px}}
#{id} .start{{text-anchor:start}}
#{id} .end{{text-anchor:end}}
#{id} .i{{font-style:italic}}
#{id} .box{{fill:currentColor;fill-opacity:.05}}
#{id} .ink{{fill:currentColor;stroke:none}}"""


def svg(diagram: Wiring) -> str:
    """The diagram as one self-contained ``<svg>`` element."""
    grid, picture, formulas = draft(diagram)
    body = "\n".join(
        [
            *(_wire(path) for path in picture.paths),
            *(f'<circle class="ink" cx="{_n(x)}" cy="{_n(y)}" r="2.6"/>' for x, y in picture.dots),
            *(_node(grid, box, formulas) for box in picture.boxes if box.width),
            *(_sign(*sign) for sign in picture.signs),
            *(_signal(label) for label in picture.labels),
        ]
    )
    title = f"Block diagram from {', '.join(diagram.inputs) or 'no input'} "
    title += f"to {', '.join(diagram.outputs) or 'no output'}"
    about = "; ".join(_described(part) for part in diagram.shown)
    digest = hashlib.sha256("\n".join([title, about, body]).encode(errors="replace")).hexdigest()
    name = f"vsctrl-{digest[:12]}"
    width, height = _n(picture.width), _n(picture.height)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" id="{name}" role="img" '
        f'aria-labelledby="{name}-title {name}-desc" width="{width}" '
        f'viewBox="0 0 {width} {height}">\n'
        f'<title id="{name}-title">{escaped(title)}</title>\n'
        f'<desc id="{name}-desc">{escaped(about)}</desc>\n'
        f"<style>{_STYLE.format(id=name)}</style>\n{body}\n</svg>\n"
    )


def draft(diagram: Wiring) -> tuple[Grid, Picture, dict[int, typeset.Formula]]:
    """The diagram placed, wired and measured, with the formula of each block."""
    graph = Graph(diagram)
    grid = build(graph)
    formulas = {
        i: mathtext.formula(node.part.expr, node.part.name)
        for i, node in enumerate(graph.nodes)
        if isinstance(node.part, Block)
    }
    sizes = {i: _size(formula, graph.nodes[i].part) for i, formula in formulas.items()}
    picture = arrange(grid, route(grid), sizes.__getitem__, signal_width)
    return grid, picture, formulas


def _size(formula: typeset.Formula, block: object) -> Size:
    assert isinstance(block, Block)
    tall = any(isinstance(piece, typeset.Fraction) for piece in formula)
    width = max(typeset.width(formula) * MATH + 18.0, 42.0)
    return Size(round(width), 54.0 if tall else 38.0, name_width(block.name))


def name_width(name: str) -> float:
    """Width of a block's name above its box, px."""
    return typeset.words(name).width * NAME * 1.08


@lru_cache(maxsize=4096)
def signal_width(name: str) -> float:
    """Width of a signal's name beside its wire, px."""
    return typeset.symbol(name).width * SIGNAL


def _n(value: float) -> str:
    """A coordinate, as short as it is exact enough."""
    return f"{value:.1f}".removesuffix(".0")


def _wire(path: Path) -> str:
    """A wire; its line ends inside the arrow's head, so that the tip stays sharp."""
    *_, (a, b), (x, y) = path.points
    dx, dy = (x > a) - (x < a), (y > b) - (y < b)
    line = [*path.points[:-1], (x - 6 * dx, y - 6 * dy)]
    run = "L".join(f"{_n(u)} {_n(v)}" for u, v in line)
    left = f"{_n(x - 9 * dx - 3.6 * dy)} {_n(y - 9 * dy - 3.6 * dx)}"
    right = f"{_n(x - 9 * dx + 3.6 * dy)} {_n(y - 9 * dy + 3.6 * dx)}"
    head = f'<path class="ink" d="M{_n(x)} {_n(y)}L{left}L{right}Z"/>'
    return f'<path d="M{run}"/>{head}'


def _node(grid: Grid, box: Box, formulas: dict[int, typeset.Formula]) -> str:
    part = grid.graph.nodes[box.node].part
    title = f"<title>{escaped(_described(part))}</title>"
    if not isinstance(part, Block):
        return f'<g>{title}<circle class="box" cx="{_n(box.x)}" cy="{_n(box.y)}" r="{RADIUS}"/></g>'
    x, y = box.x - box.width / 2, box.y - box.height / 2
    frame = f'width="{_n(box.width)}" height="{_n(box.height)}"'
    name = _text(typeset.words(part.name), box.x, y - 5, NAME, ' class="name"')
    return (
        f'<g>{title}<rect class="box" x="{_n(x)}" y="{_n(y)}" {frame}/>'
        f"{name}{_formula(formulas[box.node], box.x, box.y)}</g>"
    )


def _described(part: object) -> str:
    return f"{part.name}: {part}" if isinstance(part, Block) else str(part)


def _formula(formula: typeset.Formula, x: float, y: float) -> str:
    """A formula centred on a point: each line and each side of a fraction is one text."""
    out = []
    x -= typeset.width(formula) * MATH / 2
    for piece in formula:
        wide = piece.width * MATH
        middle = x + wide / 2
        if isinstance(piece, typeset.Line):
            out.append(_text(piece, middle, y + 0.3 * MATH, MATH))
        else:
            out.append(_text(piece.num, middle, y - _BAR * MATH + 1.5, MATH))
            out.append(f'<path d="M{_n(x + 1)} {_n(y)}h{_n(wide - 2)}" stroke-width="1"/>')
            out.append(_text(piece.den, middle, y + 1.08 * MATH, MATH))
        x += wide
    return "".join(out)


def _text(line: typeset.Line, x: float, y: float, size: float, more: str = "") -> str:
    """One line of text; scripts are runs shifted by dy, which the next run shifts back."""
    spans, height = [], 0.0
    for run in line.runs:
        shift = (height - run.rise) * size
        height = run.rise
        look = ' class="i"' if run.italic else ""
        look += f' dx="{_n(run.skip * size)}"' if run.skip else ""
        look += f' dy="{_n(shift)}"' if shift else ""
        look += f' font-size="{_n(run.size * size)}"' if run.size != 1 else ""
        text = escaped(run.text)
        spans.append(f"<tspan{look}>{text}</tspan>" if look else text)
    return f'<text{more} x="{_n(x)}" y="{_n(y)}">{"".join(spans)}</text>'


def _signal(label: Label) -> str:
    anchor = "" if label.anchor == "middle" else f" {label.anchor}"
    line = typeset.symbol(label.signal)
    return _text(line, label.x, label.y, SIGNAL, f' class="signal{anchor}"')


def _sign(x: float, y: float, sign: int) -> str:
    """A plus or minus as strokes, so that it looks the same in every font."""
    level = f"M{_n(x - 3.5)} {_n(y)}h7"
    return f'<path d="{level}{"" if sign < 0 else f"M{_n(x)} {_n(y - 3.5)}v7"}"/>'
