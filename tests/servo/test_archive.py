"""Runs as files and datasets: exact, whole or not at all, and nothing is believed when read."""

import builtins
import dataclasses
import errno
import io
import json
import os
import pickle
import re
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.results.columns import COLUMNS
from vsctrl.servo.results.status import Event, Status

HOSTILE = 'a "quoted" \\ name\twith ünïcode, a NUL\x00 and </script>'


def slide(**changes) -> Scenario:
    return paper.sliding().with_(**({"duration": 0.4} | changes))


def filled(run: Run) -> Run:
    """The run with everything that only some runs have."""
    n, p = run.depths.shape
    rng = np.random.default_rng(1)
    visible = run.visible.copy()
    visible[3:5, 1] = False
    return dataclasses.replace(
        run,
        visible=visible,
        events=(Event("lost", 3, 2, 'Point 2 was "lost" for 2 frames – ü.'),),
        joints=rng.standard_normal((n, 6)),
        depth_estimate=rng.uniform(0.5, 1, (n, p)),
        excitation=-0.0 * np.ones((n, p)),
    )


HOME = (0.0, 0.0, 0.0, 0.0, 0.5, 0.0)


RUNS = {
    "short": lambda: simulate(slide(noise_px=0.5, seed=3, name=HOSTILE)),
    "failed": lambda: simulate(paper.sliding(lam=22.0)),
    "filled": lambda: filled(
        simulate(slide(carrier="gantry", joints=HOME, depth="estimated", features="segments"))
    ),
    "pose": lambda: simulate(slide(scheme="pose")),
    "rank loss at the last frame": lambda: one_frame(simulate(slide(duration=0.04)), 2),
    "gantry": lambda: simulate(slide(carrier="gantry", joints=HOME, speed_limit=0.045)),
    "depth": lambda: simulate(slide(depth="estimated", features="segments")),
    "one frame": lambda: one_frame(simulate(slide())),
    "oscillation": lambda: simulate(paper.oscillation("sine").with_(duration=1.0)),
}


def one_frame(run: Run, frames: int = 1) -> Run:
    """The run as if it had lost rank in its first frame, or another one."""
    arrays = {name: getattr(run, name) for name in COLUMNS}
    first = {name: v[:frames] for name, v in arrays.items() if v is not None}
    status = Status(False, "rank loss", frames - 1, "It ended.")
    return dataclasses.replace(run, status=status, **first)


@pytest.fixture(params=RUNS)
def run(request) -> Run:
    return RUNS[request.param]()


@pytest.fixture
def small() -> Run:
    return simulate(slide(duration=0.12))


def assert_same(a: Run, b: Run) -> None:
    """Equal to the last bit, compared field by field of the dataclass itself."""
    for field in dataclasses.fields(Run):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if isinstance(left, np.ndarray):
            assert left.dtype == right.dtype and left.shape == right.shape, field.name
            assert left.tobytes() == right.tobytes(), field.name
        else:
            assert type(left) is type(right) and left == right, field.name


# What works ------------------------------------------------------------------------------------
def test_a_run_comes_back_to_the_last_bit(run, tmp_path):
    run.save(tmp_path / "run.npz")
    found = Run.load(str(tmp_path / "run.npz"))
    assert_same(run, found)
    assert found.scenario.digest == run.scenario.digest
    for name in COLUMNS:
        value = getattr(found, name)
        assert value is None or not value.flags.writeable
    assert [p.name for p in tmp_path.iterdir()] == ["run.npz"]


def test_equal_runs_are_equal_bytes(run, tmp_path, monkeypatch):
    run.save(tmp_path / "a.npz")
    monkeypatch.setattr("time.time", lambda: 2e9)
    Run.load(tmp_path / "a.npz").save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_every_array_of_a_run_is_in_the_table_of_columns(run):
    arrays = {f.name for f in dataclasses.fields(Run)} - {"scenario", "status", "events"}
    assert set(COLUMNS) == arrays
    for name, column in COLUMNS.items():
        value = getattr(run, name)
        assert column.optional or value is not None
        if value is not None:
            assert value.ndim == len(column.dims) and value.shape[0] == len(run.t)


