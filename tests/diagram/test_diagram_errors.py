"""Bad input ends in a sentence: it names what was given, and says what to do."""

import re

import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1

from vsctrl.diagram import Block, Diagram, Parabola, Ramp, Sine, Step, Sum
from vsctrl.errors import InputError
from vsctrl.symbols import ell_hat, lam, s, tau

X = sp.Symbol("x")
ONE = Block("a", 1, "u -> y")


def refuse(ask, *words):
    """`ask` raises InputError whose one sentence holds all these words and ends as one."""
    with pytest.raises(InputError) as caught:
        ask()
    text = str(caught.value)
    for word in words:
        assert word in text, f"{word!r} is missing in: {text}"
    assert text.endswith((".", "…")), text
    assert "\n" not in text
    # A sentence for the user shows values, not Python's insides.
    assert not re.search(r"<.* at 0x|Traceback|dtype=", text)


# Blocks ----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("expr", "words"),
    [
        ("1/s", ["'1/s'", "no transfer function", "SymPy"]),
        (True, ["True", "no transfer function"]),
        (None, ["None", "no transfer function"]),
        (1j, ["1j", "no transfer function"]),
        ([1.0, 2.0], ["no transfer function"]),
        (sp.Matrix([[s]]), ["no transfer function"]),
        (sp.Eq(s, 1), ["no transfer function"]),
        (float("nan"), ["nan", "finite"]),
        (float("inf"), ["inf", "finite"]),
        (sp.nan, ["nan", "give a"]),
        (sp.oo, ["infinite", "division by zero"]),
        (sp.zoo, ["infinite", "division by zero"]),
        (sp.exp(tau * s), ["predicts the future", "exp(-tau*s)"]),
        (sp.exp(s), ["predicts the future"]),
        (1 / sp.exp(-tau * s), ["predicts the future"]),
        (sp.exp(-(s**2)), ["no constant delay", "linear in s"]),
        (sp.exp(-1 / s), ["no constant delay"]),
        (sp.sqrt(s), ["sqrt(s)", "rational"]),
        (s**lam, ["rational"]),
        (sp.sin(s), ["sin(s)", "rational"]),
        (sp.log(s + 1), ["log", "rational"]),
        (sp.tanh(s), ["rational"]),
        (sp.Abs(s), ["rational"]),
        (sp.Function("f")(s), ["f(s)", "rational"]),
        (2 ** (-s), ["rational"]),
        (sp.sqrt(sp.exp(-tau * s) + 1), ["rational"]),
        (1 / (s + sp.sqrt(1 + s)), ["rational"]),
        (sp.Piecewise((s, X > 0), (1, True)), []),
    ],
    ids=str,
)
def test_expressions_that_are_no_block(expr, words):
    refuse(lambda: Block("odd one", expr, "u -> y"), "'odd one'", *words)


def test_numbers_of_every_honest_kind_are_gains():
    from fractions import Fraction

    for value in (2, 2.0, np.float64(2), np.int64(2), np.float32(2), Fraction(2), sp.Integer(2)):
        assert Block("g", value, "u -> y").rational.num_expr == 2


@pytest.mark.parametrize("wiring", ["u", "u > y", "u -> ", "-> y", "u -> y -> z", "", None, 3])
def test_wirings_that_are_none(wiring):
    refuse(lambda: Block("odd one", 1, wiring), "'odd one'", "u -> y")


@pytest.mark.parametrize("name", ["2y", "y-1", "y.z", "y[0]"])
def test_names_that_are_no_signals(name):
    refuse(lambda: Block("b", 1, f"u -> {name}"), name, "letters, digits")


@pytest.mark.parametrize("name", ["", "  ", None, 3])
def test_blocks_without_a_name(name):
    refuse(lambda: Block(name, 1, "u -> y"), "name")


@pytest.mark.parametrize(
    "text",
    ["e", "e =", "= a", "e = a b", "e = a *b", "e = a + + b", "e = a -", "e = 2 - a", "", None, 4],
)
def test_sums_that_are_no_equation(text):
    refuse(lambda: Sum(text))


def test_a_signal_twice_in_a_sum():
    refuse(lambda: Sum("e = a - b + a"), "'a' appears twice", "Block")


def test_sums_in_free_spacing():
    assert Sum("e=-a+ b -c").terms == ((-1, "a"), (1, "b"), (-1, "c"))
    assert str(Sum("e=-a+ b -c")) == "e = -a + b - c"
    assert Sum(str(Sum("e=-a+ b -c"))).terms == Sum("e=-a+ b -c").terms


