"""Cases as archives: one zip with plans, surfaces, volumes, registrations and checksums."""

from __future__ import annotations

import asyncio
import shutil
import threading
from functools import partial
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.passing_file import PassingFile
from app.api.uploads import Upload, form_of, receive, safe_name
from app.exchange.patient_images import WITH_IMAGES, check_images
from app.kit.errors import JobCancelled
from app.kit.jobs import Progress
from app.plans.model import NOTICE
from app.services import Services
from app.store.errors import StorageError

router = APIRouter(prefix="/cases", tags=["archives"], responses=ERRORS)

MAX_ARCHIVE_BYTES = 8 << 30
_LOOK_S = 0.2  # between looks whether the client is still there
_FORM = form_of({"file": "a .zip that GET /api/v1/cases/{case_id}/archive made"}, {}, frame=False)
_ZIP = "application/zip"


@router.get(
    "/{case_id}/archive",
    response_class=FileResponse,
    responses={200: {"content": {_ZIP: {}}, "description": "The archive"}},
)
async def export_archive(
    case_id: Identifier,
    request: Request,
    services: ServicesDep,
    runs: Annotated[bool, Query(description="the manifests of recorded drives as well")] = False,
    with_images: Annotated[bool, Query(description=WITH_IMAGES)] = False,
) -> PassingFile:
    """The case as one zip with checksums; made first, which takes seconds to minutes. Not for clinical use.

    Images can identify their patient: a case that has some is exported with `with_images=true` only.

    One is made at a time, others wait; where too many do, the answer is 503.
    """
    case = await run_in_threadpool(services.cases.get, case_id)
    check_images(case, with_images, "with_images=true")
    ticket = services.archive_line.join()
    try:
        while not services.archive_line.is_turn(ticket):
            await asyncio.sleep(_LOOK_S)
            if await request.is_disconnected():
                raise JobCancelled
        path = await _made(case_id, request, services, runs)
        services.archive_line.done(ticket)
    except BaseException:
        services.archive_line.leave(ticket)
        raise
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    answer = PassingFile(path, media_type=_ZIP, filename=f"{safe_name(case.name)}.zip", headers=headers)
    answer.ended = partial(services.archive_line.leave, ticket)
    return answer


async def _made(case_id: str, request: Request, services: Services, runs: bool) -> Path:
    """The archive in a folder of its own; nothing is left where the client goes away. Raises JobCancelled then."""
    place = await run_in_threadpool(services.store.exports.new_place)
    gone, path = threading.Event(), place / "case.zip"

    def check() -> None:
        if gone.is_set():
            raise JobCancelled

    def work() -> None:
        try:
            with path.open("xb") as target:
                services.archive_writer.write(case_id, target, with_runs=runs, go_on=check)
        except OSError as error:
            raise StorageError(f"the archive could not be written: {error.strerror or error}.") from error

    making = asyncio.ensure_future(run_in_threadpool(work))
    try:
        while not (await asyncio.wait({making}, timeout=_LOOK_S))[0]:
            if await request.is_disconnected():
                gone.set()
        await making
    except BaseException:
        gone.set()
        await asyncio.wait({making})  # nothing is written any more once it has ended
        await run_in_threadpool(shutil.rmtree, place, ignore_errors=True)
        raise
    return path


@router.post("/archive", status_code=202, openapi_extra=_FORM)
async def import_archive(request: Request, services: ServicesDep) -> JobPublic:
    """Upload an archive; the response is a job whose result is the new case's id.

    Every name, size and checksum is examined; nothing is left of an archive that is refused.
    """
    return start_import(services, await receive(request, services.store.scratch, MAX_ARCHIVE_BYTES, ()))


def start_import(services: Services, upload: Upload) -> JobPublic:
    """Import a received archive as a job."""

    def work(progress: Progress) -> str:
        return services.archive_reader.read(upload.path, progress).id

    return JobPublic.of(services.jobs.submit(work, upload.remove, kind="import", lane="import", subject="Saved head"))
