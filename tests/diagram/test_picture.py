"""Pictures are checked by geometry: what may not touch does not, in any diagram."""

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from itertools import combinations, pairwise
from pathlib import Path

import effort
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.diagram.picture import mathtext, typeset
from vsctrl.diagram.picture.draw import MATH, draft, name_width, svg
from vsctrl.symbols import ell, ell_hat, k_ff, lam, s, tau

K, T_i, a, w = sp.symbols("K T_i a omega_0", positive=True)

FIGURE_1 = [
    Sum("e = S_ref - S_meas"),
    Block("gain", lam, "e -> u_fb"),
    Block("feed-forward", k_ff * s, "S_ref -> u_ff"),
    Sum("u = u_fb + u_ff"),
    Block("inverse model", 1 / ell_hat, "u -> T"),
    Block("robot, camera", ell / s, "T -> S"),
    Block("vision", sp.exp(-tau * s), "S -> S_meas"),
]


def fifteen() -> Diagram:
    at = {1: "r - x15", 2: "x1 - f1", 4: "x3 - f2", 8: "x7 - x12", 10: "x9 + f4"}
    sums = [Sum(f"w{i} = {text}") for i, text in at.items()]
    row = [
        Block(f"G{i}", 1 / (i * s + 1), f"{f'w{i}' if i in at else f'x{i - 1}'} -> x{i}")
        for i in range(1, 16)
    ]
    back = [Block("H1", s, "x6 -> f1"), Block("H2", K, "x5 -> f2"), Block("H4", a, "x10 -> f4")]
    return Diagram([*sums, *row, *back], inputs=["r"], outputs=["x15"])


GALLERY = {
    "figure 1": Diagram(FIGURE_1, inputs=["S_ref"], outputs=["S"]),
    "figure 1 without an output": Diagram(FIGURE_1, inputs=["S_ref"]),
    "figure 1 with three outputs": Diagram(FIGURE_1, ["S_ref"], ["e", "S", "u"]),
    "cascade": Diagram(
        [
            Sum("e1 = r - y_m"),
            Block("position", K * (1 + 1 / (T_i * s)), "e1 -> r2"),
            Sum("e2 = r2 - v_m"),
            Block("speed", a, "e2 -> u"),
            Block("motor", 1 / (T_i * s + 1), "u -> v"),
            Block("integrator", 1 / s, "v -> y"),
            Block("tacho", sp.exp(-s / 50), "v -> v_m"),
            Block("encoder", sp.exp(-tau * s), "y -> y_m"),
        ]
    ),
    "two by two": Diagram(
        [
            Sum("e1 = r1 - y1"),
            Block("C1", K, "e1 -> u1"),
            Block("P11", 1 / (s + 1), "u1 -> a1"),
            Block("P12", a / (s + 2), "u2 -> a2"),
            Sum("y1 = a1 + a2"),
            Sum("e2 = r2 - y2"),
            Block("C2", a, "e2 -> u2"),
            Block("P21", 1 / (s + 3), "u1 -> b1"),
            Block("P22", w**2 / (s**2 + w * s + w**2), "u2 -> b2"),
            Sum("y2 = b1 + b2"),
        ],
        inputs=["r1", "r2"],
        outputs=["y1", "y2"],
    ),
    "chain of fifteen": fifteen(),
    "single block": Diagram([Block("plant", 1 / (s * (tau * s + 1)), "u -> y")]),
    "block around itself": Diagram([Block("plant", 1 / (s + 2), "x -> x")]),
    "disturbances": Diagram(
        [
            Sum("e = r - y_m"),
            Block("C", K + a / s, "e -> u"),
            Sum("v = u + d_in"),
            Block("P", 1 / s, "v -> p"),
            Block("G_d", 1 / (s + 5), "d_out -> q"),
            Sum("y = p + q"),
            Sum("y_m = y + n"),
        ],
        outputs=["y"],
    ),
    "unity feedback": Diagram(
        [Sum("e = r - y"), Block("C", K, "e -> u"), Block("P", 1 / s, "u -> y")], outputs=["y"]
    ),
    "Smith predictor": Diagram(
        [
            Sum("e = r - y"),
            Sum("e_p = e - y_p"),
            Block("C", K, "e_p -> u"),
            Block("P", sp.exp(-tau * s) / (s + 1), "u -> y"),
            Block("model", 1 / (s + 1), "u -> y_0"),
            Block("delay", sp.exp(-tau * s), "y_0 -> y_d"),
            Sum("y_p = y_0 - y_d"),
        ],
        outputs=["y"],
    ),
    "figure 1 cut open": Diagram(FIGURE_1, ["S_ref"], ["S"]).open("S_meas"),
    "a sum of five": Diagram([Sum("y = a + b - c + d - f")]),
    "an output that is an input": Diagram([Block("P", 1 / s, "u -> y")], ["u"], ["u", "y"]),
}


