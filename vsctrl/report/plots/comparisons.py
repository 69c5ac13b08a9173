"""Theory and simulation side by side: the steady lags, sines or histories of a comparison."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vsctrl.errors import InputError
from vsctrl.report.plots.canvas import LETTERS, NOTEBOOK, Size, canvas, legend, say
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.style import EXACT, GREY, INK, PADE, WITH, WITHOUT
from vsctrl.report.wording import length
from vsctrl.study import Comparison, Validation

ROW = 0.3  #: inches a case
LEAST, MOST = 1e-6, 10.0  #: shares of what is allowed that are told apart
WAYS = (
    ("analytic", "closed form", "|", INK),
    ("pade", "Padé", "s", PADE[4]),
    ("exact", "exact delay", "D", EXACT),
    ("sampled", "sampled loop", "^", WITH),
    ("simulated", "6-DOF simulation", "o", WITHOUT),
)


def comparison(result: Any, *, ax: Any = None, size: Size = None) -> Figure:
    """What each way says of the lag, case by case, in mm; a history where there is one only.

    ``comparison(vs.validate(scenario))``: of a constant twist or a triangle the steady lag,
    negative = behind; of a sine the amplitude of the error; else the lag over time. ax: axes of
    yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for a comparison that holds no case.

    >>> figure = vs.plots.comparison(vs.validate(vs.paper.sliding()))
    >>> figure.alt
    'The lag of 8 cases by closed form, models and simulation.'
    """
    rows: Any = result.rows or result.waves
    if not rows:
        return _histories(result, ax, size)
    usual = (NOTEBOOK[0], 1.6 + ROW * len(rows))
    with canvas(ax, size, usual) as (figure, (axes,)):
        y = np.arange(len(rows))[::-1]
        for field, name, marker, colour in WAYS:
            values: list[Any] = [getattr(row, field, None) for row in rows]
            known = [k for k, value in enumerate(values) if value is not None]
            if known:
                mm = [1e3 * (values[k] if result.rows else abs(values[k])) for k in known]
                style: Any = {"color": colour, "mfc": "none", "linestyle": "", "label": name}
                style |= {"markersize": 14 if marker == "|" else 7, "markeredgewidth": 1.5}
                axes.plot(mm, y[known], marker, **style)
        letters = int(0.42 * LETTERS * figure.get_figwidth())
        axes.set_yticks(y, [textwrap.fill(row.case, letters) for row in rows], fontsize=8)
        axes.set_ylim(-0.6, len(rows) - 0.4)
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.grid(visible=False, axis="y")
        steady = bool(result.rows)
        axes.set_xlabel("steady lag, mm (negative: behind)" if steady else "amplitude, mm")
        legend(figure, axes)
        words = {True: "All ways agree", False: "The ways DISAGREE", None: "Nothing to compare"}
        caption = words[result.agrees]
        if result.largest_disagreement is not None:
            caption += f"; they differ by {length(result.largest_disagreement)} at most"
        about = f"The lag of {len(rows)} cases by closed form, models and simulation."
        say(figure, axes, f"{caption}.", f"{caption}.", about, room=0.6)
    return figure


def validation(result: Validation, *, ax: Any = None, size: Size = None) -> Figure:
    """How far theory and simulation are apart in every row, as a share of what is allowed.

    ``validation(vs.validate_all(scenario))``; left of the line at 1 they agree. ax: axes of yours.
    size: (width, height), inches. Returns the figure, with `caption` and `alt`.

    >>> found = vs.validate_all(vs.paper.sliding())
    >>> len(vs.plots.validation(found).axes) > 1
    False
    """
    kinds = [
        (_spaced(type(part).__name__), [r for r in _rows(part) if r.agrees is not None])
        for part in result.parts
    ]
    kinds = [(kind, rows) for kind, rows in kinds if rows]
    with canvas(ax, size, (NOTEBOOK[0], 1.4 + 0.42 * len(kinds))) as (figure, (axes,)):
        parts = []
        for y, (kind, rows) in enumerate(reversed(kinds)):
            # Side by side rather than over each other, in the order of the table.
            place = y + np.linspace(0.28, -0.28, len(rows)) * (len(rows) > 1)
            for agrees, colour in ((True, WITH), (False, WITHOUT)):
                chosen = [k for k, row in enumerate(rows) if row.agrees is agrees]
                shares = [float(np.clip(_share(rows[k]), LEAST, MOST)) for k in chosen]
                axes.plot(shares, place[chosen], "o" if agrees else "X", color=colour, markersize=5)
            worst = max(rows, key=_share)
            parts.append(f"{kind} at most {short(100 * _share(worst))} % ({worst.case})")
        axes.set_xscale("log")
        axes.set_xlim(LEAST / 2, 2 * MOST)
        axes.axvline(1, color=INK, linewidth=1)
        names = [f"{kind}, {len(rows)} row{'s' * (len(rows) > 1)}" for kind, rows in kinds]
        axes.set_yticks(range(len(kinds)), reversed(names))
        axes.set_ylim(-0.6, len(kinds) - 0.4)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("difference of theory and simulation, over what is allowed")
        every = [row for _, rows in kinds for row in rows]
        words = f"{sum(row.agrees for row in every)} of {len(every)} rows agree."
        about = "Difference of theory and simulation in every experiment, over what is allowed."
        shares_said = f"Of what is allowed they differ by: {'; '.join(reversed(parts))}."
        say(figure, axes, words, f"{words} {shares_said}", about)
    return figure


def _rows(part: Any) -> Any:
    return part.rows or getattr(part, "waves", ())


def _share(row: Any) -> float:
    allowed = getattr(row, "allowed", None)
    allowed = row.tolerance if allowed is None else allowed
    difference = float(row.disagreement)
    return difference / allowed if allowed else float("inf") if difference else 0.0


def _spaced(name: str) -> str:
    """Words of a class's name."""
    return "".join(f" {c.lower()}" if c.isupper() else c for c in name).strip()


def _histories(result: Comparison, ax: Any, size: Size) -> Figure:
    chosen = result.own_histories or result.histories
    if not chosen:
        raise InputError(
            "plot: this comparison holds no case"
            + (f" ({result.note})" if result.note else "")
            + "; plot the run instead, vs.plot(vs.simulate(scenario))."
        )
    with canvas(ax, size, (NOTEBOOK[0], 3.8)) as (figure, (axes,)):
        axes.axhline(0, color=INK, linewidth=0.8)
        for each in chosen:
            colour, name = (WITH, "with") if each.feedforward else (WITHOUT, "without")
            axes.plot(each.t, 1e3 * each.predicted, color=colour, label=f"{name} feed-forward")
            n = len(each.simulated)
            dots = slice(None, None, max(1, n // 90) | 1)
            style: Any = {"color": colour, "mfc": "none", "markersize": 3.6}
            axes.plot(each.t[:n][dots], 1e3 * each.simulated[dots], "o", **style)
        axes.plot([], [], "o", color=GREY, mfc="none", markersize=3.6, label="6-DOF simulation")
        axes.set_xlabel("t, s")
        axes.set_ylabel("lag, mm")
        axes.set_xlim(0, float(max(each.t[-1] for each in chosen)))
        legend(figure, axes)
        largest = max(each.largest for each in chosen)
        words = f"The lag is at most {length(largest)}."
        say(figure, axes, words, words, "The lag over time, predicted and simulated.")
    return figure
