"""The steps of the page, one line each; commands, routes and tabs come from here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from app.steps.spec import StepSpec

if TYPE_CHECKING:  # the scene is slow to load, and the address needs none of it
    from fastapi import APIRouter

    from app.steps.base import Step

STEPS: list[str] = [
    "app.steps.patient",
    "app.steps.plan",
    "app.steps.register",
    "app.steps.rehearse",
]


def specs() -> tuple[StepSpec, ...]:
    """Every step, in the order of the tabs. Raises ValueError where two have one name."""
    found = sorted((importlib.import_module(package).SPEC for package in STEPS), key=lambda spec: spec.order)
    names = [spec.name for spec in found]
    if len(set(names)) < len(names):
        raise ValueError(f"two steps have one name: {', '.join(names)}")
    return tuple(found)


def load(spec: StepSpec) -> type[Step]:
    """A step's class; the first call loads the scene's libraries."""
    found: type[Step] = getattr(importlib.import_module(f"{spec.package}.step"), spec.step)
    return found


def routers() -> tuple[APIRouter, ...]:
    """The steps' own addresses. Raises ValueError for one outside of its step's."""
    found = []
    for spec in specs():
        if spec.has_routes:
            router = importlib.import_module(f"{spec.package}.routes").router
            paths = [str(getattr(route, "path", "")) for route in router.routes]
            outside = [path for path in paths if not path.startswith(f"/api/v1/steps/{spec.name}/")]
            if outside:
                raise ValueError(f"{', '.join(outside)}: routes of this step begin with /api/v1/steps/{spec.name}/.")
            found.append(router)
    return tuple(found)
