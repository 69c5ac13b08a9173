"""Axes against SciPy's integration of their equations, limits against what they mean."""

import math

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.se3 import hat
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from vsctrl.errors import InputError
from vsctrl.servo.robot.axes import Axes, TwistSegment, along
from vsctrl.servo.robot.capability import Capability
from vsctrl.servo.robot.gantry import Gantry

A = np.array([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
B = np.array([-0.3, 0.1, 0.2, -0.6, 0.3, 0.5])
WANTED = [(0.25, A), (0.03, B), (0.4, -A), (0.5, np.zeros(6)), (0.3, B)]
LIMITS = {"twist_acceleration": 0.9, "angular_acceleration": 4.0}
# Adaptive integration at rtol 1e-12 keeps about 1e-11 over a thousand steps.
ODE = 2e-11


def integrated(wanted, capability):
    """Ends of every span: time, set value, twist, ∫ twist, pose; by SciPy, with the corner found.

    u' points from u to what is wanted, as fast as the limits allow, until it is there; T' = (u −
    T)/τ; pose' = pose hat(T).
    """
    a, alpha = capability.twist_accelerations
    tau = capability.time_constant

    def missing(u, aim):
        return max(
            np.linalg.norm((aim - u)[:3]) / a,
            np.linalg.norm((aim - u)[3:]) / alpha,
        )

    def field(y, du):
        T = y[6:12] if tau else y[:6]
        dT = (y[:6] - T) / tau if tau else du
        return np.concatenate([du, dT, T, (y[18:].reshape(4, 4) @ hat(T)).ravel()])

    def solve(f, a, b, y, events=None):
        return solve_ivp(
            f, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-14, events=events, max_step=0.02
        )

    t, y, out = 0.0, np.concatenate([np.zeros(18), np.eye(4).ravel()]), []
    for span, aim in wanted:
        end = t + span
        if missing(y[:6], aim) == 0:
            y[:6] = aim
        else:
            first = y[:6].copy()
            du = (aim - first) / missing(first, aim)

            def arrived(t, y, aim=aim, du=du):
                return (aim - y[:6]) @ du

            arrived.terminal = True
            ramp = solve(lambda t, y, du=du: field(y, du), t, end, y, arrived)
            t, y = ramp.t[-1], ramp.y[:, -1].copy()
            if t < end:
                y[:6] = aim
        if t < end:
            y = solve(lambda t, y: field(y, np.zeros(6)), t, end, y).y[:, -1].copy()
        t = end
        out.append((t, y[:6], y[6:12] if tau else y[:6], y[12:18], y[18:].reshape(4, 4)))
    return out


CASES = [
    Capability(time_constant=0.05),
    Capability(time_constant=0.003),
    Capability(time_constant=30.0),
    Capability(**LIMITS),
    Capability(twist_acceleration=0.9),
    Capability(angular_acceleration=4.0),
    Capability(**LIMITS, time_constant=0.07),
]


@pytest.mark.parametrize("capability", CASES)
def test_axes_and_the_pose_under_them_are_the_solution_of_their_equations(capability):
    axes, integral, pose = Axes(capability), np.zeros(6), np.eye(4)
    for (span, T), (_, _, twist, area, reached) in zip(
        WANTED, integrated(WANTED, capability), strict=True
    ):
        pieces = axes.follow([(span, T)])
        assert sum(piece.span for piece in pieces) == pytest.approx(span, rel=1e-15)
        pose = pose @ along(pieces, np.array([span]))[0]
        integral += sum(piece.integral() for piece in pieces)
        np.testing.assert_allclose(pieces[-1].twist(pieces[-1].span), twist, atol=ODE)
        np.testing.assert_allclose(integral, area, atol=ODE)
        np.testing.assert_allclose(pose, reached, atol=ODE)


@pytest.mark.parametrize("capability", CASES)
def test_the_twist_is_continuous_from_piece_to_piece(capability):
    pieces = Axes(capability).follow(WANTED)
    before = np.zeros(6)
    for piece in pieces:
        gap = piece.twist(0.0) - before
        np.testing.assert_allclose(gap, 0, atol=1e-15)
        before = piece.twist(piece.span)


@pytest.mark.parametrize("capability", CASES)
def test_motions_at_many_times_agree_with_motions_at_one(capability):
    pieces = Axes(capability).follow(WANTED)
    t = np.linspace(0.0, sum(span for span, _ in WANTED), 57)
    together = along(pieces, t)
    np.testing.assert_array_equal(together[0], np.eye(4))
    for moment, motion in zip(t, together, strict=True):
        np.testing.assert_allclose(along(pieces, np.array([moment]))[0], motion, atol=1e-13)


def test_acceleration_keeps_both_limits_and_reaches_one_of_them():
    pieces = Axes(Capability(**LIMITS)).follow(WANTED)
    ramps = [piece for piece in pieces if piece.slope.any()]
    assert len(ramps) == len(WANTED)
    for piece in ramps:
        shares = (
            np.linalg.norm(piece.slope[:3]) / LIMITS["twist_acceleration"],
            np.linalg.norm(piece.slope[3:]) / LIMITS["angular_acceleration"],
        )
        assert max(shares) == pytest.approx(1, rel=1e-14)


def test_axes_that_reach_their_aim_hold_exactly_that():
    axes = Axes(Capability(**LIMITS))
    ramp, hold = axes.follow([(2.0, A)])
    assert hold.is_constant
    np.testing.assert_array_equal(hold.start, A)
    (still,) = axes.follow([(1.0, A)])
    assert still.is_constant
    assert ramp.span == pytest.approx(max(np.linalg.norm(A[:3]) / 0.9, np.linalg.norm(A[3:]) / 4))


def test_axes_are_short_of_a_twist_only_while_acceleration_keeps_them_from_it():
    # From rest to A takes max(|A_V|/a, |A_Ω|/α) = 0.4157 s, and the last span wanted decides.
    needed = max(np.linalg.norm(A[:3]) / 0.9, np.linalg.norm(A[3:]) / 4)
    for spans, short in (
        ([0.99 * needed], True),
        ([needed], False),
        ([0.5 * needed] * 2, False),
        ([1.01 * needed], False),
    ):
        axes = Axes(Capability(**LIMITS, time_constant=0.3))
        axes.follow([(span, A) for span in spans])
        assert axes.short is short, spans
    axes.follow([(0.001, B), (2.0, A)])
    assert not axes.short
    axes.follow([(2.0, A), (0.001, B)])
    assert axes.short
    lagging = Axes(Capability(time_constant=5.0))
    lagging.follow([(0.01, A)])
    assert not lagging.short


def test_a_lag_ends_where_nothing_is_left_of_it():
    axes = Axes(Capability(time_constant=0.01))
    axes.follow([(0.5, A)])
    (piece,) = axes.follow([(0.5, A)])
    assert piece.is_constant
    np.testing.assert_array_equal(piece.start, A)


@pytest.mark.parametrize("tau", [1e-9, 1e-5])
def test_a_lag_far_below_the_period_is_a_shift_of_the_path_by_the_lag(tau):
    (piece,) = Axes(Capability(time_constant=tau)).follow([(0.04, A)])
    exact = 0.04 * A - tau * A  # ∫ of A (1 − e^{−t/τ})
    np.testing.assert_allclose(piece.integral(), exact, rtol=1e-14)
    # Along one screw the twists commute and the motion is the exponential of the integral.
    np.testing.assert_allclose(piece.motions(np.array([0.04]))[0], expm(hat(exact)), atol=1e-14)


def test_brakes_let_the_axes_go_on_from_what_is_left():
    axes = Axes(Capability(**LIMITS, time_constant=0.05))
    last = axes.follow([(0.1, A)])[-1]
    axes.brake(0.25)
    (first, *_) = axes.follow([(0.1, B)])
    np.testing.assert_allclose(first.twist(0.0), 0.25 * last.twist(last.span), rtol=1e-15)


def test_a_scaled_piece_has_the_share_of_the_twist_at_every_time():
    t = np.linspace(0, 0.2, 5)
    for piece in (
        TwistSegment.constant(0.2, A),
        TwistSegment(0.2, A, A, B),
        TwistSegment(0.2, A, B, -A, 0.1),
    ):
        np.testing.assert_allclose(piece.scaled(0.3).twist(t), 0.3 * piece.twist(t), rtol=1e-13)
        assert piece.scaled(0.3).is_constant == piece.is_constant


number = st.floats(-1e3, 1e3)
limit = st.one_of(st.none(), st.floats(1e-6, 1e4), st.just(math.inf))


@settings(max_examples=effort.share(300), deadline=None)
@given(st.tuples(*[number] * 6), limit, limit)
def test_saturation_keeps_the_direction_and_no_more_is_lost_than_the_limits_ask(T, speed, rate):
    T = np.array(T)
    share = Capability(speed=speed, rate=rate).share(T)
    assert 0 < share <= 1
    sizes = np.linalg.norm(T[:3]), np.linalg.norm(T[3:])
    kept = [
        share * size / limit
        for size, limit in zip(sizes, (speed, rate), strict=True)
        if limit is not None
    ]
    assert all(part <= 1 + 1e-14 for part in kept)
    if share < 1:
        assert max(kept) == pytest.approx(1, rel=1e-13)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"speed": 0.0}, "speed: 0.0 is no limit; give a number of m/s above 0"),
        ({"rate": -1.0}, "rate: -1.0"),
        ({"twist_acceleration": math.nan}, "twist_acceleration: nan"),
        ({"angular_acceleration": 0.0}, "rad/s²"),
        ({"time_constant": -0.1}, "time_constant: -0.1 is no time"),
        ({"time_constant": math.inf}, "time_constant: inf"),
        ({"avoidance": True}, "avoidance: a free camera has no joints"),
        ({"joints0": np.zeros(6)}, "joints0: a free camera has no joints"),
        ({"joints0": np.zeros(5), "gantry": Gantry()}, "joints0"),
    ],
)
def test_capabilities_out_of_range_are_refused_in_a_sentence(options, match):
    with pytest.raises(InputError, match=match):
        Capability(**options)


def test_no_limit_at_all_is_known_as_such():
    assert Capability().unlimited
    assert Capability(speed=math.inf, time_constant=0.0).unlimited
    assert not Capability(rate=1.0).unlimited
    assert not Capability(time_constant=0.1).unlimited
    assert not Capability(gantry=Gantry()).unlimited
