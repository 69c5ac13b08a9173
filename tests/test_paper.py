"""The paper's experiments as the theory page decides them."""

import math

import numpy as np
import pytest
from click.testing import CliRunner

from vsctrl import paper
from vsctrl.cli import main
from vsctrl.errors import InputError
from vsctrl.servo import Camera, Scenario, simulate
from vsctrl.study import validate

HALF_WIDTH, HALF_HEIGHT = 384, 288  # of a CCIR image, px


def test_the_slide_has_the_numbers_of_section_4():
    scenario = paper.sliding()
    assert scenario.motion.V == (0.04, 0.0, 0.0)
    assert scenario.motion.Omega == (0.0, 0.0, 0.0)
    assert scenario.law.lam == pytest.approx(2.5, rel=1e-15)
    assert (scenario.vision.period, scenario.vision.latency) == (0.04, 0.08)
    assert scenario.latency_frames == 2
    assert scenario.start.position == (-0.174, 0.044, -0.77)
    assert scenario.start.euler_xyz_deg == (2.0, 4.2, -0.2)
    leds = np.abs(np.array(scenario.target.points))
    np.testing.assert_array_equal(leds, np.tile([0.125, 0.075, 0.125], (4, 1)))
    assert len(set(scenario.target.points)) == 4


def test_feed_forward_is_the_paper_s_second_term():
    assert paper.sliding().law.k_ff == 1.0
    assert paper.sliding(feedforward=False).law.k_ff == 0.0
    assert "without" in paper.sliding(feedforward=False).description


def test_gain_latency_and_placement_are_parameters():
    scenario = paper.sliding(lam=5, latency=0.04, placement="aligned")
    law, vision = scenario.law, scenario.vision
    assert (law.lam, law.placement, vision.latency) == (5.0, "aligned", 0.04)
    with pytest.raises(InputError, match=r"law\.lam: -1 is not positive"):
        paper.sliding(lam=-1)


def test_the_printed_start_looks_away_from_the_leds():
    printed = paper.PRINTED_START
    assert printed == (-0.174, 0.044, -0.077)
    with pytest.raises(InputError, match=r"behind the camera.*z = -0\.77 m"):
        paper.sliding().with_(position=printed)


def test_the_first_led_is_the_upper_left_one_and_its_path_is_equation_16():
    run = simulate(paper.sliding())
    scenario = run.scenario
    camera = Camera(scenario.camera.Fx, scenario.camera.Fy)
    p = camera.points(run.reference_pose[0], np.array(scenario.target.points))
    X, Y = run.reference[0].reshape(4, 2).T
    assert X[0] < X[1] and Y[0] < Y[3]
    # X*(t) = (x(t₀) − Vx Δt) Fx / z(t₀), Y*(t) = y(t₀) Fy / z(t₀), Δt from the start.
    expected = (p[:, 0] - 0.04 * run.t[:, None]) / p[:, 2] * 700
    np.testing.assert_allclose(run.reference[:, ::2], expected, atol=1e-10)
    np.testing.assert_allclose(run.reference[:, 1::2], np.tile(Y, (226, 1)), atol=1e-10)


@pytest.mark.parametrize("name", paper.PRESETS)
def test_every_experiment_has_its_name_its_file_and_a_run_that_completes(name):
    scenario = paper.preset(name)
    assert scenario.name == name
    assert Scenario.from_toml(scenario.to_toml()) == scenario
    assert "with the derivative term" in scenario.description
    assert paper.PRESETS[name](feedforward=False).law.k_ff == 0.0
    run = simulate(scenario)
    assert run.status.ok
    assert run.depths.min() > 0.5
    printed = CliRunner().invoke(main, ["new", name])
    assert printed.exit_code == 0 and printed.stdout == scenario.to_toml()
    with pytest.raises(
        InputError, match=r"no experiment 'x'; choose sliding, oscillation, rotation"
    ):
        paper.preset("x")