# Diagrams --------------------------------------------------------------------------------------
def loop(**changes):
    parts = {
        "sum": Sum("e = r - S_meas"),
        "plant": Block("plant", 1 / s, "e -> S"),
        "vision": Block("vision", sp.exp(-tau * s), "S -> S_meas"),
    } | changes
    return list(parts.values())


@pytest.mark.parametrize(
    ("parts", "ends", "words"),
    [
        (loop(sum=Sum("e = r - S_maes")), {}, ["'S_maes'", "did you mean 'S_meas'", "declare"]),
        (loop(), {"inputs": ["ref"]}, ["'r'", "drive it or declare it"]),
        (loop(), {"inputs": []}, ["'r'", "declare it in inputs"]),
        (loop(), {"outputs": ["Smeas"]}, ["'Smeas'", "did you mean 'S_meas'"]),
        (loop(), {"inputs": ["r", "noise"]}, ["'noise'", "leads nowhere", "take it out"]),
        (loop(), {"inputs": ["r", "S"]}, ["'S'", "driven by", "rename"]),
        (
            [*loop(), Block("twin", 2, "r -> S")],
            {},
            ["'S'", "two drivers", "rename one"],
        ),
        ([*loop(), Block("plant", 2, "r -> q")], {"outputs": ["S", "q"]}, ["'plant'", "rename"]),
        (
            [*loop(), Block("spare", 2, "r -> q")],
            {"outputs": ["S"]},
            ["leads nowhere", "'q'", "declare it in outputs"],
        ),
        ([], {}, ["no parts", "Block"]),
        (["u -> y"], {}, ["'u -> y'", "Block"]),
        (
            [Sum("a = r + b"), Sum("b = a - c"), Block("g", 1, "a -> c")],
            {"outputs": ["c"]},
            ["a → b → a", "Block"],
        ),
        ([Sum("a = r + a"), Block("g", 1, "a -> c")], {}, ["a → a", "Block"]),
    ],
)
def test_diagrams_that_are_none(parts, ends, words):
    refuse(lambda: Diagram(parts, **({"inputs": ["r"]} | ends)), *words)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda d: d.transfer("S_ref", "S_mea"), ["'S_mea'", "did you mean 'S_meas'", "S_ref"]),
        (lambda d: d.transfer("Sref", "S"), ["'Sref'", "did you mean 'S_ref'"]),
        (lambda d: d.transfer("e", "S"), ["'e' is not an input", "'S_ref'"]),
        (lambda d: d.open("S_ref"), ["'S_ref' is an input", "open one of", "S_meas"]),
        (lambda d: d.open("S_mes"), ["'S_mes'", "did you mean 'S_meas'"]),
        (lambda d: d.at(WORKING)["S_ref"], ["'S_ref'", "system['input', 'output']"]),
        (lambda d: d.at(WORKING)["S_ref", "SS"], ["'SS'", "did you mean 'S'"]),
        (lambda d: d.at(WORKING)["S", "S_ref"], ["'S' is not an input"]),
        (lambda d: d.at(WORKING)["S_ref", 1], ["1"]),
        (lambda d: d.at(WORKING).open("S_ref"), ["'S_ref' is an input"]),
        (lambda d: d.open("e").open("e"), ["'e'", "nothing takes"]),
    ],
)
def test_signals_that_are_not_there(ask, words):
    refuse(lambda: ask(figure1()), *words)


def test_an_end_cannot_be_opened():
    refuse(lambda: Diagram([ONE]).open("y"), "'y'", "no loop")


# Numbers ---------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kff": 1.0}, ["'kff'", "did you mean 'k_ff'"]),
        ({"lambda": 1.0}, ["'lambda'", "did you mean 'lam'"]),
        ({"s": 1.0}, ["'s'", "no parameter"]),
        ({"lam": np.nan}, ["lam = nan", "finite"]),
        ({"lam": -np.inf}, ["lam = -inf", "finite"]),
        ({"lam": 10**400}, ["lam", "finite"]),
        ({"lam": "2.5"}, ["lam = '2.5'", "number"]),
        ({"lam": True}, ["lam = True", "number"]),
        ({"lam": np.True_}, ["lam", "True", "number"]),
        ({"lam": None}, ["lam = None", "number"]),
        ({"lam": 1j}, ["lam = 1j", "number"]),
        ({"lam": X}, ["lam = x", "number"]),
        ({"lam": [2.5]}, ["lam = [2.5]", "number"]),
        ({"tau": -0.08}, ["tau = -0.08", "negative", "0 or more"]),
        ({"ell_hat": 0}, ["inverse model", "zero"]),
    ],
    ids=lambda changes: str(changes)[:20],
)
def test_numbers_that_are_refused_by_at(changes, words):
    refuse(lambda: figure1().at({**WORKING, **changes}), *words)


