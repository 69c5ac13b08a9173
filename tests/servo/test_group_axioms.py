"""The rigid motions are a group, twists its algebra, and the adjoint acts on them: any motions."""

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl.servo import pose

MANY = settings(max_examples=effort.share(200, least=50), deadline=None)
ATOL = 2e-13  # products of translations of some metres, a few ulp each

metres = st.floats(-3, 3)
twists = st.builds(
    lambda v, axis, angle: np.array([*v, *(angle * np.array(axis) / np.linalg.norm(axis))]),
    st.tuples(metres, metres, metres),
    st.tuples(metres, metres, metres).filter(lambda axis: np.linalg.norm(axis) > 1e-3),
    st.floats(0, np.pi - 1e-3),  # half a turn has two logarithms
)
motions = twists.map(pose.exp)


def same(found, expected):
    np.testing.assert_allclose(found, expected, atol=ATOL)


@MANY
@given(motions, motions, motions)
def test_composition_is_associative_and_stays_in_the_group(a, b, c):
    same((a @ b) @ c, a @ (b @ c))
    R = (a @ b)[:3, :3]
    same(R @ R.T, np.eye(3))
    assert np.linalg.det(R) == pytest.approx(1, abs=ATOL)
    np.testing.assert_array_equal((a @ b)[3], [0, 0, 0, 1])


@MANY
@given(motions, motions)
def test_the_inverse_undoes_a_motion_from_both_sides_and_turns_products_round(a, b):
    same(pose.inverse(a) @ a, np.eye(4))
    same(a @ pose.inverse(a), np.eye(4))
    same(pose.inverse(a @ b), pose.inverse(b) @ pose.inverse(a))


@MANY
@given(twists)
def test_log_undoes_exp_and_minus_the_twist_is_the_inverse(T):
    same(pose.log(pose.exp(T)), T)
    same(pose.exp(-T), pose.inverse(pose.exp(T)))


@MANY
@given(twists, st.floats(-2, 2), st.floats(-2, 2))
def test_motions_along_one_twist_add_up(T, h, k):
    same(pose.exp(h * T) @ pose.exp(k * T), pose.exp((h + k) * T))


@MANY
@given(motions, motions, twists)
def test_the_adjoint_is_linear_and_follows_composition(a, b, T):
    same(pose.adjoint(a @ b), pose.adjoint(a) @ pose.adjoint(b))
    same(pose.adjoint(pose.inverse(a)) @ (pose.adjoint(a) @ T), T)
    same(a @ pose.exp(T) @ pose.inverse(a), pose.exp(pose.adjoint(a) @ T))


@MANY
@given(twists)
def test_a_twist_is_carried_into_itself_by_its_own_motion(T):
    same(pose.adjoint(pose.exp(T)) @ T, T)
