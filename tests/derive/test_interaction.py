"""The interaction matrix against the published formula and against a camera that really moves."""

import numpy as np
import pytest
from oracles.moving import COLUMNS, finite_difference
from sympy import Matrix, Symbol, lambdify, log, sqrt, symbols, zeros

from vsctrl.derive import PIXELS, Feature, Point, interaction_matrix
from vsctrl.symbols import F_x, F_y, X, Y, x, y, z

FIRST, SECOND = (x, y, z), symbols("x_1 y_1 z_1", positive=True)
x_1, y_1, z_1 = SECOND
FEATURES = [
    Point(PIXELS),
    Feature("depth", (log(z),), (FIRST,)),
    Feature("middle", ((x / z + x_1 / z_1) / 2, (y / z + y_1 / z_1) / 2), (FIRST, SECOND)),
    Feature(
        "length",
        (sqrt(F_x**2 * (x / z - x_1 / z_1) ** 2 + F_y**2 * (y / z - y_1 / z_1) ** 2),),
        (FIRST, SECOND),
        (F_x, F_y),
    ),
]


def test_point_matches_the_published_matrix():
    expected = Matrix(
        [
            [-F_x / z, 0, X / z, X * Y / F_y, -(F_x + X**2 / F_x), F_x * Y / F_y],
            [0, -F_y / z, Y / z, F_y + Y**2 / F_y, -X * Y / F_x, -F_y * X / F_x],
        ]
    )
    L = interaction_matrix(Point(PIXELS))
    assert L.shape == (2, 6)
    assert (L - expected).expand() == zeros(2, 6)


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.name)
@pytest.mark.parametrize("column", range(6), ids=COLUMNS)
def test_every_column_against_a_moving_camera(feature, column):
    rng = np.random.default_rng(20)
    size, k = (150, len(feature.points)), len(feature.expressions)
    points = rng.uniform([-0.4, -0.4, 0.5], [0.4, 0.4, 2.0], size=(*size, 3))
    focal = rng.uniform(300, 1200, size=(2, size[0]))
    symbols_used = (*feature.coordinates, F_x, F_y)
    s = lambdify(symbols_used, list(feature.expressions))

    def measure(p):
        return np.array(s(*p.reshape(size[0], -1).T, *focal))

    def image(p):
        """Pixels by eq. 15, in place of the coordinates x and y."""
        uv = p[..., :2] / p[..., 2:] * focal.T[:, None] if feature.measures else p[..., :2]
        return np.concatenate([uv, p[..., 2:]], axis=-1).reshape(size[0], -1).T

    written_in = feature.arguments[: len(feature.coordinates)]
    entries = lambdify((*written_in, F_x, F_y), list(interaction_matrix(feature)[:, column]))
    values = entries(*image(points), *focal)
    derived = np.array([np.broadcast_to(value, size[0]) for value in values])
    assert derived.shape == (k, size[0])
    # s of 1e3 px in doubles over h = 1e-3 leaves 1e-10; the fifth derivative is below 1e5 px here.
    np.testing.assert_allclose(derived, finite_difference(measure, points, column), atol=1e-6)


def test_depth_alone():
    L = interaction_matrix(Feature("depth", (z,), (FIRST,)))
    assert Matrix([[0, 0, -1, -y, x, 0]]).as_immutable() == L


def test_measures_are_substituted_everywhere():
    assert interaction_matrix(Point(PIXELS)).free_symbols == {X, Y, z, F_x, F_y}
    assert Symbol("x", real=True) not in interaction_matrix(Point(PIXELS)).free_symbols
