"""The sections about the linear loop of a scenario: its diagram, its directions, its margins."""

from __future__ import annotations

import math

from vsctrl.loop import ScenarioLoop
from vsctrl.report.rendering import drawn, equations
from vsctrl.report.section import Part, Picture, Section, Table
from vsctrl.report.wording import per_second


def loop_sections(loop: ScenarioLoop, prefix: str) -> list[Section]:
    """Diagram with its formula, directions with κ and gain limit, and what is left out."""
    from vsctrl.diagram.picture.draw import svg

    diagram = loop.diagram
    opened = diagram.open("T")
    parts: list[Part] = [
        Picture(drawn(svg(diagram))),
        "The loop of one direction of this very scenario; ℓ/ℓ̂ is its κ, which everything that the "
        "law believes of camera, depths and hand decides.",
        equations(("L(s)", -opened.transfer("T__cut", "T"))),
        _directions(loop),
    ]
    if loop.left_out:
        rows = [(key, why) for key, why in loop.left_out.items()]
        parts.append(Table(("left out", "why"), rows, "What this loop leaves out", left=2))
    return [Section("loop", "The loop of this scenario", parts)]


def _directions(loop: ScenarioLoop) -> Table:
    rows = []
    for each in loop.directions:
        kappa = f"{each.kappa.real:.4g}" if not each.kappa.imag else f"{each.kappa:.4g}"
        limit = loop.limit_of(each)
        growth = loop.frames(each).spectral_radius
        rows.append(
            (
                each.name,
                kappa,
                "∞" if not math.isfinite(limit) else per_second(limit),
                f"{growth:.5g}",
                "stable" if growth < 1 else "unstable",
            )
        )
    heads = ("direction", "κ", "stable up to λ =", "a mode is multiplied each frame by", "")
    return Table(heads, rows, "As sampled, with the twist held over a video period")
