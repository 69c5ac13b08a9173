"""Chromium by its DevTools protocol."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from browser.harness.process import Process
from browser.harness.tab import Point, Tab
from browser.harness.wire import BrowserError, Wire

_ARGUMENTS = (
    "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --hide-scrollbars "
    "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--disable-extensions --force-device-scale-factor=1 --remote-debugging-port=0 about:blank"
)
_CODES = {"Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "PageUp": 33, "PageDown": 34, "End": 35}
_CODES |= {"Home": 36, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
_PRINTED = {"Enter": "\r"}


class Chromium:
    """A running Chromium; `tab()` is a fresh window."""

    name = "chromium"

    def __init__(self) -> None:
        self._process = Process(
            ("chromium", "chromium-browser", "google-chrome"),
            lambda profile: [f"--user-data-dir={profile}", *_ARGUMENTS.split()],
        )
        self._tabs: dict[str, ChromiumTab] = {}
        try:
            address = self._process.wait_for(self._address)
            self.wire = Wire(address, self._heard)
        except BaseException:
            self._process.stop()
            raise

    def _address(self) -> str | None:
        port = self._process.profile / "DevToolsActivePort"
        lines = port.read_text().split() if port.exists() else []
        return f"ws://127.0.0.1:{lines[0]}{lines[1]}" if len(lines) == 2 else None

    def _heard(self, event: dict[str, Any]) -> None:
        tab = self._tabs.get(event.get("sessionId", ""))
        if tab is not None:
            tab.heard(event["method"], event["params"])

    def tab(self) -> "ChromiumTab":
        context = self.wire.call("Target.createBrowserContext")["browserContextId"]
        made = self.wire.call("Target.createTarget", url="about:blank", browserContextId=context)
        target = made["targetId"]
        attached = self.wire.call("Target.attachToTarget", targetId=target, flatten=True)
        tab = ChromiumTab(self.wire, context, attached["sessionId"])
        self._tabs[attached["sessionId"]] = tab
        for domain in ("Page", "Runtime", "Log", "Network"):
            tab.call(f"{domain}.enable")
        tab.call("Page.setLifecycleEventsEnabled", enabled=True)
        return tab

    def stop(self) -> None:
        self.wire.close()
        self._process.stop()


class ChromiumTab(Tab):
    """A window of Chromium."""

    def __init__(self, wire: Wire, context: str, session: str) -> None:
        super().__init__()
        self._wire, self._context, self._session = wire, context, session
        self._loaded: set[str] = set()

    def call(self, method: str, **parameters: Any) -> Any:
        return self._wire.call(method, self._session, **parameters)

    def heard(self, method: str, said: dict[str, Any]) -> None:
        if method == "Page.lifecycleEvent":
            if said["name"] == "load":
                self._loaded.add(said["loaderId"])
        elif method == "Network.requestWillBeSent":
            self.took(said["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            details = said["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning"):
            self.errors.append(" ".join(str(each.get("value")) for each in said["args"]))
        elif method == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
            self.errors.append(said["entry"]["text"])

    def _show(self, address: str, width: int, height: int, dark: bool, script: bool) -> None:
        self._go("about:blank")
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call("Emulation.setScriptExecutionDisabled", value=not script)
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.errors.clear()
        self.requests.clear()
        self._go(address)

    def _go(self, address: str) -> None:
        answer = self.call("Page.navigate", url=address)
        if failed := answer.get("errorText"):
            raise BrowserError(f"{address}: {failed}")
        self._wire.listen(lambda: answer["loaderId"] in self._loaded)

    def _evaluated(self, expression: str) -> str:
        answer = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if failed := answer.get("exceptionDetails"):
            raise BrowserError(failed.get("exception", {}).get("description", failed["text"]))
        return answer["result"]["value"]

    def press(self, *keys: str) -> None:
        for key in keys:
            code = {"windowsVirtualKeyCode": _CODES.get(key, ord(key[0].upper()))}
            text = {"text": _PRINTED.get(key, key)} if len(key) == 1 or key in _PRINTED else {}
            name = "Space" if key == " " else key
            self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=name, **code, **text)
            self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=name, **code)

    def drag(self, points: Sequence[Point]) -> None:
        def at(kind: str, point: Point, buttons: int) -> None:
            where = {"x": point[0], "y": point[1], "button": "left", "buttons": buttons}
            self.call("Input.dispatchMouseEvent", type=kind, clickCount=1, **where)

        at("mousePressed", points[0], 1)
        for point in points[1:]:
            at("mouseMoved", point, 1)
        at("mouseReleased", points[-1], 0)

    def screenshot(self, path: Path, whole: bool = True) -> Path:
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        return self.save(shot["data"], path)

    def pdf(self, path: Path) -> Path:
        printed = self.call(
            "Page.printToPDF",
            printBackground=True,
            preferCSSPageSize=True,
            paperWidth=8.27,
            paperHeight=11.69,
        )
        return self.save(printed["data"], path)

    def close(self) -> None:
        self._wire.call("Target.disposeBrowserContext", browserContextId=self._context)
