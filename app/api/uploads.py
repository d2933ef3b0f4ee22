"""Uploads: streamed to disk, counted while they arrive, refused as soon as they are too large (HAZ-30)."""

import io
import re
import shutil
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, cast

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from app.store.errors import StorageError
from app.store.scratch import Scratch
from vfix_engine.errors import InputError

MAX_FILES = 5000  # of one upload; a series has one for each slice
# Of a form: that the file's series description may become the name, which it does not by itself (HAZ-33).
USE_DESCRIPTION = {
    "type": "string",
    "enum": ["yes"],
    "description": "name it by the series description of the DICOM files, which may tell of the patient",
}
_OVERHEAD = 64 << 10  # [byte] boundaries and fields around the file
_MAX_FIELD = 4 << 10  # [byte] of a field
_UNSAFE, _UNSAFE_WORD = re.compile(r"[^A-Za-z0-9._-]+"), re.compile(r"[^\w.-]+")
_MAX_NAME = 200  # [byte] of a file's name


def form_of(files: dict[str, str], fields: dict[str, str | dict[str, Any]], *, frame: bool = True) -> dict[str, Any]:
    """What the schema says of a multipart form.

    files: descriptions by name, the first of which is needed. fields: of text, a description or a schema by name.
    frame: whether frame and units may be said as well.
    """
    properties: dict[str, Any] = {name: {"type": "string", "format": "binary", "description": words}
                                  for name, words in files.items()}  # fmt: skip
    for name, words in fields.items():
        properties[name] = {"type": "string", "description": words} if isinstance(words, str) else words
    if frame:
        properties |= {
            "frame": {"type": "string", "enum": ["LPS", "RAS"], "description": "where the file names none"},
            "units": {"type": "string", "enum": ["mm", "m", "um"], "description": "where the file names none"},
        }
    schema = {"type": "object", "required": [next(iter(files))], "properties": properties}
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": schema}}}}


@dataclass(frozen=True)
class Upload:
    """What was received, in a folder of its own, and the fields of the form.

    path: the file; of several, the folder that they lie in. beside: files of other parts of the form, by their names.
    """

    path: Path
    fields: dict[str, str]
    place: Path
    beside: dict[str, Path]

    @property
    def uses_description(self) -> bool:
        """Whether the form asks for the series description as a name."""
        return self.fields.get("use_description") == "yes"

    def remove(self) -> None:
        """Delete the files."""
        shutil.rmtree(self.place, ignore_errors=True)


async def receive(
    request: Request,
    scratch: Scratch,
    max_bytes: int,
    fields: tuple[str, ...],
    *,
    max_files: int = 1,
    beside: tuple[str, ...] = (),
) -> Upload:
    """Receive the files 'file' and the named fields of a multipart request.

    max_files: that may be sent as 'file'. beside: names of parts with one further file each, which may be left out.
    Refused with 413 as soon as more bytes are claimed or received than allowed. Raises InputError for a malformed form,
    and StorageError when it cannot be written.
    """
    place = await run_in_threadpool(scratch.new_place)
    try:
        form = await _form(request, max_bytes, fields, _numbered(place), max_files, beside)
        if (word := form.fields.get("use_description", "yes")) != "yes":
            raise InputError(f"use_description is {word!r:.20}; say yes, or leave it out.")
        path = await run_in_threadpool(_placed, form.files["file"], place)
        named = {name: _placed_alone(form.files[name][0], place / name) for name in beside if name in form.files}
        return Upload(path, form.fields, place, named)
    except OSError as error:
        shutil.rmtree(place, ignore_errors=True)
        raise StorageError(f"the upload could not be stored: {error.strerror or error}.") from error
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        raise


async def receive_small(request: Request, max_bytes: int, fields: tuple[str, ...]) -> tuple[str, bytes, dict[str, str]]:
    """Name, bytes and fields of a small file, kept in memory."""
    form = await _form(request, max_bytes, fields, io.BytesIO, 1, ())
    (file,) = form.files["file"]
    return file.filename or "file", file.file.read(), form.fields


def _numbered(place: Path) -> Callable[[], BinaryIO]:
    """Makes a file of a new name in the folder for each part of a form."""
    numbers = count()
    return lambda: cast(BinaryIO, _PartFile(place / f"upload-{next(numbers)}"))


