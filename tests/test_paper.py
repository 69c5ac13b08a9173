"""The paper's experiments as the theory page decides them."""

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Camera, simulate


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
