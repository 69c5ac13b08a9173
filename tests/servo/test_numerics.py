"""Numerical methods that modules of the simulator share, on problems with known answers."""

import numpy as np
import pytest
from scipy.linalg import expm

from vsctrl import InputError
from vsctrl.servo import checks
from vsctrl.servo.feasibility.golden_section import GOLDEN, golden_section
from vsctrl.servo.least_squares import minimise
from vsctrl.servo.magnus import NODE, integrated, magnus, magnus_one

RNG = np.random.default_rng(7)
TIMES = 0.3 + 0.2 * np.array([0.5 - NODE, 0.5, 0.5 + NODE])


# Magnus steps ----------------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(20))
def test_the_step_in_plain_arithmetic_is_the_step_of_arrays(seed):
    a, b, c = np.random.default_rng(seed).normal(size=(3, 6))

    def twist(t):
        t = np.asarray(t)[..., None]
        return a + b * t + c * t**2

    got = magnus_one(*(-0.2 * twist(t) for t in TIMES))
    np.testing.assert_allclose(got, magnus(twist, np.array(0.3), np.array(0.5)), atol=1e-15)


def test_poses_at_knots_are_the_products_of_exponentials_where_the_twist_keeps_its_screw():
    T = RNG.normal(size=6)
    hat = np.zeros((4, 4))
    x, y, z = T[3:]
    hat[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    hat[:3, 3] = T[:3]
    knots = np.array([0.0, 0.1, 0.4, 1.0])
    poses = integrated(np.eye(4), lambda t: np.asarray(t)[..., None] * T, knots)
    for t, pose in zip(knots, poses, strict=True):
        np.testing.assert_allclose(pose, expm(hat * t**2 / 2), atol=1e-14)


# Least squares ---------------------------------------------------------------------------------
class Curves:
    """min (x − a)² + w (y − x²)² for many a and w at once, of which the minimum is (a, a²)."""

    def __init__(self, a, w, start):
        self.a, self.w = a, w
        self.best = self.tried = np.broadcast_to(start, (len(a), 2)).astype(float)
        self.refused = np.zeros(len(a), dtype=int)

    def _residuals(self, p):
        return np.stack([p[:, 0] - self.a, np.sqrt(self.w) * (p[:, 1] - p[:, 0] ** 2)], axis=-1)

    def cost(self):
        return np.sum(self._residuals(self.tried) ** 2, axis=-1)

    def accept(self, better):
        self.refused += ~better
        self.best = np.where(better[:, None], self.tried, self.best)

    def step(self, damping):
        J = np.zeros((len(self.a), 2, 2))
        J[:, 0, 0], J[:, 1, 1] = 1.0, np.sqrt(self.w)
        J[:, 1, 0] = -2 * np.sqrt(self.w) * self.best[:, 0]
        A = J.swapaxes(1, 2) @ J
        A = A + damping[:, None, None] * A * np.eye(2)
        gradient = J.swapaxes(1, 2) @ self._residuals(self.best)[..., None]
        step = -np.linalg.solve(A, gradient)[..., 0]
        self.tried = self.best + step
        return np.abs(step).max(axis=-1) < 1e-9


def test_every_problem_ends_in_its_own_minimum_however_many_there_are():
    a, w = RNG.uniform(-2, 2, 40), RNG.uniform(1, 100, 40)
    problem = Curves(a, w, (-1.2, 1.0))
    ended = minimise(problem, problem.cost(), 100)
    assert ended.settled.all() and 2 < ended.steps < 100
    np.testing.assert_allclose(problem.best, np.stack([a, a**2], axis=-1), atol=1e-7)
    assert problem.refused.any()  # far starts need the damping
    for k in range(0, 40, 8):
        alone = Curves(a[k : k + 1], w[k : k + 1], (-1.2, 1.0))
        minimise(alone, alone.cost(), 100)
        np.testing.assert_array_equal(alone.best[0], problem.best[k])


def test_what_has_no_finite_cost_or_no_time_has_no_minimum():
    problem = Curves(np.array([1.0, 1.0, 1.0]), np.full(3, 100.0), (-1.2, 1.0))
    ended = minimise(problem, np.array([np.inf, np.nan, problem.cost()[2]]), 100)
    assert ended.settled.tolist() == [False, False, True]
    problem = Curves(np.array([1.0]), np.array([100.0]), (-1.2, 1.0))
    ended = minimise(problem, problem.cost(), 2)
    assert not ended.settled.any() and ended.steps == 2


def test_a_small_step_after_a_crawl_is_no_minimum():
    class Stuck:
        """Every step is refused until the damping makes it small."""

        def step(self, damping):
            return np.asarray(1 / (1 + damping) < 1e-3)

        def cost(self):
            return np.asarray(2.0)

        def accept(self, better):
            assert not better

    ended = minimise(Stuck(), np.asarray(1.0), 100)
    assert not ended.settled and ended.steps < 100


# Golden section --------------------------------------------------------------------------------
def test_each_function_is_searched_in_its_own_bracket():
    tops, seen = RNG.uniform(0, 1, 9), []
    low, high = tops - RNG.uniform(0, 1, 9), tops + RNG.uniform(0, 1, 9)
    got = golden_section(lambda x: -((x - tops) ** 2), low, high, 30, lambda x, f: seen.append(x))
    width = (high - low) * GOLDEN**30
    assert ((got <= tops + 1e-8) & (tops <= got + width + 1e-8)).all()
    assert len(seen) == 60
    assert all(((low < x) & (x < high)).all() for x in seen)


# Checks ----------------------------------------------------------------------------------------
def test_a_choice_lists_its_words():
    for letters, listed in {"a": "'a'", "ab": "'a' or 'b'", "abc": "'a', 'b' or 'c'"}.items():
        words = tuple(letters)
        checks.choice("key", "a", words)
        with pytest.raises(InputError, match=rf"^key: 'x' is no choice; give {listed}\.$"):
            checks.choice("key", "x", words)


def test_what_is_typed_may_be_a_little_less_rigid_than_what_is_computed():
    off = np.eye(4)
    assert checks.is_rigid(off)
    off[0, 0] += 4e-6  # (RᵀR)₁₁ is 8e-6 too much
    assert not checks.is_rigid(off)
    checks.rigid("pose", off)
    off[0, 0] += 4e-6
    mirrored, last = np.diag([1.0, 1.0, -1.0, 1.0]), np.eye(4)
    last[3, 0] = 1e-7
    for bad in (off, mirrored, last):
        with pytest.raises(InputError, match=r"^pose: the matrix is no rigid motion"):
            checks.rigid("pose", bad)
    stack = np.stack([np.eye(4), mirrored, last, np.full((4, 4), np.nan)])
    assert checks.is_rigid(stack).tolist() == [True, False, True, False]
