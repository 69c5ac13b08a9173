"""Runs as files: a NumPy archive (.npz) that holds the arrays and what made them.

``numpy.load(path)`` opens one without vsctrl: an array for every entry of ``columns.COLUMNS``, and
text for the rest, ``format``, ``vsctrl``, ``numpy`` (versions), ``scenario`` (TOML), ``digest``,
``status`` and ``events`` (JSON). Nothing is pickled, so that opening a file never runs code, and
equal runs give equal bytes. A file is written whole or not at all. It is read with every check
that takes no simulation: whatever loads has the arrays, in shape and kind, of a run of its
scenario, finite, with rigid poses, positive depths of what is seen, and an end that goes with its
frames. Whether its numbers are those that ``simulate`` returns, only ``simulate`` can tell.
"""

import io
import json
import math
import zipfile
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, BinaryIO, NoReturn, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from vsctrl import files
from vsctrl.arrays import Array, Mask
from vsctrl.checks import quoted
from vsctrl.errors import InputError, cut
from vsctrl.problems import FieldsError
from vsctrl.servo import checks
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.features.feature_sets import measures
from vsctrl.servo.results.columns import COLUMNS, Column, sizes
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.results.npz import Archive, Header
from vsctrl.servo.results.status import SEEN, Event, Kind, Status
from vsctrl.servo.scenario import Scenario

R = TypeVar("R", bound=Frames)

FORMAT, VERSION = "vsctrl-run", 1
# The oldest date that a zip archive can tell: the time of writing is no part of a run.
_NEVER = (1980, 1, 1, 0, 0, 0)
# A camera that is farther from its reference than it can be has ended its run long before: sums of
# squares of what is kept are finite numbers.
_LARGEST = 1e100
_AGAIN = "simulate the scenario again and save that"


def save(run: Frames, path: Path) -> None:
    """Write a run to exactly this path, all of it or nothing. Raises InputError if impossible."""
    files.write(path, pack(run), "run")


def load(cls: type[R], path: Path) -> R:
    """Run, of class cls, from a file. Raises InputError, a sentence that begins with the path."""
    with files.opened(path, "run's .npz file") as file:
        return unpack(cls, file, files.named(path))


def pack(run: Frames) -> bytes:
    """The bytes of a run's file; the same for equal runs."""
    texts = {
        "format": f"{FORMAT}/{VERSION}",
        "vsctrl": metadata.version("vsctrl"),
        "numpy": np.__version__,
        "scenario": run.scenario.to_toml(),
        "digest": run.scenario.digest,
        "status": json.dumps(asdict(run.status)),
        "events": json.dumps([asdict(event) for event in run.events]),
    }
    entries: dict[str, NDArray[Any]] = {name: np.array(text) for name, text in texts.items()}
    for name, column in COLUMNS.items():
        value = getattr(run, name)
        if value is not None:
            entries[name] = np.asarray(value, dtype="?" if column.truth else "<f8", order="C")
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, value in entries.items():
            entry = zipfile.ZipInfo(f"{name}.npy", _NEVER)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # whatever the machine that writes
            entry.external_attr = 0o644 << 16
            content = io.BytesIO()
            np.lib.format.write_array(content, value, allow_pickle=False)
            archive.writestr(entry, content.getvalue())
    return out.getvalue()


def unpack(cls: type[R], content: BinaryIO, source: str) -> R:
    """The run in a file. Raises InputError, a sentence that begins with source."""
    file = _File.of(content, source)
    file.check_format()
    scenario = file.scenario()
    status, events = file.status(scenario), file.events(scenario)
    arrays = {name: file.array(name, column, scenario) for name, column in COLUMNS.items()}
    file.check_end(status, len(arrays["t"]), scenario)
    for name in ("pose", "reference_pose"):
        file.check_rigid(name, arrays[name])
    file.check_depths(arrays["depths"], arrays["visible"])
    return cls(scenario=scenario, status=status, events=events, **arrays)


