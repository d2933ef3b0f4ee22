"""Points, targets and curve of a plan for the page and the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from app.kit.values import Position
from app.plans.service import Plan
from app.scene.plan import CurveNodes, ItemNodes, PlanItem
from app.workspace.layers import Layer
from app.workspace.sections import CurveSection, ItemsSection
from vfix_engine.arrays import Array
from vfix_engine.geometry.path import SplinePath

CURVE_SAMPLES = 160


def position_of(values: Any) -> Position:
    x, y, z = (float(value) for value in values)
    return x, y, z


def plan_items(plan: Plan) -> list[PlanItem]:
    """Points and targets of a plan, as drawn and driven."""
    return [
        PlanItem(entry.id, kind, entry.label, entry.position)
        for kind, listed in (("point", plan.content.points), ("target", plan.content.targets))
        for entry in listed
    ]


def entries(items: Iterable[PlanItem]) -> ItemsSection:
    """Points and targets for the page's sections."""
    found: ItemsSection = {"points": [], "targets": []}
    for item in items:
        position = [round(value, 4) for value in item.position]
        listed = found["points"] if item.kind == "point" else found["targets"]
        listed.append({"id": item.id, "label": item.label, "position": position})
    return found


def curve_points(path: SplinePath | None) -> Array | None:
    """At most CURVE_SAMPLES places along a path."""
    if path is None:
        return None
    return np.asarray(path.position(np.linspace(0.0, path.length, CURVE_SAMPLES)))


def curve_section(places: Array | None) -> CurveSection:
    """The page's section of a curve (n, 3): every second place, and the last."""
    if places is None:
        return {"points": []}
    return {"points": np.round(np.concatenate([places[:-1:2], places[-1:]]), 2).tolist()}


def items_layer(items: tuple[PlanItem, ...], selected: str | None, locked: bool) -> Layer[ItemNodes]:
    """Points and targets; locked: they cannot be dragged."""
    return Layer("plan.items", (items, selected, locked), ItemNodes, lambda nodes: nodes.show(items, selected, locked))


def curve_layer(key: object, curve: Callable[[], tuple[Array | None, Array | None]]) -> Layer[CurveNodes]:
    """Positions (n, 3) along a path with the clearance (n,) there; computed only if the key has changed."""
    return Layer("plan.curve", key, CurveNodes, lambda nodes: nodes.show(*curve()))
