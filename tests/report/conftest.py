"""Reports are expensive: each is written once for all workers of a test run and then read."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sympy import exp, symbols

import vsctrl as vs
from vsctrl import paper
from vsctrl.report import write_report
from vsctrl.symbols import s

HOSTILE = "</title><script>alert(1)</script>"
HOSTILE_TEXT = "<img src=x onerror=alert(2)> & \"quoted\" 'text' {{ 7 * 7 }} <!-- ${1}"

OFFSET = (0.1, 0.05, -0.1, 0.05, -0.1, 0.5)

K, T, theta = symbols("K T theta", positive=True)


def simc(**values: float) -> vs.Loop:
    """PI control of e^{−θs}/(T s + 1) with T_i = T, so that L = K e^{−θs}/(T s)."""
    diagram = vs.Diagram(
        [
            vs.Sum("e = r - y"),
            vs.Block("PI", K * (1 + 1 / (T * s)), "e -> u"),
            vs.Block("process", exp(-theta * s) / (T * s + 1), "u -> y"),
        ],
        inputs=["r"],
        outputs=["y"],
    )
    numbers = {"K": 2.5, "T": 5.0, "theta": 1.0} | values
    return vs.Loop(diagram, numbers, name="simc", applied=(vs.Applied("r", "step"),))


def wild() -> vs.Loop:
    """−1/s fed back: one root at 1 rad/s."""
    diagram = vs.Diagram([vs.Sum("e = r - y"), vs.Block("plant", -1 / s, "e -> y")], ["r"], ["y"])
    return vs.Loop(diagram, name="wild", applied=(vs.Applied("r", "step"),))


@pytest.fixture(scope="session")
def simc_loop() -> vs.Loop:
    """The first loop that the report "loops" is about."""
    return simc()


REPORTED = {
    "loops": lambda: [simc(), wild()],
    "slide": lambda: paper.sliding(),
    "unstable": lambda: paper.sliding(lam=17.0),  # above 15.45 s⁻¹, below 19.63 s⁻¹
    "sine": lambda: paper.oscillation("sine"),
    "rest": lambda: paper.sliding().with_(kind="hold", duration=1.0),
    "prompt": lambda: paper.sliding(latency=0.0).with_(name=HOSTILE, description=HOSTILE_TEXT),
    "goal": lambda: paper.sliding().with_(kind="hold", duration=4.0, offset=OFFSET),
    "late": lambda: paper.sliding(lam=9.0).with_(dead_time=0.2),
}


@pytest.fixture(scope="session")
def report_of(tmp_path_factory) -> Callable[[str], Path]:
    """The folder of a written report, by the name of what it is about."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if base.name.startswith("popen-") else base

    def folder(name: str) -> Path:
        out, claim = shared / f"report-{name}", shared / f"report-{name}.claimed"
        done = shared / f"report-{name}.done"
        try:
            claim.mkdir()
        except FileExistsError:
            for _ in range(1200):
                if done.exists():
                    break
                time.sleep(0.1)
            assert done.read_text() == "written", f"the report {name} could not be written"
            return out
        outcome = "failed"
        try:
            write_report(REPORTED[name](), out, command="vsctrl report")
            outcome = "written"
        finally:
            done.write_text(outcome)
        return out

    return folder
