"""One run of the simulator in four panels, and any figure as the bytes of a file."""

from __future__ import annotations

import io
import re
import textwrap
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.report.plots.style import EXACT, INK, STYLE, WITH, WITHOUT, drawing, label, takes
from vsctrl.servo import Gantry, Run
from vsctrl.servo.results.columns import measured_in_pixels
from vsctrl.servo.results.outcome import distance, notice, outcome, side, swings
from vsctrl.tables import visible

#: What a figure can be written as.
SUFFIXES = (".png", ".svg", ".pdf")
#: x, y, z of twists and lags: the same three colours everywhere.
AXES = (EXACT, WITH, WITHOUT)
#: Half heights below which a panel would magnify rounding, in the panel's unit (px, mm, mrad, …).
LEAST = 0.1
#: A diverged run is drawn on a logarithmic scale once it grows by more than this factor.
GROWTH = 100.0


@takes(Run)
def run_figure(run: Run) -> Figure:
    """Image plane, errors, twist and lag of a run, with a caption that says what to notice.

    Of a gantry its joints too.

    >>> figure = vs.plots.run_figure(vs.simulate(vs.paper.sliding()))
    >>> figure.alt[:61]
    'A run: its points in the image, errors, twist and lag. The ca'
    """
    joints = run.joints is not None
    with drawing(9.6, 9.8 if joints else 7.6) as figure:
        rows = (1, 1, 0.55) if joints else (1, 1)
        how: Any = {"width_ratios": (1, 1.15), "height_ratios": rows, "hspace": 0.06}
        grid = figure.add_gridspec(len(rows), 2, **how)
        image_plane(figure.add_subplot(grid[0, 0]), run)
        _errors(figure.add_subplot(grid[0, 1]), run)
        _twist(figure, grid[1, 0], run)
        _lag(figure, grid[1, 1], run)
        if joints:
            _joints(figure.add_subplot(grid[2, :]), run)
        summary = outcome(run)
        words = " ".join([notice(summary), *(event.sentence for event in run.events)])
        # Dollar signs would start a formula.
        name = f"{visible(run.scenario.name)} ({run.scenario.digest})".replace("$", r"\$")
        figure.suptitle(textwrap.shorten(name, 90), x=0.01, ha="left", fontsize=11)
        caption = _balanced(textwrap.shorten(words.replace("$", r"\$"), 420), 118)
        figure.supxlabel(caption, x=0.01, ha="left", fontsize=9.5)
        panels = "errors, twist, lag and joints" if joints else "errors, twist and lag"
        figure.alt = f"A run: its points in the image, {panels}. {visible(words)}"
    return figure


