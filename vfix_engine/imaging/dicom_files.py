"""The files of a DICOM folder or zip, in order and within limits; nothing is unpacked to disk."""

from __future__ import annotations

import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from vfix_engine.errors import ImageError
from vfix_engine.imaging.text_bytes import text_of_member, text_of_path

MAX_FILES = 5000
MAX_FILE_BYTES = 640 << 20  # of enhanced CT, which has all slices in one file
MAX_TOTAL_BYTES = 2 << 30
MAX_RATIO = 200  # inflated to stored; CT slices stay below 20

_DICOM_BEGIN = 132  # [byte] up to the end of the magic word
# Files beside the slices on a hospital's disc, by their names: what the system keeps there, and what belongs to other
# programs, such as a viewer, its pictures and its texts. All other files have to be DICOM: a damaged slice must not be
# dropped silently.
_OF_THE_SYSTEM = re.compile(r"(?i)^(dicomdir|\..*|thumbs\.db|desktop\.ini)$")
_OF_PROGRAMS = re.compile(
    r"(?i)^(readme|licen[cs]e|autorun|.*\.("
    r"txt|md|pdf|html?|xml|xslt?|xsd|dtd|json|csv|log|rtf|docx?|xlsx?|pptx?|chm|hlp|cnt|"
    r"jpe?g|png|gif|bmp|tiff?|svg|ico|icns|ttf|otf|woff2?|wav|mp[34]|avi|mov|wmv|swf|"
    r"exe|dll|ocx|sys|drv|ax|com|scr|msi|cab|bat|cmd|vbs|ps1|sh|command|so|dylib|jar|class|jnlp|js|css|php|pyc?|pdb|"
    r"inf|ini|cfg|conf|config|manifest|properties|plist|nib|strings|lnk|url|desktop|db|sqlite|lic|lng|lang|res|pak"
    r"))$"
)
# How files of other programs begin whose names do not say it: of Windows, Linux and macOS, archives, texts of pages.
_MAGIC = (
    b"MZ", b"\x7fELF", b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe", b"\xca\xfe\xba\xbe", b"MSCF",
    b"PK\x03\x04", b"%PDF", b"GIF8", b"\x89PNG", b"\xff\xd8\xff", b"\0\0\1\0", b"#!", b"[autorun]",
)  # fmt: skip
_OF_IMAGES = re.compile(r"(?i).*\.(dcm|dicom|ima|img)$")
# Names that scanners and archives give, which hold nothing that a person wrote.
_PLAIN_NAME = re.compile(
    r"(?i)(im|img|image|i|ct|s|slice|file|scout|topogram|localizer|z)?[-_]?\d[\d._-]*(\.(dcm|ima))?"
)


def is_companion(name: str) -> bool:
    """Whether the name is that of a file beside the slices, not of a slice."""
    return _of_the_system(name) or _OF_PROGRAMS.match(_last(name)) is not None


def plain_name(name: str, number: int) -> str:
    """How a note, which is stored, calls a file: by its name where that can hold no patient's (HAZ-33)."""
    return f"'{name}'" if len(name) <= 64 and _PLAIN_NAME.fullmatch(name) else f"file {number} by name"


def begins_as_dicom(data: bytes) -> bool:
    """Whether a file begins as DICOM does."""
    return data[_DICOM_BEGIN - 4 : _DICOM_BEGIN] == b"DICM"


