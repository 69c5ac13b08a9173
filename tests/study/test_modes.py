"""What the experiments share: M of wrong depths and focal lengths, and an ideal camera and robot.

The M are checked against finite differences of the projection typed here.
"""

import numpy as np
import pytest
from effort import some

from vsctrl import paper, study
from vsctrl.servo.pose import exp, inverse
from vsctrl.study import modes, runs
from vsctrl.study.experiments import matrix_law

RHO, PHI = 0.9, 1.1
SQUARE = ((-0.1, -0.1, 0.0), (0.1, -0.1, 0.0), (0.1, 0.1, 0.0), (-0.1, 0.1, 0.0))


def wrong(scenario):
    return scenario.with_(depth_ratio=RHO, focal_ratio=PHI)


def frontal():
    """Four points at one depth of half a metre."""
    start = {"position": (0.0, 0.0, -0.5), "euler_xyz_deg": (0.0, 0.0, 0.0), "V": (0.02, 0, 0)}
    return paper.sliding().with_(points=SQUARE, **start, Omega=(0, 0, 0))


def by_differences(scenario):
    """L̂⁺L from central differences of the projection, with true and with believed points."""
    F = np.array([scenario.camera.Fx, scenario.camera.Fy])
    points = np.array(scenario.target.points)
    p = (points - (oTc := scenario.reference.pose(0.0))[:3, 3]) @ oTc[:3, :3]
    image = (F * p[:, :2] / p[:, 2:]).ravel()
    depths = scenario.law.depth_ratio * p[:, 2:]
    F_hat = scenario.calibration.focal_ratio * F
    believed = np.hstack([image.reshape(-1, 2) / F_hat * depths, depths])

    def jacobian(p, F):
        columns = []
        for axis in np.eye(6):
            sides = []
            for step in (1e-6, -1e-6):
                moved = inverse(exp(step * axis))
                q = p @ moved[:3, :3].T + moved[:3, 3]
                sides.append((F * q[:, :2] / q[:, 2:]).ravel())
            columns.append((sides[0] - sides[1]) / 2e-6)
        return np.stack(columns, axis=-1)

    return np.linalg.pinv(jacobian(believed, F_hat)) @ jacobian(p, F)


@pytest.mark.parametrize("make", some([paper.sliding, frontal], 1))
def test_the_calibration_matrix_is_that_of_finite_differences(make):
    scenario = wrong(make())
    # Central differences of step 1e-6 are right to about 1e-10 of L, of condition about 30.
    np.testing.assert_allclose(
        modes.calibration(scenario), by_differences(scenario), rtol=0, atol=1e-7
    )
    assert modes.sideways_ratio(scenario) == pytest.approx(RHO / PHI)


def test_wrong_depths_alone_leave_rotations_as_they_are():
    found = modes.eigen_directions(paper.sliding().with_(depth_ratio=RHO))
    assert [(each.name, each.eigenvalue) for each in found] == [
        ("translation", RHO),
        ("rotation", 1.0),
    ]
    for each in found:
        assert np.count_nonzero(each.direction) == 3


def test_each_direction_is_an_eigenvector_of_the_calibration_matrix():
    scenario = wrong(frontal())
    found = modes.eigen_directions(scenario)
    # diag(ρ/φ, ρ/φ, ρ, φ, φ, 1) and what is above its diagonal.
    assert [each.eigenvalue for each in found] == pytest.approx([RHO / PHI, RHO, 1.0, PHI])
    for each in found:
        turned = by_differences(scenario) @ each.direction
        np.testing.assert_allclose(turned, each.eigenvalue * each.direction, rtol=0, atol=1e-7)


def test_a_wrong_focal_length_limits_the_gain_and_the_decay_as_its_eigenvalues_say():
    scenario = wrong(frontal())
    edge = study.stability_edge(scenario, (1,), ())
    assert edge.agrees
    # One frame late: κλTₛ = 2 sin(π/6) = 1, κ the largest eigenvalue.
    assert edge.rows[0].simulated == pytest.approx(1 / (PHI * 0.04), rel=1e-5)
    decay = study.decay_modes(scenario, (2.5,))
    assert decay.agrees and len(decay.rows) == 4
    assert study.sine_response(scenario, (3.0,)).agrees


@pytest.mark.parametrize("make", some([paper.sliding, frontal], 1))
def test_the_matrix_law_holds_for_a_wrong_focal_length(monkeypatch, make):
    motions = {"turn about y": (0, 0, 0, 0, 1.0, 0), "screw": (0.5, -0.4, 0.3, 0.4, 0.5, -0.3)}
    monkeypatch.setattr(matrix_law, "MOTIONS", motions)
    scenario = make().with_(focal_ratio=PHI)
    found = study.matrix_law(scenario, RHO)
    assert found.agrees and found.focal_ratio == PHI
    rows = [row for row in found.rows if row.focal_ratio != 1]
    assert [row.depth_ratio for row in rows] == [1.0] * 4 + [RHO] * 4
    lam, tau = scenario.law.lam, scenario.vision.latency
    for row in rows:
        M = by_differences(scenario.with_(depth_ratio=row.depth_ratio))
        gain = float("with k_ff" in row.case)
        twist = np.array(row.twist)
        expected = tau * twist - np.linalg.solve(lam * M, (np.eye(6) - gain * M) @ twist)
        np.testing.assert_allclose(row.law, expected, rtol=0, atol=1e-7 * np.abs(twist).max())
        assert "focal ratio 1.1" in row.case
        # What is left of the bend after the extrapolation is of fifth order.
        np.testing.assert_allclose(row.linear, expected, rtol=0, atol=2e-3 * np.abs(expected).max())
    # A turn is answered with a slide too, which no scalar κ does.
    turn = next(row for row in rows if row.motion == "turn about y")
    assert abs(turn.linear[0]) > 0.01 * abs(turn.linear[4])


def test_nearly_equal_directions_do_not_blur_the_limit():
    scenario = paper.sliding()
    found = study.stability_edge(scenario, (), (0.995, 1.005))
    assert found.agrees
    for row, kappa in zip(found.rows, (1.0, 1.005), strict=True):
        limit = 2 * np.sin(np.pi / 10) / (kappa * 0.04)
        assert row.simulated == pytest.approx(limit, rel=1e-5)


def test_what_theory_knows_nothing_of_is_off_in_the_experiments():
    clean = paper.sliding()
    dirty = clean.with_(
        noise_px=3.0, k1=0.2, speed_limit=0.01, dead_time=0.1, T_i=1.0, preview=0.1,
        offset=(0.05, 0, 0, 0, 0, 0), outliers=0.1, size_px=(800, 800), drift=(0.02,) * 6,
    )  # fmt: skip
    for ask in (
        lambda scenario: study.sine_response(scenario, (3.0,)),
        lambda scenario: study.decay_modes(scenario, (2.5,)),
        lambda scenario: study.stability_edge(scenario, (0,), ()),
    ):
        assert ask(dirty).rows == ask(clean).rows
    assert (runs.run(dirty, 20).lag == runs.run(clean, 20).lag).all()
