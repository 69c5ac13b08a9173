"""Everything that can fail in a run: once where it ends the run, once where the run goes on."""

import math

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.servo import faults, simulate
from vsctrl.servo.robot.joints import Stop

REST = {
    "position": (0.0, 0.0, -0.77), "euler_xyz_deg": (0.0, 0.0, 0.0), "V": (0, 0, 0), "k_ff": 0.0,
}  # fmt: skip
ON_A_LINE = [(-0.1, 0, 0), (0, 0, 0), (0.2, 0, 0)]
# Half of 330 px is 29 px outside the LEDs' ±136 px, and 30 px in the other direction is nothing.
SWINGING = REST | {"size_px": (330.0, 330.0), "lam": 0.3, "duration": 4.0, "sway": 2.0}

# Kind of fault, the key that decides, an experiment that meets it, and words of the sentence.
CASES = {
    "target behind camera": (
        "on_behind",
        # The target comes to meet a camera that approaches it, and the law is slow and late.
        REST | {
            "position": (0.0, 0.0, -1.0), "V": (0, 0, 0.3), "k_ff": 1.0, "latency": 0.2,
            "lam": 0.1, "duration": 2.5, "drift": (0, 0, -0.2, 0, 0, 0),
        },
        ["would lie at depth −", "behind the camera. Lower law.lam"],
    ),
    "too few points": (
        "on_lost", SWINGING | {"drift": (0.3, 0, 0, 0, 0, 0)},
        ["showed only 2 of the points, and three are needed", "camera.size_px"],
    ),
    "all points lost": (
        "on_lost",
        # The first image that is late enough to be new shows nothing any more.
        SWINGING | {"drift": (9.0, 0, 0, 0, 0, 0), "latency": 0.0},
        ["showed none of the points, and three are needed"],
    ),
    "rank loss": (
        "on_rank_loss", {"points": ON_A_LINE}, ["had rank 5 of 6", "its twist is of least norm"],
    ),
    "pose not found": (
        "on_rank_loss", {"points": ON_A_LINE, "scheme": "pose"}, ["no pose of the camera fitted"],
    ),
    "joint limit": (
        "on_joint_limit",
        {"carrier": "gantry", "joints": (-0.6, 0, 0.2, 0, 0.5, 0), "V": (0.1, 0, 0)},
        ["joint 3 of the robot would pass the end", "the limit is 0.4601 m", "robot.avoidance"],
    ),
}  # fmt: skip


def run_of(kind, policy):
    key, changes, _ = CASES[kind]
    return simulate(paper.sliding().with_(**changes, **{key: policy}))


def met(run, kind):
    """Frames of a run in which its own arrays show the fault, where they do."""
    left = run.visible.sum(axis=1)
    if kind == "target behind camera":
        return np.flatnonzero(run.depths.min(axis=1) <= 0)
    d = round(run.scenario.vision.latency / run.scenario.vision.period)
    seen = left[np.maximum(np.arange(len(left)) - d, 0)]
    if kind == "too few points":
        return np.flatnonzero((seen < 3) & (seen > 0))
    if kind == "all points lost":
        return np.flatnonzero(seen == 0)
    if kind == "joint limit":  # the camera rests where it was, though it is told to move
        return np.flatnonzero((run.twist == 0).all(axis=1) & (run.command != 0).any(axis=1))
    return np.arange(len(run.t))


@pytest.mark.parametrize("kind", CASES)
def test_a_fault_ends_the_run_in_its_frame_with_a_sentence(kind):
    run = run_of(kind, "end")
    assert (run.status.kind, run.status.ok, run.events) == (kind, False, ())
    k = run.status.frame
    assert run.status.sentence.startswith(f"At frame {k} (t = {k * 0.04:g} s) ")
    for words in CASES[kind][2]:
        assert words.replace("−", "-") in run.status.sentence
    # The frame is kept where it had an image and a command.
    assert len(run.t) == k + (kind != "target behind camera")
    if kind != "target behind camera":
        assert met(run, kind)[0] == k