@pytest.mark.parametrize("name", GALLERY)
def test_nothing_touches_what_it_should_not(name):
    check_geometry(GALLERY[name])


@st.composite
def diagrams(draw: st.DrawFn) -> Diagram:
    count = draw(st.integers(1, 10))
    signals = [f"x{i}" for i in range(count)] + [f"r_{i}" for i in range(draw(st.integers(0, 3)))]
    gains = st.sampled_from([K, 1 / s, sp.exp(-tau * s), (s + a) / (s**2 + w * s + 2)])
    is_block = [draw(st.booleans()) for _ in range(count)]
    parts = []
    for i in range(count):
        # A sum takes later signals only from blocks, so that no sums feed each other in a ring.
        later = {f"x{j}" for j in range(i, count) if not is_block[j]}
        free = [name for name in signals if name not in later]
        if is_block[i] or not free:
            source = draw(st.sampled_from(signals))
            parts.append(Block(f"block number {i}"[: 5 + i], draw(gains), f"{source} -> x{i}"))
        else:
            taken = draw(st.lists(st.sampled_from(free), min_size=1, max_size=5, unique=True))
            signs = [draw(st.sampled_from("+-")) for _ in taken]
            terms = "".join(k + name for k, name in zip(signs, taken, strict=True))
            parts.append(Sum(f"x{i} = {terms}"))
    ends = Diagram(parts).outputs
    names = [f"x{i}" for i in range(count)]
    more = draw(st.lists(st.sampled_from(names), max_size=2, unique=True))
    return Diagram(parts, outputs=(*more, *(end for end in ends if end not in more)))


@settings(max_examples=effort.share(60), deadline=None)
@given(diagrams())
def test_nothing_touches_in_any_diagram(diagram):
    check_geometry(diagram)


def check_geometry(diagram: Diagram) -> None:
    """Wires, boxes, names and labels of one picture against each other."""
    grid, picture, formulas = draft(diagram)
    boxes = {b.node: rectangle(b.x, b.y, b.width, b.height) for b in picture.boxes if b.width}
    names = {i: name_above(grid.graph.nodes[i].part.name, boxes[i]) for i in formulas}
    labels = [(label.signal, label_rectangle(label)) for label in picture.labels]
    signs = [rectangle(x, y, 7, 7) for x, y, _ in picture.signs]
    things = [*boxes.values(), *names.values(), *(r for _, r in labels), *signs]
    for one, other in combinations(things, 2):
        assert not overlap(one, other)
    for x0, y0, x1, y1 in things:
        assert x0 >= 0 and y0 >= 0 and x1 <= picture.width and y1 <= picture.height
    for i, formula in formulas.items():
        assert typeset.width(formula) * MATH < boxes[i][2] - boxes[i][0] - 8
    segments = [(p.signal, seg) for p in picture.paths for seg in pairwise(p.points)]
    for signal, segment in segments:
        (x0, y0), (x1, y1) = segment
        assert (x0 == x1) != (y0 == y1), "wires run along the axes"
        assert all(
            not overlap(span(segment), thing) for thing in (*boxes.values(), *names.values())
        )
        assert not any(overlap(span(segment), r) for owner, r in labels if owner != signal)
        assert not any(overlap(span(segment), r) for r in signs)
        assert min(x0, x1) >= 0 and max(x0, x1) <= picture.width
        assert min(y0, y1) >= 0 and max(y0, y1) <= picture.height
    for (one, p), (other, q) in combinations(segments, 2):
        if one != other:
            assert not run_together(p, q)
            assert not any(on(end, q) for end in p) and not any(on(end, p) for end in q)
    check_wiring(grid, picture)


def check_wiring(grid, picture) -> None:
    """Every part is reached by a wire from what drives it, at a port of its own."""
    nodes, at = grid.graph.nodes, {box.node: box for box in picture.boxes}
    wanted = sorted(name for node in nodes for _, name in node.takes)
    assert sorted(path.signal for path in picture.paths) == wanted
    tips = [path.points[-1] for path in picture.paths]
    assert len(set(tips)) == len(tips)
    free = {(i, name) for i, node in enumerate(nodes) for _, name in node.takes}
    for n, path in enumerate(picture.paths):
        source = at[grid.graph.driver[path.signal]]
        earlier = [p for p in picture.paths[:n] if p.signal == path.signal]
        on_earlier = [seg for p in earlier for seg in pairwise(p.points)]
        start = path.points[0]
        assert any(on(start, seg) for seg in on_earlier) or (not earlier and borders(start, source))
        hit = [i for i, name in free if name == path.signal and borders(path.points[-1], at[i])]
        assert hit
        free.discard((hit[0], path.signal))
    # The sign stands beside the wire that it belongs to.
    for i, node in enumerate(nodes):
        if node.kind == "sum":
            own = [p for p in picture.paths if borders(p.points[-1], at[i])]
            assert sorted(p.signal for p in own) == sorted(name for _, name in node.takes)
            for sign, name in node.takes:
                x, y = next(p.points[-1] for p in own if p.signal == name)
                near = min(picture.signs, key=lambda k: (k[0] - x) ** 2 + (k[1] - y) ** 2)
                assert near[2] == sign


