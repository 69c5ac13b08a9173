"""What is not seen does not count, and what is believed of depths is believed everywhere."""

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate

SLIDE = paper.sliding()
FOUR = [list(point) for point in SLIDE.target.points]
FACING = {"position": (0.0, 0.0, -0.77), "euler_xyz_deg": (0.0, 0.0, 0.0)}


def facing(points, motion, law, offset=(0.0,) * 6):
    """A small image of a target that is faced; points far aside are not in it."""
    return Scenario(
        camera={"Fx": 700.0, "Fy": 700.0, "size_px": (700.0, 600.0)},
        target={"points": points},
        start={**FACING, "offset": offset},
        motion=motion,
        law=law,
        vision={"period": 0.04, "latency": 0.0},
    )


def test_the_integral_does_not_sum_up_what_is_not_seen():
    """A fifth point goes out of the image and comes back while the reference oscillates."""
    motion = {"kind": "oscillation", "direction": (1, 0, 0, 0, 0, 0), "amplitude": 0.12,
              "cycle": 10.0, "duration": 20.0}  # fmt: skip
    law = {"lam": 2.0, "T_i": 2.0}
    five = simulate(facing([*FOUR, [0.35, 0.0, -0.125]], motion, law))
    four = simulate(facing(FOUR, motion, law))
    assert not five.visible.all() and five.visible[:, 4].any()
    assert np.abs(five.lag[:, :3]).max() < 2 * np.abs(four.lag[:, :3]).max() < 1e-3


def test_the_adaptive_gain_does_not_look_at_what_is_not_seen():
    law = {"lam": 0.5, "lam_zero": 4.0, "lam_slope": 0.5}
    motion, offset = {"kind": "hold", "duration": 6.0}, (0.05, 0.0, -0.05, 0.0, 0.0, 0.05)
    five = simulate(facing([*FOUR, [0.6, 0.0, -0.125]], motion, law, offset))
    four = simulate(facing(FOUR, motion, law, offset))
    assert not five.visible[:, 4].any()
    np.testing.assert_allclose(five.pose, four.pose, atol=1e-12)


@pytest.mark.parametrize("interaction", ["current", "mean", "desired"])
def test_observed_depths_are_used_wherever_l_is_taken(interaction):
    """Once depths are known the lag is v/λ, although the first guess was 40 % too far."""
    scenario = SLIDE.with_(latency=0.0, k_ff=0.0, depth="estimated", depth_ratio=1.4)
    run = simulate(scenario.with_(interaction=interaction))
    np.testing.assert_allclose(run.depth_estimate[-1] / run.depths[-1], 1.0, atol=1e-6)
    assert run.lag_along_motion[-1] == pytest.approx(-0.04 / 2.5, rel=1e-4)


@pytest.mark.parametrize("interaction", ["current", "mean", "desired"])
def test_constant_depths_are_constant_wherever_l_is_taken(interaction):
    """A retreat at 3 cm/s with the depths at the start: κ = Z(t)/Z(0) at the end, so −v/(κλ)."""
    law = {"latency": 0.0, "k_ff": 0.0, "interaction": interaction, "lam": 10.0}
    scenario = SLIDE.with_(V=(0.0, 0.0, -0.03), duration=9.0, **law, euler_xyz_deg=(0, 0, 0))
    true, constant = (simulate(scenario.with_(depth=d)).lag[-1, 2] for d in ("true", "constant"))
    depths = simulate(scenario).depths
    # Depths that are believed too small make the law too slow by Z/Ẑ; to first order of the lag.
    assert constant / true == pytest.approx(depths[-1, 0] / depths[0, 0], rel=0.02)
    assert constant / true > 1.3


def test_a_depth_in_the_features_is_the_one_believed():
    """2½-D: with the same wrong depths in law and reference, or with observed ones, it rests."""
    rest = SLIDE.with_(kind="hold", duration=40.0, latency=0.0, features="points-and-depth")
    both = simulate(rest.with_(depth_ratio=1.2, reference_depth_ratio=1.2, duration=1.0))
    assert np.abs(both.measured_error).max() < 1e-12 and np.abs(both.lag).max() < 1e-12
    seen = simulate(
        rest.with_(depth="estimated", depth_ratio=1.2, offset=(0.02, 0.01, -0.05, 0.02, 0.03, 0.1))
    )
    assert np.abs(seen.measured_error[-1]).max() < 1e-5 and np.abs(seen.lag[-1]).max() < 1e-7


def test_a_predictor_knows_that_nothing_was_asked_while_nothing_was_seen():
    """All points leave the image; the Smith predictor must not add motion of long ago."""
    scenario = SLIDE.with_(
        kind="hold", predictor="smith", size_px=(700, 560), drift=(0.9, 0, 0, 0, 0, 0), sway=4.0,
        duration=8.0, on_lost="continue", on_rank_loss="continue", lam=0.3,
    )  # fmt: skip
    run = simulate(scenario)
    blind = ~run.visible.any(axis=1)
    assert blind.any() and not blind[-1]
    # Two frames late: from the third blind image on nothing was asked for two frames.
    late = np.flatnonzero(blind[:-4] & blind[1:-3] & blind[2:-2] & blind[3:-1])
    first = late[-1] + 4 + 2  # an image with points again, as the law is shown it
    image_error = run.features[first - 2] - run.reference[first]
    shown = np.repeat(run.visible[first - 2], 2)
    assert shown.any()
    np.testing.assert_allclose(run.measured_error[first][shown], image_error[shown], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("reference_depth_ratio", 1.3), ("reference_focal_ratio", 1.2), ("reference_k1", 0.2),
        ("reference_centre_px", (5.0, 0.0)),
    ],
)  # fmt: skip
def test_beliefs_of_an_image_mean_nothing_to_a_law_on_poses(name, value):
    with pytest.raises(
        InputError, match=rf"reference_image\.{name}: has no meaning for law.scheme"
    ):
        SLIDE.with_(scheme="pose", **{name: value})
