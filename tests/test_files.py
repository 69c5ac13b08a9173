"""One way to read and to write files: whole or not at all, and what goes wrong in a sentence."""

import errno
from pathlib import Path

import pytest

from vsctrl import InputError, files


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def fail_at(monkeypatch, call):
    """The rename of that number, from 1, finds a full disk."""
    calls, real = [], Path.replace

    def replace(self, target):
        calls.append(target)
        if len(calls) == call:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)


def test_text_and_bytes_come_back_as_they_were_written(tmp_path):
    files.write(tmp_path / "a", "λ\n", "letter")
    files.write(tmp_path / "b", b"\xff\x00", "data")
    assert files.read_text(tmp_path / "a") == "λ\n"
    assert files.read_bytes(tmp_path / "b") == b"\xff\x00"
    assert contents(tmp_path) == {"a": "λ\n".encode(), "b": b"\xff\x00"}


@pytest.mark.parametrize("call", [1, 2, 3])
@pytest.mark.parametrize("older", [(), ("a",), ("b", "c"), ("a", "b", "c")])
def test_several_files_are_written_all_or_none(tmp_path, monkeypatch, call, older):
    for name in older:
        (tmp_path / name).write_bytes(b"older " + name.encode())
    before = contents(tmp_path)
    new = {tmp_path / name: f"newer {name}" for name in "abc"}
    fail_at(monkeypatch, call)
    with pytest.raises(OSError, match="No space"):
        files.write_all(new)
    assert contents(tmp_path) == before
    files.write_all(new)
    assert contents(tmp_path) == {name: f"newer {name}".encode() for name in "abc"}


def test_what_cannot_be_a_file_leaves_the_others_alone(tmp_path):
    for bad in (tmp_path / "no" / "such", Path("a\0b")):
        with pytest.raises((OSError, ValueError)):
            files.write_all({tmp_path / "good": "1", bad: "2"})
        assert contents(tmp_path) == {}
    with pytest.raises(ValueError, match="surrogates"):
        files.write_all({tmp_path / "good": "1", tmp_path / "bad": "\ud800"})
    assert contents(tmp_path) == {}


def test_sentences_name_the_file_the_trouble_and_the_remedy(tmp_path):
    def said(call, *given):
        with pytest.raises(InputError) as error:
            call(*given)
        return str(error.value)

    missing = tmp_path / "none"
    assert said(files.read_bytes, missing) == f"{missing}: there is no such file; check the path."
    assert said(files.read_text, tmp_path, "TOML file") == (
        f"{tmp_path}: this is a directory; name a TOML file in it."
    )
    (tmp_path / "b").write_bytes(b"ab\xff")
    assert said(files.read_text, tmp_path / "b") == (
        f"{tmp_path / 'b'}: byte 2 is not UTF-8; save the file as UTF-8 text."
    )
    assert "cannot be read (embedded null byte)" in said(files.read_bytes, Path("a\0b"))
    there = tmp_path / "no" / "such"
    assert said(files.write, there, "text", "letter") == (
        f"{there}: the letter cannot be written (No such file or directory); name a file in an "
        "existing directory where you may write."
    )
