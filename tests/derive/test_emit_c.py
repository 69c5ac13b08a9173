"""Printed C, compiled with every warning an error, against NumPy."""

import ctypes
import itertools
import os
import shutil
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from oracles.running_error import exact_and_bound
from sympy import Float, Function, I, Integer, Piecewise, Rational, Symbol, gamma, log, pi, sqrt

from vsctrl.derive import Camera, Feature, Point, Sphere, catalogue, emit, evaluate
from vsctrl.derive.catalogue import FEATURES
from vsctrl.derive.emit.c import is_reserved
from vsctrl.errors import InputError
from vsctrl.symbols import x, y, z

named = cache(catalogue.named)  # derived once for all tests
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"]
P = (x, y, z)
_COUNT = itertools.count()


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """Compiles C source and loads it; without a compiler the test fails, since nothing is known."""
    folder = tmp_path_factory.mktemp("c")

    def compiled(source, *flags):
        stem = f"m{next(_COUNT)}"
        path = folder / f"{stem}.c"
        path.write_text(source, encoding="ascii")
        command = [shutil.which("cc") or "gcc", *STRICT, *flags, "-shared", "-fPIC"]
        done = subprocess.run(
            [*command, "-o", folder / f"{stem}.so", path, "-lm"], capture_output=True, text=True
        )
        assert done.returncode == 0 and not done.stderr, done.stderr + source
        return ctypes.CDLL(str(folder / f"{stem}.so"))

    return compiled


def in_c(library, name, rows, values):
    function = getattr(library, f"{name}_interaction")
    function.restype = None
    function.argtypes = [ctypes.c_double] * len(values) + [ctypes.POINTER(ctypes.c_double)]
    L = np.full((rows, 6), np.nan)  # every entry must be written
    function(*map(float, values), L.ctypes.data_as(ctypes.POINTER(ctypes.c_double)))
    return L


def assert_same(library, feature, name=None, places=3, low=0.5):
    """C and NumPy within the roundings that each of them may make."""
    rng = np.random.default_rng(7)
    for _ in range(places):
        values = {symbol.name: rng.uniform(low, low + 1) for symbol in feature.arguments}
        if "R" in values:  # a sphere, farther than its radius
            values["z"] += 2 * values["R"]
        matrix = feature.interaction
        L = in_c(library, name or feature.name, matrix.rows, values.values())
        _, bound = exact_and_bound(matrix, feature.arguments, values.values())
        expected = evaluate(feature, **values)
        np.testing.assert_array_less(np.abs(L - expected), 2.02 * np.array(bound) + 1e-300)


@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_is_the_same_in_c_and_numpy(build, name):
    feature = named(name)
    assert_same(build(emit(feature, "c")), feature)


def test_features_in_pixels_too(build):
    camera = Camera(centre=(Symbol("u_0"), Float("320.123456789012")), distortion=(Symbol("k_1"),))
    for feature in (named("line", pixels=True), named("polar-point", pixels=True), Point(camera)):
        assert_same(build(emit(feature, "c")), feature)


def test_where_theta_u_divides_zero_by_zero_c_does_not(build):
    feature = named("theta-u")
    L = in_c(build(emit(feature, "c")), feature.name, 3, [0, 0, 0])
    np.testing.assert_array_equal(np.abs(L), np.eye(3, 6, 3))


# Names and expressions that C could trip over ----------------------------------------------------
TRIPPING = ["y0", "j1", "gamma", "double", "lambda", "L", "c0", "sqrt", "new", "exp", "NAN", "M_PI"]


@pytest.mark.parametrize("standard", ["-std=c99", "-std=gnu17"])
def test_names_that_mean_something_in_c(build, standard):
    parameters = tuple(Symbol(name, positive=True) for name in TRIPPING)
    s = tuple(sqrt(x * a) / z + log(a * y) * z**3 for a in parameters)
    feature = Feature("double", s, (P,), parameters)
    source = emit(feature, "c")
    signature = source[source.index("void double_interaction(") : source.index("\n{")]
    for name in TRIPPING:
        assert f"const double {name}," not in signature or name in ("c0", "lambda")
    assert_same(build(source, standard), feature)


