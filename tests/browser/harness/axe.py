"""axe-core's judgement of a page: what a person who sees or moves little would stumble on."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from browser.harness.tab import Tab

WIDTHS = (390, 1280)


@cache
def _source() -> str:
    spec = find_spec("axe_playwright_python")
    assert spec is not None and spec.origin is not None, "axe-core comes with the extra `test`"
    return Path(spec.origin).with_name("axe.min.js").read_text(encoding="utf-8")


def violations(tab: Tab) -> list[str]:
    """What axe-core finds on the page that is shown: rule, sentence, and where."""
    tab.run(_source())
    return tab.evaluate(
        "axe.run(document, {resultTypes: ['violations']}).then(found => found.violations.flatMap("
        "v => v.nodes.map(n => `${v.id}: ${v.help}: ${n.html.slice(0, 200)} ${n.failureSummary}`)))"
    )


def assert_accessible(tab: Tab, page: str | Path) -> None:
    """No violation on the page, light and dark, on a phone and on a desk."""
    for dark in (False, True):
        for width in WIDTHS:
            tab.open(page, width, dark=dark)
            found = violations(tab)
            where = f"{'dark' if dark else 'light'}, {width} px wide"
            assert not found, f"{where}: {len(found)} violations\n" + "\n".join(found[:10])
