"""Loops as files: what is written is read back, and what is wrong is told, all of it at once."""

import json
import pickle
import random

import numpy as np
import pytest
import sympy as sp
from effort import share, some
from hypothesis import given, settings
from hypothesis import strategies as st

import vsctrl as vs
from vsctrl import examples
from vsctrl.diagram import Applied, Block, Diagram, Loop, Sum
from vsctrl.documents import from_toml, kind_of, schema
from vsctrl.symbols import ell, lam, s, tau

LOOPS = [name for name in examples.FILES if name != "positioning"]
SMALL = """
time_unit = "min"
inputs = ["r"]
outputs = ["y"]
[parameters]
K = 2
theta = "1 min"
[[block]]
sum = "e = r - y"
[[block]]
name = "PI"
wiring = "e -> u"
pid = { K = "K", T_i = "5 min" }
[[block]]
name = "process"
wiring = "u -> y"
transfer = "exp(-theta*s)/(300*s + 1)"
[[apply]]
input = "r"
"""


def refused(text):
    with pytest.raises(vs.InputError) as error:
        Loop.from_toml(text)
    return str(error.value)


# What a file says -------------------------------------------------------------------------------
def test_a_file_is_the_loop_that_its_formulas_are():
    loop = Loop.from_toml(SMALL)
    p = 0.003 + 0.01j
    L = 2 * (1 + 1 / (300 * p)) * np.exp(-60 * p) / (300 * p + 1)
    assert loop.open(p) == pytest.approx(L, rel=1e-12)
    assert loop.values == {"K": 2.0, "theta": 60.0} and loop.units == {"theta": "min"}
    assert loop.opened == "y" and loop.watched == ("y",) and loop.sampled is None
    assert loop.system["r", "y"](p) == pytest.approx(L / (1 + L), rel=1e-12)
    assert loop.with_(K=3).open(p) == pytest.approx(1.5 * L, rel=1e-12)
    assert loop.applied == (Applied("r"),) and loop.applied[0].signal([1.0]) == [1.0]


@pytest.mark.parametrize(
    ("given", "expr"),
    [
        ('transfer = "K/(s + 1)"', "K/(s+1)"),
        ("numerator = [1, 2]\ndenominator = [0.5, 0, 1]", "(s+2)/(s**2/2+1)"),
        ('numerator = "K"\ndenominator = [1, "theta"]\ndelay = 2', "K*exp(-2*s)/(s+theta)"),
        ("gain = 3", "3"),
        ("integrator = {}", "1/s"),
        ('integrator = "K"', "K/s"),
        ('delay = "80 ms"', "exp(-2*s/25)"),
        ("fopdt = { K = 2, T = 3 }", "2/(3*s+1)"),
        ('fopdt = { K = "K", T = "1 min", theta = "theta" }', "K*exp(-theta*s)/(60*s+1)"),
        ("sopdt = { K = 1, T_1 = 2, T_2 = 3, theta = 4 }", "exp(-4*s)/((2*s+1)*(3*s+1))"),
        ("pid = { K = 2 }", "2"),
        ("pid = { K = 2, T_i = 4 }", "2*(1+1/(4*s))"),
        ("pid = { K = 2, T_i = 4, T_d = 1, N = 5 }", "2*(1+1/(4*s)+s/(s/5+1))"),
        ("lead = { T = 2, alpha = 0.1 }", "(2*s+1)/(s/5+1)"),
        ("lag = { T = 2 }", "1/(2*s+1)"),
        ("notch = { omega = 3, zeta_p = 0.5 }", "(s**2+9)/(s**2+3*s+9)"),
    ],
)
def test_every_kind_of_block_is_its_formula(given, expr):
    text = f'[[block]]\nname = "b"\nwiring = "u -> y"\n{given}\n'
    (block,) = Diagram.from_toml(text).blocks
    names = {str(x): x for x in block.expr.free_symbols}
    assert sp.simplify(block.expr - sp.sympify(expr, locals={**names, "s": s})) == 0


