"""Pictures of runs: they show the run's own numbers, at any length and whatever became of it."""

import dataclasses
import math
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.report.plots import picture, run_figure
from vsctrl.report.plots.animation import animate, timing
from vsctrl.report.plots.style import WITH
from vsctrl.servo import Run, simulate
from vsctrl.servo.results.outcome import notice, outcome
from vsctrl.servo.results.status import Status

STILL = {"V": (0.0, 0.0, 0.0), "offset": (0.05, -0.03, 0.1, 0.1, -0.1, 0.3)}


def hidden() -> Run:
    """A run in which the image loses sight of two points for a while, and of one at the end."""
    run = simulate(paper.sliding().with_(size_px=(1000.0, 576.0)))
    visible = run.visible.copy()
    visible[50:90, :2] = False
    visible[-20:, 3] = False
    return dataclasses.replace(run, visible=visible)


def other_features() -> Run:
    run = simulate(paper.sliding())
    scenario = run.scenario.with_(features="segments")
    return dataclasses.replace(run, scenario=scenario, measured_error=run.measured_error[:, :3])


def one_frame() -> Run:
    run = simulate(paper.sliding())
    cut = {
        f.name: value[:1]
        for f in dataclasses.fields(Run)
        if isinstance(value := getattr(run, f.name), np.ndarray)
    }
    return dataclasses.replace(run, status=Status(False, "rank loss", 0, "It ended."), **cut)


RUNS = {
    "slide": lambda: simulate(paper.sliding()),
    "oscillation": lambda: simulate(paper.oscillation("sine", False)),
    "still": lambda: simulate(paper.sliding().with_(**STILL, noise_px=0.5)),
    "at rest": lambda: simulate(paper.sliding().with_(V=(0, 0, 0), duration=0.2)),
    "diverged": lambda: simulate(paper.sliding(lam=22.0)),
    "hidden": hidden,
    "other features": other_features,
    "one frame": one_frame,
    "lost": lambda: simulate(
        paper.sliding().with_(V=(0.12, 0, 0), duration=6.0, size_px=(768, 576), on_lost="continue")
    ),
    "pose": lambda: simulate(paper.sliding().with_(scheme="pose", noise_px=0.3, duration=1.0)),
}


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    return {name: make() for name, make in RUNS.items()}


@pytest.fixture(params=RUNS)
def run(request, runs) -> Run:
    return runs[request.param]


# The figure ------------------------------------------------------------------------------------
def lines(figure, title: str) -> dict[str, np.ndarray]:
    """The curves of the axes with this title, by label."""
    (axes,) = [a for a in figure.axes if a.get_title(loc="left") == title]
    return {line.get_label(): np.array(line.get_data()) for line in axes.get_lines()}


def test_the_figure_shows_the_run_s_own_numbers(runs):
    run = runs["slide"]
    figure = run_figure(run)
    error = lines(figure, "image error")
    np.testing.assert_allclose(error["true, s − s*"][1], np.sqrt((run.error**2).sum(axis=1)))
    seen = np.sqrt((run.measured_error**2).sum(axis=1))
    np.testing.assert_allclose(error["as the law was shown"][1], seen, atol=1e-12)
    lag = lines(figure, "lag")
    assert lag["along the motion (+ ahead)"][1][-1] == pytest.approx(3.2, abs=1e-9)
    np.testing.assert_allclose(lines(figure, "twist of the camera")["Vx"][1], 1e3 * run.twist[:, 0])
    image = next(a for a in figure.axes if a.get_title(loc="left") == "image plane")
    paths = [line.get_data() for line in image.get_lines() if line.get_label() == "path"]
    np.testing.assert_array_equal(paths[0], run.features[:, :2].T)
    assert image.get_ylim()[0] > image.get_ylim()[1]  # y of an image points downwards


