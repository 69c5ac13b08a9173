"""Tables as text and HTML, and values as JSON takes them, against what is typed here."""

import json
import math
from dataclasses import dataclass
from html.parser import HTMLParser

import numpy as np
import pytest
from IPython.lib import pretty

import vsctrl as vs
from vsctrl import tables
from vsctrl.tables import Printed, Tables, finite, fitting, html, paragraphs, plain, text


class Reader(HTMLParser):
    """The tags of a text in order, and the text of each cell."""

    def __init__(self, source):
        super().__init__()
        self.tags, self.cells = [], []
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs).get("style", "")))
        if tag in ("td", "th", "caption", "p"):
            self.cells.append("")

    def handle_data(self, data):
        self.cells[-1] += data


def test_the_form_places_cells_and_no_line_ends_in_blanks():
    rows = [("name", "1.5", "agree"), ("longer name", "−20", ""), ("name", "3")]
    assert text(rows, "{:8}{:>6}  {}").splitlines() == [
        "name       1.5  agree",
        "longer name   −20",
        "name         3",
    ]


def test_fitting_columns_are_as_wide_as_their_widest_cell():
    rows = [("a", "value"), ("bbb", "1")]
    assert text(rows, fitting(rows, "<>")).splitlines() == ["a    value", "bbb      1"]


def test_whatever_a_cell_holds_is_shown_as_text():
    hostile = "<b>\"x\" & 'y'</b>"
    read = Reader(html([(hostile, "1")], heads=(hostile, ""), caption=hostile, remarks=[hostile]))
    assert read.cells == [hostile, hostile, "", hostile, "1", hostile]
    assert "b" not in [tag for tag, _ in read.tags]
    assert Reader(paragraphs([hostile])).cells == [hostile]


def test_heads_labels_and_sides_of_a_table():
    left = "text-align:left"
    read = Reader(html([("a", "1", "x\ny")], heads=("n", "v", ""), labels=True, left=1, top=True))
    assert read.tags == [
        ("table", ""), ("tr", ""), ("th", ""), ("th", ""), ("th", ""),
        ("tr", "vertical-align:top"), ("th", left), ("td", ""), ("td", ""), ("br", ""),
    ]  # fmt: skip
    assert [tag for tag, _ in Reader(html([("a",)])).tags] == ["table", "tr", "td"]


def test_a_result_of_several_tables_shows_them_and_its_words():
    class Part(Printed):
        def __str__(self):
            return "a table"

        def _repr_html_(self):
            return "<table></table>"

    class Both(Tables):
        def _tables(self):
            return [Part(), Part()]

        def _words(self):
            return ["1 < 2"]

    assert repr(Part()) == "a table"
    assert repr(Both()) == str(Both()) == "a table\n\na table\n\n1 < 2"
    assert Both()._repr_html_() == "<table></table><table></table><p>1 &lt; 2</p>"


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, None, np.inf])
def test_what_is_no_finite_number_is_null(value):
    assert finite(value) is None and plain(value) is None


def test_values_as_json_takes_them():
    found = plain(("a", True, 2, np.float64(0.5), 1 - 2j, complex(0, math.inf), (1.5, None)))
    assert found == ["a", True, 2.0, 0.5, [1.0, -2.0], [0.0, None], [1.5, None]]
    assert type(found[3]) is float


# Numbers ---------------------------------------------------------------------------------------
def test_the_results_of_a_loop_give_their_numbers_as_json_takes_them():
    loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    opened = loop.open("S_meas")
    data = strict(opened.margins().data())
    assert data["gain"] == opened.margins().gain and data["stable"] is True
    assert data["gain_crossings"] == [list(pair) for pair in opened.margins().gain_crossings]
    roots = loop.with_(lam=30).roots_right_of(0)
    assert strict(roots.data())["roots"] == [[root.real, root.imag] for root in roots.roots]
    assert strict(roots.data())["chain"] is None, "an infinite number is null"
    chart = loop.stability_chart(lam=(1, 30), tau=(0.02, 0.2), grid=(4, 3))
    assert strict(chart.data())["unstable"] == chart.unstable.tolist()
    assert len(strict(chart.data())["boundaries"]) == len(chart.boundaries)
    checked = vs.loop.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=0).check()
    assert [line["faces"] for line in strict(checked.data())["lines"]] == [
        line.faces for line in checked.lines
    ]
    model = opened.pade(3)
    assert strict(model.data())["delays"] == [0.08]
    assert strict(model.data())["worst_error"] == model.worst()[1]


def test_formulas_and_limits_of_a_motion_give_theirs():
    constants = vs.loop.error_constants(vs.figure1, "S_meas", kappa=1)
    assert strict(constants.data()) == {
        "type": 1, "position": "oo", "velocity": "lambda", "acceleration": "0",
    }  # fmt: skip
    found = vs.servo.feasibility(vs.paper.sliding().reference, robot=vs.servo.Gantry())
    assert strict(found.data())["binding"] == found.binding.name
    assert len(strict(found.data())["readings"]) == len(found.readings)


def strict(data):
    """What a reader of the JSON gets, in which neither infinity nor NaN can stand."""
    return json.loads(json.dumps(data, allow_nan=False))


def test_lines_show_themselves_in_a_terminal_in_a_notebook_and_at_a_prompt():
    """The same rows everywhere; `repr` is left to the dataclass."""

    @dataclass(frozen=True)
    class Two(tables.Lines):
        a: float

        def _lines(self):
            return {"long name": f"{self.a:g} <", "b": "2"}

        def _sentences(self):
            return ["It is so."]

    two = Two(1.0)
    assert str(two) == "long name  1 <\nb          2\nIt is so."
    assert pretty.pretty(two) == str(two)
    assert "<th>long name</th><td>1 &lt;</td>" in two._repr_html_()
    assert "<p>It is so.</p>" in two._repr_html_()
    assert repr(two).endswith("Two(a=1.0)")


def test_roots_angles_and_limits_in_words():
    inf = float("inf")
    assert tables.roots_listed([-1e-17 - 1e-17j]) == "0 rad/s"
    assert tables.roots_listed([2 - 3j, 2 + 3j, 1e-15 + 0j, -1]) == "2 ± 3j, 0, -1 rad/s"
    assert tables.roots_listed([]) == "none"
    assert tables.listed([*"abcdefgh"], 3) == "a, b, c, … (8 in all)"
    assert (tables.angle(inf), tables.limit(inf, "s"), tables.limit(2.5, "s")) == (
        "no limit",
        "no limit",
        "2.5 s",
    )
    assert tables.angle(0.5) == "28.65° (0.5 rad)"
