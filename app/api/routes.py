"""Every REST route below /api/v1, put together."""

from typing import Any

from fastapi import APIRouter

from app.api import (
    archives,
    assignments,
    cases,
    endoscope,
    jobs,
    label_files,
    lumen_endoscope,
    lumen_paths,
    lumen_views,
    openings,
    overlays,
    pictures,
    plan_files,
    plan_parts,
    plan_reports,
    plan_versions,
    plans,
    refining,
    registration_calibration,
    registration_files,
    registrations,
    robots,
    run_comments,
    run_exports,
    run_scores,
    run_swept,
    runs,
    segmentation,
    structures,
    studies,
    suggestions,
    tool_poses,
    tracing,
    volumes,
)
from app.api.dependencies import ERRORS
from app.operations.rest import OperationRoutes

__all__ = ["described", "router"]

_operations = OperationRoutes(lambda request: request.app.state.services)
router = APIRouter(prefix="/api/v1")
router.include_router(_operations.router, responses=ERRORS)
for part in (
    archives,
    cases,
    structures,
    segmentation,
    label_files,
    volumes,
    overlays,
    openings,
    pictures,
    plans,
    plan_parts,
    plan_reports,
    plan_versions,
    suggestions,
    tool_poses,
    endoscope,
    lumen_endoscope,
    lumen_paths,
    lumen_views,
    plan_files,
    registrations,
    registration_files,
    refining,
    tracing,
    registration_calibration,
    robots,
    jobs,
    runs,
    run_comments,
    run_exports,
    run_scores,
    run_swept,
    assignments,
    studies,
):
    router.include_router(part.router)


def described(document: dict[str, Any]) -> dict[str, Any]:
    """OpenAPI with the schemas that the routes of operations refer to."""
    document.setdefault("components", {}).setdefault("schemas", {}).update(_operations.components)
    return document