@dataclass(frozen=True, slots=True, eq=False)
class _File:
    """An archive and where it comes from, read with checks; what no run has is left unread."""

    source: str
    archive: Archive

    @classmethod
    def of(cls, content: BinaryIO, source: str) -> "_File":
        try:
            return cls(source, Archive(content))
        except Exception as error:  # a damaged archive makes zipfile and NumPy raise all kinds
            raise InputError(f"{source}: {_damaged(error)}.") from None

    def refuse(self, problem: str) -> NoReturn:
        raise InputError(f"{self.source}: {problem}.")

    def header(self, name: str) -> Header | None:
        """Type and shape of an array, None where there is none of that name."""
        if name not in self.archive.names:
            return None
        try:
            return self.archive.header(name)
        except Exception as error:
            self.refuse(_damaged(error))

    def read(self, name: str) -> NDArray[Any]:
        """An array whose header was found to be what is wanted."""
        try:
            return self.archive.read(name)
        except Exception as error:
            self.refuse(_damaged(error))

    def check_format(self) -> None:
        if "format" not in self.archive.names:
            self.refuse("this is no run of vsctrl (no entry 'format'); name a file of Run.save")
        name, _, number = self.text("format").partition("/")
        if name != FORMAT or not (number.isascii() and number.isdigit() and len(number) < 9):
            self.refuse("this is no run of vsctrl; name a file that Run.save has written")
        if int(number) > VERSION:
            self.refuse(
                f"format {name}/{number} is newer than the {FORMAT}/{VERSION} of this vsctrl; "
                f"install vsctrl {self.text('vsctrl')[:20]} or newer"
            )

    def text(self, name: str) -> str:
        header = self.header(name)
        if header is None:
            self.refuse(f"the entry {quoted(name)} is missing; {_AGAIN}")
        if header.dtype.kind != "U" or header.shape:
            self.refuse(f"{name}: {_described(header)} is no text; {_AGAIN}")
        if header.size > files.MOST:
            self.refuse(f"{name}: a text of {header.size} bytes is that of no run; {_AGAIN}")
        try:
            return str(self.read(name)[()])
        except ValueError:
            self.refuse(f"{name}: this is no text, a character is beyond Unicode; {_AGAIN}")

    def json(self, name: str) -> Any:
        try:
            return json.loads(self.text(name))
        except (ValueError, RecursionError) as error:
            if isinstance(error, InputError):
                raise
            self.refuse(f"{name}: this is no JSON ({cut(str(error), 80)}); {_AGAIN}")

    def scenario(self) -> Scenario:
        try:
            scenario = Scenario.from_toml(self.text("scenario"))
        except FieldsError as error:
            raise FieldsError(error.problems, source=f"{self.source}: scenario") from None
        said = self.text("digest")
        if scenario.digest != said:
            self.refuse(
                f"its scenario has the digest {scenario.digest}, but the file says "
                f"{quoted(said[:20])} "
                f"(vsctrl {self.text('vsctrl')[:20]}), so it was edited or is read in another way "
                f"now; {_AGAIN}"
            )
        return scenario

    def status(self, scenario: Scenario) -> Status:
        value = self.json("status")
        kinds = {"ok": bool, "kind": str, "frame": int, "sentence": str}
        if not (
            _is_record(value, kinds)
            and value["kind"] in get_args(Kind)
            and value["ok"] == (value["kind"] == "completed")
            and 0 <= value["frame"] <= scenario.frames
        ):
            self.refuse(f"status: {quoted(value)} is not how a run ends; {_AGAIN}")
        return Status(**value)

    def events(self, scenario: Scenario) -> tuple[Event, ...]:
        value = self.json("events")
        kinds = {"kind": str, "frame": int, "frames": int, "sentence": str}
        frames = range(scenario.frames + 2)
        if not isinstance(value, list) or not all(
            _is_record(event, kinds) and event["frame"] in frames and event["frames"] in frames
            for event in value
        ):
            self.refuse(f"events: {quoted(value)} is no list of events; {_AGAIN}")
        return tuple(Event(**event) for event in value)

    def check_end(self, status: Status, frames: int, scenario: Scenario) -> None:
        """A run keeps the frame that it failed in only where that had an image and a command."""
        kept = status.frame + (status.complete or status.kind in SEEN)
        if frames != kept or (status.complete and status.frame != scenario.frames):
            self.refuse(
                f"{frames} frames of {scenario.frames + 1} do not go with the status "
                f'"{status.kind}" at frame {status.frame}; {_AGAIN}'
            )

    def check_rigid(self, name: str, poses: Array) -> None:
        wrong = ~checks.is_rigid(poses)
        if wrong.any():
            self.refuse(f"{name}: at frame {np.argmax(wrong)} this is no rigid motion; {_AGAIN}")

    def check_depths(self, depths: Array, visible: Mask) -> None:
        wrong = visible & ~(depths > 0)
        if wrong.any():
            frame, point = np.argwhere(wrong)[0]
            self.refuse(
                f"depths: at frame {frame} point {point + 1} is visible and not in front of the "
                f"camera; {_AGAIN}"
            )

    def frames(self, scenario: Scenario) -> int:
        """Frames that the run has, of which a scenario has no more than it says."""
        header = self.header("t")
        return 0 if header is None else min(math.prod(header.shape), scenario.frames + 1)

    def array(self, name: str, column: Column, scenario: Scenario) -> Any:
        """A read-only array of the right type and shape, finite; None where that is allowed."""
        header, wanted = self.header(name), _optional(scenario)
        if header is None:
            if column.optional and name not in wanted:
                return None
            self.refuse(f"the array {quoted(name)} is missing; {_AGAIN}")
        if column.optional and name not in wanted:
            self.refuse(f"{name}: a run of this scenario has none; {_AGAIN}")
        kind = np.dtype(np.bool_ if column.truth else np.float64)
        length = sizes(scenario) | {"frame": self.frames(scenario), "measured": _width(scenario)}
        shape = tuple(length[dim] for dim in column.dims)
        # Equal but for the order of bytes, which may be another machine's.
        if header.dtype.newbyteorder("=") != kind or header.shape != shape:
            self.refuse(
                f"{name}: {_described(header)}, where the scenario needs {kind} of shape {shape}; "
                f"{_AGAIN}"
            )
        out = np.ascontiguousarray(self.read(name), dtype=kind)
        if not np.isfinite(out).all():
            self.refuse(f"{name}: a value is not a finite number; {_AGAIN}")
        if kind == np.float64 and np.abs(out).max(initial=0.0) > _LARGEST:
            self.refuse(f"{name}: a value is beyond ±{_LARGEST:g}, as no run has it; {_AGAIN}")
        if name == "t" and not (len(out) and np.array_equal(out, scenario.t[: len(out)])):
            self.refuse(f"t: these are not the frames of the scenario; {_AGAIN}")
        out.setflags(write=False)
        return out


