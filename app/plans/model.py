"""A plan as a value: its paths, targets, zones, robot placement and settings, all in LPS mm."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from app.cases.second_volume import SecondVolume, check_second
from app.documents import Document, read_as, written
from app.kit.errors import TooLarge
from app.kit.names import MAX_TEXT, check_text
from app.kit.values import check_id
from app.plans.paths import (
    DEFAULT_TOOL,
    FIRST_NAME,
    FIRST_PATH,
    MAX_PATHS,
    EntrySide,
    PlanPath,
    check_paths,
    check_tool_shape,
)
from app.plans.points import PlanPoint, check_point, new_point_id
from app.plans.robot import DEFAULT_ROBOT, check_robot, unplaced_robot, without_placement
from app.plans.shapes import check_least
from app.plans.zones import PlanZone, RemovedBone, check_removed, check_zones
from vfix_engine.control import ControlSettings
from vfix_engine.control.settings import RETIRED
from vfix_engine.errors import PlanError

__all__ = [
    "DEFAULT_ROBOT",
    "DEFAULT_TOOL",
    "FRAME",
    "MAX_NOTES",
    "MAX_POINTS",
    "NOTICE",
    "SCHEMA",
    "UNIT",
    "Plan",
    "PlanContent",
    "PlanFile",
    "PlanPath",
    "PlanPoint",
    "PlanZone",
    "RemovedBone",
    "check_content",
    "check_registration_id",
    "check_robot",
    "check_size",
    "check_stored",
    "check_tool_shape",
    "content_from_json",
    "content_to_json",
    "drive_parts",
    "driven_hash",
    "new_point_id",
    "unplaced_robot",
    "without_placement",
]

SCHEMA = "vfix-plan/1"  # of files
FRAME, UNIT = "LPS", "mm"
NOTICE = "Not for clinical use"
MAX_POINTS = 300  # of path points of each path, and of targets
MAX_NOTES = MAX_TEXT  # [characters]
_OF_CHOSEN = ("points", "tool", "tool_shape")  # of the chosen path, what a plan's JSON has itself


@dataclass(frozen=True, kw_only=True)
class PlanContent:
    """What undo and redo go back and forth over, and what a file of a plan carries.

    paths: every path, in the order of the list; path_id: of the chosen one, which is edited and driven. No path at all
    is an empty one.
    robot: name, base (16 numbers, row by row, transform_base_to_patient [mm]) or None, and q_start ([mm], [rad]) or
    None; of a URDF of one's own also its SHA-256 as 'urdf' and the link that holds the tool as 'tool_frame'.
    A placement is that of the chosen path.
    settings: those of the controller that differ from its defaults, by field name.
    zones: protected structures; removed_bone: bone that is taken away first. Both are of every path.
    notes: what the planner writes down, in lines.
    second_volume: what is laid over the head's slices; None for nothing.
    registration: id of the registration that says how the image lies on the patient; None for none.
    """

    targets: tuple[PlanPoint, ...] = ()
    robot: Mapping[str, Any] = field(default_factory=unplaced_robot)
    settings: Mapping[str, float] = field(default_factory=dict)
    path_id: str = FIRST_PATH
    paths: tuple[PlanPath, ...] = ()
    zones: tuple[PlanZone, ...] = ()
    removed_bone: tuple[RemovedBone, ...] = ()
    notes: str = ""
    second_volume: SecondVolume | None = None
    registration: str | None = None

    def __post_init__(self) -> None:
        if not self.paths:
            name = FIRST_NAME if self.path_id == FIRST_PATH else self.path_id
            object.__setattr__(self, "paths", (PlanPath(self.path_id, name),))
        elif self.path_id not in [path.id for path in self.paths]:
            raise PlanError(f"there is no path {self.path_id!r:.80} in this plan.")

    @property
    def path(self) -> PlanPath:
        """The chosen path."""
        return next(path for path in self.paths if path.id == self.path_id)

    @property
    def points(self) -> tuple[PlanPoint, ...]:
        """The points of the chosen path, from outside to inside."""
        return self.path.points

    @property
    def tool(self) -> str:
        """The name of the chosen path's tool, a shipped one."""
        return self.path.tool

    @property
    def tool_shape(self) -> Mapping[str, float]:
        """The 'bend_deg' and 'shaft_radius_mm' of the chosen path's tool where they are not the shipped ones."""
        return self.path.tool_shape

    @property
    def entry_side(self) -> EntrySide:
        """Where the chosen path enters."""
        return self.path.entry_side

    def with_points(self, points: Sequence[PlanPoint]) -> PlanContent:
        """The content with other points of the chosen path; a placement that belonged to the old ones is dropped."""
        return self._with_path(replace(self.path, points=tuple(points)))

    def with_tool(self, tool: str, tool_shape: Mapping[str, float] | None = None) -> PlanContent:
        """The content with another tool of the chosen path; a placement, which was made for the old one, is dropped."""
        content = self._with_path(replace(self.path, tool=tool, tool_shape=dict(tool_shape or {})))
        return content.without_placement()

    def with_paths(self, paths: Sequence[PlanPath], path_id: str) -> PlanContent:
        """The content with other paths, of which one is chosen; a placement of another way is dropped."""
        content = replace(self, paths=tuple(paths), path_id=path_id)
        return content if _way(content.path) == _way(self.path) else content.without_placement()

    def along(self, name: str) -> PlanContent:
        """The content with the path of that id or name chosen; its robot has a placement for the chosen one only.

        Raises PlanError where there is no such path.
        """
        wanted = [path for path in self.paths if name in (path.id, path.name)]
        if not wanted:
            known = ", ".join(repr(path.name) for path in self.paths)
            raise PlanError(f"there is no path {name!r:.80} in this plan; it has {known}.")
        return self.with_paths(self.paths, wanted[0].id)

    def without_placement(self) -> PlanContent:
        """The content whose robot gets a placement when the plan is driven."""
        return replace(self, robot=without_placement(self.robot))

    def _with_path(self, changed: PlanPath) -> PlanContent:
        return self.with_paths([changed if path.id == changed.id else path for path in self.paths], self.path_id)


