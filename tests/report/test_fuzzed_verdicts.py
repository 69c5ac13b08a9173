"""Whatever a file says, its first lines and its tables are sentences, or an error is one.

Pages take seconds because of their figures, so what is drawn is left out here: verdicts, tables and
numbers of random files, odd ones among them.
"""

import json
import math
import re

import numpy as np
import pytest
from effort import share
from oracles.linear_scenarios import random_scenario

from vsctrl.diagram import Loop
from vsctrl.errors import InputError, LimitError
from vsctrl.report.loop_tables import margins_table, parameter_table, roots_table, step_table
from vsctrl.report.loop_verdict import loop_verdict, own_limits
from vsctrl.report.verdict import verdict
from vsctrl.study.examination.examination import examination
from vsctrl.study.examination.gain_ranges import known

BROKEN = re.compile(r"\b(nan|inf|Infinity|None)\b|\de[-+]\d|\(,|  |\.\.|,,")


def number(rng):
    """Of any size, now and then one that is no sensible value of anything."""
    if rng.random() < 0.05:
        return str(rng.choice(["0", "1e300", "1e-300", "-1", "1e12"]))
    return f"{10 ** rng.uniform(-3, 3) * rng.choice([1, 1, 1, -1]):.3g}"


def transfer(rng):
    """A rational transfer function of order 0 to 3, often late."""
    a, b, c, tau = (number(rng) for _ in range(4))
    forms = [
        f"{a}", f"{a}/s", f"{a}/({b}*s + 1)", f"{a}/(s*({b}*s + 1))", f"{a}*({c}*s + 1)/s",
        f"{a}*(s + {c})/(s**2 + {b}*s + 1)", f"{a}/s**2", f"{a}*s/({b}*s + 1)",
        f"(1 - exp(-{abs(float(b)):g}*s))/({abs(float(b)):g}*s)",
    ]  # fmt: skip
    form = str(rng.choice(forms))
    return f"({form})*exp(-{abs(float(tau)):g}*s)" if rng.random() < 0.5 else form


def loop_file(rng):
    """A loop of one or two controllers and a plant, MIMO, sampled or open now and then."""
    sign = str(rng.choice(["-", "-", "-", "+"]))
    fed = "e = r" if rng.random() < 0.1 else f"e = r {sign} y"
    blocks = [f'[[block]]\nsum = "{fed}"', '[[block]]\nsum = "v = u + d"']
    for name, wiring in (("law", "e -> u"), ("plant", "v -> y")):
        blocks.append(
            f'[[block]]\nname = "{name}"\nwiring = "{wiring}"\ntransfer = "{transfer(rng)}"'
        )
    if rng.random() < 0.2:
        blocks.append('[[block]]\nname = "inner"\nwiring = "y -> w"\ngain = 0.5')
    for name in ("r", "d"):
        if rng.random() < 0.7:
            kind = rng.choice(["step", "step", "ramp", 'pulse"\nwidth = "1 s'])
            blocks.append(f'[[apply]]\ninput = "{name}"\nkind = "{kind}"\nsize = {number(rng)}')
    if rng.random() < 0.3:
        blocks.append(f'[sampling]\nperiod = {abs(float(number(rng))):g}\nhold = "u"')
    unit = rng.choice(["ms", "s", "min", "h"])
    head = f'inputs = ["r", "d"]\noutputs = ["y", "u"]\ntime_unit = "{unit}"\n'
    return head + "\n".join(blocks)


def whole(text):
    assert text and not BROKEN.search(text), text
    assert text[0].isupper() or not text[0].isalpha() or text.startswith(("λ", "k_ff")), text
    assert text.endswith((".", "?")), text


@pytest.mark.parametrize("seed", range(share(128)))
def test_a_random_loop_file_has_first_lines_and_tables_or_an_error_that_is_a_sentence(seed):
    rng = np.random.default_rng(seed)
    try:
        loop = Loop.from_toml(loop_file(rng))
        opened = known(lambda: loop.open)
        margins = None if opened is None else known(opened.margins)
        found = loop_verdict(loop, margins, own_limits(loop, margins))
        tables = [roots_table(loop), step_table(loop), parameter_table(loop)]
        if margins is not None:
            tables.append(margins_table(loop, opened, margins, "Opened"))
    except (InputError, LimitError) as error:
        assert str(error).endswith("."), error
        return
    for sentence in found.sentences:
        whole(sentence)
    assert (found.kind == "bad") == (
        "stable:" in found.sentences[0] or "unstable" in found.sentences[0]
    )
    for table in tables:
        for row in table.rows if table is not None else ():
            assert not any(BROKEN.search(cell) for cell in row), row


@pytest.mark.parametrize("seed", range(share(64)))
def test_a_random_scenario_has_first_lines_or_an_error_that_is_a_sentence(seed):
    """All that is not linear too: noise, limits, sizes of images, far starts, adaptive gains."""
    rng = np.random.default_rng(4000 + seed)
    odd = {
        "noise_px": 0.5, "jitter": 0.01, "missed": 0.2, "outliers": 0.02, "speed_limit": 0.05,
        "size_px": (640, 480), "lam_zero": 20.0, "smooth": 2.0, "reference_depth_ratio": 1.1,
        "quantum_px": 1.0, "scheme": "pose", "depth": "estimated", "rate_limit": 0.1,
        "offset": tuple(rng.uniform(-0.3, 0.3, 6)), "sway": 2.0,
        "drift": (0.01, 0.02, 0, 0, 0.01, 0),
    }  # fmt: skip
    chosen = {key: odd[key] for key in rng.choice(list(odd), 3, replace=False)}
    if "lam_zero" in chosen:
        chosen["lam_slope"] = 5.0
    try:
        scenario = random_scenario(rng, frames=80).with_(**chosen)
        limit = examination(scenario).loop.gain_limit
        if 0 < limit < math.inf and "lam_zero" not in chosen:
            scenario = scenario.with_(lam=float(rng.choice([0.1, 0.4, 0.9, 1.3]) * limit))
        x = examination(scenario)
        found = verdict(x)
    except (InputError, LimitError) as error:
        assert str(error).endswith((".", ")")), error
        return
    for sentence in found.sentences:
        whole(sentence)
    json.dumps(x.data(), allow_nan=False)
    stable = "unstable" not in found.sentences[0]
    assert (x.loop is not None and x.loop.is_stable) == stable or x.loop is None
    if not x.run.status.ok:
        assert found.kind == "bad"
