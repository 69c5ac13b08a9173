"""The simulation against an independent one, closed forms and a scalar recursion."""

import math
import pickle

import effort
import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from oracles import simulator

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.control.law import RANK_TOLERANCE, Law

V, LAM, TS, TAU = 0.04, 2.5, 0.04, 0.08
PLACEMENTS = ["measurement", "aligned", "actuator"]
INTERACTIONS = ["current", "desired", "mean", "initial"]
# A start in front of the cube's face with the object's orientation: all LEDs at Z = 0.645 m.
FACING = {"position": (0.0, 0.0, -0.77), "euler_xyz_deg": (0.0, 0.0, 0.0)}
STILL = {**FACING, "V": (0.0, 0.0, 0.0), "k_ff": 0.0}


def slide(**changes):
    return paper.sliding().with_(**changes)


def finite(run: Run) -> bool:
    names = "t pose reference_pose features reference error measured_error twist lag depths"
    return all(np.isfinite(getattr(run, name)).all() for name in names.split())


@pytest.mark.parametrize("interaction", INTERACTIONS)
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_every_frame_is_that_of_the_plain_simulation(placement, interaction):
    scenario = slide(
        V=(0.04, -0.02, 0.03),
        Omega=(0.02, 0.1, -0.05),
        offset=(0.01, -0.02, 0.03, 0.05, -0.04, 0.1),
        duration=0.8,
        Fy=500.0,
        k_ff=0.7,
        placement=placement,
        interaction=interaction,
        depth_ratio=1.2,
        noise_px=0.5,
        seed=3,
    )
    run = simulate(scenario)
    pose, lag, error, measured_error, _, twist = simulator.run(scenario)
    assert run.status.ok, run.status.sentence
    assert len(run.t) == len(pose) == 21
    # Rounding of 21 frames, at a condition number of L near 30 and image coordinates near 200 px.
    np.testing.assert_allclose(run.pose, pose, atol=1e-11)
    np.testing.assert_allclose(run.lag, lag, atol=1e-11)
    np.testing.assert_allclose(run.error, error, atol=1e-8)
    np.testing.assert_allclose(run.measured_error, measured_error, atol=1e-8)
    np.testing.assert_allclose(run.twist, twist, atol=1e-10)


