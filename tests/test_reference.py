"""The examples in the documentation of the public names: each name has one, and it is true."""

import doctest
import inspect
import runpy
import types
from pathlib import Path

import effort
import numpy as np
import pytest

import vsctrl as vs

ROOT = Path(__file__).parents[1]
ROOMS = ("derive", "loop", "paper", "plots", "servo", "study")
SLOW = ("compare_remedies(", "validate_all(", "statements()", "matrix_law(", "examine(")


def documented():
    """Each public function and class once, by a name that it has."""
    found = {}
    for room in ("", *ROOMS):
        module = getattr(vs, room) if room else vs
        for name in module.__all__:
            value = getattr(module, name)
            if callable(value) and not isinstance(value, types.ModuleType):
                found.setdefault(id(value), (f"{room}.{name}".lstrip("."), value))
    return dict(found.values())


PUBLIC = {name: value for name, value in documented().items() if name != "figure1"}
EXAMPLES = {name: inspect.getdoc(value) or "" for name, value in PUBLIC.items()}
QUICK = sorted(name for name, text in EXAMPLES.items() if not any(s in text for s in SLOW))


def test_every_public_name_has_an_example():
    assert [name for name, text in EXAMPLES.items() if ">>> " not in text] == []


@pytest.mark.parametrize("name", sorted(EXAMPLES) if effort.long else effort.some(QUICK, 60))
def test_the_example_of_a_name_is_true(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    globs = {"vs": vs, "np": np}
    test = doctest.DocTestParser().get_doctest(EXAMPLES[name], globs, name, None, 0)
    said = []
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert not said, "".join(said)


def test_the_page_has_every_name_with_its_example(tmp_path):
    page = runpy.run_path(str(ROOT / "analysis" / "reference.py"))["main"](tmp_path)
    text = page.read_text(encoding="utf-8")
    for name in PUBLIC:
        assert f'<h3 id="vs.{name}">' in text
    assert text.count("<pre tabindex='0'>&gt;&gt;&gt;") >= len(PUBLIC)
    assert " at 0x" not in text and "<script" not in text
