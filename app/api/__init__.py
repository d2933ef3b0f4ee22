"""REST over the services: cases, plans, jobs, runs, pictures and exports. Not for clinical use."""

from fastapi import APIRouter

from app.api import cases, jobs, pictures, plan_files, plans, robots, runs

__all__ = ["router"]

router = APIRouter(prefix="/api")
for part in (cases, pictures, plans, plan_files, robots, jobs, runs):
    router.include_router(part.router)
