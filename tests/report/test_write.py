"""Writing: both files or neither, never over a stranger's file, and nothing left behind."""

import errno
import json
import os
import shutil
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.report import report as writing
from vsctrl.report import write_report
from vsctrl.report.section import Entry, Verdict

FILES = ["index.html", "report.json"]


@pytest.fixture
def quick(monkeypatch):
    """The mechanics of writing with a page made of a few words, so that they can be tried often."""
    said = Entry("scenario", "a name", "", Verdict("good", ("said",)), (), {})

    def entry_of(x, name, prefix, progress):
        progress("looking")
        progress("page and figures")
        return said

    page = '<!DOCTYPE html>\n<meta name="generator" content="vsctrl 9">\n<p>new</p>\n'
    text = json.dumps({"schema": "vsctrl-report/2", "new": True})
    monkeypatch.setattr(writing, "entry_of", entry_of)
    monkeypatch.setattr(writing, "page", lambda *given: page)
    data = SimpleNamespace(text=lambda: text)
    monkeypatch.setattr(writing, "ReportData", SimpleNamespace(of=lambda *given: data))


@pytest.fixture(scope="module")
def real(report_of):
    """A real report, made before `quick` can stand in for its parts."""
    return report_of("prompt")


@pytest.fixture
def older(real, tmp_path):
    """A folder with an older, real report and another file of the user's."""
    folder = tmp_path / "older"
    shutil.copytree(real, folder)
    (folder / "mine.txt").write_text("keep")
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    } | {f"{p.relative_to(folder)}/": b"" for p in folder.rglob("*") if p.is_dir()}


def fail_with(number: int):
    def fail(*given, **named):
        raise OSError(number, os.strerror(number))

    return fail


# What works ------------------------------------------------------------------------------------
def test_a_real_report_is_three_files_that_anyone_may_read(report_of):
    folder = report_of("slide")
    files = sorted([*FILES, "paper.html"])
    assert sorted(p.name for p in folder.iterdir()) == files
    for name in files:
        assert (folder / name).stat().st_mode & 0o777 == 0o644
        assert (folder / name).read_bytes().decode("utf-8")


def test_nested_folders_are_made(quick, tmp_path):
    steps = []
    found = write_report(paper.sliding(), tmp_path / "a" / "b" / "c", progress=steps.append)
    assert found.page == tmp_path / "a" / "b" / "c" / "index.html"
    assert found.data == tmp_path / "a" / "b" / "c" / "report.json"
    assert sorted(p.name for p in found.page.parent.iterdir()) == FILES
    assert len(steps) == 2 and found.sentences == ("said",)


