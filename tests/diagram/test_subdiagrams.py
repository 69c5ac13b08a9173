"""A diagram as a block of another: the same loop as if all had been wired by hand."""

import numpy as np
import pytest
import sympy as sp

import vsctrl as vs
from vsctrl.symbols import s

K, T, h = sp.symbols("K T h", positive=True)
VALUES = {"K": 2.0, "T": 0.5, "h": 0.1}


def speed_loop():
    parts = [
        vs.Sum("e = r - y"),
        vs.Block("P", K, "e -> u"),
        vs.Block("motor", sp.exp(-h * s) / (1 + T * s), "u -> y"),
    ]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"])


def cascade(inner, **how):
    parts = [
        vs.Sum("e = ref - pos"),
        vs.Block("C", 3 + 1 / s, "e -> v"),
        *inner,
        vs.Block("way", 1 / s, "w -> pos"),
    ]
    return vs.Diagram(parts, inputs=["ref"], **{"outputs": ["pos"], **how})


def by_hand():
    return cascade(
        [
            vs.Sum("d = v - w"),
            vs.Block("P", K, "d -> i"),
            vs.Block("motor", sp.exp(-h * s) / (1 + T * s), "i -> w"),
        ]
    )


def test_it_is_the_loop_wired_by_hand():
    nested, flat = cascade([speed_loop().block("speed loop", "v -> w")]), by_hand()
    assert sp.simplify(nested.transfer("ref", "pos") - flat.transfer("ref", "pos")) == 0
    one, other = nested.at(VALUES), flat.at(VALUES)
    assert one.poles(6) == pytest.approx(other.poles(6), rel=1e-12, abs=0)
    t = np.linspace(0, 3, 40)
    a, b = (x["ref", "pos"].response(vs.Step(), t).outputs for x in (one, other))
    assert a == pytest.approx(b, rel=0, abs=1e-13)
    assert one.check().passed


def test_signals_and_blocks_inside_bear_its_name():
    nested = cascade([speed_loop().block("speed loop", "v -> w")])
    assert "speed_loop_e" in nested.signals
    assert [block.name for block in nested.blocks] == [
        "C",
        "speed loop: P",
        "speed loop: motor",
        "way",
    ]
    margins = nested.at(VALUES).open("speed_loop_e").margins()
    assert margins == by_hand().at(VALUES).open("d").margins()


def test_one_diagram_serves_twice_and_parameters_of_one_name_are_one():
    axes = [speed_loop().block(name, wiring) for name, wiring in (("a", "r -> x"), ("b", "x -> y"))]
    twice = vs.Diagram(axes, inputs=["r"], outputs=["y"])
    assert list(twice.parameters) == ["K", "T", "h"]
    once = speed_loop().transfer("r", "y")
    assert sp.simplify(twice.transfer("r", "y") - once**2) == 0


def test_what_cancels_from_outside_still_counts_as_a_root():
    """1/(s − 1) behind its own zero: the transfer function is 1/(s + 1), the root at 1 stays."""
    parts = [vs.Block("zero", (s - 1) / (s + 1), "r -> x"), vs.Block("pole", 1 / (s - 1), "x -> y")]
    inner = vs.Diagram(parts, inputs=["r"], outputs=["y"])
    outer = vs.Diagram([inner.block("both", "u -> v")], inputs=["u"], outputs=["v"])
    assert outer.transfer("u", "v") == 1 / (s + 1)
    assert outer.at().poles() == pytest.approx([1, -1], rel=0, abs=1e-12)


def test_nesting_goes_as_deep_as_one_likes():
    diagram, closed = speed_loop(), speed_loop().transfer("r", "y")
    for _ in range(3):
        box = diagram.block("inner", "e -> y")
        diagram = vs.Diagram([vs.Sum("e = r - y"), box], inputs=["r"], outputs=["y"])
        closed = closed / (1 + closed)
    at = {K: sp.Rational(2), T: sp.Rational(1, 2), h: sp.Rational(1, 10), s: sp.Rational(3, 7)}
    expected = complex(closed.subs(at).evalf(30))
    assert diagram.at(VALUES)["r", "y"](3 / 7) == pytest.approx(expected, rel=1e-13, abs=0)
    assert "inner_inner_inner_e" in diagram.signals


