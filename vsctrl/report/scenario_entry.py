"""A scenario on a page: its verdict, how it arrives or lags, its run, its loop, and its file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from vsctrl import loop
from vsctrl.derive import ledger
from vsctrl.report import plots
from vsctrl.report.explorer.explorer import figure_1_explorer
from vsctrl.report.figure_1 import figure_1_sections, gain_readings
from vsctrl.report.figures import figure
from vsctrl.report.loop_sections import loop_sections
from vsctrl.report.rendering import fragment
from vsctrl.report.section import Entry, Part, Section, Table, Verbatim
from vsctrl.report.tiles import scenario_tiles
from vsctrl.report.verdict import verdict
from vsctrl.report.wording import digits, length, listed
from vsctrl.servo import Run, Scenario
from vsctrl.study.examination.examination import (
    Examination,
    examination,
    examination_of_run,
)
from vsctrl.study.examination.positioning import Arrival, Positioning
from vsctrl.study.statements import about as statements_about

A_LOOP = 100.0  #: times the length of its line, from which on a path returns to where it began

PLACES = {
    "measurement": "in the measurement",
    "aligned": "in the measurement, reference aligned with it",
    "actuator": "in the actuator",
}


def scenario_entry(
    scenario: Scenario, prefix: str, progress: Callable[[str], None] = lambda step: None
) -> Entry:
    """All that is known of a scenario; `prefix` keeps the ids of figures on one page apart."""
    x = examination(scenario, progress)
    progress("page and figures")
    return _entry(x, "scenario", prefix)


def run_entry(run: Run, prefix: str, progress: Callable[[str], None] = lambda step: None) -> Entry:
    """The same of a run that there is already: it is judged, and no other one is made."""
    x = examination_of_run(run, progress)
    progress("page and figures")
    return _entry(x, "run", prefix)


def _entry(x: Examination, kind: str, prefix: str) -> Entry:
    scenario = x.scenario
    return Entry(
        kind=kind,
        name=scenario.name,
        about=_about(scenario),
        verdict=verdict(x),
        tiles=scenario_tiles(x),
        sections=[
            *_positioning(x, prefix),
            *(_explorer(scenario, prefix) if x.figure_1 else []),
            *(figure_1_sections(x.figure_1, prefix) if x.figure_1 else _own_loop(x, prefix)),
            Section(
                "file",
                "The scenario",
                [Verbatim("TOML, ready to save and edit", scenario.to_toml())],
                appendix=True,
            ),
        ],
        paper=_paper(x) if kind == "scenario" else (),
        data=_data(x),
        source=x,
        note=f"Scenario {scenario.digest}, seed {scenario.vision.seed}.",
    )


def _explorer(scenario: Scenario, prefix: str) -> list[Section]:
    moved = figure_1_explorer(loop.of(scenario), scenario.law.placement, f"{prefix}-explorer")
    return [] if moved is None else [Section("move", "Move its numbers", [moved])]


def _about(scenario: Scenario) -> str:
    law, vision, calibration = scenario.law, scenario.vision, scenario.calibration
    text = f"{scenario.description}. " if scenario.description else ""
    text += (
        f"λ = {law.lam:g} s⁻¹, latency {1e3 * vision.latency:g} ms ({PLACES[law.placement]}), "
        f"k_ff = {law.k_ff:g}, video period {1e3 * vision.period:g} ms, depth ratio "
        f"{law.depth_ratio:g}"
    )
    return text + (
        f", focal ratio {calibration.focal_ratio:g}." if calibration.focal_ratio != 1 else "."
    )


def _data(x: Examination) -> dict[str, Any]:
    own = x.data()
    if x.figure_1 is not None:
        own["figure_1"] = {
            key: value for key, value in x.figure_1.data().items() if key != "scenario"
        }
    return own


# Positioning -------------------------------------------------------------------------------------
def _positioning(x: Examination, prefix: str) -> list[Section]:
    p = x.positioning
    if p is None:
        return []
    picture = figure(
        plots.arrival(x),
        prefix,
        "arrival",
        alt=f"Paths in the image and in space, and the decay of the error{_decay(p)}.",
        caption="From the start (dot) to the goal (cross); dotted is the straight line, the dots "
        "below are the linear loop. Notice whether the lines are parallel: then the errors die out "
        "as fast as theory says, and what lies between them is how far the start is from linear.",
    )
    rows = [_row(name, p.simulated, p.predicted, form) for name, form in ARRIVAL.items()]
    table = Table(("", "simulated", "linear loop"), rows, "How it arrives")
    bends: list[Part] = [
        f"In the image a point leaves its straight line by up to {digits(p.image_bend, 3)} px, its "
        f"path being {_longer(p.image_detour)}; in space the camera leaves its own by up to "
        f"{length(p.space_bend)}, its path being {_longer(p.space_detour)}."
        + (
            f" At the least {p.visible} of {p.points} points were in the image."
            if p.visible < p.points
            else ""
        )
    ]
    return [Section("arrival", "How it arrives", [picture, table, *bends])]


def _decay(p: Positioning) -> str:
    """The decay of the error, simulated and by the linear loop, where there is one."""
    of = {"simulated": p.simulated, "in the linear loop": p.predicted}
    found = [
        f"{digits(each.decay, 3)} s⁻¹ {name}" for name, each in of.items() if each and each.decay
    ]
    return f": {listed(found)}" if found else ""


def _longer(detour: float) -> str:
    """How much longer a path is than its straight line."""
    if detour < 1.0005:
        return "no longer"
    if detour < 2:
        return f"{digits(100 * (detour - 1), 2)} % longer"
    return f"{digits(detour, 3)} times as long" if detour < A_LOOP else "a loop"


ARRIVAL: dict[str, tuple[str, float, str]] = {
    "decay of the error": ("decay", 1.0, "s⁻¹"),
    "within 1 px for good after": ("to_image", 1.0, "s"),
    "within 1 mm for good after": ("to_space", 1.0, "s"),
    "overshoot": ("overshoot", 100.0, "%"),
    "greatest speed": ("peak_speed", 1e3, "mm/s"),
    "greatest rate of turn": ("peak_rate", 1e3, "mrad/s"),
}


def _row(
    name: str, simulated: Arrival, predicted: Arrival | None, form: tuple[str, float, str]
) -> tuple[str, str, str]:
    key, factor, unit = form

    def shown(arrival: Arrival | None) -> str:
        value = None if arrival is None else getattr(arrival, key)
        return "–" if value is None else f"{digits(factor * value, 4)} {unit}"

    return name, shown(simulated), shown(predicted)


# The run and the loop ----------------------------------------------------------------------------
def _own_loop(x: Examination, prefix: str) -> list[Section]:
    """The run as configured, held to its linear loop, and that loop."""
    alt = "The run: image, errors, twist and lag over time."
    run: list[Part] = [
        figure(plots.run_figure(x.run), prefix, "own", alt=alt),
        Verbatim("The run in numbers", str(x.outcome)),
    ]
    sections = [Section("run", "The run as configured", run)]
    if x.loop is None:
        return sections
    if x.predicted is not None and x.positioning is None:
        sections.append(_prediction(x, prefix))
    return [*sections, *loop_sections(x.loop, prefix)]


def _prediction(x: Examination, prefix: str) -> Section:
    assert x.loop is not None and x.predicted is not None
    n = len(x.predicted)
    apart = np.linalg.norm(x.run.lag[:n, :3] - x.predicted[:, :3], axis=1)
    text = (
        f"Over all {n} frames the run is at most {length(float(apart.max()))} from the linear loop"
        f"{'' if x.difference is None else f', in the last quarter {length(x.difference)}'}."
    )
    parts: list[Part] = [
        figure(
            plots.predicted_lag(x),
            prefix,
            "lag",
            alt=f"Lag of the run and of the linear loop: {text}",
            caption="The lag of the camera: lines are the run in six degrees of freedom, dots the "
            "linear loop below, frame by frame. Where they part, something that is not linear "
            "acts.",
        ),
        text,
    ]
    lag = x.loop.steady_lag
    if lag is not None and x.scenario.motion.kind != "hold":
        parts.append(_steady(x, lag))
    return Section("prediction", "The run against its linear loop", parts)


def _steady(x: Examination, lag: Any) -> Table:
    n = max(1, len(x.run.t) // 4)
    mean = x.run.lag[-n:].mean(axis=0)
    names = ("x, mm", "y, mm", "z, mm", "about x, mrad", "about y, mrad", "about z, mrad")
    rows = [
        (name, f"{1e3 * a:+.4f}".replace("-", "−"), f"{1e3 * b:+.4f}".replace("-", "−"))
        for name, a, b in zip(names, lag, mean, strict=True)
    ]
    return Table(("along", "linear loop", "run, last quarter"), rows, "Steady lag")


# The paper ---------------------------------------------------------------------------------------
def _paper(x: Examination) -> list[Section]:
    """What the paper says of its own experiments and in its equations; nothing of other ones."""
    scenario = x.scenario
    rows = statements_about(scenario)
    if not len(rows):
        return []
    latency_ms = 1e3 * scenario.vision.latency
    said = fragment("paper/statements.html", statements=rows, latency_ms=latency_ms)
    claims = ledger()
    counts = Counter(claim.status for claim in claims)
    return [
        Section("statements", "What the paper says of its experiments", [said]),
        *([gain_readings(x.figure_1)] if x.figure_1 is not None else []),
        Section(
            "ledger",
            "The paper, statement by statement",
            [fragment("paper/ledger.html", claims=claims, counts=counts)],
        ),
    ]
