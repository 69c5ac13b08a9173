"""What a name, a dot and the tabulator show: what is meant for people, and it explains itself."""

import inspect
import json
import pydoc
import re
import types

import pytest

import vsctrl as vs

ROOMS = {name: getattr(vs, name) for name in ("derive", "loop", "paper", "plots", "servo", "study")}
ROOMS["vsctrl"] = vs


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_shows_its_public_names_and_nothing_else(room):
    shown = [name for name in dir(ROOMS[room]) if not name.startswith("__")]
    assert shown == sorted(ROOMS[room].__all__) and len(set(shown)) == len(shown)
    assert all(getattr(ROOMS[room], name) is not None for name in shown)
    # No room for what was only imported, and no module but the rooms themselves.
    for name in shown:
        value = getattr(ROOMS[room], name)
        if isinstance(value, types.ModuleType):
            assert room == "vsctrl" and name in {*ROOMS, "plots"}
        else:
            home = getattr(value, "__module__", "vsctrl")
            assert home.startswith("vsctrl") or not callable(value), name


@pytest.mark.parametrize("room", ROOMS)
def test_every_public_name_begins_its_documentation_with_a_sentence(room):
    assert inspect.getdoc(ROOMS[room])
    for name in ROOMS[room].__all__:
        value = getattr(ROOMS[room], name)
        if not (callable(value) or isinstance(value, types.ModuleType)):
            continue  # a number, a table, a diagram: what it is a comment of the source says
        own = value.__doc__ or ""
        first = inspect.cleandoc(own).split("\n\n")[0]
        assert re.match(r"\S.*[.:;)]$", " ".join(first.split())), (name, first)
        # A dataclass without words of its own is documented by its signature.
        assert not own.startswith(f"{name}("), name


def test_help_of_a_scenario_shows_every_field_with_its_meaning():
    shown = pydoc.plain(pydoc.render_doc(vs.Scenario))
    text = " ".join(shown.replace("|", " ").split())
    for words in (
        "lam gain λ, 1/s", "period video period, s", "V reference velocity in the camera frame,",
        '[motion] kind = "oscillation"', "k_ff = 1.0", "sure = False", "offset = 6 zeros",
    ):  # fmt: skip
        assert words in text, words
    listed = inspect.getdoc(vs.Scenario.with_)
    for key in ("lam", "euler_xyz_deg", "reference_hand_eye", "max_acceleration", "sure"):
        assert key in re.split(r"[\s,:]+", listed)
    assert max(map(len, vs.Scenario.__doc__.splitlines())) <= 100
    # An editor that completes a file is told in one paragraph what the file is.
    assert json.loads(vs.servo.schema())["description"].count("\n") == 2


def test_a_scenario_prints_itself_in_six_lines():
    scenario = vs.paper.sliding().with_(noise_px=0.3, lam=4.0)
    lines = str(scenario).splitlines()
    assert len(lines) == 6 and repr(scenario) == str(scenario)
    for line, words in zip(
        lines,
        ("sliding: ", "0.04 m/s along (1, 0, 0), for 9 s", "F = 700 px, 4 points", "λ = 4 s⁻¹",
         "every 40 ms, 80 ms late (2 frames)", "vision.noise_px = 0.3"),
        strict=True,
    ):  # fmt: skip
        assert words in line
    assert "nothing" in str(vs.paper.sliding()).splitlines()[-1]
    html = scenario.with_(name="<b>")._repr_html_()
    assert html.startswith("<table>") and "&lt;b&gt;" in html and "<b>" not in html


MOTIONS = {
    "0.1 rad/s about (0, 0, 1)": {"V": (0, 0, 0), "Omega": (0, 0, 0.1)},
    "rests": {"kind": "hold"},
    "0.2 rad/s about an axis (0, 1, 0), 0.8 m away": {
        "kind": "rotation", "axis": (0, 2, 0), "arm": (0, 0, 0.8), "speed": 0.2, "duration": 1,
    },
    "sine of ±0.1 m (rad where V = 0), cycle 5 s": {
        "kind": "oscillation", "direction": (1, 0, 0, 0, 0, 0), "amplitude": 0.1, "cycle": 5.0,
    },
    "a path through 1 poses": {
        "kind": "path", "times": (2.0,), "positions": [(0, 0, 0.1)], "frame": "start",
        "angles_xyz_deg": [(0, 0, 0)],
    },
    "1 motions one after another, blend none": {
        "kind": "linked", "parts": [{"kind": "hold", "duration": 1.0}], "blend": "none",
    },
}  # fmt: skip


@pytest.mark.parametrize("words", MOTIONS)
def test_every_kind_of_motion_is_told_in_words(words):
    assert words in str(vs.paper.sliding().with_(**MOTIONS[words])).splitlines()[1]