def test_renamed_arguments_stay_different(build):
    parameters = tuple(Symbol(name, positive=True) for name in ("y0", "y0_", "y0__", "_Xa", "θ"))
    s = (sum(a * x ** (i + 1) for i, a in enumerate(parameters)),)
    feature = Feature("named", s, (P,), parameters)
    source = emit(feature, "c")
    assert "const double theta" in source and "const double _" not in source
    assert_same(build(source), feature)


def test_all_macros_and_functions_of_math_h_are_reserved():
    """The preprocessor and the compiler's own list of names, whatever the C library is."""
    cc = shutil.which("cc") or "gcc"
    macros = subprocess.run(
        [cc, "-D_GNU_SOURCE", "-dM", "-E", "-include", "math.h", "-x", "c", os.devnull],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    plain = {line.split()[1].split("(")[0] for line in macros.splitlines()}
    known = {name for name in plain if name[0] != "_"}
    assert {"NAN", "isnan", "M_PI"} <= known
    assert not {name for name in known if not is_reserved(name)}


def test_numbers_keep_all_their_digits(build):
    third = Float(1) / 3
    s = (
        third * x + pi * y + Rational(1, 3) * z,
        10**30 * x + Integer(2**31) * y - 2 * z,
        x ** Rational(3, 2) / (x + y) ** 2 + (y + z) ** Rational(-5, 2),
        z / (x**2 + y**2) ** 3,
        Piecewise((x, x < y), (y / 2, True)) / 3,
        x**100 / 2**90,
    )
    feature = Feature("digits", s, (P,))
    source = emit(feature, "c")
    assert "0.3333333333333333*" in source or "0.3333333333333333;" in source
    assert "M_PI" not in source and "pow(" in source  # of x^99, and of nothing else
    assert source.count("pow(") == 1
    assert_same(build(source), feature)


def test_integer_powers_are_products_in_c_and_numpy():
    feature = Feature("powers", (x**4 / z**3, y / (x + y) ** 3, (x + z) ** Rational(3, 2)), (P,))
    assert "pow(" not in emit(feature, "c")
    assert "**" not in emit(feature, "numpy")


# What the text says ------------------------------------------------------------------------------
def test_the_point_in_c():
    source = emit(Point(), "c")
    assert source.startswith("#include <math.h>\n")
    assert source.count("#include") == 1
    assert "void point_interaction(const double X, const double Y, const double z, " in source
    assert "double L[2][6])" in source
    for words in ("L of point", "Columns Vx Vy Vz (per m/s)", "z: depth, m", "p' = -V - Omega x p"):
        assert words in source
    assert source.isascii()
    assert source.count("/z") == 1  # shared


def test_an_argument_that_l_does_not_depend_on_is_no_warning(build):
    """z_star of log_depth; -Wextra would tell."""
    source = emit(named("log-depth"), "c")
    assert "(void)z_star;" in source
    build(source)


def test_the_text_is_the_same_in_every_process():
    code = (
        "from vsctrl.derive import Sphere, emit\n"
        "feature = Sphere()\n"
        "print(emit(feature, 'c'), emit(feature))"
    )
    feature = Sphere()
    here = f"{emit(feature, 'c')} {emit(feature)}\n"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONHASHSEED": "4711"},
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert done.stdout == here


@pytest.mark.parametrize(
    ("s", "words"),
    [
        (Function("f")(x) * x, "C has no function"),
        (gamma(x), "C has no function"),  # its derivative is polygamma
        (I * x, "is not real in row 0"),
    ],
)
def test_what_c_cannot_say_is_refused(s, words):
    with pytest.raises(InputError, match=words):
        emit(Feature("strange", (s,), (P,)), "c")
