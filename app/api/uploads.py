"""Uploads: streamed to disk, counted while they arrive, refused as soon as they are too large (HAZ-30)."""

import io
import re
import shutil
import unicodedata
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any, BinaryIO, NamedTuple, cast

from fastapi import Request
from python_multipart import MultipartParser
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header
from starlette.concurrency import run_in_threadpool

from app.store.errors import StorageError
from app.store.scratch import Scratch
from vfix_engine.errors import InputError

MAX_FILES = 5000  # of one upload; a series has one for each slice
# Of a form: that the file's series description may become the name, which it does not by itself (HAZ-33).
USE_DESCRIPTION = {
    "type": "string",
    "enum": ["yes"],
    "description": "name it by the series description, which may identify the patient",
}
_OVERHEAD = 64 << 10  # [byte] boundaries and fields around the file
_MAX_FIELD, _MAX_FIELDS = 4 << 10, 8  # [byte] of a field, and how many there may be
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
        form = await _form(request, max_bytes, fields, place, max_files, beside)
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
    form = await _form(request, max_bytes, fields, None, 1, ())
    (file,) = form.files["file"]
    return file.name or "file", file.content.read(), form.fields


class _File(NamedTuple):
    """A received file: its name in the form, and its content, closed where it is a file on disk."""

    name: str
    content: BinaryIO


def _placed(files: list[_File], place: Path) -> Path:
    """The received file under its safe name, or the folder in which all of them lie so."""
    if len(files) == 1:
        return _placed_alone(files[0], place)
    folder = place / "files"
    folder.mkdir()
    for number, file in enumerate(files):
        wanted = folder / stored_name(file.name or "file")
        if wanted.exists():  # of another folder on the user's disk
            wanted = folder / f"{number:05d}" / wanted.name
            wanted.parent.mkdir()
        Path(file.content.name).rename(wanted)
    return folder


def _placed_alone(file: _File, folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    wanted = folder / safe_name(file.name or "file")
    Path(file.content.name).rename(wanted)
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


class _Form:
    """A multipart form, taken apart while it arrives.

    files: by the names of their parts, written into ``folder``, or kept in memory where that is None.
    fields: texts by name.
    """

    def __init__(self, folder: Path | None, max_files: int) -> None:
        self.files: dict[str, list[_File]] = {}
        self.fields: dict[str, str] = {}
        self._folder, self._most, self._begun = folder, {"files": max_files, "fields": _MAX_FIELDS}, Counter[str]()
        self._headers: list[tuple[bytearray, bytearray]] = []
        self._name, self._file_name = "", cast(str | None, None)
        self._content: BinaryIO = io.BytesIO()

    async def receive(self, request: Request) -> None:
        """Read the request. Raises InputError for a form that is malformed, OSError for what the disk refuses."""
        _, options = parse_options_header(request.headers["content-type"])
        if b"boundary" not in options:
            raise _unreadable("Missing boundary in multipart.")
        ended, headers = Event(), self._headers
        try:
            parser = MultipartParser(
                options[b"boundary"],
                {
                    "on_header_begin": lambda: headers.append((bytearray(), bytearray())),
                    "on_header_field": lambda data, start, end: headers[-1][0].extend(data[start:end]),
                    "on_header_value": lambda data, start, end: headers[-1][1].extend(data[start:end]),
                    "on_headers_finished": self._part_begun,
                    "on_part_data": self._part_continued,
                    "on_part_end": self._part_ended,
                    "on_end": ended.set,
                },
            )
            async for chunk in request.stream():
                await run_in_threadpool(parser.write, chunk)  # the disk may be slow
            if not ended.is_set():
                raise _unreadable("it ends before its last boundary.")
        except FormParserError:
            raise _unreadable("Invalid multipart data.") from None
        finally:
            self._content.close()

    def _part_begun(self) -> None:
        headers = {bytes(name).lower(): bytes(value) for name, value in self._headers}
        self._headers.clear()
        _, options = parse_options_header(headers.get(b"content-disposition"))
        if b"name" not in options:
            raise _unreadable('The Content-Disposition header field "name" must be provided.')
        self._name = _decoded(options[b"name"])
        self._file_name = _decoded(options[b"filename"]) if b"filename" in options else None
        kind = "fields" if self._file_name is None else "files"
        self._begun[kind] += 1
        if self._begun[kind] > self._most[kind]:
            raise _unreadable(f"Too many {kind}. Maximum number of {kind} is {self._most[kind]}.")
        if self._folder is None or self._file_name is None:
            self._content = io.BytesIO()
        else:  # one at a time is open: there may be thousands
            self._content = (self._folder / f"upload-{self._begun[kind]}").open("xb+")

    def _part_continued(self, data: bytes, start: int, end: int) -> None:
        if self._file_name is None and self._content.tell() + end - start > _MAX_FIELD:
            raise _unreadable(f"Part exceeded maximum size of {_MAX_FIELD >> 10}KB.")
        self._content.write(data[start:end])

    def _part_ended(self) -> None:
        self._content.seek(0)
        if self._file_name is None:
            self.fields[self._name] = _decoded(self._content.read())
            return
        if self._folder is not None:
            self._content.close()
        self.files.setdefault(self._name, []).append(_File(self._file_name, self._content))
        self._content = io.BytesIO()


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _unreadable(why: str) -> InputError:
    return InputError(f"the upload cannot be read: {why}")


async def _form(
    request: Request,
    max_bytes: int,
    fields: tuple[str, ...],
    folder: Path | None,
    max_files: int,
    beside: tuple[str, ...],
) -> _Form:
    request.state.max_body_bytes = max_bytes + _OVERHEAD  # more than the gateway, which counts, takes of others
    request.state.too_large = f"the file is larger than {max_bytes >> 20} MiB, the most that is taken."
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise InputError("send the file as multipart/form-data.")
    form = _Form(folder, max_files + len(beside))
    await form.receive(request)
    counts = {name: len(files) for name, files in form.files.items()}
    most = {"file": max_files} | dict.fromkeys(beside, 1)
    expected = all(count <= most.get(name, 0) for name, count in counts.items())
    if "file" not in counts or not expected or set(form.fields) - {*most, *fields}:
        further = ", ".join((*beside, *fields)) or "nothing else"
        raise InputError(f"send {'one file' if max_files == 1 else 'files'} as 'file' and, where needed, {further}.")
    form.fields = {name: form.fields[name] for name in fields if form.fields.get(name)}
    return form
