"""Polyps and labels of the open route for the page and the scene."""

from __future__ import annotations

import math
from typing import Any

from app.drives.view import place
from app.lumen.document import Route
from app.lumen.marks import MARK_KINDS, RouteMark
from app.lumen.paths import RoutePath
from app.scene import palette
from app.scene.lumen import MarkNodes, MarkShape
from app.tabs.route.sections import MarkKindView, MarkView
from app.workspace.layers import Layer
from app.workspace.plan_items import position_of
from vfix_engine.study.polyps.printed import PROUD_MM

_STOP_MM = 4.0  # radius of the ball where the tip stops


def mark_view(mark: RouteMark) -> MarkView:
    """One of them in the list."""
    return {"id": mark.id, "kind": mark.kind, "name": mark.name, "at": place(mark.at)}


def mark_kinds() -> list[MarkKindView]:
    """Every kind that the page has a button for."""
    return [{"kind": kind, "many": style.many} for kind, style in MARK_KINDS.items()]


def marks_layer(route: Route, case_id: str | None) -> Layer[Any]:
    """All of them on the wall."""
    shapes = tuple(
        MarkShape(mark.id, mark.name, mark.at, PROUD_MM, MARK_KINDS[mark.kind].colour) for mark in route.marks
    )
    return Layer("route.marks", shapes, MarkNodes, lambda nodes: nodes.show(shapes), case_id)


def stop_layer(path: RoutePath, case_id: str | None) -> Layer[Any]:
    """Where the robot stops before the end of its way."""
    words = f"Tip stops, {math.floor(round(path.reach.depth_mm, 1) + 0.5)} mm"  # as the page rounds it
    shapes = (MarkShape("stop", words, position_of(path.stop), _STOP_MM, palette.BLOCKED),)
    return Layer("route.stop", shapes, MarkNodes, lambda nodes: nodes.show(shapes), case_id)
