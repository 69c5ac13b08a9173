"""The oracle of rigid motions against motions that anybody can do by hand."""

import numpy as np
import pytest
from oracles import se3
from scipy.linalg import expm


def test_a_quarter_turn_about_z_takes_x_to_y():
    turned = expm(se3.hat([0, 0, 0, 0, 0, np.pi / 2])) @ [1, 0, 0, 1]
    np.testing.assert_allclose(turned, [0, 1, 0, 1], atol=1e-15)


def test_a_twist_is_the_velocity_of_the_points_that_move_with_the_body():
    V, W, p = np.array([[1.0, 2.0, 3.0], [0.4, -0.5, 0.6], [0.7, 0.8, -0.9]])
    np.testing.assert_allclose((se3.hat([*V, *W]) @ [*p, 1])[:3], V + np.cross(W, p), rtol=1e-15)


def test_vee_undoes_hat_and_log_undoes_exp():
    T = np.array([0.3, -0.2, 0.1, 0.5, 0.6, -0.7])
    np.testing.assert_array_equal(se3.vee(se3.hat(T)), T)
    np.testing.assert_allclose(se3.log(expm(se3.hat(T))), T, atol=1e-14)


def test_a_turn_carried_to_a_frame_beside_its_axis_moves_that_frame():
    """Turning about z through the origin, seen from 2 m along x: a point there moves along −y."""
    beside = np.eye(4)
    beside[0, 3] = -2.0
    found = se3.carried(beside, [0, 0, 0, 0, 0, 1])
    assert found == pytest.approx([0, 2, 0, 0, 0, 1])  # the axis passes 2 m behind that frame