class OtherFiles:
    """The files of a folder or zip that are not DICOM: those of other programs are passed over with a note.

    A file belongs to another program by its name, by how it begins, or where it lies beside or below such a file in a
    folder without images.
    """

    def __init__(self) -> None:
        self._folders: set[PurePosixPath] = set()  # that images lie in
        self._above: set[PurePosixPath] = set()  # and those and all above them
        self._programs: list[PurePosixPath] = []
        self._unclear: list[PurePosixPath] = []

    def image(self, place: PurePosixPath) -> None:
        """Count an image."""
        self._folders.add(place.parent)
        self._above.update(place.parents)

    def companion(self, place: PurePosixPath) -> None:
        """Count a file that was passed over because of its name."""
        if not _of_the_system(str(place)):
            self._programs.append(place)

    def other(self, place: PurePosixPath, data: bytes) -> None:
        """Count a file that does not begin as DICOM does."""
        foreign = data.startswith(_MAGIC) and not _OF_IMAGES.match(place.name)
        (self._programs if foreign else self._unclear).append(place)

    def check(self) -> tuple[str, ...]:
        """The note on what was passed over. Raises ImageError that names a file which may be a damaged slice."""
        homes = {place.parent for place in self._programs}
        for place in self._unclear:
            belongs = place.parent in homes - self._folders or not (homes - self._above).isdisjoint(place.parents)
            if _OF_IMAGES.match(place.name) or not belongs:
                raise ImageError(f"the file {place.name!r:.80} is not DICOM.")
        passed = [*self._programs, *self._unclear]
        if not passed:
            return ()
        endings = sorted({place.suffix.lower() for place in passed if _OF_PROGRAMS.match(place.name) and place.suffix})
        one, kinds = len(passed) == 1, f" ({', '.join(endings[:12])})" if endings else ""
        return (f"{len(passed)} file{'s' * (not one)} of other programs beside the images{kinds} "
                f"{'was' if one else 'were'} passed over.",)  # fmt: skip


def _never_read(name: str) -> bool:
    """Whether it is none of the slices though it may begin as DICOM: the directory of the medium."""
    return "__MACOSX" in _path(name).parts or _last(name).lower() == "dicomdir"


def _of_the_system(name: str) -> bool:
    return "__MACOSX" in _path(name).parts or _OF_THE_SYSTEM.match(_last(name)) is not None


def _path(name: str) -> PurePosixPath:
    return PurePosixPath(name.replace("\\", "/"))


def _last(name: str) -> str:
    return _path(name).name


def contents(path: Path, others: OtherFiles | None = None) -> Iterator[tuple[PurePosixPath, bytes]]:
    """Place within the folder or zip, and bytes, of each file that is not passed over because of its name.

    others: takes note of those that are.
    Raises:
        ImageError: a limit is exceeded, or the archive is damaged or unsafe.
    """
    taken = OtherFiles() if others is None else others
    return _zip_contents(path, taken) if path.is_file() else _folder_contents(path, taken)


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
    return [_last(name) for name in found if not is_companion(name)]


def _folder_contents(path: Path, others: OtherFiles) -> Iterator[tuple[PurePosixPath, bytes]]:
    files = []
    for file in sorted(path.rglob("*")):
        if file.is_symlink():
            raise ImageError("the folder holds a symbolic link; copy the series itself.")
        if not file.is_file():
            continue
        place = PurePosixPath(text_of_path(file.relative_to(path).as_posix()))
        if is_companion(str(place)) and (_never_read(str(place)) or not _is_image(file.open("rb"))):
            others.companion(place)
        else:
            files.append((place, file))
    _check_caps([file.stat().st_size for _, file in files])
    for place, file in files:
        yield place, file.read_bytes()


def _zip_contents(path: Path, others: OtherFiles) -> Iterator[tuple[PurePosixPath, bytes]]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = []
            for member in sorted(archive.infolist(), key=lambda member: member.filename):
                if member.is_dir():
                    continue
                _check_member(member)
                name = member.filename
                if is_companion(name) and (_never_read(name) or not _is_image(archive.open(member))):
                    others.companion(_path(name))
                else:
                    members.append(member)
            _check_caps([member.file_size for member in members])
            if sum(member.compress_size for member in members) > path.stat().st_size:
                raise ImageError("entries of the zip overlap.")
            for member in members:
                with archive.open(member) as stream:
                    data = stream.read(member.file_size + 1)
                if len(data) != member.file_size:
                    raise ImageError("an entry of the zip is not as long as the zip says.")
                yield _path(text_of_member(member.filename, member.flag_bits, member.create_system)), data
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, RuntimeError, ValueError):
        raise ImageError("the zip is damaged, encrypted, or packed in a way that is not read.") from None


def _is_image(stream: IO[bytes]) -> bool:
    """Whether a file is an image whatever its name says."""
    with stream:
        return begins_as_dicom(stream.read(_DICOM_BEGIN))


def _check_member(member: zipfile.ZipInfo) -> None:
    name = member.filename.replace("\\", "/")
    if name.startswith("/") or ":" in name or ".." in _path(name).parts:
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
