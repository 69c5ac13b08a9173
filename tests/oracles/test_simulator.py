"""The plain simulator against a scalar recursion that has no camera, and against a hand's count."""

import numpy as np
import pytest
from oracles import experiments, simulator

from vsctrl import paper


@pytest.mark.parametrize("k_ff", [0.0, 1.0])
@pytest.mark.parametrize("aligned", [False, True])
def test_a_slide_at_constant_depth_is_the_scalar_recursion(k_ff, aligned):
    scenario = paper.sliding(placement="aligned" if aligned else "measurement")
    scenario = scenario.with_(k_ff=k_ff, duration=1.2)
    _, lag, *_, twist = simulator.run(scenario)
    _, expected, speed = experiments.lateral(experiments.ramp, 30, k_ff=k_ff, aligned=aligned)
    np.testing.assert_allclose(lag[:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(twist[:, 0], speed, atol=1e-12)
    np.testing.assert_allclose(lag[:, 1:], 0, atol=1e-9)


def test_the_first_frames_without_feed_forward_by_hand():
    """Nothing is seen to be wrong for two frames: then λ times what the reference gained in two."""
    scenario = paper.sliding(feedforward=False).with_(duration=0.16)
    *_, command, _ = simulator.run(scenario)
    gained = 0.04 * 0.04
    assert command[:4, 0] == pytest.approx([0, 2.5 * gained, 2.5 * 2 * gained, 2.5 * 3 * gained])
