"""The explorer's numbers are Python's, to 1e-9, in both browsers and at many parameters."""

import json
import math

import numpy as np
import pytest
from browser import explorer_page
from effort import share

import vsctrl as vs

MARGINS = ("gain", "gain_down", "phase", "delay", "peak_sensitivity")
PLAIN = """(x) => JSON.parse(JSON.stringify(x, (key, value) =>
  typeof value === 'number' && !Number.isFinite(value) ? String(value) : value))"""
TIMES = 40


def drawn(loop: vs.Loop, cases: int, seed: int) -> list[vs.Loop]:
    """The loop, and the same with every parameter and the period up to doubled or halved."""
    rng = np.random.default_rng(seed)
    out = [loop]
    for _ in range(cases - 1):
        values = {k: float(f"{v * 2 ** rng.uniform(-1, 1):.4g}") for k, v in loop.values.items()}
        period = loop.period and float(f"{loop.period * 2 ** rng.uniform(-1, 1):.3g}")
        out.append(vs.Loop(**{**fields(loop), "values": values, "period": period}))
    return out


def fields(loop):
    return {name: getattr(loop, name) for name in loop.__dataclass_fields__}


def answers(tab, loops, horizon):
    """What the page's own engine says of each: margins, roots, L, responses; sampled too."""
    values = [dict(x.values) | ({"period": x.period} if x.period else {}) for x in loops]
    return tab.evaluate(
        f"""{json.dumps(values)}.map((values) => {{
          const explorer = vsctrl.explorers[0];
          const at = explorer.loop.at(values);
          const shown = explorer.data.model.shown.map((_, i) => i);
          const times = Array.from({{length: {TIMES}}}, (_, k) => {horizon} * k / {TIMES});
          const responses = (f) => shown.map((i) => [0, 1].map((power) => f(i, power)));
          return ({PLAIN})({{
            margins: at.margins, L: [0.1, 1, 10].map((x) => at.L(x / {horizon} * 20)),
            responses: responses((i, power) => {{
              const y = at.response(i, power, {horizon});
              return times.map((t) => y.at(t));
            }}),
            sampled: explorer.sampled && at.sampledMargins,
            samples: explorer.sampled && responses((i, p) => at.sampledResponse(i, p, {TIMES})),
          }});
        }})"""
    )


def assert_same(found, expected, where=""):
    found, expected = float(found), float(expected)
    if math.isinf(expected) or math.isinf(found):
        assert found == expected, where
    else:
        assert abs(found - expected) <= 1e-9 * abs(expected) + 1e-12, (where, found, expected)


def assert_margins(found, expected, where):
    assert (found["stable"], found["unstable"]) == (expected.stable, expected.unstable_roots), where
    for name in MARGINS:
        assert_same(found[name], getattr(expected, name), where=f"{where} {name}")
    # Where a flat peak is, is known to the root of what its height is known to.
    assert math.isclose(found["peak_frequency"], expected.peak_frequency, rel_tol=1e-6), where


@pytest.mark.parametrize(
    "name", ["figure1", "fopdt", "smith", "cascade", "wood_berry", "adaptive_optics"]
)
def test_margins_responses_and_samples_are_those_of_python(tab, name):
    loop = explorer_page.example(name)
    loops, horizon = (
        drawn(
            loop,
            share(48, least=4)
            if not __import__("os").environ.get("N")
            else int(__import__("os").environ["N"]),
            seed=7,
        ),
        loop.horizon,
    )
    tab.open(explorer_page.of_loop(loop))
    t = horizon * np.arange(TIMES) / TIMES
    for one, found in zip(loops, answers(tab, loops, horizon), strict=True):
        where = f"{name} {one.values} {one.period}"
        assert_margins(found["margins"], one.open.margins(), where)
        L = one.open(1j * np.array([0.1, 1, 10]) / horizon * 20)
        assert np.allclose([complex(*z) for z in found["L"]], L, rtol=1e-9, atol=0), where
        for i, target in enumerate(one.watched[:2]):
            channel = one.system[one.applied[0].input, target]
            for signal, y in zip((vs.Step(1.0), vs.Ramp(1.0)), found["responses"][i], strict=True):
                expected = channel.response(signal, t).outputs
                assert np.abs(np.array(y) - expected).max() <= 1e-9 * np.abs(expected).max(), where
        if one.sampled is None:
            continue
        assert_margins(found["sampled"], one.sampled.open().margins(), f"sampled {where}")
        for i, target in enumerate(one.watched[:2]):
            channel = one.sampled[one.applied[0].input, target]
            for signal, y in zip((vs.Step(1.0), vs.Ramp(1.0)), found["samples"][i], strict=True):
                expected = channel.response(signal, TIMES).outputs
                assert np.abs(np.array(y) - expected).max() <= 1e-9 * np.abs(expected).max(), where


def test_the_limits_of_figure_1_are_the_closed_ones(tab):
    tab.open(explorer_page.of_figure_1(vs.paper.sliding()))
    taus, periods = [0.03, 0.08, 0.2], [0.01, 0.04, 0.033]
    found = tab.evaluate(
        f"""{json.dumps([*zip(taus, periods, strict=True)])}.map(([tau, period]) => {{
          const at = vsctrl.explorers[0].loop.at({{tau, period}});
          return [at.gainLimit('lam'), at.sampledLimit('lam'), at.rampError(0)];
        }})"""
    )
    for (continuous, sampled, lead), tau, period in zip(found, taus, periods, strict=True):
        assert_same(continuous, vs.loop.gain_limit(tau=tau))
        assert_same(sampled, vs.loop.gain_limit(tau=tau, period=period))
        assert_same(lead, tau)  # v τ ahead with the derivative term