def test_the_folder_may_be_text_relative_or_already_there(quick, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    for out in ("there", "./there", "new/er"):
        write_report(paper.sliding(), out)
    assert (tmp_path / "there" / "index.html").is_file()
    assert (tmp_path / "new" / "er" / "report.json").is_file()


def test_an_older_report_is_replaced_and_the_rest_kept(quick, older):
    write_report(paper.sliding(), older)
    assert "<p>new</p>" in (older / "index.html").read_text()
    assert json.loads((older / "report.json").read_text())["new"] is True
    assert (older / "mine.txt").read_text() == "keep"
    assert sorted(p.name for p in older.iterdir()) == [*FILES[:1], "mine.txt", *FILES[1:]]


# What is refused -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("index.html", "<!DOCTYPE html><title>my home page</title>"),
        ("index.html", '<meta name="generator" content="Hugo 0.1">'),
        ("index.html", ""),
        ("report.json", '{"schema": "someone-else/1"}'),
        ("report.json", "[]"),
        ("report.json", "{broken"),
        ("report.json", ""),
    ],
)
def test_a_foreign_file_is_never_overwritten(quick, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    before = contents(tmp_path)
    with pytest.raises(InputError, match=rf"^out: .*{name} .*no report of vsctrl.*(move|name)"):
        write_report(paper.sliding(), tmp_path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", FILES)
def test_a_folder_or_bytes_of_that_name_are_foreign_too(quick, tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"^out: .*{name}"):
        write_report(paper.sliding(), tmp_path)
    (tmp_path / name).rmdir()
    (tmp_path / name).write_bytes(b"\xff\xfe\x00 not text")
    with pytest.raises(InputError, match=f"^out: .*{name}"):
        write_report(paper.sliding(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", FILES)
def test_a_pipe_or_a_file_without_end_of_that_name_is_foreign(quick, tmp_path, name):
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=f"^out: .*{name}"):
        write_report(paper.sliding(), tmp_path)
    (tmp_path / name).unlink()
    (tmp_path / name).touch()
    os.truncate(tmp_path / name, 5 << 30)  # a file of holes, which takes no room
    with pytest.raises(InputError, match=f"^out: .*{name}"):
        write_report(paper.sliding(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("text", ["[" * 100_000, '{"schema": ' + "9" * 5000 + "}", '"' * 100_000])
def test_no_json_of_a_stranger_is_too_odd_to_be_foreign(quick, tmp_path, text):
    (tmp_path / "report.json").write_text(text)
    with pytest.raises(InputError, match="no report of vsctrl"):
        write_report(paper.sliding(), tmp_path)


def test_a_folder_that_another_report_makes_meanwhile_is_not_taken_back(
    quick, tmp_path, monkeypatch
):
    real = Path.mkdir

    def mkdir(self, *given, **named):
        real(self, *given, **named)  # the other one was quicker
        return real(self, *given, **named)

    monkeypatch.setattr(Path, "mkdir", mkdir)
    monkeypatch.setattr(writing, "entry_of", lambda *given: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_report(paper.sliding(), tmp_path / "new")
    assert (tmp_path / "new").is_dir()


def test_a_foreign_page_beside_our_data_leaves_both_alone(quick, older):
    (older / "index.html").write_text("<p>mine now</p>")
    before = contents(older)
    with pytest.raises(InputError, match=r"index\.html"):
        write_report(paper.sliding(), older)
    assert contents(older) == before


def test_a_file_is_no_folder(quick, tmp_path):
    (tmp_path / "taken").write_text("keep")
    with pytest.raises(InputError, match=r"^out: .*taken is a file, not a folder; name another"):
        write_report(paper.sliding(), tmp_path / "taken")
    for below in ("taken/x", "taken/x/y"):
        with pytest.raises(InputError, match=r"^out: .*(written|file).*name another"):
            write_report(paper.sliding(), tmp_path / below)
    assert contents(tmp_path) == {"taken": b"keep"}


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS, errno.ENOSPC])
def test_a_folder_that_cannot_be_made_is_a_sentence(quick, tmp_path, monkeypatch, number):
    real = Path.mkdir

    def mkdir(self, *given, **named):
        if self.name == "inner":
            fail_with(number)()
        real(self, *given, **named)

    monkeypatch.setattr(Path, "mkdir", mkdir)
    with pytest.raises(InputError, match=r"^out: .*cannot be written to.*name another"):
        write_report(paper.sliding(), tmp_path / "outer" / "inner")
    assert contents(tmp_path) == {}


def test_a_folder_that_may_not_be_written_to_is_refused_before_any_work(
    quick, tmp_path, monkeypatch
):
    monkeypatch.setattr(writing, "entry_of", lambda *given: pytest.fail("worked for nothing"))
    for name in ("TemporaryFile", "NamedTemporaryFile", "mkstemp"):
        monkeypatch.setattr(tempfile, name, fail_with(errno.EACCES))
    with pytest.raises(InputError, match=r"^out: .*cannot be written to \(Permission denied\)"):
        write_report(paper.sliding(), tmp_path / "new")
    assert contents(tmp_path) == {}


def test_a_folder_that_may_not_be_looked_at_is_a_sentence(quick, tmp_path, monkeypatch):
    real = os.stat

    def stat(path, *given, **named):
        if "secret" in str(path):
            fail_with(errno.EACCES)()
        return real(path, *given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", stat)
        patch.setattr(Path, "stat", lambda self, **named: stat(self, **named))
        patch.setattr(Path, "mkdir", fail_with(errno.EACCES))
        with pytest.raises(InputError, match=r"^out: .*(written|read).*name another"):
            write_report(paper.sliding(), tmp_path / "secret" / "report")
    assert contents(tmp_path) == {}


def test_a_name_that_is_too_long_is_a_sentence(quick, tmp_path):
    with pytest.raises(InputError, match=r"^out: .*name another"):
        write_report(paper.sliding(), tmp_path / ("x" * 300))
    assert contents(tmp_path) == {}


# Failures midway -------------------------------------------------------------------------------
@pytest.mark.parametrize("error", [RuntimeError("broken"), KeyboardInterrupt(), InputError("no")])
def test_folders_made_for_a_report_that_fails_are_removed(quick, tmp_path, error):
    def progress(step):
        raise error

    with pytest.raises(type(error)):
        write_report(paper.sliding(), tmp_path / "a" / "b", progress=progress)
    assert contents(tmp_path) == {}


def test_a_failure_midway_leaves_an_older_report_alone(quick, older, monkeypatch):
    before = contents(older)
    monkeypatch.setattr(writing, "page", fail_with(errno.EIO))
    with pytest.raises(OSError):
        write_report(paper.sliding(), older)
    assert contents(older) == before


def test_a_bad_scenario_leaves_nothing_for_real(tmp_path):
    still = paper.sliding().with_(V=(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"^motion\.V: "):
        write_report(still, tmp_path / "a" / "b")
    assert contents(tmp_path) == {}


def test_a_stranger_s_file_in_a_new_folder_neither_dies_nor_hides_the_error(quick, tmp_path):
    def progress(step):
        (tmp_path / "a" / "b" / "other.txt").write_text("keep")
        raise RuntimeError("the real error")

    with pytest.raises(RuntimeError, match="the real error"):
        write_report(paper.sliding(), tmp_path / "a" / "b", progress=progress)
    assert contents(tmp_path)["a/b/other.txt"] == b"keep"


@pytest.mark.parametrize("call", [1, 2])
@pytest.mark.parametrize("where", ["new", "older"])
def test_a_disk_that_fills_up_leaves_both_files_or_neither(
    quick, older, tmp_path, monkeypatch, call, where
):
    before = contents(tmp_path)
    calls = []
    real = os.replace  # which Path.replace calls

    def replace(source, target, **named):
        calls.append(target)
        if len(calls) == call:
            fail_with(errno.ENOSPC)()
        return real(source, target, **named)

    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(os, "rename", replace)
    with pytest.raises(InputError, match=r"^out: .*cannot be written"):
        write_report(paper.sliding(), tmp_path / where)
    assert contents(tmp_path) == before


def test_a_disk_that_fills_up_while_writing_leaves_nothing(quick, tmp_path, monkeypatch):
    real = Path.open

    class Full:
        def __init__(self, file):
            self.file = file

        def __enter__(self):
            return self

        def __exit__(self, *error):
            self.file.close()

        def write(self, text):
            fail_with(errno.ENOSPC)()

    monkeypatch.setattr(Path, "open", lambda *given, **named: Full(real(*given, **named)))
    with pytest.raises(InputError, match=r"^out: .*cannot be written.*No space"):
        write_report(paper.sliding(), tmp_path / "new")
    assert contents(tmp_path) == {}
