"""A loop of one's own on a page: picture, margins, responses, roots, chart, Padé, twin, check."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from vsctrl.diagram import Loop
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.errors import InputError, LimitError
from vsctrl.report import plots
from vsctrl.report.explorer.explorer import explorer
from vsctrl.report.figures import figure
from vsctrl.report.loop_answers import first_step_info
from vsctrl.report.loop_tables import margins_table, parameter_table, roots_table, step_table
from vsctrl.report.loop_verdict import Limits, loop_verdict, own_limits
from vsctrl.report.rendering import drawn, equations
from vsctrl.report.section import Entry, Part, Picture, Section, Verbatim
from vsctrl.report.tiles import loop_tiles
from vsctrl.report.wording import listed, time
from vsctrl.tables import plain

PADE = (1, 2, 4, 6)  #: orders of the models whose errors are shown
SPREAD = (0.25, 3.0)  #: of a parameter's value, over which the stability chart is drawn
GRID = (15, 10)  #: on which boundaries are looked for, which are exact wherever they are found
FINE = (30, 20)  #: the same of chains of roots, whose edge is that of the grid


def loop_entry(
    loop: Loop, prefix: str, progress: Callable[[str], None] = lambda step: None
) -> Entry:
    """All that is known of a loop; `prefix` keeps the ids of figures on one page apart."""
    progress(f"{loop.name}: margins and responses")
    opened = _of(lambda: loop.open)
    margins = None if opened is None else _of(opened.margins)
    sections = [_the_loop(loop, opened), *_explorer(loop, prefix)]
    own = own_limits(loop, margins)
    if opened is not None and margins is not None:
        sections.append(_how_fast(loop, opened, margins, own, prefix))
    sections += _responses(loop, prefix)
    sections.append(_roots(loop, prefix))
    progress(f"{loop.name}: chart, models and check")
    sections += [*_chart(loop, prefix), *_models(loop, opened, prefix), *_check(loop)]
    sections.append(Section("file", "The loop as a file", [_file(loop)], appendix=True))
    judged = loop_verdict(loop, margins, own)
    tiles = loop_tiles(loop, own, judged.kind == "bad", first_step_info(loop))
    return Entry(
        kind="loop",
        name=loop.name,
        about=loop.description,
        verdict=judged,
        tiles=tiles,
        sections=sections,
        data=_data(loop, margins, own),
        source=loop,
    )


def _of(make: Callable[[], Any]) -> Any:
    """What a question has for an answer; None where it has none."""
    try:
        return make()
    except (InputError, LimitError):
        return None


def _file(loop: Loop) -> Part:
    try:
        return Verbatim("TOML, ready to save and edit", loop.to_toml())
    except InputError as error:
        return str(error)


def _the_loop(loop: Loop, opened: Any) -> Section:
    from vsctrl.diagram.picture.draw import svg

    parts: list[Part] = [Picture(drawn(svg(loop.diagram)))]
    if opened is not None:
        cut = loop.diagram.open(loop.opened)
        transfer = -cut.transfer(f"{loop.opened}__cut", loop.opened)
        parts.append(equations((rf"L(s)\ \text{{at {_safe(loop.opened)}}}", transfer)))
    if loop.values:
        parts.append(parameter_table(loop))
    return Section("loop", "The loop", parts)


def _explorer(loop: Loop, prefix: str) -> list[Section]:
    moved = explorer(loop, f"{prefix}-explorer")
    return [] if moved is None else [Section("move", "Move its numbers", [moved])]


def _safe(name: str) -> str:
    """A signal's name as the text of a formula, which takes letters, digits and underscores."""
    return "".join(c if c.isalnum() or c == "_" else " " for c in name)


def _how_fast(
    loop: Loop, opened: Any, margins: Margins, own: Limits | None, prefix: str
) -> Section:
    parts: list[Part] = []
    L, held = opened, ""
    if own is not None and own.period is not None:
        L, held = own.L, " in continuous time,"
        every = f"As sampled every {time(own.period, loop.time_unit)}, opened at {own.at}"
        parts.append(margins_table(loop, L, own.margins, every))
    caption = f"Opened at {loop.opened},{held} delays exact"
    parts += [
        margins_table(loop, opened, margins, caption),
        figure(plots.bode(L), prefix, "bode", loop.name),
        figure(plots.nyquist(L), prefix, "nyquist", loop.name),
        figure(plots.nichols(L), prefix, "nichols", loop.name),
    ]
    plant_input = _plant_input(loop)
    if plant_input is not None:
        four = _of(lambda: plots.gang_of_four(loop.system, plant_input, loop.opened))
        if four is not None:
            parts += ["The four sensitivities are those in continuous time."] if held else []
            parts.append(figure(four, prefix, "four", loop.name))
    return Section("margins", "How close to shaking", parts)


def _plant_input(loop: Loop) -> str | None:
    """The output of the first block in the loop that is not the plant: what the controller says."""
    from vsctrl.diagram.document.check import in_a_loop

    signals = [name for name in in_a_loop(loop.diagram) if name != loop.opened]
    drivers = {block.output: block for block in loop.diagram.blocks}
    ruled = [name for name in signals if name in drivers]
    return ruled[0] if ruled else None


