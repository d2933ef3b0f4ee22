"""Uploads: streamed to disk, counted while they arrive, refused as soon as they are too large (HAZ-30)."""

import io
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from app.store.errors import StorageError
from app.store.scratch import Scratch
from vfix_engine.errors import InputError

_OVERHEAD = 64 << 10  # [byte] boundaries and fields around the file
_MAX_FIELD = 4 << 10  # [byte] of a field
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


@dataclass(frozen=True)
class Upload:
    """A received file, alone in a folder of its own, and the fields that came with it."""

    path: Path
    fields: dict[str, str]

    def remove(self) -> None:
        """Delete the file."""
        shutil.rmtree(self.path.parent, ignore_errors=True)


async def receive(request: Request, scratch: Scratch, max_bytes: int, fields: tuple[str, ...]) -> Upload:
    """Take the file called 'file' and the named fields of a multipart request; it is written where it stays.

    Refused with 413 as soon as more bytes are claimed or come than are allowed. Raises InputError for another form,
    and StorageError when the disk does not take it.
    """
    place = await run_in_threadpool(scratch.new_place)
    try:
        form = await _form(request, max_bytes, fields, lambda: (place / "upload").open("xb+"))
        path = place / safe_name(form.name)
        form.file.close()  # what the disk refuses at the last moment is told here
        (place / "upload").rename(path)
        return Upload(path, form.fields)
    except OSError as error:
        shutil.rmtree(place, ignore_errors=True)
        raise StorageError(f"the upload could not be stored: {error.strerror or error}.") from error
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        raise


async def receive_small(request: Request, max_bytes: int, fields: tuple[str, ...]) -> tuple[str, bytes, dict[str, str]]:
    """Name, bytes and fields of a small file; it never touches the disk."""
    form = await _form(request, max_bytes, fields, io.BytesIO)
    return form.name, form.file.read(), form.fields


def safe_name(file_name: str) -> str:
    """The last part of a file's name, of harmless characters only; its ending tells the format."""
    name = _UNSAFE.sub("_", file_name.replace("\\", "/").rsplit("/", 1)[-1])[-100:].lstrip(".-")
    return name or "file"


@dataclass(frozen=True)
class _Form:
    """What a form holds: a file at its beginning, what it is called, and the fields that are not empty."""

    file: BinaryIO
    name: str
    fields: dict[str, str]


class _Parser(MultiPartParser):
    """Writes the file into one of ours; that of the base would lie in the system's temporary folder."""

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


async def _form(request: Request, max_bytes: int, fields: tuple[str, ...], make_file: Callable[[], BinaryIO]) -> _Form:
    request.state.max_body_bytes = max_bytes + _OVERHEAD  # more than the gateway, which counts, takes of others
    request.state.too_large = f"the file is larger than {max_bytes >> 20} MiB, which is the most that is taken."
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise InputError("send the file as multipart/form-data.")
    parser = _Parser(make_file, request.headers, request.stream(), max_files=1, max_fields=8, max_part_size=_MAX_FIELD)
    try:
        form = await parser.parse()
    except MultiPartException as error:
        raise InputError(f"the upload cannot be read: {error.message}") from None
    file = form.get("file")
    if not isinstance(file, UploadFile) or set(form) - {"file", *fields}:
        await form.close()
        raise InputError(f"send one file as 'file' and, where needed, {', '.join(fields) or 'nothing else'}.")
    values = {name: value for name in fields if isinstance(value := form.get(name), str) and value}
    return _Form(file.file, file.filename or "file", values)
