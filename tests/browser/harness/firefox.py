"""Firefox by WebDriver BiDi, which it speaks without a driver."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from browser.harness.process import Process
from browser.harness.tab import Point, Tab
from browser.harness.wire import BrowserError, Wire

#: Nothing is fetched, nothing is asked, a page of the file system may be opened.
_PREFERENCES: dict[str, bool | int | str] = {
    "app.normandy.enabled": False,
    "app.update.enabled": False,
    "browser.aboutwelcome.enabled": False,
    "browser.search.update": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "layout.css.prefers-color-scheme.content-override": 1,  # light
    "messaging-system.rsexperimentloader.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,#remote-settings-dummy/v1",
    "toolkit.telemetry.enabled": False,
    "ui.prefersReducedMotion": 1,
}
_KEYS = {"Tab": "\ue004", "Enter": "\ue007", "Escape": "\ue00c", "PageUp": "\ue00e"}
_KEYS |= {"PageDown": "\ue00f", "End": "\ue010", "Home": "\ue011", "ArrowLeft": "\ue012"}
_KEYS |= {"ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015"}


class Firefox:
    """A running Firefox; `tab()` is a fresh window."""

    name = "firefox"

    def __init__(self) -> None:
        self._process = Process(("firefox-esr", "firefox"), _prepare)
        self._tabs: dict[str, FirefoxTab] = {}
        try:
            address = self._process.wait_for(self._address)
            self.wire = Wire(f"{address}/session", self._heard)
            self.wire.call("session.new", capabilities={})
            events = ["log.entryAdded", "network.beforeRequestSent"]
            self.wire.call("session.subscribe", events=events)
        except BaseException:
            self._process.stop()
            raise

    def _address(self) -> str | None:
        text = self._process.log.read_text(encoding="utf-8", errors="replace")
        found = re.search(r"WebDriver BiDi listening on (ws://\S+)", text)
        return found[1] if found else None

    def _heard(self, event: dict[str, Any]) -> None:
        said = event.get("params", {})
        context = said.get("context") or said.get("source", {}).get("context")
        if (tab := self._tabs.get(context)) is not None:
            tab.heard(event["method"], said)

    def tab(self) -> "FirefoxTab":
        context = self.wire.call("browsingContext.create", type="tab")["context"]
        self._tabs[context] = FirefoxTab(self.wire, context)
        return self._tabs[context]

    def stop(self) -> None:
        self.wire.close()
        self._process.stop()


def _prepare(profile: Path) -> list[str]:
    lines = []
    for name, value in _PREFERENCES.items():
        shown = f'"{value}"' if isinstance(value, str) else str(value).lower()
        lines.append(f'user_pref("{name}", {shown});\n')
    (profile / "user.js").write_text("".join(lines), encoding="utf-8")
    listen = ["--remote-debugging-port", "0"]
    return ["--headless", "--no-remote", "--profile", str(profile), *listen, "about:blank"]


class FirefoxTab(Tab):
    """A window of Firefox, whose pages are light and have their script."""

    def __init__(self, wire: Wire, context: str) -> None:
        super().__init__()
        self._wire, self._context = wire, context

    def call(self, method: str, **parameters: Any) -> Any:
        return self._wire.call(method, context=self._context, **parameters)

    def heard(self, method: str, said: dict[str, Any]) -> None:
        if method == "network.beforeRequestSent":
            self.took(said["request"]["url"])
        elif said["level"] in ("error", "warn"):
            self.errors.append(str(said["text"]))

    def _show(self, address: str, width: int, height: int, dark: bool, script: bool) -> None:
        if dark or not script:
            raise BrowserError("Chromium is the browser for dark pages and those without script.")
        self.call("browsingContext.setViewport", viewport={"width": width, "height": height})
        self.call("browsingContext.navigate", url="about:blank", wait="complete")
        self.errors.clear()
        self.requests.clear()
        self.call("browsingContext.navigate", url=address, wait="complete")

    def _evaluated(self, expression: str) -> str:
        answer = self._wire.call(
            "script.evaluate",
            expression=expression,
            target={"context": self._context},
            awaitPromise=True,
            resultOwnership="none",
        )
        if answer["type"] == "exception":
            raise BrowserError(answer["exceptionDetails"]["text"])
        return answer["result"]["value"]

    def press(self, *keys: str) -> None:
        actions = []
        for key in keys:
            value = _KEYS.get(key, key)
            actions += [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        sources = [{"type": "key", "id": "keyboard", "actions": actions}]
        self.call("input.performActions", actions=sources)

    def drag(self, points: Sequence[Point]) -> None:
        def move(point: Point) -> dict[str, Any]:
            return {"type": "pointerMove", "x": round(point[0]), "y": round(point[1])}

        actions = [move(points[0]), {"type": "pointerDown", "button": 0}]
        actions += [*map(move, points[1:]), {"type": "pointerUp", "button": 0}]
        sources = [{"type": "pointer", "id": "mouse", "actions": actions}]
        self.call("input.performActions", actions=sources)

    def screenshot(self, path: Path, whole: bool = True) -> Path:
        origin = "document" if whole else "viewport"
        return self.save(
            self.call("browsingContext.captureScreenshot", origin=origin)["data"], path
        )

    def close(self) -> None:
        self.call("browsingContext.close")