@pytest.mark.parametrize("face", ["value", "array", "expr", "response", "poles", "pade", "margins"])
def test_no_face_answers_where_a_block_divides_by_zero(face):
    """ℓ̂ = 0 is an error, not a silent infinity, whichever face is asked first."""
    faces = {
        "value": lambda c, d: c(1j),
        "array": lambda c, d: c(np.array([1j, 2j])),
        "expr": lambda c, d: c.expr,
        "response": lambda c, d: c.response(Step(), [0.0, 1.0]),
        "poles": lambda c, d: d.poles(),
        "pade": lambda c, d: c.pade(3),
        "margins": lambda c, d: d.open("S_meas").margins(),
    }

    def ask():
        system = figure1().at(WORKING | {"ell_hat": 0.0, "k_ff": 0.0})
        return faces[face](system["S_ref", "S"], system)

    refuse(ask, "inverse model")


def test_missing_numbers_are_all_named():
    refuse(lambda: figure1().at(lam=1.0, tau=0.1), "ell", "ell_hat", "k_ff", "ell=…")


def test_with_checks_like_at():
    system = figure1().at(WORKING)
    refuse(lambda: system.with_(la=2.0), "'la'", "did you mean 'lam'")
    refuse(lambda: system.with_(tau=-1.0), "negative")
    assert system.with_(lam=5.0).values["lam"] == 5.0
    assert system.values["lam"] == 2.5


@pytest.mark.parametrize(
    ("expr", "numbers", "words"),
    [
        (1 / (X * s + X), {"x": 0}, ["'p'", "zero"]),
        (sp.sqrt(X) / (s + 1), {"x": -1}, ["x = -1", "root"]),
        (sp.log(X) / (s + 1), {"x": 0}, ["x = 0"]),
        (sp.exp(-X * s), {"x": -1}, ["negative"]),
        (sp.exp(-X * s / (X - 1)), {"x": 1}, ["x = 1"]),
        (sp.exp(X) / s, {"x": 1e4}, ["x = 10000"]),
        (1 / (1 + s * sp.exp(-X * s)), {"x": 1}, ["'p'", "predicts the future"]),
    ],
    ids=str,
)
def test_values_that_break_a_block(expr, numbers, words):
    system = Diagram([Block("p", expr, "u -> y")])
    refuse(lambda: system.at(numbers), *words)


def test_a_parameter_may_be_zero_where_that_makes_sense():
    diagram = Diagram([Block("p", 1 / (X * s + 1), "u -> y")])
    np.testing.assert_allclose(diagram.at(x=0)["u", "y"].response(Step(), [0.0, 1.0]).outputs, 1.0)


# Responses -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "t", [[], [-0.1], [0.0, np.nan], [np.inf], [[0.0, 1.0]], 1.0, "abc", None, [1j], ["a"]], ids=str
)
def test_times_that_are_none(t):
    refuse(lambda: figure1().at(WORKING)["S_ref", "S"].response(Step(), t), "t must be")


@pytest.mark.parametrize("signal", ["step", None, 1.0, [0.0, 1.0], np.ones(3), Step], ids=str)
def test_signals_that_are_none(signal):
    refuse(lambda: figure1().at(WORKING)["S_ref", "S"].response(signal, [0.0, 1.0]), "Step")


def test_signals_with_symbols_need_numbers():
    refuse(lambda: figure1().at(WORKING)["S_ref", "S"].response(Ramp(X), [1.0]), "symbols")


@pytest.mark.parametrize("kind", [Step, Ramp, Parabola, Sine])
@pytest.mark.parametrize("value", ["1", True, None, np.nan, np.inf, 1j, [1.0]], ids=str)
def test_sizes_of_signals(kind, value):
    refuse(lambda: kind(value), kind.__name__, "finite number")


@pytest.mark.parametrize("n", [-1, 2.5, "6", None, True], ids=str)
def test_a_number_of_poles_is_a_whole_number(n):
    refuse(lambda: figure1().at(WORKING).poles(n), "n")
    refuse(lambda: figure1().at(WORKING)["S_ref", "S"].poles(n), "n")