def test_it_is_drawn_as_one_box_unless_one_looks_inside():
    inner = speed_loop().block("speed loop", "v -> w")
    assert cascade([inner])._repr_svg_().count('class="name"') == 3
    inside = cascade([inner], outputs=["pos", "speed_loop_u"])
    assert inside._repr_svg_().count('class="name"') == 4


def test_diagrams_are_joined_by_the_signals_they_share():
    left, right = (
        speed_loop().renamed({"y": "x"}, "left"),
        speed_loop().renamed({"r": "x"}, "right"),
    )
    both = vs.Diagram([*left.parts, *right.parts], inputs=["left_r"], outputs=["right_y"])
    once = speed_loop().transfer("r", "y")
    assert sp.simplify(both.transfer("left_r", "right_y") - once**2) == 0


def test_renaming_back_gives_the_same_diagram():
    names = {"r": "a", "e": "b", "u": "c", "y": "d"}
    back = {new: old for old, new in names.items()}
    assert speed_loop().renamed(names).renamed(back) == speed_loop()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: speed_loop().renamed({"y": "r"}), "'r' would be two signals"),
        (lambda: speed_loop().renamed({"yy": "r"}), "no signal 'yy' (did you mean 'y'?)"),
        (lambda: speed_loop().renamed("y"), "maps no signals"),
        (lambda: speed_loop().renamed({"y": "a b"}), "'a b' is no signal name"),
        (lambda: speed_loop().block("inner", "v"), "the wiring 'v' is not understood"),
        (lambda: speed_loop().block("", "v -> w"), "is empty"),
        (lambda: ring().block("ring", "v -> w"), "inputs none"),
    ],
)
def test_what_cannot_be_is_said(wrong, words):
    with pytest.raises(vs.InputError) as refused:
        wrong()
    assert words in str(refused.value)


def ring():
    return vs.Diagram([vs.Block("one", 1 / s, "y -> z"), vs.Block("two", 2, "z -> y")])


def test_further_inputs_and_outputs_are_signals_like_others():
    parts = [
        vs.Sum("e = r - y"),
        vs.Sum("v = e + d"),
        vs.Block("P", K, "v -> y"),
        vs.Block("watch", 2, "v -> w"),
    ]
    inner = vs.Diagram(parts, inputs=["r", "d"], outputs=["y", "w"])
    box = inner.block("inner", "a -> b")
    outer = vs.Diagram([box], inputs=["a", "inner_d"], outputs=["b", "inner_w"])
    assert outer.transfer("a", "b") == inner.transfer("r", "y")
    assert outer.transfer("inner_d", "inner_w") == inner.transfer("d", "w")
    assert outer._repr_svg_().count('class="name"') == 2  # one looks inside
    with pytest.raises(vs.InputError, match="nothing drives signal 'inner_d'"):
        vs.Diagram([box], inputs=["a"], outputs=["b", "inner_w"])


def test_a_further_output_or_input_is_named_as_its_own_diagram_names_it():
    """Whoever wires a block of two outputs cannot know what they are called outside."""
    inner = vs.Diagram(
        [
            vs.Sum("v = u + w"),
            vs.Block("P", 1 / (s + 1), "v -> y"),
            vs.Block("Q", 1 / (s + 2), "v -> y2"),
        ],
        inputs=["u", "w"],
        outputs=["y", "y2"],
    )
    box = inner.block("my plant", "a -> b")
    with pytest.raises(
        vs.InputError, match=r"output 'y2' of block 'my plant' leads nowhere.*'my_plant_y2'"
    ):
        vs.Diagram([box], outputs=["b"])
    with pytest.raises(vs.InputError, match="'my_plant_w', the input 'w' of block 'my plant'"):
        vs.Diagram([box], inputs=["a"], outputs=["b", "my_plant_y2"])
    whole = vs.Diagram([box], ["a", "my_plant_w"], ["b", "my_plant_y2"])
    assert whole.at()["a", "my_plant_y2"](0) == 0.5
