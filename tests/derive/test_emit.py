"""Printed source against SymPy, and the committed kernels against what the derivation prints."""

import ast
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from oracles.running_error import exact_and_bound
from sympy import Symbol, lambdify, log, sqrt, symbols

from vsctrl.derive import (
    PIXELS,
    Feature,
    Point,
    catalogue,
    emit,
    emit_servo_kernels,
    interaction_matrix,
)
from vsctrl.derive.catalogue import FEATURES as CATALOGUE
from vsctrl.derive.emit.mathematics import as_text, latex_names
from vsctrl.errors import InputError
from vsctrl.servo.generated import kernels
from vsctrl.symbols import F_x, F_y, lam, x, y, z

named = cache(catalogue.named)  # derived once for all tests
printed_kernels = cache(emit_servo_kernels)  # and printed once
SHAPES = [(), (4,), (3, 5)]
FIRST, SECOND = (x, y, z), symbols("x_1 y_1 z_1", positive=True)


def run(source):
    namespace = {}
    exec(source, namespace)
    return namespace


def evaluated(matrix, arguments, values):
    """The SymPy matrix at every place of the broadcast batch, one place at a time, in doubles."""
    batch = np.broadcast_arrays(*values)
    exact = lambdify(arguments, matrix.tolist(), "mpmath")
    out = np.empty((*batch[0].shape, *matrix.shape))
    for place in np.ndindex(batch[0].shape):
        out[place] = np.array(exact(*(float(v[place]) for v in batch)), dtype=float)
    return out


def test_the_committed_kernels_regenerate_to_the_letter():
    assert Path(kernels.__file__).read_text(encoding="utf-8") == printed_kernels()


def test_the_command_prints_the_kernels():
    """Also in another process, where sets and dictionaries of symbols iterate otherwise."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "vsctrl.derive.emit"],
        env={**os.environ, "PYTHONHASHSEED": "4711"},
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert done.stdout == printed_kernels()
    assert done.stderr == ""


def test_the_kernels_import_numpy_only():
    imports = [
        node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
        for node in ast.walk(ast.parse(printed_kernels()))
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    assert imports == ["numpy", "numpy.typing"]


@pytest.mark.parametrize("shape", SHAPES)
def test_point_interaction_equals_sympy(shape):
    rng = np.random.default_rng(1)
    values = [
        rng.uniform(-300, 300, shape),
        rng.uniform(-300, 300, shape),
        rng.uniform(0.3, 3, shape),
        rng.uniform(300, 900, shape),
        rng.uniform(300, 900, shape),
    ]
    L = kernels.point_interaction(*values)
    assert L.shape == (*shape, 2, 6)
    expected = evaluated(interaction_matrix(Point(PIXELS)), Point(PIXELS).arguments, values)
    # A handful of roundings; the two terms of columns 4 and 5 have the same sign: no cancellation.
    np.testing.assert_allclose(L, expected, rtol=2e-15)


@pytest.mark.parametrize("shape", SHAPES)
def test_point_projection_is_eq_15(shape):
    rng = np.random.default_rng(2)
    px, py, pz = rng.uniform([-1] * 2 + [0.3], [1, 1, 3], (*shape, 3)).T
    s = kernels.point_projection(px, py, pz, 700.0, 650.0)
    assert s.shape == (*px.shape, 2)
    np.testing.assert_allclose(s[..., 0], px / pz * 700.0, rtol=1e-15)
    np.testing.assert_allclose(s[..., 1], py / pz * 650.0, rtol=1e-15)


def test_arguments_broadcast():
    rng = np.random.default_rng(3)
    u, v, depth = rng.uniform(1, 9, (3, 1)), rng.uniform(1, 9, 5), np.float64(0.7)
    L = kernels.point_interaction(u, v, depth, 700.0, 650.0)
    assert L.shape == (3, 5, 2, 6)
    values = [u, v, depth, 700.0, 650.0]
    expected = evaluated(interaction_matrix(Point(PIXELS)), Point(PIXELS).arguments, values)
    np.testing.assert_allclose(L, expected, rtol=2e-15)


def test_no_batch_shares_memory():
    first = kernels.point_interaction(1.0, 2.0, 3.0, 4.0, 5.0)
    first[...] = 0
    assert kernels.point_interaction(1.0, 2.0, 3.0, 4.0, 5.0).any()


def test_emit_prints_a_module_that_runs_by_itself():
    printed = run(emit(Point(PIXELS)))["point_interaction"]
    batch = np.array([10.0, 20.0, 30.0])
    here = printed(batch, 2 * batch, 0.8, 700.0, 650.0)
    np.testing.assert_array_equal(here, kernels.point_interaction(batch, 2 * batch, 0.8, 700, 650))


FEATURES = [
    # Constant entries, zero (0) and not (−1), on batched input.
    Feature("depth", (z,), (FIRST,)),
    Feature("logs", (log(z / lam), x / sqrt(x**2 + z**2)), (FIRST,), (lam,)),
    Feature(
        "length",
        (sqrt(F_x**2 * (x / z - SECOND[0] / SECOND[2]) ** 2 + F_y**2 * y**2),),
        (FIRST, SECOND),
        (F_x, F_y),
    ),
    # Names that the printed function could trip over.
    Feature("clash", (x * Symbol("c0") / z**3 + Symbol("out") * y,), (FIRST,), symbols("c0 out")),
]


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.name)
@pytest.mark.parametrize("shape", SHAPES)
def test_any_feature_prints_what_sympy_derives(feature, shape):
    rng = np.random.default_rng(4)
    values = [rng.uniform(0.5, 2, shape) for _ in feature.arguments]
    L = run(emit(feature))[f"{feature.name}_interaction"](*values)
    matrix = interaction_matrix(feature)
    assert L.shape == (*shape, *matrix.shape)
    expected = evaluated(matrix, feature.arguments, values)
    np.testing.assert_allclose(L, expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_feature_of_the_catalogue_is_exact_up_to_rounding(name):
    feature = named(name)
    rng = np.random.default_rng(5)
    values = {symbol.name: rng.uniform(0.5, 1.5, (2, 1)) for symbol in feature.arguments}
    if "R" in values:  # a sphere, farther than its radius
        values["z"] = values["z"] + 2 * values["R"]
    L = run(emit(feature))[f"{feature.name}_interaction"](*values.values())
    assert L.shape == (2, 1, *feature.interaction.shape)
    for i in range(2):
        here = [v[i, 0] for v in values.values()]
        exact, bound = exact_and_bound(feature.interaction, feature.arguments, here)
        np.testing.assert_array_less(np.abs(L[i, 0] - exact), 1.01 * np.array(bound) + 1e-300)


# LaTeX, MathML and text ------------------------------------------------------------------------
def test_the_point_in_latex():
    """As in textbooks, Chaumette and Hutchinson's (11), with z for Z."""
    assert emit(Point(), "latex").split("\n") == [
        r"\begin{bmatrix}",
        r"- \frac{1}{z} & 0 & \frac{X}{z} & X Y & - X^{2} - 1 & Y \\",
        r"0 & - \frac{1}{z} & \frac{Y}{z} & Y^{2} + 1 & - X Y & - X",
        r"\end{bmatrix}",
        "",
    ]