def _placed(files: list[UploadFile], place: Path) -> Path:
    """The received file under its safe name, or the folder in which all of them lie so."""
    if len(files) == 1:
        return _placed_alone(files[0], place)
    folder = place / "files"
    folder.mkdir()
    for number, file in enumerate(files):
        wanted = folder / stored_name(file.filename or "file")
        if wanted.exists():  # of another folder on the user's disk
            wanted = folder / f"{number:05d}" / wanted.name
            wanted.parent.mkdir()
        cast(_PartFile, file.file).path.rename(wanted)
    return folder


def _placed_alone(file: UploadFile, folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    wanted = folder / safe_name(file.filename or "file")
    cast(_PartFile, file.file).path.rename(wanted)
    return wanted


def safe_name(file_name: str) -> str:
    """The last part of a file name, with safe characters only; its suffix is the format."""
    name = _UNSAFE.sub("_", file_name.replace("\\", "/").rsplit("/", 1)[-1])[-100:].lstrip(".-")
    return name or "file"


def stored_name(file_name: str) -> str:
    """Like `safe_name`, with letters of every script: structures are called after the files of their masks."""
    last = unicodedata.normalize("NFC", file_name.replace("\\", "/").rsplit("/", 1)[-1])
    short = _UNSAFE_WORD.sub("_", last).encode()[-_MAX_NAME:].decode("utf-8", "ignore")
    return short.lstrip(".-") or "file"


class _PartFile:
    """A part of a form on disk, opened with its first bytes and closed with its last: there may be thousands."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: BinaryIO | None = None

    def write(self, data: bytes) -> int:
        return self._opened().write(data)

    def seek(self, _: int) -> int:
        """The parser goes back to the beginning of a part that is complete; what the disk refuses is told here."""
        self._opened()
        self.close()
        return 0

    def close(self) -> None:
        if self._file is not None:
            self._file.close()

    def _opened(self) -> BinaryIO:
        if self._file is None:
            self._file = self.path.open("xb+")
        return self._file


@dataclass(frozen=True)
class _Form:
    """Content of a form: its files by the names of their parts, and the non-empty fields."""

    files: dict[str, list[UploadFile]]
    fields: dict[str, str]


class _Parser(MultiPartParser):
    """Writes the files into our folder instead of the system's temporary folder."""

    def __init__(self, make_file: Callable[[], BinaryIO], *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._make_file = make_file

    def on_headers_finished(self) -> None:
        super().on_headers_finished()
        upload = self._current_part.file
        if upload is not None:
            upload.file.close()
            upload.file = self._make_file()
            self._files_to_close_on_error[-1] = upload.file  # type: ignore[call-overload]


async def _form(
    request: Request,
    max_bytes: int,
    fields: tuple[str, ...],
    make_file: Callable[[], BinaryIO],
    max_files: int,
    beside: tuple[str, ...],
) -> _Form:
    request.state.max_body_bytes = max_bytes + _OVERHEAD  # more than the gateway, which counts, takes of others
    request.state.too_large = f"the file is larger than {max_bytes >> 20} MiB, which is the most that is taken."
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise InputError("send the file as multipart/form-data.")
    limits = {"max_files": max_files + len(beside), "max_fields": 8, "max_part_size": _MAX_FIELD}
    parser = _Parser(make_file, request.headers, request.stream(), **limits)
    try:
        form = await parser.parse()
    except MultiPartException as error:
        raise InputError(f"the upload cannot be read: {error.message}") from None
    files: dict[str, list[UploadFile]] = {}
    for name, value in form.multi_items():
        if isinstance(value, UploadFile):
            files.setdefault(name, []).append(value)
    if not _is_expected(form, files, fields, max_files, beside):
        await form.close()
        further = ", ".join((*beside, *fields)) or "nothing else"
        raise InputError(f"send {'one file' if max_files == 1 else 'files'} as 'file' and, where needed, {further}.")
    values = {name: text for name in fields if isinstance(text := form.get(name), str) and text}
    return _Form(files, values)


def _is_expected(
    form: FormData,
    files: dict[str, list[UploadFile]],
    fields: tuple[str, ...],
    max_files: int,
    beside: tuple[str, ...],
) -> bool:
    if set(form) - {"file", *fields, *beside} or set(files) - {"file", *beside} or "file" not in files:
        return False
    return len(files["file"]) <= max_files and all(len(files.get(name, ())) <= 1 for name in beside)