def _balanced(words: str, most: int) -> str:
    """The words on as few lines as they need, equally long; a number keeps its unit."""
    bound = re.sub(r"(?<=\d) (?=\w)", "\u00a0", words)
    lines = len(textwrap.wrap(bound, most))
    for width in range(len(bound) // max(1, lines), most):
        if len(textwrap.wrap(bound, max(1, width))) == lines:
            most = max(1, width)
            break
    return textwrap.fill(bound, most).replace("\u00a0", " ")


def picture(figure: Figure, suffix: str) -> bytes:
    """The figure as a PNG, SVG or PDF file, by suffix; the same bytes for the same figure.

    >>> figure = vs.plot(vs.figure1)
    >>> vs.plots.picture(figure, ".svg")[:5]
    b'<?xml'
    """
    if suffix not in SUFFIXES:
        raise InputError(f"{suffix}: figures are written as {', '.join(SUFFIXES)}; choose one.")
    dateless: dict[str, Any] = {
        ".png": {"Software": None},
        ".svg": {"Date": None, "Creator": None},
        ".pdf": {"CreationDate": None},
    }
    out = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(out, format=suffix[1:], dpi=160, metadata=dateless[suffix])
    return out.getvalue()


def image_plane(
    axes: Axes, run: Run, *, paths: bool = True, within: NDArray[np.bool_] | None = None
) -> None:
    """Paths of the points and of their references in the image, y downwards, in px.

    The image is drawn as a rectangle where the camera has a size. Points that it does not show
    leave gaps in their paths. paths: False leaves everything that moves to the caller. within:
    (n,), the frames that a camera without a size has to show.
    """
    shown, goal = (e.reshape(len(run.t), -1, 2) for e in (run.features, run.reference))
    size = run.scenario.camera.size_px
    if size is not None:
        corner = (-size[0] / 2, -size[1] / 2)
        axes.add_patch(Rectangle(corner, *size, fill=False, edgecolor=INK, linewidth=0.8))
    if paths:
        seen = np.where(run.visible[..., None], shown, np.nan)
        axes.plot(seen[..., 0], seen[..., 1], color=WITH, linewidth=2, label="path")
        axes.plot(
            goal[..., 0], goal[..., 1], color=INK, linestyle="--", linewidth=0.8, label="reference"
        )
        first, last = shown[0, run.visible[0]], shown[-1, run.visible[-1]]
        axes.plot(*first.T, "o", color=WITH, mfc="none", markersize=5, label="start")
        axes.plot(*last.T, "o", color=WITH, markersize=5, label="end")
        axes.plot(*goal[-1].T, "x", color=INK, markersize=7, label="reference's end")
    low, high = _image_limits(run, shown, goal, within)
    axes.set(aspect="equal", adjustable="datalim", title="image plane")
    axes.set(xlabel="X, px", ylabel="Y, px")
    # Not fixed, since equal scales widen one of them, and never narrow what holds data.
    axes.update_datalim([low, high])
    axes.set_xlim(low[0], high[0], auto=True)
    axes.set_ylim(high[1], low[1], auto=True)
    if paths:
        entries = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
        axes.legend(
            entries.values(),
            entries.keys(),
            loc="upper left",
            bbox_to_anchor=(-0.02, -0.16),
            ncols=5,
            columnspacing=1.0,
            handlelength=1.4,
            handletextpad=0.5,
            borderaxespad=0,
        )


def _image_limits(
    run: Run, shown: Array, goal: Array, within: NDArray[np.bool_] | None
) -> tuple[Array, Array]:
    """The camera's image, or all that is seen and asked for, with a margin."""
    size = run.scenario.camera.size_px
    if size is not None:
        half = 0.53 * np.array(size)
        return -half, half
    counts = run.visible if within is None else run.visible & within[:, None]
    every = np.concatenate([goal.reshape(-1, 2), shown[counts]])
    low, high = every.min(axis=0), every.max(axis=0)
    middle, half = low / 2 + high / 2, np.maximum(0.56 * (high - low), LEAST)
    return middle - half, middle + half


def _errors(axes: Axes, run: Run) -> None:
    true, seen = (np.linalg.norm(e, axis=1) for e in (run.error, run.measured_error))
    axes.plot(run.t, true, color=WITH, label="true, s − s*")
    here, name = axes, "as the law was shown"
    if not measured_in_pixels(run.scenario):
        here = axes.twinx()
        here.spines.right.set_visible(True)
        here.grid(False)
        law = run.scenario.law
        what = "the pose" if law.scheme == "pose" else law.features
        here.set_ylabel(f"error of {what}", color=WITHOUT)
        name += " (right)"
    here.plot(run.t, seen, color=WITHOUT, linestyle=(0, (4, 2)), label=name)
    axes.set(title="image error", ylabel="its norm, px")
    handles, labels = axes.get_legend_handles_labels()
    if here is not axes:
        more, names = here.get_legend_handles_labels()
        handles, labels = handles + more, labels + names
        _scale(here, run, seen, zero=True)
    _scale(axes, run, np.column_stack([true, seen]) if here is axes else true, zero=True)
    _legend_above(axes, 2, handles, labels)
    _time(axes, run)


def _twist(figure: Figure, cell: Any, run: Run) -> None:
    top, bottom = _stacked(figure, cell)
    for axes, part, letter in ((top, slice(0, 3), "V"), (bottom, slice(3, 6), "Ω")):
        values = run.twist[:, part]
        large = np.abs(values).max() >= 2
        scale, unit = (1.0, "") if large else (1e3, "m")
        for values_i, colour, name in zip(scale * values.T, AXES, "xyz", strict=True):
            # The twist of a frame is held until the next one.
            axes.step(run.t, values_i, where="post", color=colour, label=f"{letter}{name}")
        axes.set_ylabel(f"{unit}{'m' if letter == 'V' else 'rad'}/s")
        _scale(axes, run, scale * values)
        _legend_above(axes, 3)
    top.set_title("twist of the camera")
    _time(bottom, run)


def _stacked(figure: Figure, cell: Any) -> tuple[Axes, Axes]:
    """Two axes, one above the other, over one axis of time."""
    grid = cell.subgridspec(2, 1)
    top = figure.add_subplot(grid[0])
    top.tick_params(labelbottom=False)
    return top, figure.add_subplot(grid[1], sharex=top)


def _lag(figure: Figure, cell: Any, run: Run) -> None:
    top, bottom = _stacked(figure, cell)
    away = 1e3 * distance(run)
    shown = [away]
    try:
        along = 1e3 * run.lag_along_motion
    except InputError:
        top.set_title("lag")
    else:
        shown.append(along)
        top.plot(run.t, along, color=EXACT, label="along the motion (+ ahead)")
        top.set_title("lag")
        words, lag = side(along[-1]), outcome(run).along
        if run.status.complete and words and lag is not None and not swings(lag):
            # In the middle between the curve and 0, where neither is.
            middle: Any = (run.t[-1], along[-1] / 2)
            place: Any = {"ha": "right", "va": "center", "color": EXACT}
            label(top, f"{abs(along[-1]):.3g} mm {words}", middle, (-3, 0), **place)
    top.plot(run.t, away, color=INK, linewidth=1.0, linestyle=":", label="distance")
    top.axhline(0, color=INK, linewidth=0.8)
    top.set_ylabel("mm")
    _scale(top, run, np.column_stack(shown), zero=len(shown) == 1)
    _legend_above(top, 2)
    angle = 1e3 * np.linalg.norm(run.lag[:, 3:], axis=1)
    bottom.plot(run.t, angle, color=WITHOUT, label="angle to the reference")
    bottom.set_ylabel("mrad")
    _legend_above(bottom, 1)
    _scale(bottom, run, angle, zero=True)
    _time(bottom, run)


def _joints(axes: Axes, run: Run) -> None:
    """Where each joint of the gantry is in its range: 0 and 100 % are its ends."""
    assert run.joints is not None
    gantry = Gantry()
    share = 100 * (run.joints - gantry.lower) / (gantry.upper - gantry.lower)
    for k, values in enumerate(share.T):
        kind, style = ("slide", "-") if k < 3 else ("wrist", (0, (4, 2)))
        how: Any = {"color": AXES[k % 3], "linestyle": style}
        axes.plot(run.t, values, label=f"{k + 1}, {kind}", **how)
    for end in (0, 100):
        axes.axhline(end, color=INK, linewidth=0.8)
    axes.set(title="joints of the gantry", ylabel="share of the range, %", ylim=(-8, 108))
    axes.set_yticks((0, 25, 50, 75, 100))
    _legend_above(axes, 6)
    _time(axes, run)


def _legend_above(axes: Axes, columns: int, *entries: Any) -> None:
    """Beside the title, where no curve can be; entries: handles and labels if not all."""
    axes.legend(
        *entries,
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=columns,
        columnspacing=1.0,
        handlelength=1.4,
        borderaxespad=0.1,
    )


def _time(axes: Axes, run: Run) -> None:
    axes.set_xlim(0, float(run.t[-1]) or run.scenario.vision.period)
    axes.set_xlabel("t, s")


def _scale(axes: Axes, run: Run, values: Array, *, zero: bool = False) -> None:
    """Limits that do not magnify rounding; logarithmic for a failed run that grows out of sight."""
    low, high = float(values.min()), float(values.max())
    size = np.abs(values).reshape(len(run.t), -1).max(axis=1)
    usual = float(np.median(size))
    if not run.status.complete and usual > LEAST and size.max() > GROWTH * usual:
        if zero:
            axes.set_yscale("log")
            axes.set_ylim(bottom=max(float(size[size > 0].min()), 1e-3 * usual))
        else:
            axes.set_yscale("symlog", linthresh=usual)
            axes.yaxis.get_major_locator().set_params(numticks=5)  # type: ignore[call-arg]
        return
    low, high = (0.0, max(high, LEAST)) if zero else (min(low, -LEAST), max(high, LEAST))
    axes.set_ylim(low - (0 if zero else 0.08 * (high - low)), high + 0.12 * (high - low))