Plan = Document[PlanContent]


@dataclass(frozen=True)
class PlanFile:
    """A plan as it comes out of a file: no place in a store yet. case_hash is None where the format carries none.

    urdf: that of a robot of one's own, where the file carries it. notes: what its reader took for granted.
    """

    name: str
    content: PlanContent
    case_hash: str | None = None
    urdf: bytes | None = None
    notes: tuple[str, ...] = ()


def _way(path: PlanPath) -> tuple[Any, ...]:
    """What of a path a robot is placed for."""
    held = [(point.position, point.direction, point.roll_deg) for point in path.points]
    return held, path.tool, dict(path.tool_shape)


def drive_parts(content: PlanContent) -> list[Any]:
    """What a drive along the chosen path depends on, as JSON values: equal for plans that are driven alike.

    Names count, since a drive says what blocks it; labels, colours, notes and the other paths do not.
    """
    zones = [{k: v for k, v in vars(zone).items() if k not in ("id", "colour", "visible")} for zone in content.zones]
    return [
        content.tool,
        dict(content.tool_shape),
        dict(content.robot),
        dict(content.settings),
        [point.position for point in content.points],
        [[point.direction, point.roll_deg] for point in content.points],
        zones,
        [dict(region.shape) for region in content.removed_bone],
    ]


def driven_hash(content: PlanContent) -> str:
    """SHA-256 of what a trainee is given: path, targets, tool, robot, zones and removed bone.

    Where the robot stands and the settings of hand and margin do not count: they are chosen for a drive.
    """
    given = replace(content, settings={}, robot=without_placement(content.robot))
    parts = drive_parts(given), [target.position for target in content.targets]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def check_content(content: PlanContent) -> PlanContent:
    """The content of a new plan: checked like a stored one, and for the number of its points and least sizes as well.

    Raises InputError or one of its kinds.
    """
    checked = check_stored(check_size(content))
    regions: tuple[PlanZone | RemovedBone, ...] = (*checked.zones, *checked.removed_bone)
    for region in regions:
        check_least(region.shape, repr(region.name))
    return checked


def check_size(content: PlanContent) -> PlanContent:
    """The content, where it has no more points and paths than a plan may have. Raises TooLarge."""
    listed = [(path.points, "path points") for path in content.paths]
    for points, what in (*listed, (content.targets, "targets")):
        if len(points) > MAX_POINTS:
            raise TooLarge(f"{len(points)} {what} are too many; a plan has {MAX_POINTS} at most. Keep every nth.")
    if len(content.paths) > MAX_PATHS:
        raise TooLarge(f"{len(content.paths)} paths are too many; a plan has {MAX_PATHS} at most.")
    return content