def _responses(loop: Loop, prefix: str) -> list[Section]:
    if not loop.applied:
        return []
    parts: list[Part] = []
    for i, one in enumerate(loop.applied):
        channels = [loop.channel(one.input, signal) for signal in loop.watched]
        shown = _drawn_response(loop, one.signal, channels)
        if shown is not None:
            plots.in_unit(shown, loop.time_unit)
            size = f"{one.size:g}".replace("-", "−")
            what = f"{one.kind.capitalize()} of {size} in {one.input}"
            until = time(loop.horizon, loop.time_unit)
            told = shown.caption if shown.caption != shown.alt else ""
            shown.alt = f"{what}: responses of {listed(loop.watched)} over {until}."
            shown.caption = " ".join(filter(None, [f"{what}, over {until}.", told]))
            parts.append(figure(shown, prefix, f"response{i}", loop.name))
    table = step_table(loop)
    if table is not None:
        parts.append(table)
    return [Section("responses", "What it answers", parts)] if parts else []


def _drawn_response(loop: Loop, signal: Any, channels: list[Any]) -> Any:
    """The responses of all watched signals, None where one of them has none."""
    return _of(
        lambda: plots.response(*channels, signal=signal, t=loop.horizon, names=list(loop.watched))
    )


def _roots(loop: Loop, prefix: str) -> Section:
    parts: list[Part] = []
    shown = _of(lambda: plots.pole_map(loop.system, names=[loop.name]))
    if shown is not None:
        parts.append(figure(shown, prefix, "roots", loop.name))
    parts.append(roots_table(loop))
    return Section("roots", "Its characteristic roots", parts)


def chart_ranges(loop: Loop) -> dict[str, tuple[float, float]] | None:
    """Two parameters to draw the chart over: one of a delay first, if there is one, and a gain."""
    late = {
        symbol
        for block in loop.diagram.blocks
        for delay in block.expr.atoms(sp.exp)
        for symbol in delay.free_symbols
    }
    usable = [name for name, value in loop.values.items() if value]
    delays = [name for name in usable if loop.diagram.parameters[name] in late]
    others = [name for name in usable if name not in delays]
    chosen = [*others[:1], *delays[:1]] if delays and others else usable[:2]
    if len(chosen) < 2:
        return None
    ends = {name: sorted(share * loop.values[name] for share in SPREAD) for name in chosen}
    return {name: (low, high) for name, (low, high) in ends.items()}


def _chart(loop: Loop, prefix: str) -> list[Section]:
    ranges = chart_ranges(loop)
    if ranges is None:
        return []
    chart = _of(lambda: loop.system.stability_chart(ranges, grid=GRID))
    if chart is not None and np.isinf(chart.unstable).any():
        chart = _of(lambda: loop.system.stability_chart(ranges, grid=FINE))
    if chart is None:
        return []
    here = (loop.values[chart.x_name], loop.values[chart.y_name])
    text = (
        f"Over {chart.x_name} and {chart.y_name} in SI units, all else as it is; the dot is this "
        f"loop, {here[0]:g} and {here[1]:g}."
    )
    drawn_chart = figure(plots.stability_chart(chart, here=here), prefix, "chart", loop.name)
    return [Section("chart", "Where it is stable", [text, drawn_chart])]


def _models(loop: Loop, opened: Any, prefix: str) -> list[Section]:
    parts: list[Part] = []
    if opened is not None and any(block.delays for block in loop.system.blocks):
        errors = _of(lambda: plots.pade(opened, PADE))
        if errors is not None:
            parts.append(figure(errors, prefix, "pade", loop.name))
    if loop.sampled is not None:
        twin = loop.sampled
        shown = _of(lambda: plots.pole_map(twin, names=[f"{loop.name}, sampled"]))
        if shown is not None:
            parts.append(figure(shown, prefix, "twin", loop.name))
        largest = np.abs(twin.poles(1))
        text = "stable" if twin.is_stable else "unstable"
        parts.append(
            f"As sampled it is {text}: its largest pole has modulus {float(largest[0]):.5g}."
        )
    return _appendix("models", "Padé models and the sampled twin", parts)


def _check(loop: Loop) -> list[Section]:
    found = _of(loop.system.check)
    if found is None:
        return []
    parts: list[Part] = [
        "They agree." if found.passed else "SOME DISAGREE: see the table.",
        Verbatim("The faces of this loop, each by its own way", str(found)),
    ]
    return _appendix("check", "Every face against every other", parts)


def _appendix(anchor: str, title: str, parts: list[Part]) -> list[Section]:
    return [Section(anchor, title, parts, appendix=True)] if parts else []


def _data(loop: Loop, margins: Margins | None, own: Limits | None) -> dict[str, Any]:
    poles = loop.system.poles(6)
    return {
        "parameters": {name: float(value) for name, value in loop.values.items()},
        "unstable_roots": plain(loop.system.unstable_roots),
        "rightmost_roots_rad_s": [[float(p.real), float(p.imag)] for p in poles],
        "margins": None if margins is None else plain(margins),
        "sampled_margins": None if own is None or own.period is None else plain(own.margins),
        "sampled_stable": None if loop.sampled is None else loop.sampled.is_stable,
    }
