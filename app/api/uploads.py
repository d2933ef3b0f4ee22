"""Uploads: streamed to disk, counted while they arrive, refused as soon as they are too large (HAZ-30)."""

import re
import shutil
from collections.abc import AsyncGenerator
from dataclasses import dataclass
from pathlib import Path

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from app.services.errors import TooLarge
from app.services.uploads import Uploads
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


async def receive(request: Request, uploads: Uploads, max_bytes: int, fields: tuple[str, ...]) -> Upload:
    """Take the file called 'file' and the named fields of a multipart request.

    Raises TooLarge as soon as more bytes are claimed or come than are allowed, and InputError for another form.
    """
    form = await _form(request, max_bytes)
    try:
        file = form.get("file")
        if not isinstance(file, UploadFile) or set(form) - {"file", *fields}:
            raise InputError(f"send one file as 'file' and, where needed, {', '.join(fields) or 'nothing else'}.")
        values = {name: value for name in fields if isinstance(value := form.get(name), str) and value}
        upload = Upload(uploads.new_place() / safe_name(file.filename or "file"), values)
        try:
            await run_in_threadpool(_copy, file, upload.path)
        except BaseException:
            upload.remove()
            raise
        return upload
    finally:
        await form.close()


async def receive_small(request: Request, max_bytes: int, fields: tuple[str, ...]) -> tuple[str, bytes, dict[str, str]]:
    """Name, bytes and fields of a small file; it never touches the disk under its own name."""
    form = await _form(request, max_bytes)
    try:
        file = form.get("file")
        if not isinstance(file, UploadFile) or set(form) - {"file", *fields}:
            raise InputError(f"send one file as 'file' and, where needed, {', '.join(fields) or 'nothing else'}.")
        values = {name: value for name in fields if isinstance(value := form.get(name), str) and value}
        return file.filename or "file", await file.read(), values
    finally:
        await form.close()


def safe_name(file_name: str) -> str:
    """The last part of a file's name, of harmless characters only; its ending tells the format."""
    name = _UNSAFE.sub("_", file_name.replace("\\", "/").rsplit("/", 1)[-1])[-100:].lstrip(".-")
    return name or "file"


async def _form(request: Request, max_bytes: int) -> FormData:
    limit = max_bytes + _OVERHEAD
    claimed = request.headers.get("content-length", "0")
    if not claimed.isdigit() or int(claimed) > limit:
        raise _too_large(max_bytes)
    request.state.max_body_bytes = limit  # more than the gateway takes of other requests; it counts as well
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise InputError("send the file as multipart/form-data.")
    parser = MultiPartParser(
        request.headers, _counted(request, limit, max_bytes), max_files=1, max_fields=8, max_part_size=_MAX_FIELD
    )
    try:
        return await parser.parse()
    except MultiPartException as error:
        raise InputError(f"the upload cannot be read: {error.message}") from None


async def _counted(request: Request, limit: int, max_bytes: int) -> AsyncGenerator[bytes, None]:
    received = 0
    async for chunk in request.stream():
        received += len(chunk)
        if received > limit:
            raise _too_large(max_bytes)
        yield chunk


def _too_large(max_bytes: int) -> TooLarge:
    return TooLarge(f"the file is larger than {max_bytes >> 20} MiB, which is the most that is taken.")


def _copy(file: UploadFile, path: Path) -> None:
    with path.open("xb") as target:
        shutil.copyfileobj(file.file, target, 1 << 20)
