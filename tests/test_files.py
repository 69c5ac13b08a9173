"""One way to read and to write files: whole or not at all, and what goes wrong in a sentence."""

import errno
import os
import threading
import time
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


def test_of_two_writers_at_once_the_files_of_one_stay(tmp_path, monkeypatch):
    real = Path.replace

    def slowly(self, target):
        time.sleep(0.002)
        return real(self, target)

    monkeypatch.setattr(Path, "replace", slowly)
    for _ in range(8):
        start = threading.Barrier(4)

        def write(word, start=start):
            start.wait()
            files.write_all({tmp_path / name: word for name in "abc"})

        writers = [threading.Thread(target=write, args=(str(n),)) for n in range(4)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        assert len(set(contents(tmp_path).values())) == 1
        assert sorted(contents(tmp_path)) == ["a", "b", "c"]


def test_what_stood_there_is_kept_where_there_are_no_links(tmp_path, monkeypatch):
    (tmp_path / "a").write_text("older")
    monkeypatch.setattr(os, "link", lambda *given, **named: Path("/no/such").stat())
    fail_at(monkeypatch, 2)
    with pytest.raises(OSError, match="No space"):
        files.write_all({tmp_path / "a": "newer", tmp_path / "b": "newer"})
    assert contents(tmp_path) == {"a": b"older"}


def test_a_file_is_read_up_to_a_limit(tmp_path):
    (tmp_path / "a").write_bytes(b"x" * 1000)
    assert files.read_bytes(tmp_path / "a", most=1000) == b"x" * 1000
    with pytest.raises(InputError, match=r"a: this holds more than 0\.000999 MB, which no letter"):
        files.read_bytes(tmp_path / "a", "letter", most=999)
    with pytest.raises(InputError, match="more than 16 MB"):
        files.read_bytes(Path("/dev/zero"))
    assert files.beginning(tmp_path / "a", 10) == b"x" * 10


def test_a_pipe_is_read_as_far_as_it_is_written(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert files.read_bytes(tmp_path / "pipe") == b""  # nobody writes
    end = os.open(tmp_path / "pipe", os.O_RDWR)
    writer = threading.Timer(0.05, lambda: (os.write(end, b"later"), os.close(end)))
    writer.start()
    assert files.read_bytes(tmp_path / "pipe") == b"later"
    writer.join()


def test_a_message_quotes_a_path_that_no_system_takes_in_part(tmp_path):
    with pytest.raises(InputError) as found:
        files.read_bytes(tmp_path / ("x" * 100_000))
    assert len(str(found.value)) < 1500
