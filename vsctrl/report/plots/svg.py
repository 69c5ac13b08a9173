"""The way of a figure into a page: SVG elements that take the page's colours and hold real text.

Words stay words, so that they can be searched, copied and read aloud; what Matplotlib writes as
style becomes attributes, so that a page may forbid inline styles; and each colour of the palette
becomes a variable that a page sets for light and for dark.
"""

from __future__ import annotations

import io
import re

import matplotlib as mpl
from matplotlib.figure import Figure

from vsctrl.report.plots.narrow import narrow
from vsctrl.report.plots.style import INK, PALETTE, PAPER, STYLE

_ID = re.compile(r'\sid="([^"]*)"')
_REFERENCE = re.compile(r'(href="#|url\(#)([^")]*)')
_FRACTION = re.compile(r"-?\d+\.\d{3,}")
_STYLED = re.compile(r'style="([^"]*)"')
_TEXT = re.compile(r"<text.*?</text>", re.DOTALL)
_UNSEEN = re.compile(r'<path d="[^"]*" fill="none"/>\n')  # neither filled nor drawn
_LINES = re.compile(r' d="[^QC"]*"')  # of straight pieces, which need no letter for each point
_MARKERS = re.compile(r"<g([^>]*)>\n((?:<use [^>]*/>\n){2,})</g>")
_FAMILY = re.compile(r""" font-family="'DejaVu Sans'[^"]*\"""")
#: Letters as wide as those that Matplotlib measures, in this order.
FAMILY = "DejaVu Sans,Verdana,Bitstream Vera Sans,sans-serif"
#: In the style that Matplotlib gives all elements; the page says the same once.
_USUAL = '<style type="text/css">*{stroke-linejoin: round; stroke-linecap: butt}</style>'


def to_svg(figure: Figure, title: str, prefix: str) -> str:
    """The figure as an SVG element to put into a page, without links, styles or scripts.

    `title`: what a screen reader says, escaped; `prefix` keeps the ids of figures on one page
    apart.

    >>> figure = vs.plot(vs.figure1)
    >>> vs.plots.to_svg(figure, "Figure 1", "one")[:4]
    '<svg'
    """
    svg = _clean(_drawn(figure))
    used = dict.fromkeys(found[2] for found in _REFERENCE.finditer(svg))
    name = {old: f"{prefix}-{number}" for number, old in enumerate(used)}
    svg = _ID.sub(lambda found: f' id="{name[found[1]]}"' if found[1] in name else "", svg)
    svg = _REFERENCE.sub(lambda found: found[1] + name[found[2]], svg)
    return svg.replace("<svg", f'<svg class="plot" role="img" aria-label="{title}"', 1)


def to_svgs(figure: Figure, title: str, prefix: str) -> tuple[str, str]:
    """The figure for a page, and the same drawn anew for a phone; it is narrow from then on.

    >>> wide, narrow = vs.plots.to_svgs(vs.plot(vs.figure1), "Figure 1", "one")
    >>> "Figure 1" in narrow
    True
    """
    wide = to_svg(figure, title, prefix)
    narrow(figure)
    return wide, to_svg(figure, title, f"{prefix}-narrow")


def _drawn(figure: Figure) -> str:
    buffer = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(
            buffer,
            format="svg",
            transparent=True,
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    svg = buffer.getvalue()
    return svg[svg.index("<svg") :]


def _clean(svg: str) -> str:
    """Only what is seen: no metadata, no comments, short numbers, attributes for styles."""
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = svg.replace(_USUAL, "")
    svg = re.sub(r"<defs>\s*</defs>\n?", "", svg)
    svg = re.sub(r'\s(?:xmlns(?::\w+)?|version)="[^"]*"', "", svg)
    svg = re.sub(r' transform="rotate\(-?0 [^"]*"', "", svg.replace("xlink:href", "href"))
    svg = re.sub(r"<!--.*?-->|^ +", "", svg, flags=re.DOTALL | re.MULTILINE)
    svg = _STYLED.sub(lambda found: _attributes(found[1]), svg)
    svg = _FAMILY.sub("", svg).replace("<svg", f'<svg font-family="{FAMILY}"', 1)
    svg = _UNSEEN.sub("", svg)
    svg = _MARKERS.sub(_shared, svg)
    svg = _TEXT.sub(_words, svg)
    svg = _LINES.sub(lambda found: found[0].replace(" \nL ", " "), _FRACTION.sub(_short, svg))
    for name, colour in PALETTE.items():
        svg = svg.replace(f'"{colour}"', f'"var(--{name},{colour})"')
    return svg.replace(f'"{INK}"', '"currentColor"').replace(f'"{PAPER}"', '"var(--paper,#fff)"')


def _attributes(style: str) -> str:
    """``a: b; c: d`` as ``a="b" c="d"``."""
    pairs = (part.partition(":") for part in style.split(";") if part.strip())
    return " ".join(f'{key.strip()}="{value.strip()}"' for key, _, value in pairs)


def _shared(group: re.Match[str]) -> str:
    """Markers that look alike say so once."""
    markers = [re.split(r" (?=(?:fill|stroke)[\w-]*=)", one) for one in group[2].splitlines()]
    looks = {" ".join(parts[1:]).removesuffix("/>") for parts in markers}
    if len(looks) > 1:
        return group[0]
    places = "\n".join(f"{parts[0]}/>" for parts in markers)
    return f"<g{group[1]} {looks.pop()}>\n{places}\n</g>"


def _words(text: re.Match[str]) -> str:
    """The parts of a formula without the white space between, which would part its letters."""
    return re.sub(r">\s+<", "><", text[0])


def _short(number: re.Match[str]) -> str:
    """A position to a twentieth of a point, finer than a screen, and a factor to six places."""
    value = float(number[0])
    return f"{value:.{1 if abs(value) >= 10 else 2 if abs(value) >= 1 else 6}f}".rstrip("0").rstrip(
        "."
    )