# One name, one symbol --------------------------------------------------------------------------
@pytest.mark.parametrize(
    "other", [{"complex": True}, {"positive": True}, {"real": True}, {"commutative": True}]
)
def test_any_symbol_called_s_is_the_laplace_variable(other):
    mine = sp.Symbol("s", **other)
    diagram = Diagram([Block("lag", sp.exp(-tau * mine) / (mine + 1), "u -> y")])
    assert list(diagram.parameters) == ["tau"]
    assert diagram.transfer("u", "y") == sp.exp(-tau * s) / (s + 1)
    assert diagram.at(tau=0.5)["u", "y"](2j) == pytest.approx(
        np.exp(-1j) / (1 + 2j), rel=1e-15, abs=0
    )


def test_symbols_of_one_name_are_one_parameter_across_blocks():
    plain, real = sp.Symbol("tau"), sp.Symbol("tau", real=True)
    diagram = Diagram(
        [
            Block("a", plain / (s + 1), "u -> v"),
            Block("b", sp.exp(-tau * s), "v -> w"),
            Block("c", sp.exp(-2 * real * s) * real, "w -> y"),
        ]
    )
    assert list(diagram.parameters) == ["tau"]
    system = diagram.at(tau=0.3)
    exact = 0.3 * np.exp(-0.9j) / (1 + 1j) * 0.3
    assert system["u", "y"](1j) == pytest.approx(exact, rel=1e-14, abs=0)
    t = [0.5, 0.89, 1.0, 2.0]
    np.testing.assert_allclose(
        system["u", "y"].response(Step(), t).outputs,
        [0.09 * max(0.0, 1 - np.exp(0.9 - x)) if x > 0.9 else 0.0 for x in t],
        atol=1e-15,
    )


def test_symbols_of_one_name_are_one_parameter_within_a_block():
    a, b = sp.Symbol("a", real=True), sp.Symbol("a", positive=True)
    diagram = Diagram([Block("g", a + b, "u -> y")])
    assert diagram.at(a=3.0)["u", "y"](1j) == 6.0
    both = Diagram([Block("g", sp.exp(-a * s) + sp.exp(-b * s), "u -> y")])
    assert both.at(a=1.0)["u", "y"](1j) == pytest.approx(2 * np.exp(-1j), rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("ours", "theirs", "keyword"), [(lam, "lam", "lam"), (ell_hat, "ell_hat", "ell_hat")]
)
def test_a_keyword_never_stands_for_two_symbols(ours, theirs, keyword):
    """A user's Symbol("lam") beside our λ, which `at` also calls `lam`: one meaning, or refused."""
    try:
        diagram = Diagram([Block("g", ours + sp.Symbol(theirs), "u -> y")])
        value = diagram.at({keyword: 3.0})["u", "y"](1j)
    except InputError as error:
        assert keyword in str(error)
    else:
        assert value == 6.0


def test_parameters_with_awkward_names():
    """λ itself is a Python keyword; so may be a user's names, or none of Python's at all."""
    names = ["class", "k-1", "α", "numpy", "exp", "x{2}", "sin"]
    symbols = [sp.Symbol(n) for n in names]
    gain = sum((i + 1) * a for i, a in enumerate(symbols))
    system = Diagram([Block("g", gain / (s + 1), "u -> y")]).at(dict.fromkeys(names, 1.0))
    assert system["u", "y"](0) == pytest.approx(28.0)
    np.testing.assert_allclose(
        system["u", "y"].response(Step(), [1.0]).outputs, 28 * (1 - np.exp(-1)), rtol=1e-14
    )


def test_messages_without_parameters_have_no_hole():
    """'… at ; look for …' reads as a slip."""
    with pytest.raises(InputError) as caught:
        Diagram([Block("p", sp.I * s / (s + 1), "u -> y")]).at()
    assert "at ;" not in str(caught.value)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: Diagram(3), ["3", "no part"]),
        (lambda: Diagram([ONE], inputs=["u", "u"]), ["inputs", "once"]),
        (lambda: Diagram([ONE], inputs="u", outputs=["y", "y"]), ["outputs", "once"]),
        (lambda: Diagram([ONE], inputs=[1]), ["inputs", "[1]"]),
        (lambda: Diagram([ONE]).at(3), ["3", "mapping"]),
    ],
)
def test_shapes_that_are_none(ask, words):
    refuse(ask, *words)


def test_a_difference_of_delays_is_judged_by_its_value():
    first, second = sp.symbols("a b", positive=True)
    diagram = Diagram([Block("d", sp.exp(-(first - second) * s), "u -> y")])
    assert diagram.at(a=0.3, b=0.1)["u", "y"](2j) == pytest.approx(np.exp(-0.4j), rel=1e-15)
    refuse(lambda: diagram.at(a=0.1, b=0.3), "negative")