# What is wrong ----------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"K"', '"KK"', "parameters.K: no block uses it (did you mean 'KK'?)"),
        ('K = "K", T_i', 'K = "K", Ti', "block 'PI'.pid: unknown key 'Ti' (did you mean 'T_i'?)"),
        ("pid", "pdi", "block 'PI'.pdi: unknown key"),
        ("transfer", "transfr", "(did you mean 'transfer'?)"),
        ("300*s", "300s", "block 'process'.transfer: 'exp(-theta*s)/(300s + 1)' character 19"),
        ("outputs", "output", "output: unknown key"),
        ('"1 min"', '"1 mim"', "parameters.theta: unit 'mim' is unknown (did you mean 'min'?)"),
        ('"1 min"', '{ value = 1, unit = "minutes" }', "unit 'minutes' is unknown"),
        ('"1 min"', "true", "parameters.theta: true is not a number"),
        ('"1 min"', "-60", "the delay theta = -60 s is negative"),
        ('"e = r - y"', '"e = r - yy"', "nothing drives signal 'yy' (did you mean 'y'?)"),
        ('"e = r - y"', '"e r y"', "block 1.sum: 'e r y' is no equation"),
        ('"e -> u"', '"e, u"', "block 'PI'.wiring: the wiring 'e, u' is not understood"),
        ('input = "r"', 'input = "q"', "apply 1.input: 'q' is no input"),
        ('input = "r"', 'input = "r"\nkind = "stp"', "apply 1.kind: 'stp' is unknown (did you"),
        ('input = "r"', 'input = "r"\nkind = "sine"', "apply 1.omega: None is not usable"),
        ('input = "r"', 'input = "r"\nat = "1 rad/s"', "apply 1.at: '1 rad/s' is no time"),
        ('input = "r"', 'input = "r"\nat = -1', "apply 1.at: -1 s is no time of the response"),
        ('time_unit = "min"', 'time_unit = "mins"', "time_unit: 'mins' is unknown (did you mean"),
        ('time_unit = "min"', 'open = "r"', "open: 'r' is an input, so no loop runs through it"),
        ('time_unit = "min"', 'watch = ["z"]', "watch: there is no signal 'z'"),
        ('time_unit = "min"', "duration = 0", "duration: 0 s is no duration"),
        ("[[apply]]", "[sampling]\nperiod = 9\n[[apply]]", "sampling.hold: missing"),
        ("[[apply]]", '[sampling]\nhold = "u"\n[[apply]]', "sampling.period: missing"),
        (
            "[[apply]]",
            '[sampling]\nperiod = 9\nhold = "v"\ndigital = { P = "tustin" }\n[[apply]]',
            "sampling.hold: there is no signal 'v'",
        ),
        (
            "[[apply]]",
            '[sampling]\nperiod = 9\nhold = "u"\ndigital = { PI = "tusin" }\n[[apply]]',
            "sampling: method 'tusin' for block 'PI' is not known (did you mean 'tustin'?)",
        ),
        ('name = "PI"', 'name = "process"', "two blocks are called 'process'"),
        ('name = "PI"', 'name = "PI"\ngain = 2', "pid: is a second description beside gain"),
        ('name = "PI"', 'nme = "PI"', "block 2.nme: unknown key"),
        ("[[block]]", "[block]", "TOML: "),
    ],
)
def test_what_is_wrong_is_named_with_its_remedy(old, new, words):
    assert old in SMALL
    assert words in refused(SMALL.replace(old, new, 1))


def test_all_that_is_wrong_is_told_at_once():
    text = SMALL.replace('input = "r"', 'input = "q"').replace("K = 2\n", "k = 2\n")
    text = text.replace('time_unit = "min"', 'time_unit = "mn"\nopen = "z"\ncolour = "red"')
    said = refused(text).splitlines()
    assert said[0] == "6 problems:"
    fields = [line.split(":")[0].strip() for line in said[1:]]
    assert fields == [
        "colour",
        "time_unit",
        "parameters.k",
        "parameters.K",
        "open",
        "apply 1.input",
    ]