NAMES = {
    "x": "x",
    "X": "X",
    "z_star": "z^{*}",
    "Z_star": "Z^{*}",
    "F_x": "F_{x}",
    "n_20": "n_{20}",
    "X_1": "X_{1}",
    "rho": r"\rho",
    "Rho": r"\mathrm{Rho}",
    "RHO": r"\mathrm{RHO}",
    "Omega_x": r"\Omega_{x}",
    "omega_x": r"\omega_{x}",
    "Xbar": r"\mathrm{Xbar}",
    "xhat": r"\mathrm{xhat}",
    "thetau_x": r"(\theta u)_{x}",
    "x1": "x_{1}",
    "x_1": r"\mathrm{x\_1}",  # the other one has x with a small 1
    "_private": r"\mathrm{\_private}",
    "lambda": r"\lambda",
}


def test_latex_keeps_the_case_of_every_name():
    symbols_ = [Symbol(name) for name in NAMES]
    assert {s.name: latex for s, latex in latex_names(symbols_).items()} == NAMES


def test_mathml_keeps_the_case_of_every_name():
    letters = ("x", "X", "rho", "Rho", "RHO", "omega", "Omega", "Xbar", "XBAR")
    parameters = symbols(letters, positive=True)
    point = symbols("p_x p_y p_z", positive=True)
    feature = Feature("cases", tuple(p * point[0] for p in parameters), (point,), parameters)
    root = ET.fromstring(emit(feature, "mathml"))
    space = "{http://www.w3.org/1998/Math/MathML}"
    assert root.tag == f"{space}math"
    column = [row[0] for row in root.iter(f"{space}mtr")]
    words = ["".join(cell.itertext()).lstrip("−") for cell in column]
    assert words == ["x", "X", "ρ", "Rho", "RHO", "ω", "Ω", "Xbar", "XBAR"]


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_feature_is_mathml_of_its_size(name):
    feature = named(name)
    root = ET.fromstring(emit(feature, "mathml"))
    table = next(root.iter("{http://www.w3.org/1998/Math/MathML}mtable"))
    assert len(table) == feature.interaction.rows
    assert {len(row) for row in table} == {6}
    assert "\\" not in "".join(root.itertext())  # no LaTeX is left


def test_a_power_of_a_name_with_a_power_is_in_parentheses():
    z_star = Symbol("z_star", positive=True)
    feature = Feature("squared", (x * z_star**2,), (FIRST,), (z_star,))
    assert r"- \left(z^{*}\right)^{2} & 0" in emit(feature, "latex")


def test_text_is_a_matrix_where_it_fits_and_rows_where_not():
    wide = as_text(Point(), width=60)
    assert "⎡-1        X" in wide and "X, Y: image point" in wide and "z: depth, m" in wide
    narrow = as_text(Point(), width=25)
    assert "  Ωy  -X**2 - 1" in narrow and "⎡" not in narrow and "with" not in narrow
    assert "  c0 = " in as_text(named("sphere"), width=40)


def test_an_unknown_language_is_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"did you mean 'latex'\?\); choose one of 'numpy', 'c', "):
        emit(Point(), language="Latx")
    with pytest.raises(InputError, match="language = 3 cannot be printed"):
        emit(Point(), language=3)


def test_an_unknown_language_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="language = 'fortran' cannot be printed; choose one of"):
        emit(Point(PIXELS), language="fortran")