def test_numpy_alone_reads_the_file_without_pickle(small, tmp_path):
    small.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as archive:
        np.testing.assert_array_equal(archive["pose"], small.pose)
        assert Scenario.from_toml(archive["scenario"].item()) == small.scenario
        assert json.loads(archive["status"].item())["kind"] == "completed"
        assert archive["format"].item() == "vsctrl-run/1"
        assert archive["digest"].item() == small.scenario.digest
        assert archive["numpy"].item() == np.__version__
        assert "joints" not in archive
    assert b"\x80\x04\x95" not in (tmp_path / "run.npz").read_bytes()  # as pickles begin


def test_the_path_is_taken_as_it_is(small, tmp_path):
    for name in ("plain", "run.npz", "run.v1.dat"):
        small.save(tmp_path / name)
        assert_same(small, Run.load(tmp_path / name))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["plain", "run.npz", "run.v1.dat"]


def test_an_older_file_is_replaced(small, tmp_path):
    (tmp_path / "run.npz").write_text("old")
    small.save(tmp_path / "run.npz")
    assert_same(small, Run.load(tmp_path / "run.npz"))


def test_numbers_of_another_machine_s_byte_order_are_the_same_numbers(small, tmp_path):
    rewrite(small, tmp_path / "big.npz", {"pose": small.pose.astype(">f8")})
    assert_same(small, Run.load(tmp_path / "big.npz"))


# What cannot be written ------------------------------------------------------------------------
def test_a_path_that_cannot_be_written_is_a_sentence_and_leaves_nothing(small, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("keep")
    for path in ("folder", "missing/run.npz", "file/run.npz", "x" * 300, "nul\0.npz"):
        with pytest.raises(InputError, match=r"the run cannot be written .*name a file") as found:
            small.save(tmp_path / path)
        assert str(found.value).startswith(str(tmp_path / path))
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]
    assert (tmp_path / "file").read_text() == "keep"


def test_a_disk_that_fills_up_leaves_the_older_file(small, tmp_path, monkeypatch):
    (tmp_path / "run.npz").write_text("old")

    def full(*given):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"run\.npz: the run cannot be written \(No space"):
        small.save(tmp_path / "run.npz")
    assert [p.name for p in tmp_path.iterdir()] == ["run.npz"]
    assert (tmp_path / "run.npz").read_text() == "old"


# What is refused -------------------------------------------------------------------------------
def rewrite(run: Run, path: Path, changes: dict[str, object]) -> None:
    """A file with some entries changed, or left out where the change is None, by NumPy's savez."""
    run.save(path)
    with np.load(path) as archive:
        entries = {name: archive[name] for name in archive.files}
    entries |= changes
    np.savez(path, **{name: value for name, value in entries.items() if value is not None})


def refused(path: Path, *patterns: str) -> str:
    with pytest.raises(InputError) as found:
        Run.load(path)
    said = str(found.value)
    assert said.startswith(f"{path}: ") and said.endswith("."), said
    assert "\n" not in said, said
    for pattern in patterns:
        assert re.search(pattern, said), said
    return said


def changed(name, **values):
    def change(run):
        return {name: json.dumps(dataclasses.asdict(run.status) | values)}

    return change


def dented(name, value):
    def change(run):
        array = getattr(run, name).copy()
        array.flat[-1] = value
        return {name: array}

    return change


