"""Arrays out of a NumPy archive (.npz), each looked at before it is unpacked.

``numpy.load`` unpacks every entry to its full size, and some kilobytes of zip may hold gigabytes
of zeros. Here an entry is read only when it is asked for, and what it says of its type and shape
can be asked first; objects are never read, so that no file runs code.
"""

import io
import math
import zipfile
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

START = 1 << 16  #: bytes at the beginning of an entry that hold its header
MOST_DIRECTORY = 1 << 20  #: bytes of the archive's list of entries, hundreds of times a run's
_TAIL = 22 + (1 << 16) + 20  # the end record of a zip, its longest comment and what a big one has


class Header(NamedTuple):
    """What an array is, before any of it is read."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    by_columns: bool  #: whether the first index runs fastest
    length: int  #: of the header itself, bytes

    @property
    def size(self) -> int:
        """Bytes of the numbers alone."""
        return math.prod(self.shape) * self.dtype.itemsize


class Archive:
    """The arrays of a file that is open for reading.

    Whatever is wrong with the file ends in an exception of any kind, of zipfile, zlib or NumPy, or
    a ValueError of this module; the caller says it in a sentence.
    """

    def __init__(self, file: BinaryIO) -> None:
        _check_directory(file)
        self._zip = zipfile.ZipFile(file)
        self.names = frozenset(
            name.removesuffix(".npy") for name in self._zip.namelist() if name.endswith(".npy")
        )

    def header(self, name: str) -> Header:
        """Type and shape of an array."""
        with self._entry(name) as entry:
            return _header(entry.read(START))

    def read(self, name: str) -> NDArray[Any]:
        """The array, of the size that its header says; look at that first."""
        with self._entry(name) as entry:
            start = entry.read(START)
            header = _header(start)
            content = bytearray(start[header.length :])
            content += entry.read(max(header.size - len(content), 0))
            # At its end an entry's checksum is compared.
            if len(content) != header.size or entry.read(1):
                raise ValueError(f"{name} has more or fewer numbers than its shape")
        numbers = np.frombuffer(content, header.dtype)
        return numbers.reshape(header.shape, order="F" if header.by_columns else "C")

    def _entry(self, name: str) -> Any:
        info = self._zip.getinfo(f"{name}.npy")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"{name} is compressed in a way that NumPy never does")
        return self._zip.open(info)


def _header(start: bytes) -> Header:
    file = io.BytesIO(start)
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"version {version} of an array")
    one = version == (1, 0)
    read = np.lib.format.read_array_header_1_0 if one else np.lib.format.read_array_header_2_0
    shape, by_columns, dtype = read(file)
    if dtype.hasobject:
        raise ValueError("an array of objects, which would run code")
    if any(n < 0 for n in shape):
        raise ValueError("an array of negative size")
    return Header(dtype, shape, by_columns, file.tell())


def _check_directory(file: BinaryIO) -> None:
    """Refuse an archive whose list of entries alone would fill the memory."""
    end = file.seek(0, io.SEEK_END)
    file.seek(max(end - _TAIL, 0))
    tail = file.read(_TAIL)
    file.seek(0)
    # Found as zipfile finds it: without a comment at the very end, or else the last one.
    place = len(tail) - 22
    if not (tail[place : place + 4] == b"PK\5\6" and tail.endswith(b"\0\0")):
        place = tail.rfind(b"PK\5\6")
    if place < 0:
        raise ValueError("it is no zip archive")
    size = int.from_bytes(tail[place + 12 : place + 16], "little")
    # Twenty bytes before it an archive of more than 65 535 entries or 4 GB says where it says so.
    if size > MOST_DIRECTORY or tail[max(place - 20, 0) : place].startswith(b"PK\6\7"):
        raise ValueError("it has more entries than any run")
