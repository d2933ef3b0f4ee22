"""HAZ-21: archives that would write elsewhere or lie about what they hold are refused, and nothing is written."""

from __future__ import annotations

import io
import os
import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom

from vfix_engine.errors import ImageError
from vfix_engine.files.readers import read_volume

UP = ("../", "../../", "a/../../", "./../", "..\\", "a\\..\\..\\", "a/b/../../../", "..//", "/..", "a/../..\\")
ROOTS = ("/", "//", "\\", "\\\\host\\share\\", "C:\\", "C:/", "c:", "/tmp/", "file:///", "a/C:")


def zip_of(entries: list[tuple[str | zipfile.ZipInfo, bytes]]) -> bytes:
    """A zip as it stands, names untouched."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries:
            archive.writestr(name, data)
    return out.getvalue()


def of_kind(mode: int) -> zipfile.ZipInfo:
    """An entry that calls itself a link, a device, a pipe or a folder."""
    entry = zipfile.ZipInfo("a.dcm")
    entry.create_system, entry.external_attr = 3, mode << 16
    return entry


def central(data: bytes, offset: int, form: str, value: int) -> bytes:
    """The zip with one field of its first central header changed."""
    spoilt = bytearray(data)
    struct.pack_into(form, spoilt, data.index(b"PK\x01\x02") + offset, value)
    return bytes(spoilt)


def overlapping(data: bytes) -> bytes:
    """The zip with its central directory told a hundred times, so that one entry is read again and again."""
    begin, end = data.index(b"PK\x01\x02"), data.index(b"PK\x05\x06")
    directory, count = data[begin:end], 100
    tail = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, count, count, count * len(directory), begin, 0)
    return data[:begin] + count * directory + tail


def hostile(folder: Path) -> Iterator[tuple[str, bytes]]:
    """What it is, and the archive; ``folder``: for slices, which are written first."""
    slices = [file.read_bytes() for file in sorted(save_dicom(dicom_slices(asymmetric_volume()), folder).iterdir())]
    good = [(f"{n}.dcm", data) for n, data in enumerate(slices)]
    for way in (*UP, *ROOTS):
        yield f"name {way}evil.dcm", zip_of([*good, (f"{way}evil.dcm", slices[0])])
    for name in ("evil.txt", "DICOMDIR", "__MACOSX/evil.dcm"):  # what is passed over must not lead out either
        yield f"beside ../{name}", zip_of([*good, (f"../{name}", b"x")])
    for mode in (0o120777, 0o020666, 0o060666, 0o010666, 0o140777, 0o120000):
        yield f"mode {mode:o}", zip_of([*good, (of_kind(mode), b"/etc/passwd")])
    whole = zip_of([("0.dcm", slices[0] + bytes(2 << 20))])
    for claimed in (0, 1, len(slices[0]), 2**31, 2**32 - 1):
        yield f"claims {claimed} bytes", central(whole, 24, "<L", claimed)
    for stored in (0, 1, 2**31):
        yield f"claims {stored} stored bytes", central(whole, 20, "<L", stored)
    for offset in (1, 10**6, 2**32 - 1):
        yield f"header at {offset}", central(whole, 42, "<L", offset)
    for method in (1, 9, 14, 93, 99):
        yield f"method {method}", central(whole, 10, "<H", method)
    yield "encrypted", central(whole, 8, "<H", 0x1)
    yield "overlapping", overlapping(whole)
    yield "a zip in a zip", zip_of([("inner.dcm", zip_of(good))])
    yield "a link's name", zip_of([("a.dcm", b"../../etc/passwd")])
    yield "no entries", zip_of([])


def tree(folder: Path) -> list[tuple[str, int]]:
    return sorted((str(path), path.lstat().st_mtime_ns) for path in folder.rglob("*"))


def test_fifty_hostile_archives_write_nothing_and_are_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-21."""
    inner = tmp_path / "a" / "b" / "c"
    inner.mkdir(parents=True)
    monkeypatch.chdir(inner)
    archives = dict(hostile(tmp_path / "series"))
    whole = [(file.name, file.read_bytes()) for file in (tmp_path / "series").iterdir()]
    (inner / "ct.zip").write_bytes(zip_of(whole))
    read_volume(inner / "ct.zip")  # what each archive is but for one thing
    for data in archives.values():
        file = inner / "ct.zip"
        file.write_bytes(data)
        before, root = tree(tmp_path), set(os.listdir("/"))
        with pytest.raises(ImageError, match=r"\w+ .*\."):
            read_volume(file)
        assert tree(tmp_path) == before
        assert set(os.listdir("/")) == root
    print(f"{len(archives)} hostile archives")
    assert len(archives) >= 50
