"""Run the notebooks and keep what they show: ``python notebooks/refresh.py [NAME …] [--check]``.

A notebook is written as ``NN_name.py`` (jupytext's percent format). Beside it lies the same as
``NN_name.ipynb`` with its outputs, for those who read it where nothing runs. This script writes the
``.ipynb`` and the thumbnails anew, or with ``--check`` tells where they differ from what the
sources show now. A cell with the tag ``long`` is one that takes many seconds; the picture of one
with the tag ``thumbnail`` stands for its notebook in ``README.md``.

All run in one process, so that imports and what SymPy has worked out serve all of them.
"""

from __future__ import annotations

import argparse
import base64
import io
import re
import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any

import jupytext
import matplotlib as mpl
import nbformat
import numpy as np
import pandas as pd
from IPython.core.displayhook import DisplayHook
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from matplotlib.figure import Figure
from PIL import Image
from traitlets.config import Config

FOLDER = Path(__file__).resolve().parent
THUMBNAILS = FOLDER / "thumbnails"
DPI = 100  #: of the pictures kept; the screen's own in a notebook that runs
COLOURS = 64  #: of a picture: curves and letters, no photographs
WIDTH = 320  #: pixels of a thumbnail

RELATIVE, ABSOLUTE = 2e-3, 1e-6  #: what numbers may differ by: a flip of the fourth digit, rounding
SHADE = 4.0  #: of 255, what two pictures may differ by on the mean, made small
NUMBER = re.compile(r"(?<![\w.])[-−+]?\d+(?:\.\d+)?(?:e[-−+]?\d+)?")


class Silent(DisplayHook):
    """Keeps the value of a cell and prints nothing."""

    def write_output_prompt(self) -> None:
        """Nothing to write."""

    def compute_format_data(self, result: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """Nothing to show."""
        return {}, {}

    def finish_displayhook(self) -> None:
        """Nothing to end."""


class Shell(InteractiveShell):
    """IPython without a window system: figures are shown in the notebook."""

    displayhook_class = Silent

    def enable_gui(self, gui: str | None = None) -> None:
        """Nothing to do."""


@contextmanager
def fresh() -> Iterator[Shell]:
    """A namespace of its own in the notebooks' folder; what is set for all is put back."""
    config = Config({"HistoryManager": {"enabled": False}})
    options = ("display.precision", pd.get_option("display.precision"))
    with mpl.rc_context(), np.printoptions(), pd.option_context(*options), chdir(FOLDER):
        shell = Shell.instance(config=config)
        try:
            yield shell
        finally:
            shell.restore_sys_module_state()
            Shell.clear_instance()


def names() -> list[str]:
    """All notebooks, in their order."""
    return sorted(path.stem for path in FOLDER.glob("[0-9][0-9]_*.py"))


def source(name: str) -> Any:
    """The notebook as written, without outputs; its ids are numbers, so that they stay."""
    notebook = jupytext.read(FOLDER / f"{name}.py", fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number:02}"
    notebook.metadata = nbformat.from_dict(
        {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        }
    )
    return notebook


def stored(name: str) -> Any:
    """The notebook with the outputs that are kept."""
    return nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)


def is_long(cell: Any) -> bool:
    """Whether it takes many seconds."""
    return "long" in cell.metadata.get("tags", ())


def run(name: str, *, long: bool = True, pictures: bool = True) -> Any:
    """The notebook with outputs. Without `long` such cells have none; without `pictures` no figure
    is drawn, and only its size is noted.

    Errors: what a cell raises; `RuntimeError` for a word on stderr.
    """
    notebook = source(name)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    with fresh() as shell:
        for number, cell in enumerate(code, start=1):
            if long or not is_long(cell):
                cell.execution_count = number
                cell.outputs = _outputs(shell, cell.source, number, pictures)
    return notebook


def _outputs(shell: Shell, text: str, number: int, pictures: bool) -> list[Any]:
    with capture_output() as captured:
        result = shell.run_cell(text)
    result.raise_error()
    if captured.stderr:
        raise RuntimeError(f"stderr, of {text[:60]!r}: {captured.stderr}")
    out = []
    if captured.stdout:
        out.append(nbformat.v4.new_output("stream", name="stdout", text=captured.stdout))
    out += [nbformat.v4.new_output("display_data", data=dict(x.data)) for x in captured.outputs]
    if isinstance(result.result, Figure):
        out += _figure(result.result, number, pictures)
    elif result.result is not None:
        data = shell.display_formatter.format(result.result)[0]
        out.append(nbformat.v4.new_output("execute_result", execution_count=number, data=data))
    return out


