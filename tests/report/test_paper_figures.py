"""Figures 5 to 11 of the paper: their lines are the runs, and their axes say what and in what."""

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.report import plots
from vsctrl.report.plots.style import GREY, INK, WITH, WITHOUT
from vsctrl.study.statements import Bench
from vsctrl.study.statements.runs import FAR


@pytest.fixture(scope="module")
def slide():
    return Bench().traces(paper.sliding(), 3)


@pytest.fixture(scope="module")
def oscillation():
    return Bench().traces(paper.oscillation(), 3, FAR)


@pytest.fixture(scope="module")
def rotation():
    return Bench().traces(paper.rotation(), 3)


def lines(axes, colour, style="-"):
    """The lines with data of a colour and a style, as (x, y)."""
    return [
        line.get_xydata().T
        for line in axes.get_lines()
        if line.get_color() == colour and line.get_linestyle() == style and len(line.get_xdata())
    ]


def named(figure):
    """What the legend of a figure says."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def test_figure_5_shows_the_norm_of_the_true_error_and_of_the_measured_one(slide):
    figure = plots.error_traces(slide)
    for axes, pair in zip(figure.axes, slide, strict=True):
        for run, colour in ((pair.on, WITH), (pair.off, WITHOUT)):
            ((t, true),) = lines(axes, colour)
            ((_, seen),) = lines(axes, colour, ":")
            np.testing.assert_array_equal(t, run.t)
            np.testing.assert_allclose(true**2, (run.error**2).sum(axis=1), rtol=1e-12)
            np.testing.assert_allclose(
                seen**2, (run.measured_error**2).sum(axis=1), rtol=1e-12, atol=1e-20
            )
        assert axes.get_xlabel() == "t, s"
    assert figure.axes[0].get_ylabel() == "E, px"
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "clean",
        "as it might be measured",
    ]
    assert named(figure) == [
        "without derivative term",
        "with derivative term",
        "true",
        "as measured",
    ]
    # 6.8 px and 27.3 px: 3.2 mm and 12.8 mm at 0.645 m and 700 px, over four points.
    assert {text.get_text() for text in figure.axes[0].texts} == {"6.8 px", "27.3 px"}


def test_what_figure_5_and_7_say_in_words_stands_beside_the_curves(slide, oscillation):
    for traces in (slide, oscillation):
        figure = plots.error_traces(traces)
        figure.draw_without_rendering()
        for axes in figure.axes:
            inside = axes.get_window_extent()
            boxes = [text.get_window_extent() for text in axes.texts]
            assert all(box.y0 >= inside.y0 and box.y1 <= inside.y1 for box in boxes)
            assert all(inside.x1 < box.x0 and box.x1 <= figure.bbox.x1 for box in boxes)
            assert not boxes[0].overlaps(boxes[1])


@pytest.mark.parametrize("name", ["slide", "rotation"])
def test_figures_6_and_9_show_paths_from_above_and_distances(name, request):
    traces = request.getfixturevalue(name)
    figure = plots.paths(traces)
    (
        whole,
        *near,
    ) = figure.axes[:3]
    assert whole.get_aspect() == 1.0
    for axes, below, pair in zip(near, figure.axes[3:], traces, strict=True):
        for run, colour in ((pair.on, WITH), (pair.off, WITHOUT)):
            (x, z), *_ = lines(axes, colour)
            np.testing.assert_allclose(x, 1e3 * run.pose[:, 0, 3])
            np.testing.assert_allclose(z, 1e3 * run.pose[:, 2, 3])
            ((t, along),) = lines(below, colour)
            np.testing.assert_allclose(along, 1e3 * run.lag_along_motion)
            ((_, across),) = lines(below, colour, "--")
            # What is neither along nor across from above is vertical: together no more than the
            # distance, and after the transient the curve of the path adds less than 0.1 mm.
            distance = 1e3 * np.linalg.norm(
                run.pose[:, :3, 3] - run.reference_pose[:, :3, 3], axis=1
            )
            assert (np.hypot(along, across) <= distance + 0.1)[t > 2].all()
        (goal,) = [line for line in lines(axes, INK) if len(line[0]) > 2]
        np.testing.assert_allclose(goal[0], 1e3 * pair.on.reference_pose[:, 0, 3])
        assert "mm" in axes.get_xlabel() and below.get_xlabel() == "t, s"
    assert near[0].get_ylabel() == "z, mm" and figure.axes[3].get_ylabel() == "distance, mm"
    assert near[0].get_ylim() == near[1].get_ylim()


def test_the_scene_is_the_cube_with_its_leds_before_the_camera(slide):
    whole = plots.paths(slide).axes[0]
    (cube,) = whole.patches
    assert np.ptp(cube.get_xy(), axis=0).tolist() == [250.0, 250.0]
    ((x, z),) = lines(whole, GREY, "None")
    assert set(x) == {-125.0, 125.0} and set(z) == {-125.0}
    assert whole.get_ylim()[0] < -770 < 125 < whole.get_ylim()[1]


def test_figure_8_shows_the_first_abscissa_its_reference_and_the_difference(oscillation):
    figure = plots.first_point(oscillation)
    above, below = figure.axes[:2], figure.axes[2:]
    for column, pair in enumerate(oscillation):
        for run, colour in ((pair.on, WITH), (pair.off, WITHOUT)):
            ((_, X),) = lines(above[column], colour)
            ((_, error),) = lines(below[column], colour)
            np.testing.assert_array_equal(X, run.features[:, 0])
            np.testing.assert_allclose(error, X - run.reference[:, 0], atol=1e-12)
        ((_, goal),) = lines(above[column], INK, "--")
        np.testing.assert_array_equal(goal, pair.on.reference[:, 0])
    assert above[0].get_ylabel() == "X1, px" and below[0].get_ylabel() == "X1 − X1*, px"
    assert "reference X1*" in named(figure)


@pytest.mark.parametrize(("which", "first"), [(False, 0), (True, 3)])
def test_figures_10_and_11_show_the_six_velocities_and_what_is_asked(rotation, which, first):
    figure = plots.velocities(rotation, rotation=which)
    asked = 1e3 * np.array([-0.8 * 0.04, 0, 0, 0, 0.04, 0])
    for i, axes in enumerate(figure.axes):
        row, pair = divmod(i, 2)
        ((_, on),) = lines(axes, WITH)
        np.testing.assert_allclose(on, 1e3 * rotation[pair].on.twist[:, first + row])
        ((_, goal),) = lines(axes, INK)
        np.testing.assert_allclose(goal, asked[first + row], atol=1e-12)
    labels = [axes.get_ylabel() for axes in figure.axes[::2]]
    unit = "mrad/s" if which else "mm/s"
    assert labels == [f"{'Ω' if which else 'V'}{letter}, {unit}" for letter in "xyz"]
    assert named(figure) == ["asked", "without derivative term", "with derivative term"]


def test_panels_side_by_side_have_the_same_scale(slide, oscillation, rotation):
    for figure, pairs in (
        (plots.error_traces(slide), [(0, 1)]),
        (plots.first_point(oscillation), [(0, 1), (2, 3)]),
        (plots.velocities(rotation), [(0, 1), (2, 3), (4, 5)]),
    ):
        for left, right in pairs:
            assert figure.axes[left].get_ylim() == figure.axes[right].get_ylim()
