"""What a test does with a page, in the same words for every browser."""

import base64
import json
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from browser.harness.wire import BrowserError

Point = tuple[float, float]


class Tab(ABC):
    """A page on the screen: its script, its input, what it asked for and complained of."""

    def __init__(self) -> None:
        self.errors: list[
            str
        ] = []  #: complaints on the console, refusals of the policy, exceptions
        self.requests: list[str] = []  #: every address that was asked for but the page's own
        self._folder = Path(tempfile.mkdtemp(prefix="vsctrl-page-"))
        self._address = ""

    def open(
        self,
        page: str | Path,
        width: int = 1280,
        height: int = 900,
        *,
        dark: bool = False,
        script: bool = True,
        fragment: str = "",
    ) -> None:
        """Show a page: its text, its file, or its address; `fragment` is what follows its #."""
        if isinstance(page, str) and page.lstrip().startswith("<"):
            file = self._folder / "page.html"
            file.write_text(page, encoding="utf-8")
            page = file
        address = page.resolve().as_uri() if isinstance(page, Path) else page
        self.errors.clear()
        self.requests.clear()
        self._address = address + (f"#{fragment}" if fragment else "")
        self._show(self._address, width, height, dark, script)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression (or of its promise), by way of JSON."""
        text = self._evaluated(
            f"Promise.resolve({expression}).then(x => JSON.stringify(x ?? null))"
        )
        return json.loads(text)

    def run(self, source: str) -> None:
        """Run statements in the page, as if they were its own."""
        self._evaluated(f"{source}\n;'ran'")

    def centre(self, selector: str) -> Point:
        """The middle of an element in the window, where it is scrolled to."""
        found = self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'center', behavior: 'instant'});"
            "const r = e.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        return found[0], found[1]

    def click(self, selector: str) -> None:
        """Press and release the mouse over an element."""
        self.drag([self.centre(selector)])

    def took(self, address: str) -> None:
        """Note a request; the page itself and what stands in it are none."""
        own = address.split("#")[0] == self._address.split("#")[0]
        if not own and not address.startswith(("data:", "about:")):
            self.requests.append(address)

    def save(self, data: str, path: Path) -> Path:
        path.write_bytes(base64.b64decode(data))
        return path

    @abstractmethod
    def _show(self, address: str, width: int, height: int, dark: bool, script: bool) -> None: ...

    @abstractmethod
    def _evaluated(self, expression: str) -> str: ...

    @abstractmethod
    def press(self, *keys: str) -> None:
        """Press keys one after the other, by their names: "Tab", "ArrowRight", "a"."""

    @abstractmethod
    def drag(self, points: Sequence[Point]) -> None:
        """Press the mouse at the first point, move over the others, release at the last."""

    @abstractmethod
    def screenshot(self, path: Path, whole: bool = True) -> Path:
        """A PNG of the page, or of the window only."""

    @abstractmethod
    def close(self) -> None: ...

    def pdf(self, path: Path) -> Path:
        """The page as printed on A4."""
        raise BrowserError(f"{type(self).__name__} does not print.")
