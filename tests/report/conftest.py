"""Reports are expensive: each is written once for all workers of a test run and then read."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from vsctrl import paper
from vsctrl.report import write_report

HOSTILE = "</title><script>alert(1)</script>"
HOSTILE_TEXT = "<img src=x onerror=alert(2)> & \"quoted\" 'text' {{ 7 * 7 }} <!-- ${1}"

OFFSET = (0.1, 0.05, -0.1, 0.05, -0.1, 0.5)

SCENARIOS = {
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
    """The folder of a written report, by the name of its scenario."""
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
            write_report(SCENARIOS[name](), out, command="vsctrl report")
            outcome = "written"
        finally:
            done.write_text(outcome)
        return out

    return folder
