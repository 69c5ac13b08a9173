"""What users call of a run: its file, its dataset, its numbers and its look in a notebook.

The arrays are the record's (``frames``), which everything here takes; figures are drawn in
``vsctrl.report.plots``.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np

from vsctrl.files import as_path, write
from vsctrl.servo.results import archive
from vsctrl.servo.results.columns import measured_in_pixels
from vsctrl.servo.results.dataset import dataset
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.results.notebook_svg import sketch
from vsctrl.servo.results.outcome import number, outcome
from vsctrl.servo.results.spreadsheet import table
from vsctrl.tables import html

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, slots=True, eq=False)
class Run(Frames):
    """A simulation that ran; its arrays, status and scenario are those of ``Frames``.

    >>> run = vs.simulate(vs.paper.sliding())
    >>> print(round(1e3 * run.lag_along_motion[-1], 6))
    3.2
    """

    def save(self, path: str | Path) -> None:
        """Write the run to exactly this path as a NumPy archive: all of it or nothing.

        ``np.load`` opens it too; see ``archive`` for what is in it. Equal runs give equal bytes.
        Raises InputError when the file cannot be written.
        """
        archive.save(self, as_path("path", path))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """The run in a file that ``save`` wrote, exactly; everything in it is checked.

        Raises InputError, a sentence that begins with the path.
        """
        return archive.load(cls, as_path("path", path))

    def to_xarray(self) -> "xarray.Dataset":
        """All arrays with named dimensions, units and meanings; needs ``vsctrl[scale]``.

        Dimensions: frame (with the time t in s), feature (X1, Y1, …), component (Vx … Ωz), row and
        column of poses, point, joint. Attributes: the scenario as TOML, its digest, status, events.
        Raises InputError when xarray is not installed.
        """
        return dataset(self)

    @overload
    def to_csv(self, path: None = None) -> str: ...
    @overload
    def to_csv(self, path: str | Path) -> None: ...
    def to_csv(self, path: str | Path | None = None) -> str | None:
        """The run as a table of comma-separated values, a row a frame, for any spreadsheet.

        The first row names the columns with their units: ``t_s``, ``x_m`` … of the camera and
        ``reference_x_m`` … in the object frame, ``rx_rad`` … (θu), ``lag_x_m``, ``lag_rx_rad`` …,
        ``twist_Vx_m_per_s``, ``X1_px``, ``error_X1_px`` …; see ``spreadsheet``. Numbers are written
        so that they are read back exactly, lines end in ``\\n``. Returned as text, or with a path
        written to exactly that file, all of it or nothing. Raises InputError when it cannot be.
        """
        text = table(self)
        if path is None:
            return text
        write(as_path("path", path), text, "table of the run")
        return None

    def data(self) -> dict[str, Any]:
        """The summary of the run as JSON takes it; every name ends in its unit.

        The same as ``vsctrl simulate --json`` prints: status, events, lag, errors, peak speeds.
        """
        return outcome(self).data()

    def __repr__(self) -> str:
        """One line, whatever the number of frames."""
        name, end = self.scenario.name, self.t[-1] if len(self.t) else 0.0
        return (
            f"<Run of {name} ({self.scenario.digest}): {len(self.t)} frames to t = {end:g} s, "
            f"{self.status.kind}>"
        )

    def _repr_html_(self) -> str:
        """A small table of the run's end and a picture of its course, for notebooks."""
        rows = [
            ("scenario", f"{self.scenario.name} ({self.scenario.digest})"),
            ("status", f"{self.status.kind}: {self.status.sentence}"),
            ("frames", f"{len(self.t)} (to t = {self.t[-1]:g} s)"),
        ]
        if self.reference_velocity.any():
            rows.append(("final lag along motion", f"{number(1e3 * self.lag_along_motion[-1])} mm"))
        rows.append(("final true error", f"{number(float(np.linalg.norm(self.error[-1])))} px"))
        unit = "px" if measured_in_pixels(self.scenario) else "in the law's features"
        seen = np.linalg.norm(self.measured_error[-1])
        rows.append(("final measured error", f"{number(float(seen))} {unit}"))
        rows += [("event", event.sentence) for event in self.events]
        return f"{html(rows, labels=True, left=2)}{sketch(self)}"