@pytest.mark.parametrize("k_ff", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("rho", [1.0, 0.8, 1.25])
@pytest.mark.parametrize(
    ("placement", "latency"),
    [("measurement", 0.0), ("measurement", TAU), ("aligned", TAU), ("actuator", TAU)],
)
def test_the_slide_ends_at_the_closed_form(placement, latency, rho, k_ff):
    run = simulate(
        slide(placement=placement, latency=latency, depth_ratio=rho, k_ff=k_ff, duration=16.0)
    )
    lag = -V * (1 - k_ff * rho) / (LAM * rho)
    if placement == "measurement":
        lag += V * latency
    # The transient is below e^{-λρt} ≈ 1e-14 of 16 mm at 16 s; the rest is rounding.
    assert run.lag_along_motion[-1] == pytest.approx(lag, abs=1e-12)
    np.testing.assert_allclose(run.lag[-1], [lag, 0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(run.twist[-1], [V, 0, 0, 0, 0, 0], atol=1e-12)


def test_the_numbers_of_the_paper():
    def end(feedforward, **changes):
        return simulate(paper.sliding(feedforward, **changes)).lag_along_motion[-1]

    transient = V / LAM * math.exp(-LAM * 9.0) * 10  # of 16 mm at 9 s, with room for sampling
    assert end(False, latency=0.0) == pytest.approx(-0.016, abs=transient)
    assert end(True, latency=0.0) == pytest.approx(0.0, abs=1e-14)
    assert end(True) == pytest.approx(+0.0032, abs=transient)
    assert end(False) == pytest.approx(-0.0128, abs=transient)


def test_the_measured_error_cannot_show_the_lead():
    run = simulate(paper.sliding())
    assert np.abs(run.measured_error[-1]).max() < 1e-9
    # 3.2 mm at these depths: minus Fx τ v/Z in every X, nothing in Y.
    np.testing.assert_allclose(run.error[-1, ::2], -700 * V * TAU / run.depths[-1], rtol=1e-9)
    np.testing.assert_allclose(run.error[-1, 1::2], 0, atol=1e-9)


@pytest.mark.parametrize("interaction", ["current", "desired"])
@pytest.mark.parametrize("d", [0, 1, 2, 3])
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_lag_of_the_slide_is_the_scalar_loop_at_every_frame(placement, d, interaction):
    k_ff, rho, offset = 0.7, 1.15, -0.02
    run = simulate(
        slide(
            interaction=interaction,
            placement=placement,
            latency=d * TS,
            k_ff=k_ff,
            depth_ratio=rho,
            offset=(offset, 0, 0, 0, 0, 0),
        )
    )
    # Figure 1 sampled: e = ℓ (S − S*) exactly for lateral motion at constant depth, κ = ρ.
    S, S_ref = [offset], V * run.t
    commands = []
    for k in range(len(run.t)):
        late = max(0, k - d)
        if placement == "measurement":
            e = S[late] - S_ref[k]
        elif placement == "aligned":
            e = S[late] - S_ref[late]
        else:
            e = S[k] - S_ref[k]
        commands.append(rho * (-LAM * e + k_ff * V))
        u = commands[k] if placement != "actuator" else commands[k - d] if k >= d else 0.0
        S.append(S[k] + TS * u)
    np.testing.assert_allclose(run.lag_along_motion, np.array(S[:-1]) - S_ref, atol=1e-12)


@pytest.mark.parametrize("d", [0, 1, 2, 3])
def test_the_gain_limit_of_the_sampled_loop(d):
    limit = 2 * math.sin(math.pi / (2 * (2 * d + 1))) / TS

    def growth(lam):
        run = simulate(
            slide(
                **STILL,
                lam=lam,
                latency=d * TS,
                offset=(1e-7, -2e-7, 1e-7, 1e-7, 2e-7, -1e-7),
                duration=12.0,
            )
        )
        assert run.status.complete, run.status.sentence
        size = np.linalg.norm(run.lag, axis=1)
        return size[-50:].max() / size[50:100].max()

    # The slowest root says by how much; sizes of windows of oscillations agree to a few percent.
    for factor in (0.98, 1.02):
        roots = np.roots(
            [1.0, -1.0, *[0.0] * (d - 1), factor * limit * TS]
            if d
            else [1.0, factor * limit * TS - 1.0]
        )
        expected = np.abs(roots).max() ** 201
        assert (expected < 1) == (factor < 1)
        assert growth(factor * limit) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("lam", [60.0, 1e3, 1e9])
@pytest.mark.parametrize("interaction", INTERACTIONS)
def test_a_gain_far_too_high_ends_in_a_sentence(lam, interaction):
    run = simulate(paper.sliding(False, lam=lam).with_(interaction=interaction))
    assert not run.status.ok
    assert run.status.kind in ("diverged", "target behind camera", "rank loss")
    assert 0 < len(run.t) <= run.status.frame + 1 < 226
    assert finite(run)


def test_divergence_names_the_remedy():
    run = simulate(paper.sliding(False, lam=60.0))
    assert run.status.kind == "diverged"
    assert len(run.t) == run.status.frame
    assert f"frame {run.status.frame} " in run.status.sentence
    assert "Lower law.lam" in run.status.sentence


def test_a_rotation_about_the_optical_axis_retreats_advances_or_stays():
    Z, theta = 0.645, 0.6

    def twist(interaction, angle=theta):
        offset = (0, 0, 0, 0, 0, angle)
        return simulate(slide(**STILL, interaction=interaction, offset=offset)).twist[0]

    # First twist, exact for points at one depth: retreat, advance, and neither for the mean.
    retreat = LAM * Z * (1 - math.cos(theta))
    for interaction, v, w in [
        ("current", -retreat, LAM * math.sin(theta)),
        ("initial", -retreat, LAM * math.sin(theta)),
        ("desired", +retreat, LAM * math.sin(theta)),
        ("mean", 0.0, 2 * LAM * math.tan(theta / 2)),
    ]:
        np.testing.assert_allclose(twist(interaction), [0, 0, v, 0, 0, -w], atol=1e-12)
        np.testing.assert_allclose(twist(interaction, -theta), [0, 0, v, 0, 0, w], atol=1e-12)


def test_a_start_far_away_is_not_yet_divergence():
    # Its image cannot be servoed (a rounding of the rotation moves it by pixels): some failure
    # follows, but the first frame exists, whatever the distance.
    for distance in (1e3, 1e9):
        run = simulate(slide(offset=(distance, 0, 0, 0, 0, 0), interaction="desired"))
        assert run.status.kind != "diverged"
        assert run.lag[0, 0] == pytest.approx(distance)
        assert finite(run)


def test_rank_loss_keeps_its_frame_and_says_so():
    run = simulate(slide(**STILL, interaction="mean", offset=(0, 0, 0, 0, 0, math.pi)))
    assert (run.status.kind, run.status.frame, run.status.ok) == ("rank loss", 0, False)
    assert len(run.t) == 1
    assert finite(run)
    assert "rank" in run.status.sentence
    collinear = slide(points=[(-0.1, 0, 0), (0, 0, 0), (0.2, 0, 0)])
    assert simulate(collinear).status.kind == "rank loss"


def test_a_camera_driven_through_its_target_stops_before_it():
    run = simulate(slide(**STILL, lam=5.0, interaction="desired", offset=(0, 0, 0, 0, 0, math.pi)))
    assert run.status.kind == "target behind camera"
    assert len(run.t) == run.status.frame > 0
    assert run.depths.min() > 0
    assert finite(run)
    assert "behind the camera" in run.status.sentence


def test_the_law_is_least_squares_with_a_relative_threshold():
    rng = np.random.default_rng(1)
    L, e, ds = rng.normal(size=(8, 6)), rng.normal(size=8), rng.normal(size=8)
    law = Law(lam=2.0, k_ff=0.5)
    T, rank = law.twist(L, e, ds)
    assert rank == 6
    np.testing.assert_allclose(T, np.linalg.pinv(L) @ (0.5 * ds - 2.0 * e), atol=1e-13)
    L[:, 5] = L[:, 4]
    T, rank = law.twist(1e6 * L, e, ds)
    assert rank == 5
    expected = np.linalg.pinv(1e6 * L, rcond=RANK_TOLERANCE) @ (0.5 * ds - 2.0 * e)
    np.testing.assert_allclose(T, expected, rtol=1e-9)
    assert T[4] == pytest.approx(T[5])  # of least norm: shared evenly


def test_noise_is_drawn_once_a_frame_and_the_repeated_frame_repeats_it():
    scenario = slide(noise_px=0.3, seed=11)
    run = simulate(scenario)
    draw = 0.3 * np.random.default_rng(11).standard_normal((226, 8))
    seen = run.measured_error + run.reference
    np.testing.assert_allclose(seen[2:], run.features[:-2] + draw[:-2], atol=1e-10)
    np.testing.assert_allclose(seen[:2], np.tile(run.features[0] + draw[0], (2, 1)), atol=1e-10)
    np.testing.assert_array_equal(run.features, simulate(scenario).features)
    assert not np.array_equal(run.features, simulate(scenario.with_(seed=12)).features)


def test_the_twist_of_a_late_robot_is_zero_until_its_first_command():
    run = simulate(slide(placement="actuator"))
    np.testing.assert_array_equal(run.twist[:2], 0)
    assert run.twist[2, 0] == pytest.approx(V, abs=1e-12)


def test_a_run_carries_its_inputs_and_cannot_be_changed():
    scenario = slide()
    run = simulate(scenario)
    assert run.scenario is scenario
    np.testing.assert_allclose(run.t, np.arange(226) * 0.04)
    np.testing.assert_allclose(run.reference_pose, scenario.reference.pose(run.t))
    np.testing.assert_array_equal(run.error, run.features - run.reference)
    assert run.pose.shape == run.reference_pose.shape == (226, 4, 4)
    assert run.lag.shape == run.twist.shape == (226, 6)
    with pytest.raises(ValueError, match="read-only"):
        run.lag[0] = 0
    again = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(again.lag, run.lag)
    assert again.status == run.status


def test_the_offset_is_the_first_lag():
    offset = (0.01, -0.02, 0.03, 0.05, -0.04, 0.1)
    np.testing.assert_allclose(simulate(slide(offset=offset)).lag[0], offset, atol=1e-14)


def test_a_still_reference_has_no_direction_to_lag_along():
    run = simulate(slide(V=(0, 0, 0)))
    with pytest.raises(InputError, match=r"motion\.V: .*use run\.lag"):
        run.lag_along_motion  # noqa: B018
    assert "along motion" not in run._repr_html_()


def test_a_velocity_too_small_to_square_still_has_a_direction():
    run = simulate(slide(V=(0, 0, 1e-200), offset=(0, 0, -0.01, 0, 0, 0)))
    assert run.lag_along_motion[0] == pytest.approx(-0.01)


def test_a_notebook_shows_text_as_text():
    html = simulate(slide(name="<script>alert(1)</script>"))._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "completed" in html
    assert "3.2 mm" in html


number = st.floats(-1, 1, allow_nan=False)


@st.composite
def scenarios(draw) -> Scenario:
    def vector(size, scale):
        return [scale * draw(number) for _ in range(size)]

    points = draw(st.integers(3, 6))
    try:
        return paper.sliding().with_(
            Fx=draw(st.floats(1, 5000)),
            Fy=draw(st.floats(1, 5000)),
            points=[vector(3, 0.3) for _ in range(points)],
            position=[*vector(2, 0.2), draw(st.floats(-3, -0.4))],
            euler_xyz_deg=vector(3, 30),
            offset=[*vector(3, 0.3), *vector(3, 2)],
            V=vector(3, 0.3),
            Omega=vector(3, 0.5),
            duration=draw(st.floats(0.1, 1.5)),
            lam=draw(st.floats(0.01, 100)),
            k_ff=draw(st.floats(-3, 3)),
            interaction=draw(st.sampled_from(INTERACTIONS)),
            placement=draw(st.sampled_from(PLACEMENTS)),
            depth_ratio=draw(st.floats(0.1, 10)),
            latency=draw(st.integers(0, 6)) * TS,
            noise_px=draw(st.sampled_from([0.0, 1.0, 1e9])),
        )
    except InputError:
        reject()


@settings(max_examples=effort.share(100), deadline=None)
@given(scenarios())
def test_any_valid_scenario_gives_finite_numbers_and_a_sentence(scenario):
    run = simulate(scenario)
    assert finite(run)
    assert 1 <= len(run.t) <= scenario.frames + 1
    assert run.status.ok == (len(run.t) == scenario.frames + 1 and run.status.kind == "completed")
    assert run.status.sentence.endswith(".")
    assert run.status.sentence[0].isupper()
    assert run._repr_html_().startswith("<table>")
