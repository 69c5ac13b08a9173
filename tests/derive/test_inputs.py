"""Cameras and coefficients given as floats, and what features refuse with a sentence."""

import mpmath as mp
import numpy as np
import pytest
from sympy import Float, Function, Rational, Symbol, floor, oo

from vsctrl import derive
from vsctrl.derive import Camera, Feature, evaluate, interaction_matrix
from vsctrl.derive.features import moments
from vsctrl.derive.features.moments import Moments, m, mu
from vsctrl.errors import InputError
from vsctrl.symbols import X, Y, x, y, z

FOCAL, CENTRE, SKEW = (812.3, 799.7), (319.7, 241.3), 0.37
CAMERA = Camera(focal=FOCAL, centre=CENTRE, skew=SKEW)
OWN = (812.3 * x / z + 319.7, 799.7 * y / z + 241.3)


def image(p):
    """The doubles as they are: they differ from their decimals by 1e-16 relative."""
    a, b = p[0] / p[2], p[1] / p[2]
    return FOCAL[0] * a + SKEW * b + CENTRE[0], FOCAL[1] * b + CENTRE[1]


def own_image(p):
    return FOCAL[0] * p[0] / p[2] + CENTRE[0], FOCAL[1] * p[1] / p[2] + CENTRE[1]


def polar(p):
    u, v = (seen - origin for seen, origin in zip(image(p), CENTRE, strict=True))
    return mp.hypot(u, v), mp.atan2(v, u)


def segment(p, q):
    (a, b), (c, d) = image(p), image(q)
    return (a + c) / 2, (b + d) / 2, mp.hypot(a - c, b - d), mp.atan2(b - d, a - c)


def by_differences(s, points, still):
    """∂s/∂(V, Ω) by central differences of p' = −V − Ω × p in 50 digits: an error of 1e-20 or so;
    a vector that is ``still`` is a direction, which feels no V."""
    h = mp.mpf(10) ** -15
    columns = []
    for j in range(6):
        twist = [mp.mpf(int(i == j)) for i in range(6)]

        def moved(side, twist=twist):
            (u, v, w), (a, b, c) = (0, 0, 0) if still else twist[:3], twist[3:]
            rates = [
                (-u - b * r + c * q, -v - c * p + a * r, -w - a * q + b * p) for p, q, r in points
            ]
            return s(
                *(
                    [mp.mpf(e) + side * h * rate for e, rate in zip(point, moving, strict=True)]
                    for point, moving in zip(points, rates, strict=True)
                )
            )

        columns.append([(f - g) / (2 * h) for f, g in zip(moved(1), moved(-1), strict=True)])
    return np.array(columns, dtype=float).T


P, Q = (0.13, -0.21, 0.9), (-0.34, 0.17, 1.4)
WHERE = dict(zip("xyz", P, strict=True))
DEPTHS = {"z_1": P[2], "z_2": Q[2]}
# feature, its s in numbers, where it is, names of what it measures, depths, whether a direction
CASES = {
    "point": (derive.Point(CAMERA), image, (P,), ("X", "Y"), {"z": P[2]}),
    "polar": (derive.PolarPoint(CAMERA), polar, (P,), ("rho", "theta"), {"z": P[2]}),
    "segment": (derive.Segment(CAMERA), segment, (P, Q), ("x_c", "y_c", "l", "alpha"), DEPTHS),
    "vanishing": (derive.VanishingPoint(CAMERA), image, (P,), ("X", "Y"), {}),
    "own": (Feature("own", OWN, ((x, y, z),)), own_image, (P,), (), WHERE),
    "solved": (
        Feature("solved", OWN, ((x, y, z),), measures=((X, OWN[0]), (Y, OWN[1]))),
        own_image, (P,), ("X", "Y"), {"z": P[2]},
    ),
    "placed": (
        Feature(
            "placed", OWN, ((x, y, z),), measures=((X, OWN[0]), (Y, OWN[1])),
            places=((x, (X - 319.7) / 812.3 * z), (y, (Y - 241.3) / 799.7 * z)),
        ),
        own_image, (P,), ("X", "Y"), {"z": P[2]},
    ),
}  # fmt: skip


