"""Each browser is started when a test first asks for it; each test has a tab of its own."""

from collections.abc import Iterator
from typing import Any

import pytest
from browser.harness.chromium import Chromium, ChromiumTab
from browser.harness.firefox import Firefox
from browser.harness.tab import Tab
from report.conftest import report_of


@pytest.fixture(scope="session")
def chromium() -> Iterator[Chromium]:
    running = Chromium()
    yield running
    running.stop()


@pytest.fixture(scope="session")
def firefox() -> Iterator[Firefox]:
    running = Firefox()
    yield running
    running.stop()


@pytest.fixture(params=["chromium", "firefox"])
def tab(request: Any) -> Iterator[Tab]:
    """A page in each of the two browsers."""
    opened = request.getfixturevalue(request.param).tab()
    yield opened
    opened.close()


@pytest.fixture
def chromium_tab(chromium: Chromium) -> Iterator[ChromiumTab]:
    """A page where one browser is enough: print, no script, axe-core."""
    opened = chromium.tab()
    yield opened
    opened.close()


__all__ = ["report_of"]  # written once for all tests that read a report, wherever they are