@pytest.mark.parametrize("name", ["oscillation", "rotation"])
def test_the_camera_sees_the_face_of_the_leds_all_the_time(name):
    run = simulate(paper.preset(name))
    X, Y = np.abs(run.reference[:, ::2]), np.abs(run.reference[:, 1::2])
    assert X.max() < HALF_WIDTH and Y.max() < HALF_HEIGHT
    # The face's normal is −z of the object: the camera stays before it, and looks at it.
    assert (run.reference_pose[:, 2, 3] < -0.125).all()
    assert np.degrees(np.arccos(run.reference_pose[:, 2, 2])).max() < 30


def test_the_oscillation_has_the_numbers_of_figures_7_and_8():
    for waveform in ("triangle", "sine"):
        scenario = paper.oscillation(waveform)
        assert scenario.law.lam == pytest.approx(0.2 / 0.04, rel=1e-15)
        run = simulate(scenario)
        along = np.linalg.inv(run.reference_pose[0]) @ run.reference_pose
        np.testing.assert_allclose(along[:, [1, 2], 3], 0, atol=1e-15)
        assert np.abs(along[:, 0, 3]).max() == pytest.approx(0.15, rel=0.01)
        np.testing.assert_allclose(along[375:, 0, 3], along[:376, 0, 3], atol=1e-14)  # 15 s
        np.testing.assert_allclose(run.reference_pose[0, 0, 3], 0.0)
        speeds = np.abs(scenario.reference.twist(run.t)[:, 0])
        if waveform == "triangle":
            np.testing.assert_allclose(speeds, 0.04, rtol=1e-14)
        else:
            assert speeds.max() == pytest.approx(2 * math.pi * 0.15 / 15)
    assert paper.oscillation().motion.waveform == "triangle"
    with pytest.raises(InputError, match=r"motion\.waveform: 'square' is not one of"):
        paper.oscillation("square")


def test_the_first_led_of_the_rotation_moves_as_the_paper_develops_it():
    omega, d = 0.04, 0.8
    run = simulate(paper.rotation())
    scenario = run.scenario
    assert scenario.start.position == (-0.154, 0.014, -0.811)
    assert scenario.start.euler_xyz_deg == (-0.9, -3.8, 0.0)
    camera = Camera(700.0, 700.0)
    x, y, z = camera.points(run.reference_pose[0], np.array(scenario.target.points)).T
    # X*(t), Y*(t) of section 4.2 with x, y, z at t₀ and ωΔt from t₀.
    c, s = (f(omega * run.t)[:, None] for f in (np.cos, np.sin))
    depth = x * s + (z - d) * c + d
    np.testing.assert_allclose(
        run.reference[:, ::2], 700 * (x * c - (z - d) * s) / depth, atol=1e-9
    )
    np.testing.assert_allclose(run.reference[:, 1::2], 700 * y / depth, atol=1e-9)


def test_distance_axis_and_speed_of_the_rotation_are_parameters():
    scenario = paper.rotation(distance=0.7, axis=(0, 0, 2), speed=-0.1, lam=3)
    np.testing.assert_allclose(scenario.reference.twist(0.0), [0, 0, 0, 0, 0, -0.1], atol=1e-15)
    nearer = paper.rotation(distance=0.7).reference.twist(0.0)
    np.testing.assert_allclose(nearer, [-0.028, 0, 0, 0, 0.04, 0], atol=1e-15)
    with pytest.raises(InputError, match=r"motion\.axis: .* points nowhere"):
        paper.rotation(axis=(0, 0, 0))


def test_the_rotation_is_validated_to_first_order():
    found = validate(paper.rotation())
    assert not found.exact_motion
    for row in found.rows:
        lag = -0.032 * (0 if row.feedforward else 1 / 2.5)
        lag += 0.032 * (row.delay if row.placement == "measurement" else 0.0)
        assert row.analytic == pytest.approx(lag, abs=1e-12)
        assert row.simulated == pytest.approx(lag, abs=0.05e-3)


def test_a_reference_at_rest_has_no_lag_to_validate():
    with pytest.raises(InputError, match=r"^motion: .*does not translate.*simulate\(scenario\)"):
        validate(paper.sliding().with_(kind="hold", duration=3))


@pytest.mark.parametrize("waveform", ["triangle", "sine"])
def test_the_oscillation_is_validated_at_every_frame(waveform):
    found = validate(paper.oscillation(waveform))
    assert found.agrees is True and len(found.histories) == 8
    assert len(found.rows) == 8 * (waveform == "triangle")