@pytest.mark.parametrize("kind", CASES)
def test_the_same_fault_is_an_event_of_a_run_that_goes_on(kind):
    ended, run = run_of(kind, "end"), run_of(kind, "continue")
    assert run.status.ok, run.status.sentence
    (event,) = [event for event in run.events if event.kind == kind]
    k, frames = ended.status.frame, met(run, kind)
    assert event.frame == k == frames[0]
    assert event.frames == len(frames)
    assert event.sentence.startswith(ended.status.sentence)
    assert event.sentence.endswith(f" in {len(frames)} frame{'s' * (len(frames) > 1)}.")
    # Until the fault both are the same run.
    np.testing.assert_array_equal(run.pose[: len(ended.t)], ended.pose)
    np.testing.assert_array_equal(run.command[: len(ended.t)], ended.command)
    for name in ("pose", "features", "measured_error", "command", "twist", "lag"):
        assert np.isfinite(getattr(run, name)).all()


def test_without_points_the_camera_stands_and_with_them_again_it_comes_back():
    run = run_of("too few points", "continue")
    left = run.visible.sum(axis=1)
    lost = np.flatnonzero(left < 3)
    assert lost[0] < lost[-1] < len(left) - 3  # they come back
    assert np.any(np.diff(lost) > 1)  # and more than once
    assert left[-1] == 4
    wide = simulate(run.scenario.with_(drift=(2.0, 0, 0, 0, 0, 0)))
    none = np.flatnonzero(wide.visible.sum(axis=1) == 0)
    d = 2  # frames of latency
    np.testing.assert_array_equal(wide.command[none + d][none + d < len(wide.t)], 0)
    assert wide.visible[-1].all()
    assert [event.kind for event in wide.events] == ["too few points", "all points lost"]


def test_a_loop_that_lost_its_points_converges_once_it_sees_them_again():
    # The image is too small at the start; the target swings through it and comes to be seen.
    run = simulate(
        paper.sliding().with_(
            **SWINGING | {"duration": 8.0, "lam": 2.0, "sway": None, "latency": 0.0},
            offset=(-0.06, 0, 0, 0, 0, 0), drift=(0, 0, 0, 0, 0, 0), on_lost="continue",
        )
    )  # fmt: skip
    # Two of four points tell four things: of these the law takes the motion of least norm, until
    # the other two are in the image again.
    (event,) = run.events
    assert (event.kind, event.frame) == ("too few points", 0)
    assert event.frames == np.sum(run.visible.sum(axis=1) < 3) > 1
    assert run.visible[-1].all()
    assert np.linalg.norm(run.lag[-1]) < 1e-6 < np.linalg.norm(run.lag[0])


def test_points_that_cannot_be_seen_are_still_where_they_were_last():
    run = run_of("target behind camera", "continue")
    k = next(event.frame for event in run.events if event.kind == "target behind camera")
    hidden = run.depths[k] <= 0
    assert hidden.any()
    np.testing.assert_array_equal(run.visible[k], ~hidden)
    kept = np.repeat(hidden, 2)
    np.testing.assert_array_equal(run.features[k, kept], run.features[k - 1, kept])


def test_a_robot_that_does_less_than_it_is_told_is_an_event():
    run = simulate(paper.sliding().with_(speed_limit=0.03))
    assert run.status.ok
    (event,) = run.events
    assert (event.kind, event.frame, event.frames) == ("saturated", 0, 226)
    assert event.sentence.startswith("From frame 0 (t = 0 s) on, the robot's limits held it back.")
    np.testing.assert_allclose(np.linalg.norm(run.twist[:, :3], axis=1), 0.03, rtol=1e-12)
    later = simulate(paper.sliding(False).with_(speed_limit=0.039))
    (event,) = later.events
    speed = np.linalg.norm(later.command[:, :3], axis=1)
    assert event.frame == np.flatnonzero(speed > 0.039)[0] > 0


@pytest.mark.parametrize("policy", ["end", "continue"])
def test_divergence_ends_a_run_whatever_its_faults_do(policy):
    keys = ("on_lost", "on_behind", "on_rank_loss", "on_joint_limit")
    run = simulate(paper.sliding(False, lam=60.0).with_(**dict.fromkeys(keys, policy)))
    assert (run.status.kind, run.status.ok) == ("diverged", False)
    assert len(run.t) == run.status.frame
    assert "the loop is unstable" in run.status.sentence
    assert "No limit of the robot held it back" in run.status.sentence
    away = np.linalg.norm(run.pose[:, :3, 3] - run.reference_pose[:, :3, 3], axis=1)
    assert away.max() < 100 * max(run.depths[0].max(), 0.67)


