"""REST over the services: cases, plans, jobs, runs, pictures and exports. Not for clinical use."""

from fastapi import APIRouter

from app.api import (
    archives,
    cases,
    jobs,
    labels,
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
    runs,
    segmentation,
    structures,
    suggestions,
    tool_poses,
    tracing,
    volumes,
)

__all__ = ["router"]

router = APIRouter(prefix="/api/v1")
for part in (
    archives,
    cases,
    structures,
    segmentation,
    labels,
    volumes,
    overlays,
    pictures,
    plans,
    plan_parts,
    plan_reports,
    plan_versions,
    suggestions,
    tool_poses,
    plan_files,
    registrations,
    registration_files,
    refining,
    tracing,
    registration_calibration,
    robots,
    jobs,
    runs,
):
    router.include_router(part.router)
