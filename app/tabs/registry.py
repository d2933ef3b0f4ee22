"""The tabs of the page, one line each; commands, routes and tabs come from here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from app.tabs.spec import TabSpec

if TYPE_CHECKING:  # the scene is slow to load, and the address needs none of it
    from fastapi import APIRouter

    from app.tabs.base import Tab

TABS: list[str] = [
    "app.tabs.patient",
    "app.tabs.plan",
    "app.tabs.register",
    "app.tabs.rehearse",
    "app.tabs.route",
    "app.tabs.drive",
    "app.tabs.review",
    "app.tabs.study",
]


def specs() -> tuple[TabSpec, ...]:
    """Every tab, in the order of the tabs. Raises ValueError where two have one name."""
    found = sorted((importlib.import_module(package).SPEC for package in TABS), key=lambda spec: spec.order)
    names = [spec.name for spec in found]
    if len(set(names)) < len(names):
        raise ValueError(f"two tabs have one name: {', '.join(names)}")
    return tuple(found)


def load(spec: TabSpec) -> type[Tab]:
    """A tab's class; the first call loads the scene's libraries."""
    found: type[Tab] = getattr(importlib.import_module(f"{spec.package}.tab"), spec.tab)
    return found


def routers() -> tuple[APIRouter, ...]:
    """The tabs' own addresses. Raises ValueError for one outside of its tab's."""
    found = []
    for spec in specs():
        if spec.has_routes:
            router = importlib.import_module(f"{spec.package}.routes").router
            paths = [str(getattr(route, "path", "")) for route in router.routes]
            outside = [path for path in paths if not path.startswith(f"/api/v1/steps/{spec.name}/")]
            if outside:
                raise ValueError(f"{', '.join(outside)}: routes of this tab begin with /api/v1/steps/{spec.name}/.")
            found.append(router)
    return tuple(found)
