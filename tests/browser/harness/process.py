"""A browser's process with a profile of its own, which is gone when the tests are done."""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path


class Process:
    """A browser that was started; `ready` finds in its profile or log where it listens."""

    def __init__(self, names: Sequence[str], prepare: Callable[[Path], Sequence[str]]) -> None:
        program = next(filter(None, map(shutil.which, names)), None)
        if program is None:
            raise AssertionError(
                f"The tests of the page need {names[0]}, which is not installed here: "
                f"`apt-get install {names[0]}` (Debian) and run them again."
            )
        self.profile = Path(tempfile.mkdtemp(prefix="vsctrl-browser-"))
        self.log = self.profile / "log"
        with self.log.open("wb") as log:
            arguments = [program, *prepare(self.profile)]
            self._process = subprocess.Popen(arguments, stdout=log, stderr=log)

    def wait_for(self, ready: Callable[[], str | None], seconds: float = 60.0) -> str:
        """What `ready` finds, as soon as it finds it."""
        until = time.monotonic() + seconds
        while time.monotonic() < until and self._process.poll() is None:
            if found := ready():
                return found
            time.sleep(0.02)
        text = self.log.read_text(encoding="utf-8", errors="replace")
        raise AssertionError(f"{self._process.args[0]} did not start:\n{text[-2000:]}")

    def stop(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self.profile, ignore_errors=True)
