"""Any other result on a page: its figure, its table, and whether it agrees with itself."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from vsctrl.errors import InputError
from vsctrl.report import plots
from vsctrl.report.figures import figure
from vsctrl.report.section import Entry, Part, Section, Verbatim, Verdict

#: What a page calls them, by the names of their types.
KINDS = {
    "Comparison": "comparison",
    "Validation": "validation",
    "Remedies": "remedies",
    "StabilityChart": "stability chart",
    "SineResponse": "measured frequency response",
}


def result_entry(x: Any, prefix: str) -> Entry:
    """A comparison, a validation, remedies, a chart: as they are drawn and printed elsewhere."""
    kind = KINDS[type(x).__name__]
    parts: list[Part] = []
    try:
        parts.append(figure(plots.plot(x), prefix, "figure"))
    except InputError as error:
        parts.append(str(error))
    shown = getattr(x, "_repr_html_", None)
    parts.append(Markup(shown()) if shown is not None else Verbatim("In numbers", str(x)))
    scenario = getattr(x, "scenario", None)
    name = kind if scenario is None else f"{kind} of {scenario.name}"
    return Entry(
        kind=kind,
        name=name,
        about="" if scenario is None else scenario.description,
        verdict=_verdict(x),
        sections=[Section("result", kind.capitalize(), parts)],
        data=x.data(),
        source=x,
    )


def _verdict(x: Any) -> Verdict:
    agrees = getattr(x, "agrees", None)
    if agrees is None:
        return Verdict(None, (getattr(x, "sentence", "") or "Nothing is judged here.",))
    if agrees:
        return Verdict("good", ("All ways agree.",))
    return Verdict("warning", ("Some ways disagree: see the table.",))
