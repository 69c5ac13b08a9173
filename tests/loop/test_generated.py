"""The closed forms as printed are those that the derivations find."""

from pathlib import Path

from sympy import Basic, Tuple, srepr

from vsctrl import loop
from vsctrl.loop.generated import DERIVATIONS, closed_forms
from vsctrl.loop.generated.__main__ import source
from vsctrl.loop.generated.closed_forms import FORMS


def as_read(forms):
    """Every form as the tree of constructors that it is."""
    return {
        name: srepr(form if isinstance(form, Basic) else Tuple(*form))
        for name, form in forms.items()
    }


def test_the_printed_closed_forms_are_derived_identically_again():
    printed = as_read(FORMS)
    anew = source()  # derives all of them, starting from nothing
    assert anew == Path(closed_forms.__file__).read_text(encoding="utf-8")
    assert as_read(FORMS) == printed
    assert len(printed) == len(DERIVATIONS) == 9


def test_what_users_ask_for_reads_the_printed_form(monkeypatch):
    monkeypatch.setitem(FORMS, "limits._continuous_limit", 2 * FORMS["limits._continuous_limit"])
    assert loop.gain_limit(tau=0.08) == 2 * 19.634954084936208
