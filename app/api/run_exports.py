"""A run as a file for other programs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.passing_file import PassingFile
from app.exchange.runs.export import WRITERS, check_suffix
from app.exchange.runs.python import run_python
from app.exchange.runs.table import about
from app.plans.model import NOTICE
from app.store.errors import StorageError
from vfix_engine.runtime.run import Run

router = APIRouter(tags=["runs"], responses=ERRORS)

RunFormat = Literal["csv", "about.json", "parquet", "mcap", "py"]
MEDIA_TYPES: dict[RunFormat, str] = {
    "csv": "text/csv",
    "about.json": "application/json",
    "parquet": "application/vnd.apache.parquet",
    "mcap": "application/octet-stream",
    "py": "text/x-python",
}
_CONTENT = {kind: {"schema": {"type": "string", "format": "binary"}} for kind in sorted(set(MEDIA_TYPES.values()))}


@router.get(
    "/runs/{run_id}/export",
    response_class=Response,
    responses={200: {"content": _CONTENT, "description": "The file"}},
)
def export_run(
    run_id: Identifier, services: ServicesDep, form: Annotated[RunFormat, Query(alias="format")] = "csv"
) -> Response:
    """Every step of a run as a table (`csv`, `parquet`) or for Foxglove (`mcap`), as `vfix run export` writes them.

    `about.json` is what belongs to the table of `csv`; `py` sets up the run's scene in the library and replays it, as
    `vfix run python` prints it. 400 `extra_missing` where the planner lacks the packages that `parquet` or `mcap` need.
    """
    check_suffix(f".{form}")
    stored = services.runs.get(run_id)
    with services.runs.laid_out(run_id) as folder:
        run = Run.read(folder)
    name = f"{stored.id}.csv.{form}" if form == "about.json" else f"{stored.id}.{form}"
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store", "Content-Disposition": f'attachment; filename="{name}"'}
    if form == "py":
        return Response(run_python(run, stored.id), media_type=MEDIA_TYPES[form], headers=headers)
    told = about(run, stored.id, stored.comments)
    if form == "about.json":
        return Response(json.dumps(told, indent=1), media_type=MEDIA_TYPES[form], headers=headers)
    path = _written(run, told, services.store.exports.new_place() / name)
    return PassingFile(path, media_type=MEDIA_TYPES[form], headers=headers)


def _written(run: Run, told: dict[str, Any], path: Path) -> Path:
    """The file of a run in a folder of its own, which goes where it cannot be written."""
    try:
        WRITERS[path.suffix](run, told, path)
    except OSError as error:
        shutil.rmtree(path.parent, ignore_errors=True)
        raise StorageError(f"the export could not be written: {error.strerror or error}.") from error
    except BaseException:
        shutil.rmtree(path.parent, ignore_errors=True)
        raise
    return path