@pytest.mark.parametrize(
    ("suffix", "head"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")]
)
def test_the_same_run_is_the_same_file_in_every_format(runs, suffix, head):
    data = picture(run_figure(runs["hidden"]), suffix)
    assert data.startswith(head) and len(data) < 500_000
    assert data == picture(run_figure(runs["hidden"]), suffix)


def test_every_axes_has_a_unit_and_sane_limits(run):
    figure = run_figure(run)
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert axes.get_ylabel()
        low, high = sorted(axes.get_ylim())
        assert np.isfinite([low, high]).all() and high - low > 0.05  # rounding is not magnified
        for line in axes.get_lines():
            values = np.array(line.get_ydata(), dtype=float)
            if axes.get_yscale() == "linear" and line.get_label() != "path" and values.size:
                assert np.nanmax(values) <= high + 1e-9 and np.nanmin(values) >= low - 1e-9


def test_hidden_points_leave_gaps_and_the_image_has_its_bounds(runs):
    figure = run_figure(runs["hidden"])
    image = next(a for a in figure.axes if a.get_title(loc="left") == "image plane")
    first, *_, last = [line for line in image.get_lines() if line.get_label() == "path"]
    assert np.isnan(first.get_ydata()[50:90]).all() and np.isfinite(first.get_ydata()[:50]).all()
    assert np.isnan(last.get_ydata()[-20:]).all()
    (rectangle,) = image.patches
    assert (rectangle.get_width(), rectangle.get_height()) == (1000, 576)
    ends = [line for line in image.get_lines() if line.get_label() == "end"]
    assert len(ends[0].get_xdata()) == 3


def test_an_error_of_other_features_has_an_axis_of_its_own(runs):
    figure = run_figure(runs["other features"])
    assert any("segments" in axes.get_ylabel() for axes in figure.axes)


def test_the_caption_says_what_to_notice(runs):
    words = {name: run_figure(run).get_supxlabel().replace("\n", " ") for name, run in runs.items()}
    assert "3.2 mm ahead of its reference" in words["slide"]
    assert "shown only 0 px" in words["slide"]
    assert "swings by ±" in words["oscillation"]  # no last sample of what comes and goes
    assert "mm from its reference" in words["still"]
    assert words["diverged"] == runs["diverged"].status.sentence
    assert "2 of 4 points" in words["hidden"]


def test_no_line_of_the_caption_is_a_word_or_begins_with_a_unit(run):
    caption = run_figure(run).get_supxlabel().split("\n")
    longest = max(map(len, caption))
    assert len(caption) == 1 or min(map(len, caption)) > longest / 2
    assert not any(re.match(r"(mm|px|s|m|mrad|°)\b", line) for line in caption)


def test_the_joints_of_a_gantry_are_drawn_in_their_range(runs):
    ranges = {"carrier": "gantry", "joints": (0, 0, 0.2, 0, 0.5, 0), "duration": 1.0}
    run = simulate(runs["slide"].scenario.with_(**ranges))
    drawn = lines(run_figure(run), "joints of the gantry")
    reach = 0.4601 + 0.5001  # m, of the third slide
    np.testing.assert_allclose(drawn["3, slide"][1], 100 * (run.joints[:, 2] + 0.5001) / reach)
    assert not any("joints" in a.get_title(loc="left") for a in run_figure(runs["slide"]).axes)


def test_text_of_a_scenario_is_no_formula(runs):
    scenario = runs["slide"].scenario.with_(name=r"$\frac{$ & <b>", duration=0.2)
    figure = run_figure(simulate(scenario))
    assert r"$\frac{$ & <b>" in figure.get_suptitle().replace(r"\$", "$")
    picture(figure, ".svg")


def test_an_unknown_format_is_a_sentence(runs):
    with pytest.raises(InputError, match=r"^\.gif: .*\.png, \.svg, \.pdf"):
        picture(run_figure(runs["at rest"]), ".gif")


# The animation ---------------------------------------------------------------------------------
@pytest.mark.parametrize("name", ["slide", "diverged", "hidden", "one frame", "at rest"])
def test_an_animation_is_a_gif_of_few_pictures(runs, tmp_path, name):
    told = []
    animate(runs[name], tmp_path / "a.gif", pictures=3, progress=lambda *given: told.append(given))
    pictures = min(3, len(runs[name].t))
    assert told == [(k + 1, pictures) for k in range(pictures)]
    with Image.open(tmp_path / "a.gif") as found:
        # Pillow joins pictures that are equal, as those of a camera at rest.
        assert found.format == "GIF" and 1 <= found.n_frames <= pictures
        if name == "slide":
            assert found.n_frames == 3 and found.info["loop"] == 0
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"]


def test_the_camera_moves_from_left_to_right_in_the_animation_of_the_slide(runs, tmp_path):
    animate(runs["slide"], tmp_path / "a.gif", pictures=2)
    green = np.round(255 * np.array(to_rgb(WITH)))
    middle = []
    with Image.open(tmp_path / "a.gif") as found:
        for k in range(2):
            found.seek(k)
            space = np.asarray(found.convert("RGB"), dtype=float)[60:, found.width // 2 :]
            columns = np.flatnonzero((np.abs(space - green).sum(axis=-1) < 30).any(axis=0))
            middle.append(columns.max())
    assert middle[1] > middle[0] + 50  # px: 0.36 m of 0.6 m, in a picture 384 px wide


def test_the_same_run_is_the_same_animation(runs, tmp_path):
    for name in ("a.gif", "b.gif"):
        animate(runs["diverged"], tmp_path / name, pictures=2)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


@pytest.mark.parametrize("duration", [0.04, 0.4, 9.0, 100.0])
def test_pictures_and_time_do_not_grow_with_the_run(duration):
    run = simulate(paper.sliding(latency=0.0).with_(V=(0.001, 0, 0), duration=duration))
    chosen, ticks = timing(run)
    assert chosen[0] == 0 and chosen[-1] == len(run.t) - 1
    assert len(chosen) == len(ticks) <= 100 and (np.diff(chosen) > 0).all()
    assert min(ticks) >= 2 and sum(ticks) <= 1201  # hundredths of a second
    if 2 <= duration <= 10:
        assert sum(ticks[:-1]) / 100 == pytest.approx(duration, rel=0.1)


def test_what_cannot_be_animated_is_a_sentence(runs, tmp_path):
    with pytest.raises(InputError, match=r"^pictures: 1 do not move"):
        animate(runs["slide"], tmp_path / "a.gif", pictures=1)
    with pytest.raises(InputError, match=r"a\.gif: the animation cannot be written"):
        animate(runs["one frame"], tmp_path / "no" / "a.gif", pictures=2)
    assert not list(tmp_path.iterdir())


# The notebook ----------------------------------------------------------------------------------
def svg_of(run: Run) -> ET.Element:
    html = run._repr_html_()
    return ET.fromstring(html[html.index("<svg") :])


def test_the_notebook_s_picture_is_small_well_formed_and_without_ids(run):
    html = run._repr_html_()
    assert html.startswith("<table>") and len(html.encode()) < 40_000
    assert html == run._repr_html_()
    for element in svg_of(run).iter():
        assert "id" not in element.attrib and "href" not in element.attrib
        assert "nan" not in " ".join(element.attrib.values()).lower()
        assert "inf" not in " ".join(element.attrib.values()).lower()


def test_a_long_run_of_many_points_is_still_a_small_picture():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.2, 0.2, (60, 2)), np.full(60, -0.125)])
    scenario = paper.oscillation().with_(points=points.tolist(), duration=80.0, noise_px=2.0)
    html = simulate(scenario)._repr_html_()
    assert 10_000 < len(html.encode()) < 40_000
    assert "24 of 60 points" in html