def _figure(figure: Figure, number: int, pictures: bool) -> list[Any]:
    """A figure as code hosts show it: a picture, and its caption as a paragraph."""
    size = [round(DPI * side) for side in figure.get_size_inches()]
    data = {"text/plain": getattr(figure, "alt", "") or "Figure"}
    if pictures:
        data["image/png"] = base64.b64encode(_png(figure)).decode()
    shown = nbformat.v4.new_output(
        "execute_result",
        execution_count=number,
        data=data,
        metadata={"image/png": {"width": size[0], "height": size[1]}},
    )
    caption = getattr(figure, "caption", "")
    words = {"text/markdown": f"*{caption}*", "text/plain": caption}
    return [shown, nbformat.v4.new_output("display_data", data=words)] if caption else [shown]


def _png(figure: Figure) -> bytes:
    out, small = io.BytesIO(), io.BytesIO()
    figure.savefig(out, format="png", dpi=DPI, facecolor="white", metadata={"Software": None})
    picture = Image.open(out).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(small, format="PNG", optimize=True)
    return small.getvalue()


def opened(output: Any) -> Image.Image:
    """The picture of an output."""
    return Image.open(io.BytesIO(base64.b64decode(output.data["image/png"])))


def differences(kept: Any, now: Any) -> list[str]:
    """Where a notebook that is kept is not what its source shows; none where it is."""
    one, other = ([(c.cell_type, c.source) for c in book.cells] for book in (kept, now))
    if one != other:
        return ["the cells are not those of the source"]
    found = []
    for old, new in zip(kept.cells, now.cells, strict=True):
        if old.cell_type != "code" or new.execution_count is None:
            continue
        where = f"{new.id}, {new.source.splitlines()[0]!r}"
        if [o.output_type for o in old.outputs] != [o.output_type for o in new.outputs]:
            found.append(f"{where}: another number or kind of outputs")
            continue
        for one, other in zip(old.outputs, new.outputs, strict=True):
            found += [f"{where}: {what}" for what in _unlike(one, other)]
    return found


def _unlike(old: Any, new: Any) -> list[str]:
    if old.output_type == "stream":
        return [] if same_text(old.text, new.text) else [f"printed {new.text!r}"]
    if old.get("metadata") != new.get("metadata"):
        return ["a figure of another size"]
    found = [
        f"{kind} shows {text!r}"
        for kind, text in new.data.items()
        if kind != "image/png" and not same_text(old.data.get(kind, ""), text)
    ]
    if "image/png" in new.data and not same_picture(opened(old), opened(new)):
        found.append("another picture")
    return found


def same_text(old: str, new: str) -> bool:
    """Whether two texts are the same, but for numbers that differ by rounding."""
    if NUMBER.sub("#", old) != NUMBER.sub("#", new):
        return False
    one, other = (
        [float(found.replace("−", "-")) for found in NUMBER.findall(text)] for text in (old, new)
    )
    return bool(np.allclose(one, other, rtol=RELATIVE, atol=ABSOLUTE))


def same_picture(old: Image.Image, new: Image.Image) -> bool:
    """Whether two pictures show the same, whatever draws their letters."""
    if old.size != new.size:
        return False
    coarse = (old.width // 8, old.height // 8)
    one, other = (np.asarray(picture.convert("L").resize(coarse), float) for picture in (old, new))
    return bool(np.abs(one - other).mean() < SHADE)


def write(name: str, notebook: Any) -> None:
    """Keep a notebook, and the thumbnail of its picture."""
    text = nbformat.writes(notebook) + "\n"
    (FOLDER / f"{name}.ipynb").write_text(text, encoding="utf-8")
    for cell in notebook.cells:
        if "thumbnail" in cell.metadata.get("tags", ()):
            output = next(each for each in cell.outputs if "image/png" in each.data)
            picture = opened(output).convert("RGB")
            picture.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
            THUMBNAILS.mkdir(exist_ok=True)
            few = picture.quantize(COLOURS, dither=Image.Dither.NONE)
            few.save(THUMBNAILS / f"{name}.png", optimize=True)


def main() -> int:
    """Write, or check; the number of notebooks that differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="as 00_tour; all if none is given")
    parser.add_argument("--check", action="store_true", help="write nothing, tell what differs")
    asked = parser.parse_args()
    wrong = 0
    for name in asked.names or names():
        print(f"{name} …", flush=True)
        notebook = run(name)
        if asked.check:
            found = differences(stored(name), notebook)
            wrong += bool(found)
            print(*found, sep="\n", end="\n" if found else "")
        else:
            write(name, notebook)
    return wrong


if __name__ == "__main__":
    sys.exit(main())
