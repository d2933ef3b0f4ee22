"""The results of a study that is led on the page, as `vfix study run` writes them."""

from __future__ import annotations

import io
import tempfile
import zipfile
from pathlib import Path

from fastapi import APIRouter, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.studies.course import file_of, without_simulated
from vfix_engine.study.own.file import conditions
from vfix_engine.study.own.order import order_of
from vfix_engine.study.own.results import StudyResults

router = APIRouter(prefix="/studies", tags=["studies"], responses=ERRORS)


@router.get(
    "/{study_id}/results",
    response_class=Response,
    responses={200: {"content": {"application/zip": {}}, "description": "a zip with the files of the results"}},
)
def study_results(study_id: Identifier, services: ServicesDep) -> Response:
    """Tables, statistics, plots and report of the people of a study so far, zipped; each run takes a moment."""
    from app.exchange.study_report import write_report  # its statistics are slow to load
    from vfix_engine.study.own.evaluation import evaluate

    content = services.studies.documents.get(study_id).content
    study = without_simulated(file_of(content.text))
    names = [turn.name for turns in order_of(study).values() for turn in turns]
    with tempfile.TemporaryDirectory(dir=services.store.scratch.open()) as temporary:
        results = StudyResults(Path(temporary))
        services.studies.collect(content, study, results)
        done, answers = results.read(names), results.read_answers(study.subjects.codes, conditions(study))
        told = evaluate(study, done, answers, results.read_reasons(names))
        write_report(results.folder, told, study, [done[name] for name in names if name in done], answers)
        data = _zipped(results.folder)
    headers = {"Content-Disposition": f'attachment; filename="{study_id}.zip"', "Cache-Control": "no-store"}
    return Response(data, media_type="application/zip", headers=headers)


def _zipped(folder: Path) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                packed.write(file, str(file.relative_to(folder)))
    return out.getvalue()
