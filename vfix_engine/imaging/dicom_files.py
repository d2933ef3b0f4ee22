"""The files of a DICOM folder or zip, in order and within limits; nothing is unpacked to disk."""

from __future__ import annotations

import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from vfix_engine.errors import ImageError

MAX_FILES = 5000
MAX_FILE_BYTES = 640 << 20  # of enhanced CT, which has all slices in one file
MAX_TOTAL_BYTES = 2 << 30
MAX_RATIO = 200  # inflated to stored; CT slices stay below 20

# Files beside the slices on a hospital's disc. All other files have to be DICOM: a damaged slice must not be dropped
# silently.
_COMPANION = re.compile(
    r"(?i)^(dicomdir|\..*|thumbs\.db|desktop\.ini|.*\.(txt|md|pdf|html?|xml|json|inf|exe|jpe?g|png))$"
)


def is_companion(name: str) -> bool:
    """Whether the name is that of a file beside the slices, not of a slice."""
    path = PurePosixPath(name.replace("\\", "/"))
    return "__MACOSX" in path.parts or _COMPANION.match(path.name) is not None


def contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Name without folders, and bytes, of each file that has to be DICOM.

    Raises:
        ImageError: a limit is exceeded, or the archive is damaged or unsafe.
    """
    return _zip_contents(path) if path.is_file() else _folder_contents(path)


def names(path: Path) -> list[str]:
    """Names without folders of the files of a folder or zip, without those beside the images. Raises ImageError."""
    if path.is_file():
        try:
            with zipfile.ZipFile(path) as archive:
                found = [member.filename for member in archive.infolist() if not member.is_dir()]
        except (zipfile.BadZipFile, NotImplementedError, OSError, ValueError):
            raise ImageError("the zip is damaged, or packed in a way that is not read.") from None
    else:
        found = [file.name for file in path.rglob("*") if file.is_file()]
    return [PurePosixPath(name.replace("\\", "/")).name for name in found if not is_companion(name)]


def _folder_contents(path: Path) -> Iterator[tuple[str, bytes]]:
    files = []
    for file in sorted(path.rglob("*")):
        if file.is_symlink():
            raise ImageError("the folder holds a symbolic link; copy the series itself.")
        if file.is_file() and not is_companion(file.name):
            files.append(file)
    sizes = [file.stat().st_size for file in files]
    _check_caps(sizes)
    for file in files:
        yield file.name, file.read_bytes()


def _zip_contents(path: Path) -> Iterator[tuple[str, bytes]]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            for member in members:
                _check_member(member)
            members = [member for member in members if not is_companion(member.filename)]
            _check_caps([member.file_size for member in members])
            if sum(member.compress_size for member in members) > path.stat().st_size:
                raise ImageError("entries of the zip overlap.")
            for member in sorted(members, key=lambda member: member.filename):
                with archive.open(member) as stream:
                    data = stream.read(member.file_size + 1)
                if len(data) != member.file_size:
                    raise ImageError("an entry of the zip is not as long as the zip says.")
                yield PurePosixPath(member.filename.replace("\\", "/")).name, data
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, RuntimeError, ValueError):
        raise ImageError("the zip is damaged, encrypted, or packed in a way that is not read.") from None


def _check_member(member: zipfile.ZipInfo) -> None:
    name = member.filename.replace("\\", "/")
    if name.startswith("/") or ":" in name or ".." in PurePosixPath(name).parts:
        raise ImageError("the zip holds a path that leads out of it.")
    mode = member.external_attr >> 16
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
        raise ImageError("the zip holds a link or a device, not only files.")
    if member.flag_bits & 0x1:
        raise ImageError("the zip is encrypted.")
    if member.file_size > MAX_RATIO * max(member.compress_size, 1) and member.file_size > 1 << 20:
        raise ImageError("an entry of the zip inflates beyond reason.")


def _check_caps(sizes: list[int]) -> None:
    if not sizes:
        raise ImageError("there is no DICOM file in it.")
    if len(sizes) > MAX_FILES:
        raise ImageError(f"there are {len(sizes):,} files in it; at most {MAX_FILES:,} are read.")
    if max(sizes) > MAX_FILE_BYTES or sum(sizes) > MAX_TOTAL_BYTES:
        raise ImageError(f"its files are larger than {MAX_FILE_BYTES >> 20} MiB each or {MAX_TOTAL_BYTES >> 30} GiB.")
