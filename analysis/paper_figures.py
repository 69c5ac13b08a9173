"""Figures 5 to 11 of the paper, drawn anew: each clean, and as a bench might have measured it.

Run it with ``python analysis/paper_figures.py [OUT]``; it writes every figure as SVG and PNG into
OUT (``report/paper`` if not given), with ``index.html``, which shows them with captions and with
what became of the paper's statements about each.
"""

import io
import sys
from pathlib import Path
from typing import NamedTuple

import jinja2
import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

import vsctrl as vs
from vsctrl.files import write_all
from vsctrl.report import plots
from vsctrl.study.statements import Bench, Pair, Traces
from vsctrl.study.statements.runs import DEPTH_RATIO, FAR, FOCAL_RATIO, NOISE_PX, sideways, size

SEED = 3  #: of start and noise in all that is as measured
DPI = 200

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Trajectory generation by visual servoing: figures 5 to 11, drawn anew</title>
<style>
:root {
  color-scheme: light dark;
  --paper: #fdfdfb; --ink: #1c2330; --soft: #5c6472; --rule: #d9dbe0;
  --confirmed: #1b7f5c; --refuted: #b3261e; --depends: #8a5d00;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171c; --ink: #e4e6ea; --soft: #9aa3b0; --rule: #333944;
    --confirmed: #4fc79b; --refuted: #ff8a80; --depends: #e0b24a;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 62rem;
  background: var(--paper); color: var(--ink);
  font: 16px/1.5 "Source Serif 4", Charter, Georgia, "Times New Roman", serif;
}
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 {
  font-size: 1.25rem; margin: 3rem 0 .5rem; padding-top: .75rem;
  border-top: 1px solid var(--rule);
}
p, figcaption, li { max-width: 46rem; }
figure { margin: 1rem 0; }
figure svg { display: block; max-width: 100%; height: auto; }
figcaption { margin-top: .6rem; }
.soft, ul { color: var(--soft); font-size: .92rem; }
ul { padding-left: 1.1rem; } li { margin: .35rem 0; }
.confirmed { color: var(--confirmed); } .refuted { color: var(--refuted); }
.depends { color: var(--depends); }
@media print { body { max-width: none; } figure, ul { break-inside: avoid; } }
</style>
</head>
<body>
<h1>Figures 5 to 11 of the paper, drawn anew</h1>
<p>Berry, Martinet and Gallice, <i>Trajectory generation by visual servoing</i> (1997): the same
experiments in a simulator with six degrees of freedom, the image 80 ms late. Left they are clean:
the start is on the reference, the depths are right, nothing is noisy. Right they are what a bench
might show: {{ bench }}. The paper prints neither errors nor starts, so the shapes can be compared
with its figures, not the values.</p>
<p class="soft">{{ summary }} The others are in the report
(<code>vsctrl report</code>) and in <code>vs.study.statements()</code>.</p>
{% for picture, svg, found in pictures %}
<h2>Figure {{ picture.number }}: {{ picture.title }}</h2>
<figure>
{{ svg }}
<figcaption>{{ picture.caption }}</figcaption>
</figure>
{% if found %}
<ul>
{% for row in found %}
<li>The paper: {{ row.says }}. <span class="{{ row.verdict }}">{{ row.verdict|capitalize }}</span>
({% for case in row.cases %}{{ row.shown(case) }}{{ "; " if not loop.last }}{% endfor %}).</li>
{% endfor %}
</ul>
{% endif %}
{% endfor %}
</body>
</html>
"""


class Picture(NamedTuple):
    """One figure of the paper: its number, what it shows, what to notice, and the drawing."""

    number: int
    title: str
    caption: str
    figure: Figure

    @property
    def name(self) -> str:
        """The name of its files, without what tells their format."""
        return f"figure-{self.number:02d}"


def main(out: Path | None = None) -> list[Path]:
    """Simulate, draw and write all figures and their page; the paths written, the page last."""
    pictures = draw()
    found = vs.study.statements()
    folder = out or Path("report/paper")
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for picture in pictures:
        for kind in ("svg", "png"):
            path = folder / f"{picture.name}.{kind}"
            write_all({path: encoded(picture.figure, kind)})
            written.append(path)
    page = folder / "index.html"
    write_all({page: text(pictures, found)})
    for picture in pictures:
        print(f"Figure {picture.number}: {picture.caption}\n")
    return [*written, page]


def draw() -> list[Picture]:
    """All figures from one set of runs."""
    bench = Bench()
    slide = bench.traces(vs.paper.sliding(), SEED)
    oscillation = bench.traces(vs.paper.oscillation(), SEED, FAR)
    rotation = bench.traces(vs.paper.rotation(), SEED)
    slide_path, rotation_path = of_path(slide, "slide"), of_path(rotation, "rotation")
    first, shifts, turns = (
        of_first_point(oscillation.clean),
        of_translation(rotation.clean),
        of_rotation(rotation),
    )
    E_slide, E_oscillation = (plots.error_traces(traces) for traces in (slide, oscillation))
    V, Omega = (plots.velocities(rotation, rotation=which) for which in (False, True))
    pictures = [
        Picture(5, "the error of the slide", of_slide(slide), E_slide),
        Picture(6, "top view of the slide", slide_path, plots.paths(slide)),
        Picture(7, "the error of the oscillation", of_oscillation(oscillation), E_oscillation),
        Picture(8, "X1 and its reference", first, plots.first_point(oscillation)),
        Picture(9, "top view of the rotation", rotation_path, plots.paths(rotation)),
        Picture(10, "translation velocity", shifts, V),
        Picture(11, "rotation velocity", turns, Omega),
    ]
    for picture in pictures:  # laid out once, for all formats
        with mpl.rc_context(plots.STYLE):
            picture.figure.draw_without_rendering()
        picture.figure.set_layout_engine("none")
    return pictures


def of_slide(traces: Traces) -> str:
    """What to notice in figure 5."""
    on, off = traces.clean
    true, seen = (
        [float(size(error)[-1]) for error in errors]
        for errors in ((on.error, off.error), (on.measured_error, off.measured_error))
    )
    return (
        f"E over the four points of the slide at λ = {on.scenario.law.lam:g} s⁻¹, with and without "
        "the derivative term. Solid is the truth, dotted what the law is shown. Notice that the "
        f"measured error flatters the term: with it {seen[0]:.1f} px are seen and {true[0]:.1f} px "
        f"are there; without, {seen[1]:.1f} px are seen and {true[1]:.1f} px are there. The "
        "transients last equally long."
    )


def of_path(traces: Traces, name: str) -> str:
    """What to notice in figures 6 and 9."""
    lags = [1e3 * float(run.lag_along_motion[-1]) for run in traces.clean]
    across = [1e3 * float(np.abs(sideways(run)[run.t > 3]).max()) for run in traces.measured]
    return (
        f"The {name} from above: left to scale, with the directions in which the reference looks; "
        "above the paths with z enlarged, a cross where the reference ends and dots where the "
        "cameras do; below the distances along the path (solid) and across it (dashed). Notice "
        "that the paths coincide while the cameras do not: after the transient none is more than "
        f"{max(across):.1f} mm beside the path, yet the one without the derivative term is "
        f"{-lags[1]:.1f} mm late, the one with it {lags[0]:.1f} mm early. A top view cannot show "
        "that."
    )


def of_oscillation(traces: Traces) -> str:
    """What to notice in figure 7."""
    on, off = traces.clean
    ends = [float(size(run.error)[-1]) for run in (on, off)]
    start = float(size(traces.measured.on.error)[0])
    return (
        f"E of the oscillation, ±0.15 m at λ = {on.scenario.law.lam:g} s⁻¹, as a triangle at "
        "4 cm/s: the waveform that gives the paper's static error. Every turn disturbs both laws "
        "for half a second. Notice that the true error with the term is "
        f"{ends[0]:.1f} px, against {ends[1]:.1f} px without it only {1 - ends[0] / ends[1]:.0%} "
        f"less, while the measured one vanishes. Right, the start at random is off the scale, at "
        f"{start:.0f} px."
    )


def of_first_point(pair: Pair) -> str:
    """What to notice in figure 8."""
    errors = [float(np.abs(run.error[run.t > 28, 0]).max()) for run in pair]
    swing = float(np.ptp(pair.on.reference[:, 0])) / 2
    return (
        "The abscissa of the first LED and its reference (above), and their difference (below). "
        f"At the scale of the motion, ±{swing:.0f} px, either law seems to track. Notice below "
        f"that the error without the term is a static {errors[1]:.1f} px, always behind, and with "
        f"it {errors[0]:.1f} px, always ahead: the sign tells them apart, which E cannot."
    )


def of_translation(pair: Pair) -> str:
    """What to notice in figure 10."""
    Vx = [1e3 * run.twist[:, 0] for run in pair]
    least = min(float(V.min()) for V in Vx)
    return (
        "Translation velocity of the camera in its own frame during the rotation. Only Vx is "
        f"asked for, {minus(Vx[0][-1], 0)} mm/s: −ω d, against the sign of V = ω r̃ d in the "
        "paper. Notice that with the derivative term it is there from the first frame, then "
        f"overshoots to {minus(least, 1)} mm/s because feedback has not yet seen the camera move; "
        "without the term it rises with the error. Right, the noise of the image is most of what "
        "is left."
    )


def of_rotation(traces: Traces) -> str:
    """What to notice in figure 11."""
    on = traces.clean.on
    peak = 1e3 * float(on.twist[:, 4].max())
    late = on.t > 3
    noise = 1e3 * traces.measured.on.twist[late, 3:].std(axis=0)
    return (
        "Rotation velocity of the same runs: Ωy is the 40 mrad/s of the reference, reached at once "
        f"with the derivative term (and passed, up to {peak:.0f} mrad/s). Notice right that noise "
        f"falls on Ωx and Ωy, {noise[0]:.1f} and {noise[1]:.1f} mrad/s, far more than on Ωz, "
        f"{noise[2]:.1f} mrad/s: from the front a turn looks like a shift."
    )


def minus(value: float, digits: int) -> str:
    """A number with a real minus."""
    return f"{value:.{digits}f}".replace("-", "−")


def text(pictures: list[Picture], found: vs.study.Statements) -> str:
    """The page: figures in place, all text escaped, no script."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    shown = [
        (
            picture,
            Markup(plots.to_svg(picture.figure, f"Figure {picture.number}", picture.name)),
            found.figure(picture.number),
        )
        for picture in pictures
    ]
    return environment.from_string(PAGE).render(
        pictures=shown,
        summary=found.summary,
        bench=f"depths {1 - DEPTH_RATIO:.0%} too small and the focal length "
        f"{FOCAL_RATIO - 1:.0%} too large in L̂, {NOISE_PX:g} px of noise in every "
        f"coordinate, a start beside the reference (seed {SEED})",
    )


def encoded(figure: Figure, kind: str) -> bytes:
    """A figure as a file on white, the same bytes for the same runs."""
    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else {"Software": None}
    with mpl.rc_context(plots.STYLE):
        figure.savefig(buffer, format=kind, dpi=DPI, facecolor="white", metadata=metadata)
    return buffer.getvalue()


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)[-1])