def test_no_peak_of_the_error_is_lost_in_the_small_picture(runs):
    """The highest vertex of the curve is the greatest error, by the scale of its own ticks."""
    run = runs["oscillation"]
    true = np.linalg.norm(run.error, axis=1)
    seen = np.linalg.norm(run.measured_error, axis=1)
    panel = svg_of(run).findall("g")[1]
    curves = [path.get("d") for path in panel.find("svg").findall("path")]
    ticks = {}
    for text in panel.findall("text"):
        if text.get("text-anchor") == "end":
            ticks[float(text.text)] = float(text.get("y")) - 4
    (low, at_low), (high, at_high) = min(ticks.items()), max(ticks.items())
    for values, curve in zip((true, seen), curves, strict=True):
        y = [float(pair.split()[1]) for pair in re.split("[ML]", curve)[1:]]
        value = low + (min(y) - at_low) / (at_high - at_low) * (high - low)
        # Coordinates have one decimal, in a panel 220 high.
        assert value == pytest.approx(values.max(), abs=0.2 / 220 * max(true.max(), seen.max()) * 2)


def test_the_small_picture_takes_text_as_text():
    hostile = "</svg><script>alert('1')</script>\""
    html = simulate(paper.sliding().with_(name=hostile, duration=0.2))._repr_html_()
    assert "<script>" not in html and html.count("</svg>") == html.count("<svg")


# Numbers and sentences -------------------------------------------------------------------------
def test_the_outcome_is_that_of_the_closed_form(runs):
    found = outcome(runs["slide"])
    # v τ ahead along the motion; Fx v τ / Z for each of four points, at depth 0.645 m or so.
    assert found.along.final == pytest.approx(0.04 * 0.08, abs=1e-9)
    assert found.along.mean == pytest.approx(0.04 * 0.08, abs=1e-7)
    assert found.along.half_range < 1e-7  # e^{-λt} of 16 mm at 6.75 s is 8e-10 m
    depth = runs["slide"].depths[-1]
    expected = 700 * 0.04 * 0.08 * math.sqrt((1 / depth**2).sum())
    assert found.true_error.final == pytest.approx(expected, rel=1e-6)
    assert found.measured_error.final < 1e-6 and found.settled
    assert found.speed == (pytest.approx(np.linalg.norm(runs["slide"].twist[3, :3])), 0.12)


def test_a_growing_error_is_told_even_where_the_run_completed():
    found = outcome(simulate(paper.sliding(lam=17.0)))
    assert found.status.complete and not found.status.ok and not found.settled
    assert "still growing" in notice(found) and "still growing" in str(found)


def test_a_failed_run_has_no_steady_state(runs):
    found = outcome(runs["diverged"])
    assert found.along.mean is None and found.true_error.half_range is None
    assert notice(found) == runs["diverged"].status.sentence
    assert runs["diverged"].status.sentence in str(found)


def test_a_name_of_any_characters_leaves_a_picture_that_can_be_read(tmp_path):
    """Control characters, which no XML holds, and what looks like a tag or a formula."""
    run = simulate(paper.sliding().with_(duration=0.4, name="a\x00\x1b[2J\x9b <b> $x \ufffe λ"))
    root = ET.fromstring(picture(run_figure(run), ".svg"))
    assert root.tag.endswith("svg")
    html = run._repr_html_()
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\ufffe]", html) and "<b>" not in html
    ET.fromstring(re.search("<svg.*</svg>", html, re.DOTALL)[0])
