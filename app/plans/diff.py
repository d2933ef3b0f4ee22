"""What changed between two contents of a plan, in sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, Protocol, TypeVar

from app.cases.second_volume import SecondVolume
from app.plans.instruments import shipped_robots, shipped_tools
from app.plans.model import PlanContent
from app.plans.paths import PlanPath
from app.plans.points import PlanPoint
from app.plans.shapes import anchor, size_of
from app.plans.zones import PlanZone, RemovedBone
from vfix_engine.control import ControlSettings

SAME_MM = 0.005
_SAME_DEG = 0.05


class _Named(Protocol):
    @property
    def id(self) -> str: ...


_Item = TypeVar("_Item", bound=_Named)


def changes(before: PlanContent, after: PlanContent) -> tuple[str, ...]:
    """Sentences, in the order of the panel; none where the two are the same.

    A robot's placement, which other edits drop by the way, is told where nothing else differs.
    A field without words of its own is told by its name.
    """
    found: list[str] = []
    for name in (*_WORDS, *(field.name for field in fields(after) if field.name not in _WORDS)):
        words = _WORDS.get(name)
        found += words(before, after) if words else _plain(name, getattr(before, name), getattr(after, name))
    if not found and before.robot != after.robot:
        found.append(f"The robot’s base is {'placed automatically' if after.robot['base'] is None else 'kept'}.")
    return tuple(found)


def _plain(name: str, was: Any, now: Any) -> Iterable[str]:
    if was == now:
        return
    words = name.replace("_", " ").capitalize()
    if all(isinstance(value, (str, int, float)) for value in (was, now)):
        old, new = (f"‘{value}’" if isinstance(value, str) else f"{value}" for value in (was, now))
        yield f"{words}: {new} instead of {old}."
    else:
        yield f"{words}: changed."


def _chosen(before: PlanContent, after: PlanContent) -> Iterable[str]:
    if before.path_id != after.path_id:
        yield f"Path ‘{after.path.name}’ is chosen instead of ‘{before.path.name}’."


def _robots(before: PlanContent, after: PlanContent) -> Iterable[str]:
    if (was := _robot(before)) != (now := _robot(after)):
        yield f"Robot: {now} instead of {was}."


def listed(
    before: Sequence[_Item],
    after: Sequence[_Item],
    words: Callable[[_Item], str],
    inside: Callable[[_Item, _Item], Iterable[str]],
) -> Iterable[str]:
    """What is gone, what is new, and what changed of the items that are in both, by id."""
    was, now = {item.id: item for item in before}, {item.id: item for item in after}
    yield from (f"{words(item)} is gone." for item in before if item.id not in now)
    yield from (f"{words(item)} is new." for item in after if item.id not in was)
    for item in after:
        if item.id in was:
            yield from (f"{words(item)}: {text}." for text in inside(was[item.id], item))
    if [one for one in was if one in now] != [one for one in now if one in was]:
        yield f"{words(after[0]).split(' ‘')[0]}s are in another order."


def _path(was: PlanPath, now: PlanPath) -> Iterable[str]:
    if was.name != now.name:
        yield f"renamed from ‘{was.name}’"
    if was.entry_side != now.entry_side:
        yield f"enters {now.entry_side or 'nowhere said'} instead of {was.entry_side or 'nowhere said'}"
    if (old := _tool(was)) != (new := _tool(now)):
        yield f"tool {new} instead of {old}"
    for sentence in listed(was.points, now.points, lambda point: f"point ‘{point.label}’", _point):
        yield sentence.rstrip(".")


def _point(was: PlanPoint, now: PlanPoint) -> Iterable[str]:
    if was.label != now.label:
        yield f"renamed from ‘{was.label}’"
    if (by := math.dist(was.position, now.position)) > SAME_MM:
        yield f"moved by {by:.1f} mm"
    if (was.direction is None) != (now.direction is None):
        yield "the shaft’s direction is left open" if now.direction is None else "the shaft’s direction is given"
    elif was.direction is not None and now.direction is not None:
        cosine = sum(a * b for a, b in zip(was.direction, now.direction, strict=True))
        angle = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
        if angle > _SAME_DEG:
            yield f"the shaft is turned by {angle:.1f}°"
    if was.roll_deg != now.roll_deg:
        yield f"roll {figure(now.roll_deg, '°')} instead of {figure(was.roll_deg, '°')}"


def _tool(path: PlanPath) -> str:
    title = next((tool.title for tool in shipped_tools() if tool.name == path.tool), path.tool)
    shape = [f"{value:g}{unit}" for name, unit in (("bend_deg", "°"), ("shaft_radius_mm", " mm"))
             if (value := path.tool_shape.get(name)) is not None]  # fmt: skip
    return f"{title} ({', '.join(shape)})" if shape else title


def _robot(content: PlanContent) -> str:
    name = content.robot["name"]
    return next((robot.title for robot in shipped_robots() if robot.name == name), name)


def _zone(was: PlanZone, now: PlanZone) -> Iterable[str]:
    yield from _region(was, now)
    if was.kind != now.kind:
        yield f"{now.kind} instead of {was.kind}"
    for what, unit, old, new in (
        ("margin", " mm", was.margin_mm, now.margin_mm),
        ("stiffness", " N/mm", was.stiffness_n_per_mm, now.stiffness_n_per_mm),
        ("greatest depth", " mm", was.max_depth_mm, now.max_depth_mm),
    ):
        if old != new:
            yield f"{what} {figure(new, unit)} instead of {figure(old, unit)}"
    if was.colour != now.colour:
        yield "another colour"
    if was.visible != now.visible:
        yield "shown" if now.visible else "hidden"


def _region(was: PlanZone | RemovedBone, now: PlanZone | RemovedBone) -> Iterable[str]:
    if was.name != now.name:
        yield f"renamed from ‘{was.name}’"
    if was.shape == now.shape:
        return
    if was.shape["kind"] != now.shape["kind"]:
        yield f"a {now.shape['kind']} instead of a {was.shape['kind']}"
        return
    told = False
    if (old := size_of(was.shape)) != (new := size_of(now.shape)):
        yield f"size {_sizes(new)} instead of {_sizes(old)}"
        told = True
    here, there = anchor(was.shape), anchor(now.shape)
    if here is not None and there is not None and (by := math.dist(here, there)) > SAME_MM:
        yield f"moved by {by:.1f} mm"
        told = True
    if not told:
        yield "another shape"


def _second(was: SecondVolume | None, now: SecondVolume | None) -> Iterable[str]:
    """Where two contents lay something over the head, how; names of heads are not part of a plan."""
    if was is None or now is None:
        if was != now:
            yield f"A second volume is {'laid over the head' if was is None else 'not laid over the head any more'}."
        return
    if (was.case, was.volume) != (now.case, now.volume):
        yield "Another second volume is laid over the head."
    if was.transform != now.transform:
        yield "The second volume lies elsewhere."
    if was.opacity != now.opacity:
        yield f"Opacity of the second volume: {100 * now.opacity:.0f} % instead of {100 * was.opacity:.0f} %."
    if (was.window, was.level) != (now.window, now.level):
        yield "The second volume has other grey values."


def _registration(was: str | None, now: str | None) -> Iterable[str]:
    """Names of registrations are not part of a plan."""
    if was == now:
        return
    if now is None:
        yield "The plan uses no registration any more."
    else:
        yield "The plan uses a registration." if was is None else "The plan uses another registration."


def _settings(before: Mapping[str, float], after: Mapping[str, float]) -> Iterable[str]:
    known = {**ControlSettings().to_dict()}
    for name in dict.fromkeys([*before, *after]):
        old, new = (values.get(name, known.get(name)) for values in (before, after))
        if old != new:
            label, unit = _SETTINGS.get(name, (name, ""))
            yield f"{label}: {figure(new, unit)} instead of {figure(old, unit)}."


_SETTINGS = {"margin_mm": ("Safety margin", " mm"), "view_distance_mm": ("View distance", " mm")}


def _sizes(sizes: Sequence[float]) -> str:
    return " × ".join(f"{size:g}" for size in sizes) + " mm"


def figure(value: Any, unit: str) -> str:
    return "left open" if value is None else f"{value:g}{unit}".replace("-", "−")


_WORDS: Mapping[str, Callable[[PlanContent, PlanContent], Iterable[str]]] = {
    "paths": lambda was, now: listed(was.paths, now.paths, lambda path: f"Path ‘{path.name}’", _path),
    "path_id": _chosen,
    "targets": lambda was, now: listed(was.targets, now.targets, lambda point: f"Target ‘{point.label}’", _point),
    "robot": _robots,
    "zones": lambda was, now: listed(was.zones, now.zones, lambda zone: f"Protected structure ‘{zone.name}’", _zone),
    "removed_bone": lambda was, now: listed(
        was.removed_bone, now.removed_bone, lambda bone: f"Bone to be removed ‘{bone.name}’", _region
    ),
    "settings": lambda was, now: _settings(was.settings, now.settings),
    "second_volume": lambda was, now: _second(was.second_volume, now.second_volume),
    "registration": lambda was, now: _registration(was.registration, now.registration),
    "notes": lambda was, now: () if was.notes == now.notes else ("The notes were changed.",),
}