def check_stored(content: PlanContent) -> PlanContent:
    """The content as it is read once it is stored. Raises InputError or one of its kinds."""
    return content_from_json(content_to_json(content))


def _with_rules(content: PlanContent) -> PlanContent:
    """What types cannot say; without settings that are retired. Raises InputError or one of its kinds."""
    points = [point for path in content.paths for point in path.points] + list(content.targets)
    if len({point.id for point in points}) != len(points):
        raise PlanError("two points have the same identifier.")
    ControlSettings.from_dict(dict(content.settings))
    check_id(content.path_id, "a path")
    return replace(
        content,
        targets=tuple(check_point(point) for point in content.targets),
        robot=check_robot(content.robot),
        settings={name: value for name, value in content.settings.items() if name not in RETIRED},
        paths=check_paths(content.paths),
        zones=check_zones(content.zones),
        removed_bone=check_removed(content.removed_bone),
        notes=check_text(content.notes, "notes", MAX_NOTES),
        second_volume=check_second(content.second_volume),
        registration=check_registration_id(content.registration),
    )


def check_registration_id(value: Any) -> str | None:
    """Id of a registration; None stays None. Raises PlanError."""
    return None if value is None else check_id(value, "a registration")


def content_to_json(content: PlanContent) -> dict[str, Any]:
    """The content as plain JSON values, each number unrounded: its fields.

    'points', 'tool' and 'tool_shape' are the chosen path's, as in files from before there were several, and left out of
    its entry in 'paths'. What a point leaves open is left out.
    """
    data = written(content)
    for point in (*data["targets"], *(point for path in data["paths"] for point in path["points"])):
        for name in [name for name, value in point.items() if value is None]:
            del point[name]
    chosen = next(path for path in data["paths"] if path["id"] == content.path_id)
    own = {name: chosen.pop(name) for name in _OF_CHOSEN}
    return {"points": own.pop("points"), "targets": data.pop("targets"), **own, **data}


def content_from_json(data: Mapping[str, Any]) -> PlanContent:
    """The inverse of `content_to_json`: fields that are left out are as in an empty plan, other keys are not read.

    Raises InputError or one of its kinds.
    """
    path_id, paths = data.get("path_id", FIRST_PATH), data.get("paths", [])
    if paths == []:  # from before there were several
        paths = [{"id": path_id, "name": FIRST_NAME if path_id == FIRST_PATH else path_id}]
    values = {**data, "paths": [_path(path, path_id, data) for path in _objects(paths, "paths")]}
    values["targets"] = _points(data.get("targets", []), "targets")
    for name, of in (("zones", PlanZone), ("removed_bone", RemovedBone), ("second_volume", SecondVolume)):
        _check_keys(data.get(name), of, name)
    return _with_rules(read_as(PlanContent, values, PlanError))


def _path(path: Mapping[str, Any], path_id: Any, plan: Mapping[str, Any]) -> dict[str, Any]:
    """An entry of the JSON of paths, the chosen one with what stands in the plan's JSON itself."""
    if path.get("id") == path_id:
        if any(name in path for name in _OF_CHOSEN):
            raise PlanError("points and tool of the chosen path are those of the plan; leave them out of its 'paths'.")
        path = {**path, **{name: plan[name] for name in _OF_CHOSEN if name in plan}}
    return {**path, "points": _points(path.get("points", []), "points")}


def _points(points: Any, what: str) -> list[dict[str, Any]]:
    """JSON of points, those without an identifier or a label with one."""
    return [{"label": "", **one, "id": one.get("id") or new_point_id()} for one in _objects(points, what)]


def _objects(items: Any, what: str) -> list[Mapping[str, Any]]:
    if not isinstance(items, (list, tuple)) or not all(isinstance(item, Mapping) for item in items):
        raise PlanError(f"a plan's {what} must be a list of objects.")
    return list(items)


def _check_keys(data: Any, of: type[Any], what: str) -> None:
    """Raises PlanError for a key that is no field: it may be what keeps a tool away."""
    for item in data if isinstance(data, (list, tuple)) else [data]:
        if isinstance(item, Mapping) and (unknown := sorted(map(str, item.keys() - of.__dataclass_fields__.keys()))):
            raise PlanError(f"an entry of a plan's {what} has no '{unknown[0]:.40}'.")