REFUSALS = {
    "no t": (lambda r: {"t": None}, "'t' is missing.*simulate"),
    "no pose": (lambda r: {"pose": None}, "'pose' is missing"),
    "no scenario": (lambda r: {"scenario": None}, "'scenario' is missing"),
    "no digest": (lambda r: {"digest": None}, "'digest' is missing"),
    "no status": (lambda r: {"status": None}, "'status' is missing"),
    "no events": (lambda r: {"events": None}, "'events' is missing"),
    "no format": (lambda r: {"format": None}, "no run of vsctrl"),
    "other format": (lambda r: {"format": "else/1"}, "no run of vsctrl"),
    "odd format": (lambda r: {"format": "vsctrl-run/²"}, "no run of vsctrl"),
    "newer": (
        lambda r: {"format": "vsctrl-run/2", "vsctrl": "9.1"},
        r"vsctrl-run/2 is newer.*install vsctrl 9\.1 or newer",
    ),
    "NaN": (dented("pose", np.nan), "pose: a value is not a finite number"),
    "infinite": (dented("twist", np.inf), "twist: a value is not a finite number"),
    "short": (lambda r: {"pose": r.pose[:-1]}, r"pose: .*\(3, 4, 4\).*\(4, 4, 4\)"),
    "wide": (lambda r: {"lag": np.zeros((4, 7))}, r"lag: .*\(4, 7\)"),
    "flat": (lambda r: {"measured_error": np.zeros(4)}, "measured_error: "),
    "scalar": (lambda r: {"measured_error": np.float64(1)}, "measured_error: "),
    "points": (lambda r: {"depths": np.ones((4, 5))}, r"depths: .*\(4, 5\).*\(4, 4\)"),
    "integers": (lambda r: {"command": np.ones((4, 6), int)}, "command: int64"),
    "single": (lambda r: {"command": np.ones((4, 6), np.float32)}, "command: float32"),
    "not bool": (lambda r: {"visible": np.ones((4, 4))}, "visible: float64.*bool"),
    "joints": (lambda r: {"joints": np.ones((4, 6))}, "joints: a run of this scenario has none"),
    "estimates": (
        lambda r: {"depth_estimate": np.ones((4, 4))},
        "depth_estimate: a run of this .* none",
    ),
    "no rotation": (lambda r: {"pose": 0 * r.pose}, "pose: at frame 0 this is no rigid motion"),
    "stretched": (
        lambda r: {"reference_pose": r.reference_pose * np.array([1, 1, 1 + 1e-5, 1])},
        "reference_pose: at frame 0 this is no rigid motion",
    ),
    "mirrored": (
        lambda r: {"pose": r.pose * np.array([1, -1, 1, 1])},
        "pose: .*no rigid motion",
    ),
    "last row": (dented("pose", 2.0), "pose: at frame 3 this is no rigid motion"),
    "seen from behind": (
        dented("depths", -1.0),
        "depths: at frame 3 point 4 is visible and not in front",
    ),
    "no distance": (dented("depths", 0.0), "depths: at frame 3 point 4 is visible"),
    "other features": (
        lambda r: {"measured_error": np.zeros((4, 3))},
        r"measured_error: .*\(4, 3\).*\(4, 8\)",
    ),
    "completed before": (changed("status", frame=2), 'with the status "completed" at frame 2'),
    "failed elsewhere": (
        changed("status", ok=False, kind="rank loss", frame=1),
        '4 frames of 4 do not go with the status "rank loss" at frame 1',
    ),
    "failed unseen": (
        changed("status", ok=False, kind="diverged", frame=3),
        "4 frames of 4 do not go with",
    ),
    "other times": (lambda r: {"t": r.t + 1e-9}, "t: these are not the frames"),
    "text as t": (lambda r: {"t": np.array("0")}, "t: "),
    "no frames": (
        lambda r: {name: v[:0] for name in COLUMNS if (v := getattr(r, name)) is not None},
        "t: these are not the frames",
    ),
    "too few frames": (
        lambda r: {name: v[:2] for name in COLUMNS if (v := getattr(r, name)) is not None},
        '2 frames of 4 do not go with the status "completed"',
    ),
    "kind": (changed("status", kind="tired"), "status: .*tired.*not how a run ends"),
    "ok": (changed("status", ok=False), "status: "),
    "frame": (changed("status", frame=99), "status: "),
    "no number": (changed("status", frame="3"), "status: "),
    "more": (changed("status", more=1), "status: "),
    "a list": (lambda r: {"status": "[]"}, "status: "),
    "no JSON": (lambda r: {"status": "{"}, "status: this is no JSON"),
    "deep": (lambda r: {"events": "[" * 100_000}, "events: this is no JSON"),
    "events": (lambda r: {"events": '[{"kind": 1}]'}, "events: .*no list of events"),
    "an event": (lambda r: {"events": '{"kind": 1}'}, "events: .*no list of events"),
    "number as text": (lambda r: {"scenario": np.zeros(3)}, "scenario: float64 .*is no text"),
    "not TOML": (lambda r: {"scenario": "= 1"}, "scenario: "),
    "scenario": (
        lambda r: {"scenario": r.scenario.to_toml().replace("lam = 2.5", "lam = -2.5")},
        r"scenario: law\.lam: -2\.5 is not positive",
    ),
    "edited": (
        lambda r: {"scenario": r.scenario.to_toml().replace("lam = 2.5", "lam = 2.6")},
        "digest.*it was edited",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_whatever_is_wrong_in_a_file_is_one_sentence(small, tmp_path, name):
    change, pattern = REFUSALS[name]
    rewrite(small, tmp_path / "run.npz", change(small))
    refused(tmp_path / "run.npz", pattern)


def test_arrays_that_a_scenario_needs_are_missed_and_measured(tmp_path):
    path = tmp_path / "run.npz"
    run = RUNS["filled"]()
    rewrite(run, path, {"joints": None})
    refused(path, "'joints' is missing")
    rewrite(run, path, {"excitation": None})
    refused(path, "'excitation' is missing")
    rewrite(run, path, {"joints": run.joints[:, :5]})
    refused(path, r"joints: .*\(11, 5\).*\(11, 6\)")
    # Four sides of four features each, and six of a pose.
    rewrite(run, path, {"measured_error": run.measured_error[:, :8]})
    refused(path, r"\(11, 8\).*\(11, 16\)")
    run = RUNS["pose"]()
    rewrite(run, path, {"measured_error": run.error})
    refused(path, r"\(11, 8\).*\(11, 6\)")


def test_a_point_that_is_not_seen_may_lie_behind_the_camera(small, tmp_path):
    depths, visible = small.depths.copy(), small.visible.copy()
    depths[2, 1], visible[2, 1] = -1.0, False
    hidden = dataclasses.replace(small, depths=depths, visible=visible)
    hidden.save(tmp_path / "run.npz")
    assert_same(hidden, Run.load(tmp_path / "run.npz"))


def test_files_that_are_none_are_one_sentence(small, tmp_path):
    refused(tmp_path / "missing.npz", "no such file")
    refused(tmp_path, "is a directory")
    refused(tmp_path / "nul\0.npz", "cannot be read")
    np.save(tmp_path / "array.npy", np.eye(3))
    contents = {
        "empty": b"",
        "text": b"lam = 2.5",
        "array": (tmp_path / "array.npy").read_bytes(),
        "pickle": pickle.dumps({"t": 1}),
        "zip of text": zipped({"readme.txt": b"hello"}),
        "no array": zipped({"format.npy": b"hello"}),
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
        refused(tmp_path / name, "no .npz file|no run of vsctrl|is no text")


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


class Trap:
    """What runs code when it is unpickled."""

    sprung = False

    def __reduce__(self):
        return setattr, (Trap, "sprung", True)


def test_objects_are_refused_and_never_unpickled(small, tmp_path):
    rewrite(small, tmp_path / "run.npz", {"joints": np.array([Trap()], dtype=object)})
    refused(tmp_path / "run.npz", "an array of objects, which would run code")
    assert not Trap.sprung


SIZE = 1 << 26  # bytes of zeros


def add_zeros(path: Path, name: str, descr: str, shape: tuple[int, ...]) -> None:
    """One more entry of an archive, which unpacks to a thousand times its own length."""
    header = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
    start = header.encode().ljust(117) + b"\n"
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(f"{name}.npy", "w") as entry,
    ):
        entry.write(b"\x93NUMPY\1\0" + len(start).to_bytes(2, "little") + start)
        for _ in range(SIZE >> 20):
            entry.write(bytes(1 << 20))
    assert path.stat().st_size < SIZE // 100


def peak(call) -> int:
    """Bytes that a call holds at most."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("name", "descr", "shape", "pattern"),
    [
        ("unknown", "<f8", (SIZE // 8,), None),
        ("format", f"<U{SIZE // 4}", (), "format: a text of 67108864 bytes"),
        ("scenario", f"<U{SIZE // 4}", (), "scenario: a text of 67108864 bytes"),
        ("t", "<f8", (SIZE // 8,), r"t: float64 of shape \(8388608,\)"),
        ("pose", "<f8", (SIZE // 128, 4, 4), "pose: float64 of shape"),
        ("pose", "<f8", (4, 4, 4), "more or fewer numbers than its shape"),
        ("visible", "|b1", (SIZE,), "visible: bool of shape"),
        ("pose", "<f8", (10**4000,), "pose: float64 of shape"),
    ],
)
def test_zeros_without_end_are_never_unpacked(small, tmp_path, name, descr, shape, pattern):
    """An entry is refused by what it says of itself, or left unread where no run has such a one."""
    path = tmp_path / "run.npz"
    rewrite(small, path, {name: None} if pattern else {})
    add_zeros(path, name, descr, shape)

    def load():
        if pattern is None:
            assert_same(small, Run.load(path))
        else:
            assert len(refused(path, pattern)) < 1000

    assert peak(load) < 20e6


def test_an_archive_of_a_million_entries_is_not_listed(tmp_path):
    """Its list alone would fill the memory: it is told by the length that it says it has."""
    path = tmp_path / "run.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for number in range(25_000):
            archive.writestr(f"{number}", b"")
    assert peak(lambda: refused(path, "more entries than any run")) < 2e6
    path.write_bytes(path.read_bytes() + b"a comment with PK\5\6 in it" + bytes(30))
    assert peak(lambda: refused(path, "no run of vsctrl")) < 2e6  # zipfile believes the comment


def test_numbers_of_thousands_of_digits_are_refused(small, tmp_path):
    path = tmp_path / "run.npz"
    for name in ("status", "events"):
        for digits in (4000, 5000):
            value = '{"ok": true, "kind": "completed", "frame": %s, "sentence": ""}' % (
                "9" * digits
            )
            rewrite(small, path, {name: value if name == "status" else f"[{value}]"})
            assert len(refused(path, name)) < 400
    event = f'[{{"kind": "lost", "frame": {"9" * 300}, "frames": 1, "sentence": ""}}]'
    rewrite(small, path, {"events": event})
    refused(path, "events: .*no list of events")


def test_no_message_is_as_long_as_the_file_or_gives_the_advice_of_numpy(small, tmp_path):
    """Whatever stands in the file, and whatever NumPy and zipfile say of it."""
    path = tmp_path / "run.npz"
    long = "x" * 10_000
    for change in (
        {"format": long}, {"digest": long}, {"status": f'"{long}"'}, {"events": f'"{long}"'},
        {"scenario": f"{long} = 1"}, {"scenario": f"{long}"}, {"vsctrl": long, "digest": "0"},
        {"scenario": "\n".join(f"k{n} = {n}" for n in range(5000))},
        {"t": np.zeros(2, [(f"field{n}", float) for n in range(100)])},
    ):  # fmt: skip
        rewrite(small, path, change)
        with pytest.raises(InputError) as found:
            Run.load(path)
        assert len(str(found.value)) < 3000
    (tmp_path / "mine.toml").write_text("lam = 2.5")
    assert "pickle" not in refused(tmp_path / "mine.toml", "no .npz file.*no zip archive")


def test_a_file_cut_off_anywhere_is_refused(small, tmp_path):
    small.save(tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    for end in [*range(0, len(data), 97), len(data) - 1]:
        (tmp_path / "cut.npz").write_bytes(data[:end])
        refused(tmp_path / "cut.npz", "no .npz file, or a damaged one")


def test_a_wrong_byte_anywhere_is_refused_or_changes_nothing(small, tmp_path):
    small.save(tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    rng = np.random.default_rng(0)
    caught = 0
    for place in rng.choice(len(data), 400, replace=False):
        bad = bytearray(data)
        bad[place] ^= int(rng.integers(1, 256))
        (tmp_path / "bad.npz").write_bytes(bad)
        try:
            assert_same(small, Run.load(tmp_path / "bad.npz"))
        except InputError as error:
            assert str(error).startswith(f"{tmp_path / 'bad.npz'}: ")
            caught += 1
    # Dates and the like in zip's own records may be anything; the content may not.
    assert caught > 300


# Datasets --------------------------------------------------------------------------------------
def test_a_dataset_has_every_array_with_names_and_units(run):
    xarray = pytest.importorskip("xarray")
    found = run.to_xarray()
    assert isinstance(found, xarray.Dataset)
    for name in COLUMNS:
        value = getattr(run, name)
        assert (name in found.variables) is (value is not None)
        if value is not None:
            np.testing.assert_array_equal(found[name], value)
            assert found[name].attrs["units"] and found[name].attrs["description"]
    assert found.twist.dims == ("frame", "component") and found.pose.dims[1:] == ("row", "column")
    assert Scenario.from_toml(found.attrs["scenario"]) == run.scenario
    assert found.attrs["digest"] == run.scenario.digest
    assert found.attrs["status"] == run.status.kind
    assert len(json.loads(found.attrs["events"])) == len(run.events)


def test_a_dataset_is_asked_by_name_and_time():
    run = simulate(slide())
    found = run.to_xarray().swap_dims(frame="t")
    assert found.sel(component="Ωy").twist.shape == (11,)
    assert float(found.features.sel(t=0.2, feature="Y3", method=None)) == run.features[5, 5]
    assert float(found.depths.sel(point=2).isel(t=-1)) == run.depths[-1, 1]
    # The law is shown points, so that both errors can be subtracted by name.
    assert (found.error - found.measured_error).dims == ("t", "feature")
    np.testing.assert_array_equal(
        found.error - found.measured_error, run.error - run.measured_error
    )


def test_an_error_in_other_features_has_a_dimension_of_its_own():
    run = RUNS["filled"]()
    found = run.to_xarray()
    assert found.measured_error.dims == ("frame", "measured")
    assert found.sizes["measured"] == 16 and "px" not in found.measured_error.attrs["units"]


def test_a_dataset_can_be_written_as_netcdf(run, tmp_path):
    xarray = pytest.importorskip("xarray")
    data = run.to_xarray()
    data.attrs["scenario"] = data.attrs["scenario"].replace("\\u0000", "")
    data.attrs["title"] = data.attrs["title"].replace("\x00", "")
    data.to_netcdf(tmp_path / "run.nc", engine="scipy")
    with xarray.open_dataset(tmp_path / "run.nc", engine="scipy") as found:
        xarray.testing.assert_equal(found.load(), data)


def test_without_xarray_a_dataset_is_a_sentence_with_the_remedy(small, monkeypatch):
    real = builtins.__import__

    def without(name, *given, **named):
        if name.split(".")[0] == "xarray":
            raise ImportError(name)
        return real(name, *given, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"xarray is not installed.*pip install 'vsctrl\[scale\]'"):
        small.to_xarray()
