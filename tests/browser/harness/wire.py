"""Commands and events over a websocket, as Chromium's DevTools and WebDriver BiDi have them."""

import json
import time
from collections.abc import Callable
from typing import Any

import websocket

PATIENCE = 60.0  #: seconds that one answer of a browser may take on a machine with other work


class BrowserError(AssertionError):
    """What a browser could not do, in its own words."""


class Wire:
    """Numbered commands whose answers are waited for; `heard` is told each event on the way."""

    def __init__(self, url: str, heard: Callable[[dict[str, Any]], None]) -> None:
        self._socket = websocket.create_connection(url, timeout=PATIENCE, suppress_origin=True)
        self._heard = heard
        self._number = 0

    def call(self, method: str, session: str | None = None, **parameters: Any) -> Any:
        """The result of a command. Errors: `BrowserError` where the browser refuses it."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        self._socket.send(json.dumps(message | ({"sessionId": session} if session else {})))
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            answer = json.loads(self._socket.recv())
            if answer.get("id") != self._number:
                self._heard(answer)
            elif "error" in answer:
                raise BrowserError(f"{method}: {answer.get('message') or answer['error']}")
            else:
                return answer["result"]
        raise BrowserError(f"{method}: no answer within {PATIENCE:g} s")

    def listen(self, heard_enough: Callable[[], bool]) -> None:
        """Take events until `heard_enough`. Errors: `BrowserError` where they do not come."""
        until = time.monotonic() + PATIENCE
        while not heard_enough():
            if time.monotonic() > until:
                raise BrowserError(f"what was waited for did not happen within {PATIENCE:g} s")
            self._heard(json.loads(self._socket.recv()))

    def close(self) -> None:
        self._socket.close()