def _damaged(error: Exception) -> str:
    said = cut(str(error).strip().rstrip("."), 80) or type(error).__name__
    return f"this is no .npz file, or a damaged one ({said}); write it again with Run.save"


def _described(header: Header) -> str:
    return f"{cut(str(header.dtype), 40)} of shape {cut(str(header.shape), 60)}"


def _optional(scenario: Scenario) -> set[str]:
    """The arrays that runs of this scenario have and runs of others have not."""
    out = {"joints"} if scenario.robot.carrier == "gantry" else set()
    if scenario.law.scheme == "image" and scenario.law.depth == "estimated":
        out |= {"depth_estimate", "excitation"}
    return out


def _width(scenario: Scenario) -> int:
    """Number of features of the scenario's law: those of the pose scheme are (t, θu)."""
    if scenario.law.scheme == "pose":
        return 6
    camera = Camera(scenario.camera.Fx, scenario.camera.Fy)
    return len(measures(scenario.law.features, camera, len(scenario.target.points)).labels)


def _is_record(value: Any, kinds: dict[str, type]) -> bool:
    """Whether the value is an object with exactly these keys and types."""
    return (
        isinstance(value, dict)
        and value.keys() == kinds.keys()
        and all(type(value[name]) is kind for name, kind in kinds.items())
    )