def test_a_loop_in_hand_is_checked_like_a_file():
    diagram = Loop.from_toml(SMALL).diagram
    with pytest.raises(vs.InputError, match=r"(?s)parameters.theta: missing.*open: there is no s"):
        Loop(diagram, {"K": 1}, opened="yy")
    with pytest.raises(vs.InputError, match=r"no Diagram; give a vs\.Diagram"):
        Loop(3)
    with pytest.raises(vs.InputError, match="K: inf is not a finite number"):
        Loop(diagram, {"K": np.inf, "theta": 1})
    with pytest.raises(vs.InputError, match="apply 1: 'step' is not usable"):
        Loop(diagram, {"K": 1, "theta": 1}, applied=("step",))
    alone = Loop(Diagram([Block("b", 1 / (s + 1), "u -> y")]))
    assert alone.opened == "" and alone.horizon == pytest.approx(8)
    with pytest.raises(vs.InputError, match="no loop runs through any signal"):
        alone.open  # noqa: B018


# There and back ---------------------------------------------------------------------------------
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_the_same_after_its_file(name, tmp_path):
    loop = Loop.from_toml(examples.text(name))
    loop.save(tmp_path / "mine.toml")
    again = vs.load(tmp_path / "mine.toml")
    assert again == loop and again.to_toml() == loop.to_toml()
    assert pickle.loads(pickle.dumps(loop)) == loop
    assert 5 <= len(str(loop).splitlines()) <= 7 and loop._repr_svg_().startswith("<svg")
    assert [block.name for block in Diagram.load(tmp_path / "mine.toml").blocks]


def test_units_survive_where_they_are_exact():
    loop = Loop.from_toml(SMALL.replace('"1 min"', '{ value = 0.1, unit = "min", meaning = "m" }'))
    assert 'theta = { value = 0.1, unit = "min", meaning = "m" }' in loop.to_toml()
    awkward = loop.with_(theta=0.1 + 0.2)
    assert Loop.from_toml(awkward.to_toml()).values == awkward.values


def test_figure_1_and_a_diagram_in_a_diagram_survive():
    inner = vs.figure1.block("servo", "r -> y")
    for diagram in (vs.figure1, Diagram([inner], ["r"], ["y"]), vs.loop.smith()):
        again = Diagram.from_toml(diagram.to_toml())
        assert again.parts == diagram.parts
        assert (again.inputs, again.outputs) == (diagram.inputs, diagram.outputs)
        source, target = diagram.inputs[0], diagram.outputs[0]
        assert again.transfer(source, target) == diagram.transfer(source, target)
    text = vs.figure1.to_toml()
    assert "# tau =  # give it a number" in text
    assert "parameters.tau: missing; give it a number" in refused(text)


COEFFICIENT = st.sampled_from([lam, tau, ell, *sp.symbols("K T_1 x_θ")]) | st.decimals(
    "0.1", 9, places=2
).map(lambda d: sp.Rational(str(d)))


@st.composite
def diagrams(draw):
    """Blocks in a row, each of some order with or without a delay, under feedback from the last."""
    number = draw(st.integers(1, 4))
    parts = [Sum("e = r - y" if draw(st.booleans()) else "e = -y + r")]
    names = ["e", *(f"x{i}" for i in range(number - 1)), "y"]
    for i in range(number):
        a, b, c, d = (draw(COEFFICIENT) for _ in range(4))
        expr = draw(
            st.sampled_from(
                [
                    a / s,
                    a * s / (b * s + c),
                    (a * s + b) / (c * s**2 + d * s + a),
                    a / (s + b) ** 3,
                ]
            )
        )
        expr *= draw(st.sampled_from([1, sp.exp(-b * s), sp.exp(-2 * c * s) + 1, sp.sqrt(b)]))
        parts.append(Block(f"b {i}: ü", expr, f"{names[i]} -> {names[i + 1]}"))
    return Diagram(parts, inputs=["r"], outputs=["y", *({"e"} if draw(st.booleans()) else ())])