def test_a_target_that_outruns_the_robot_is_not_blamed_on_the_loop_alone():
    # λ = 0.01 s⁻¹ without latency is stable; the target leaves at 3 m/s, the robot makes 1 cm/s.
    outrun = {"kind": "hold", "drift": (0, 0, 3.0, 0, 0, 0), "lam": 0.01, "latency": 0.0}
    run = simulate(paper.sliding().with_(**outrun, speed_limit=0.01, duration=60.0))
    assert run.status.kind == "diverged"
    (event,) = run.events
    said = f"The robot's limits held it back, first in frame {event.frame}: they are too low, or"
    assert said in run.status.sentence
    assert "raise the limits of [robot] or slow down what it follows." in run.status.sentence
    # Without the limit a gain of 1e-4 s⁻¹ is no match either: it settles at 3/λ = 30 km.
    free = simulate(paper.sliding().with_(**outrun | {"lam": 1e-4}, duration=60.0))
    assert (free.status.kind, free.events) == ("diverged", ())
    assert "No limit of the robot held it back" in free.status.sentence
    # Its reference is held, so that there is nothing that law.k_ff could feed forward.
    assert free.status.sentence.endswith("else raise law.lam.")


def test_where_nothing_moves_and_nothing_held_it_back_the_loop_is_unstable():
    # 30 s⁻¹ would be stable at once (up to 2/40 ms = 50 s⁻¹), 60 s⁻¹ would not.
    beside = {"kind": "hold", "duration": 6.0, "offset": (0.01, 0, 0, 0, 0, 0)}
    run = simulate(paper.sliding(lam=30.0).with_(**beside))
    assert run.status.kind == "diverged"
    assert run.status.sentence.endswith(
        "Nothing that it follows moves and no limit held it back: the loop is unstable. Lower "
        "law.lam or vision.latency."
    )
    run = simulate(paper.sliding(lam=60.0).with_(**beside))
    assert run.status.sentence.endswith("the loop is unstable. Lower law.lam.")


def test_a_robot_too_slow_to_change_its_speed_is_an_event_and_its_integral_waits():
    still = {"kind": "hold", "latency": 0.0, "offset": (-0.1, 0, 0, 0, 0, 0), "duration": 2.0}
    run = simulate(paper.sliding().with_(**still, acceleration_limit=0.02, T_i=2.0))
    # 0.25 m/s are wanted, and a frame of 40 ms gives 0.8 mm/s: not there in the first second.
    (event,) = run.events
    assert (event.kind, event.frame) == ("saturated", 0)
    assert event.frames > 25
    # With the integral waiting from frame 1 on, its sum is that of frame 0 until the robot is free.
    e, T = run.lag[:25, 0], run.command[:25, 0]
    first = 2.5 * e[0] * 0.04 / 2.0
    # Sideways and with true depths L̂⁺e is the offset itself: 1e-9 is rounding of the image.
    np.testing.assert_allclose(T + 2.5 * e, -first, atol=1e-9)


def test_axes_that_only_lag_hold_nothing_back():
    run = simulate(paper.sliding().with_(time_constant=0.1, duration=2.0))
    assert run.status.ok and run.events == ()


def test_a_twist_beyond_every_number_is_told_in_words_of_the_scenario():
    # No loop was found that gets there before it has diverged by its distance.
    sentence = faults.stopped(3, 0.12, Stop("…", 4))
    assert sentence.startswith(
        "At frame 3 (t = 0.12 s) the twist that reached the robot was beyond"
    )
    assert sentence.endswith("Lower law.lam or vision.latency.")


def test_avoidance_stands_still_before_the_end_of_a_joint():
    key, changes, _ = CASES["joint limit"]
    run = simulate(paper.sliding().with_(**changes, avoidance=True))
    assert run.status.ok
    assert [event.kind for event in run.events] == ["saturated"]
    assert key == "on_joint_limit"
    assert run.joints[:, 2].max() < 0.4601
    assert math.isclose(run.joints[-1, 2], 0.4601, abs_tol=1e-3)
