"""The picture of the report in README: ``python analysis/screenshot.py [OUT] [--browser PROGRAM]``.

Writes the report of the paper's slide, shows it to a headless Chromium and keeps the first screen
as ``report.png`` in OUT (``analysis`` if not given), in few colours, so that it stays small.
"""

import argparse
import io
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

import vsctrl as vs
from vsctrl.files import write

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
SIZE = (1280, 800)  #: px of the first screen
COLOURS = 64


def main(out: Path, browser: str | None = None) -> Path:
    """Write the report, photograph it and return the path of the picture."""
    program = browser or next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        raise SystemExit(f"There is no browser here; install one of {', '.join(BROWSERS)}.")
    with TemporaryDirectory() as folder:
        print("writing the report …", file=sys.stderr, flush=True)
        page = vs.write_report(vs.paper.sliding(), out=folder).page
        print(f"opening it in {program} …", file=sys.stderr, flush=True)
        picture = photograph(program, page.resolve(), Path(folder) / "screen.png")
    out.mkdir(parents=True, exist_ok=True)
    write(out / "report.png", picture, "picture")
    return out / "report.png"


def photograph(program: str, page: Path, file: Path) -> bytes:
    """The first screen of a page as a PNG of few colours."""
    width, height = SIZE
    how = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run"]
    where = [f"--user-data-dir={file.parent / 'browser'}", f"--screenshot={file}"]
    command = [program, *how, *where, f"--window-size={width},{height}", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    if not file.exists():
        raise SystemExit(f"{program} made no picture: {done.stderr.strip()[-300:]}")
    out = io.BytesIO()
    screen = Image.open(file).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    screen.save(out, format="PNG", optimize=True)
    return out.getvalue()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", nargs="?", type=Path, default=Path("analysis"))
    parser.add_argument("--browser", help="the program, where it has another name or place")
    asked = parser.parse_args()
    print(main(asked.out, asked.browser))