def rectangle(x, y, width, height):
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def name_above(name, box):
    return rectangle((box[0] + box[2]) / 2, box[1] - 8.5, name_width(name), 12)


def label_rectangle(label):
    shift = {"start": 0.5, "middle": 0.0, "end": -0.5}[label.anchor] * label.width
    return rectangle(label.x + shift, label.y - 4, label.width, 14)


def span(segment):
    (x0, y0), (x1, y1) = segment
    return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def overlap(p, q, slack=0.01):
    x = min(p[2], q[2]) - max(p[0], q[0])
    y = min(p[3], q[3]) - max(p[1], q[1])
    # A wire has no width: it touches a box if it is inside it.
    return x > -slack and y > -slack and not edges_only(p, q, x, y, slack)


def edges_only(p, q, x, y, slack):
    flat = p[0] == p[2] or p[1] == p[3]
    inside_x = x > slack or (p[0] == p[2] and q[0] + slack < p[0] < q[2] - slack)
    inside_y = y > slack or (p[1] == p[3] and q[1] + slack < p[1] < q[3] - slack)
    return not (inside_x and inside_y) if flat else not (x > slack and y > slack)


def run_together(p, q, apart=6.0):
    """Whether two segments are parallel, side by side and closer than can be told apart."""
    for k in (0, 1):
        if p[0][k] == p[1][k] and q[0][k] == q[1][k]:
            low, high = sorted(end[1 - k] for end in p), sorted(end[1 - k] for end in q)
            beside = min(low[1], high[1]) - max(low[0], high[0])
            return beside > 0 and abs(p[0][k] - q[0][k]) < apart
    return False


def on(point, segment):
    x0, y0, x1, y1 = span(segment)
    return x0 <= point[0] <= x1 and y0 <= point[1] <= y1


def borders(point, box):
    dx, dy = abs(point[0] - box.x), abs(point[1] - box.y)
    return (dx, dy) in ((box.width / 2, 0), (0, box.height / 2)) or (
        abs(dx - box.width / 2) + dy < 1e-9 or dx + abs(dy - box.height / 2) < 1e-9
    )


def cells(diagram):
    grid, _, _ = draft(diagram)
    return {
        node.gives or f"→{node.takes[0][1]}": spot
        for node, spot in zip(grid.graph.nodes, grid.spots, strict=True)
    }


def test_figure_1_is_laid_out_like_a_textbook_does():
    at = cells(GALLERY["figure 1"])
    row = [at[name] for name in ("S_ref", "e", "u_fb", "u", "T", "S", "→S")]
    assert len({spot.lane for spot in row}) == 1
    assert [spot.column for spot in row] == sorted({spot.column for spot in row})
    assert at["u_ff"].lane < row[0].lane < at["S_meas"].lane
    assert (at["u_ff"].out, at["S_meas"].out) == ("right", "left")
    _, picture, _ = draft(GALLERY["figure 1"])
    assert len(picture.dots) == 2
    assert crossings(picture) == 0


@pytest.mark.parametrize(
    ("name", "count"),
    [("cascade", 0), ("two by two", 1), ("chain of fifteen", 0), ("disturbances", 0)],
)
def test_wires_cross_only_where_they_must(name, count):
    assert crossings(draft(GALLERY[name])[1]) == count


def crossings(picture) -> int:
    segments = [(p.signal, seg) for p in picture.paths for seg in pairwise(p.points)]
    return sum(
        (p[0][0] == p[1][0]) != (q[0][0] == q[1][0]) and overlap_cross(p, q)
        for (one, p), (other, q) in combinations(segments, 2)
        if one != other
    )


def overlap_cross(p, q):
    a0, b0, a1, b1 = span(p)
    c0, d0, c1, d1 = span(q)
    return max(a0, c0) <= min(a1, c1) and max(b0, d0) <= min(b1, d1)


def test_without_a_declared_output_the_row_still_ends_at_the_plant():
    at = cells(GALLERY["figure 1 without an output"])
    assert at["S"].lane == at["S_ref"].lane < at["S_meas"].lane


def test_the_row_does_not_run_through_the_other_loop():
    at = cells(GALLERY["two by two"])
    assert {at[name].lane for name in ("e1", "u1", "a1", "y1")} == {at["r1"].lane}
    assert {at[name].lane for name in ("e2", "u2", "b2", "y2")} == {at["r2"].lane}