@settings(max_examples=share(100), deadline=None)
@given(diagrams(), st.integers(0, 99))
def test_any_diagram_survives_with_its_transfer_functions(diagram, seed):
    rng = np.random.default_rng(seed)
    values = {name: float(rng.uniform(0.1, 2)) for name in diagram.parameters}
    again = Loop.from_toml(diagram.to_toml(values))
    assert again.values == {n.replace("θ", "theta"): x for n, x in values.items()}
    assert [str(p).split(" = ")[0] for p in again.diagram.parts] == [
        str(p).split(" = ")[0] for p in diagram.parts
    ]
    p = np.array([0.3 + 1j, 2j])
    ours, theirs = (x["r", "y"](p) for x in (again.system, diagram.at(values)))
    assert ours == pytest.approx(theirs, rel=1e-9)


# One grammar for loops and scenarios ------------------------------------------------------------
def test_a_file_is_told_by_what_is_in_it(tmp_path):
    for name in examples.about():
        path = tmp_path / f"{name}.toml"
        path.write_text(examples.text(name), encoding="utf-8")
        found = vs.load(path)
        assert isinstance(found, vs.Loop if name in LOOPS else vs.Scenario)
    path.write_text("[[block]]\nnme = 3")
    with pytest.raises(vs.InputError, match=rf"^{path}: 2 problems|^{path}: "):
        vs.load(path)
    for text, words in (
        ("", "neither .*block.* nor .*camera"),
        ("[camra]", "did you mean 'camera'"),
        ("[camera]\n[[block]]", "no file both"),
        ("= 3", "TOML: "),
    ):
        with pytest.raises(vs.InputError, match=words):
            kind_of(text)
    with pytest.raises(vs.InputError, match="no such file"):
        vs.load(tmp_path / "none.toml")


def test_the_schema_knows_every_key_and_accepts_the_examples():
    found = json.loads(schema("loop"))
    blocks = found["properties"]["block"]["items"]["properties"]
    assert {"pid", "sum", "transfer", "numerator", "wiring"} <= set(blocks)
    assert json.loads(schema("scenario"))["required"]
    import tomllib

    for name in LOOPS:
        tables = tomllib.loads(examples.text(name))
        assert set(tables) <= set(found["properties"])
        assert all(set(entry) <= set(blocks) for entry in tables["block"])
    with pytest.raises(vs.InputError, match="did you mean 'loop'"):
        schema("loops")


# Whatever is typed ------------------------------------------------------------------------------
PIECES = [
    "[[block]]\n", "[parameters]\n", '"', "'", "=", "-> ", "s", "*", "(", ")", "1e9", "-1", "nan",
    "{", "}", "[", "]", ",", '"min"', "true", "\n", "\x00", "é", "exp(", "pid = ", "K = 1\n", ".",
]  # fmt: skip


def mutated(text, rng):
    """The text with a few pieces, lines or words moved, doubled, dropped or put in."""
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        kind = rng.randrange(5)
        lines = text.split("\n")
        i, j = rng.randrange(len(text) + 1), rng.randrange(len(lines))
        if kind == 0:
            text = text[:i] + rng.choice(PIECES) + text[i:]
        elif kind == 1:
            text = text[:i] + text[i + rng.randrange(1, 6) :]
        elif kind == 2:
            lines[j : j + 1] = rng.choice([[], [lines[j]] * 2])
            text = "\n".join(lines)
        elif kind == 3:
            lines.insert(rng.randrange(len(lines)), lines.pop(j))
            text = "\n".join(lines)
        else:
            words = text.split(" ")
            words[rng.randrange(len(words))] = rng.choice(words)
            text = " ".join(words)
    return text


@pytest.mark.parametrize("seed", some(range(16), 2))
def test_a_file_with_anything_in_it_is_a_loop_or_a_sentence(seed):
    rng = random.Random(seed)
    texts = [SMALL, *(examples.text(name) for name in ("smith", "figure1", "adaptive_optics"))]
    for _ in range(share(700)):
        text = mutated(rng.choice(texts), rng)
        try:
            found = from_toml(text)
        except vs.InputError as error:
            assert str(error).rstrip().endswith("."), text
        else:
            assert isinstance(found, vs.Loop | vs.Scenario), text