# Floats -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", CASES)
def test_a_calibration_in_floats_gives_the_matrix_of_finite_differences(name):
    feature, s, points, names, depths = CASES[name]
    with mp.workdps(50):
        expected = by_differences(s, points, name == "vanishing")
        seen = s(*([mp.mpf(e) for e in point] for point in points))
        values = dict(zip(names, map(float, seen), strict=False)) | depths
    found = evaluate(feature, **values)
    # Rounding of the given pixels, of size 1e3: 1e-13 relative of the largest entry and more.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["point", "segment", "placed"])
def test_printed_source_of_a_calibration_in_floats_is_the_matrix(name):
    feature = CASES[name][0]
    namespace = {}
    exec(derive.emit(feature, "numpy"), namespace)
    values = np.linspace(0.5, 1.5, len(feature.arguments))
    L = namespace[f"{feature.name}_interaction"](*values)
    at = dict(zip(feature.arguments, map(Rational, values), strict=True))
    exact = np.array(interaction_matrix(feature).xreplace(at).evalf(30).tolist(), dtype=float)
    np.testing.assert_allclose(L, exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())


def test_a_camera_keeps_floats_as_the_decimals_that_they_print_as():
    assert CAMERA.focal == (Rational(8123, 10), Rational(7997, 10))
    assert Camera((Rational("812.3"), np.float64(799.7)), CENTRE, Float(0.37)) == CAMERA
    digits = Camera(centre=(Float("320.1234567890123456789", 25), 0)).centre[0]
    assert abs(digits - Rational("320.1234567890123456789")) < Rational(1, 10**20)


def test_the_depth_and_a_set_of_points_take_a_calibration_in_floats():
    L = interaction_matrix(derive.Depth(CAMERA))
    assert L[0, 2] == -1 and not L.has(Float)
    four = derive.copies(derive.Point(CAMERA), 4)
    assert interaction_matrix(four).shape == (8, 6)


def test_places_that_miss_their_measure_by_a_tenth_of_a_pixel_are_refused():
    places = ((x, (X - 319.6) / 812.3 * z), (y, (Y - 241.3) / 799.7 * z))
    with pytest.raises(InputError, match="does not give back its measure X"):
        Feature("off", OWN, ((x, y, z),), measures=((X, OWN[0]), (Y, OWN[1])), places=places)


# Sentences --------------------------------------------------------------------------------------
MAKERS = {
    name: getattr(derive, name)
    for name in (
        "Point", "PolarPoint", "Depth", "LogDepth", "Segment", "VanishingPoint", "Line", "Ellipse",
        "SeenLine", "SeenEllipse", "SeenCircle", "SeenSphere", "Area", "GravityCentre",
        "NormalisedMoments", "Orientation",
    )
}  # fmt: skip


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("camera", ["pixels", None, 3])
def test_what_is_no_camera_is_refused(name, camera):
    with pytest.raises(InputError, match=r"camera = .* is no camera; give derive.PIXELS or"):
        MAKERS[name](camera=camera)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: derive.Moment(2, 0, camera=None), "camera = None is no camera"),
        (lambda: derive.VanishingPoint(3, form="atan"), "camera = 3 is no camera"),
        (lambda: derive.Area(camera=Camera((1, 1), (moments.x_g, 0))), "uses x_g for two things"),
        (lambda: derive.Area(plane=(moments.a, 0, 1)), "uses a for two things"),
        (lambda: Moments("q", (m(2, 0),), parameters=(Symbol("m_11"),)), "uses m_11 for two"),
        (lambda: Moments("q", (m(2, 0),), parameters=3), "parameters .* tuple of symbols.*got 3"),
        (lambda: Moments("q", (m(2, 0),), places=3), "places .* must be pairs.*got 3"),
        (lambda: Moments("q", (oo * m(2, 0),)), "is not finite"),
        (lambda: Moments("q", (mu(2, 0) / mu(1, 0),)), "is not finite wherever .* μ_10 and μ_01"),
        (lambda: Moments("q", (floor(m(2, 0)),)), "is not differentiable: its derivative holds"),
        (lambda: Moments("q", (Function("g")(m(2, 0)),)), r"is not differentiable.*g\(m_20\)"),
        (lambda: derive.CentredMoment(0, 0, False), "never changes: .* number of its points"),
    ],
)  # fmt: skip
def test_what_is_no_feature_ends_in_a_sentence(ask, message):
    with pytest.raises(InputError, match=message):
        ask()