def test_an_error_among_the_outputs_does_not_end_the_row():
    at = cells(GALLERY["figure 1 with three outputs"])
    assert at["e"].lane == at["S"].lane


NS = "{http://www.w3.org/2000/svg}"


def test_the_svg_is_well_formed_described_and_self_contained():
    text = svg(GALLERY["figure 1"])
    root = ET.fromstring(text)
    assert root.tag == f"{NS}svg" and root.get("role") == "img"
    ids = {child.get("id") for child in root}
    assert set(root.get("aria-labelledby").split()) <= ids
    assert root.find(f"{NS}desc").text.count(";") == 6
    assert "inverse model: T = [1/ellhat] u" in {t.text for t in root.iter(f"{NS}title")}
    assert "currentColor" in text and "prefers-color-scheme:dark" in text
    assert "href" not in text and "url(" not in text and text.count("http") == 1
    assert GALLERY["figure 1"]._repr_svg_() == text


def test_pictures_on_one_page_do_not_share_an_id():
    ids = [ET.fromstring(svg(diagram)).get("id") for diagram in GALLERY.values()]
    assert len(set(ids)) == len(ids)


def test_names_are_escaped():
    text = svg(Diagram([Block('<b>&"', K, "u -> y")]))
    assert '<b>&"' not in text and "&lt;b&gt;&amp;" in text
    ET.fromstring(text)
    ET.fromstring(svg(Diagram([Block("bell \x07 \ud800", K, "u -> y")])))


def test_the_same_diagram_gives_the_same_bytes_in_every_process():
    code = (
        "import hashlib, test_picture as t;"
        "print(hashlib.sha256(''.join(map(t.svg, t.GALLERY.values())).encode()).hexdigest())"
    )
    seen = {
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=Path(__file__).parent,
            env={
                **os.environ,
                "PYTHONHASHSEED": seed,
                "PYTHONPATH": os.pathsep.join(str(p) for p in Path(__file__).parents[1:3]),
            },
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(seen) == 1


@pytest.mark.parametrize(
    ("expr", "shown"),
    [
        (lam, "λ"),
        (1 / ell_hat, "1/ℓˆ "),
        (k_ff * s, "k_ff s"),
        (sp.exp(-tau * s), "e^−τs"),
        (ell * sp.exp(-2 * tau * s) / (s + 1), "ℓe^−2τs/s + 1"),
        (K * (1 + 1 / (T_i * s)), "K(1 + 1/(T_i s))"),
        (sp.Rational(2, 25) * s, "0.08s"),
        (s / 3, "s/3"),
        (2 / (3 * s), "2/3s"),
        (w**2 / (s**2 + 2 * a * w * s + w**2), "ω_0^2/s^2 + 2aω_0 s + ω_0^2"),
        (-a / (s + 1) - 3, "− a/s + 1 − 3"),
        (1 - sp.exp(-tau * s), "1 − e^−τs"),
        (sp.sqrt(a) * K, "K√a"),
        (sp.Integer(0), "0"),
        (1 / s**2, "1/s^2"),
        (a ** sp.Symbol("n") * s, "a^ns"),
        ((a + 1) ** 2, "(a + 1)^2"),
        (1 / (s * (s + 1) ** 2), "1/s(s + 1)^2"),
        (sp.cos(a), "cos(a)"),
        (2 * 10 ** sp.Symbol("n"), "2·10^n"),
    ],
)
def test_formulas_read_as_one_writes_them(expr, shown):
    assert linear(mathtext.formula(sp.sympify(expr), "block")) == shown


def test_a_long_formula_gives_way_to_its_name_and_stays_in_the_tooltip():
    long = sum(sp.Symbol(f"c_{i}") * s**i for i in range(9)) / (s + 1) ** 9
    assert linear(mathtext.formula(long, "plant")) == "G_plant(s)"
    assert linear(mathtext.formula(long, "P1")) == "P_1(s)"
    assert str(long) in svg(Diagram([Block("plant", long, "u -> y")]))


def linear(formula) -> str:
    """A formula as plain text: ^ and _ for scripts, / for bars."""

    def line(part) -> str:
        text, level = "", 0.0
        for run in part.runs:
            script = run.size < 1
            mark = ("^" if run.rise > 0 else "_") if script and run.rise != level else ""
            text += mark + run.text
            level = run.rise if script else 0.0
        return text.replace(typeset.THIN, " ")

    return "".join(
        line(p) if isinstance(p, typeset.Line) else f"{line(p.num)}/{line(p.den)}" for p in formula
    )


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("S_ref", "S_ref"),
        ("x12", "x_12"),
        ("lambda", "λ"),
        ("omega_0", "ω_0"),
        ("S_a__b", "S_a, b"),
    ],
)
def test_names_of_signals(name, shown):
    assert linear((typeset.symbol(name),)) == shown
