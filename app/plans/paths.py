"""The paths of a plan: each with its points, its tool and the side where it enters. One of them is the chosen one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple, Protocol, get_args

from app.kit.names import check_stored_name
from app.kit.values import Position, check_id, number
from app.plans.points import PlanPoint, check_point
from vfix_engine.errors import PlanError

DEFAULT_TOOL = "bent_30"
TOOL_SHAPE = ("bend_deg", "shaft_radius_mm")
PATH = "Path"  # what a path is called, before its number
FIRST_PATH, FIRST_NAME = "path-1", f"{PATH} 1"  # of a plan that never had another one
MAX_PATHS = 32
EntrySide = Literal["", "left", "right", "midline"]  # of the patient; '' where the plan does not say
_BESIDE_MM = 2.0  # an entry farther on the other side of the midline contradicts its side
_AT_TARGET_MM = 0.5  # a path that ends nearer to a target ends at it


class Labelled(Protocol):
    """A point or target."""

    @property
    def id(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def position(self) -> Position: ...


@dataclass(frozen=True)
class PlanPath:
    """One way into the head. Its points lead from outside to inside; tool and tool_shape are as those of a plan."""

    id: str = FIRST_PATH
    name: str = FIRST_NAME
    points: tuple[PlanPoint, ...] = ()
    tool: str = DEFAULT_TOOL
    tool_shape: Mapping[str, float] = field(default_factory=dict)
    entry_side: EntrySide = ""


@dataclass(frozen=True)
class Midplane:
    """The plane between the left and the right half of a head, in LPS mm.

    point: on it. left: unit vector across it, to the patient's left. known_from: a phrase on where it is known from.
    """

    point: Position
    left: Position
    known_from: str

    def left_mm(self, place: Position) -> float:
        """How far to the patient's left of it a place lies, negative to the right."""
        return sum((a - b) * across for a, b, across in zip(place, self.point, self.left, strict=True))


def side_caution(path: PlanPath, midplane: Midplane) -> str:
    """A sentence where a path is said to enter on the side of the patient that its entry does not lie on; else ''.

    The entry is the first point.
    """
    if path.entry_side not in ("left", "right") or not path.points:
        return ""
    left_mm, other = midplane.left_mm(path.points[0].position), "right" if path.entry_side == "left" else "left"
    if (left_mm if other == "left" else -left_mm) <= _BESIDE_MM:
        return ""
    return (
        f"Entry is {abs(left_mm):.1f} mm {other} of the midline, not on the {path.entry_side}. "
        f"Check the side; the midline is {midplane.known_from}."
    )


def ends_words(points: Sequence[PlanPoint], targets: Sequence[PlanPoint]) -> str:
    """A sentence on how far before the nearest target a path ends; '' without a path or a target."""
    if (end := path_end(points, targets)) is None:
        return ""
    name = f"the target ‘{end.target.label}’" if len(targets) == 1 else f"the nearest target, ‘{end.target.label}’"
    return f"The path ends {end.short_mm:.1f} mm before {name}." if end.short_mm else f"The path ends at {name}."


class PathEnd(NamedTuple):
    """The target nearest to the end of a path, and how far before it that is, 0 where the path ends at it."""

    target: Labelled
    short_mm: float


def path_end(points: Sequence[Labelled], targets: Sequence[Labelled]) -> PathEnd | None:
    """Return where a path ends among targets; None without a path or a target."""
    if len(points) < 2 or not targets:
        return None
    away, _, target = min(
        ((math.dist(points[-1].position, one.position), one.label, one) for one in targets), key=lambda found: found[:2]
    )
    return PathEnd(target, away if away > _AT_TARGET_MM else 0.0)


def check_paths(paths: Sequence[PlanPath]) -> tuple[PlanPath, ...]:
    """The paths, whose names, tools and sides are checked. Raises InputError or one of its kinds."""
    for what, values in (("identifier", [p.id for p in paths]), ("name", [p.name for p in paths])):
        if len(set(values)) != len(values):
            raise PlanError(f"two paths of a plan have the same {what}.")
    return tuple(_checked(path) for path in paths)


def _checked(path: PlanPath) -> PlanPath:
    check_id(path.id, "a path")
    check_stored_name(path.name, "path's name")
    check_word(path.tool, "tool")
    return replace(
        path,
        points=tuple(check_point(point) for point in path.points),
        tool_shape=check_tool_shape(path.tool_shape),
        entry_side=check_side(path.entry_side),
    )


def check_side(side: Any) -> EntrySide:
    """Raises PlanError."""
    for known in get_args(EntrySide):
        if side == known:
            return known  # type: ignore[no-any-return]
    raise PlanError(f"the side of an entry is {str(side)!r:.20}; say left, right, midline or nothing.")


def check_tool_shape(shape: Any) -> dict[str, float]:
    """A tool's changed bend and radius, by name. Raises PlanError."""
    if not isinstance(shape, Mapping) or set(shape) - set(TOOL_SHAPE):
        raise PlanError(f"a tool's shape has {' and '.join(TOOL_SHAPE)}.")
    return {name: number(shape[name], f"the tool's {name}") for name in TOOL_SHAPE if name in shape}


def check_word(text: Any, what: str) -> None:
    """Names of shipped robots and tools: never a path."""
    check_stored_name(text, f"{what}'s name")
    if not all(c.isalnum() or c in "_-" for c in text):
        raise PlanError(f"the {what}'s name may hold letters, digits, '_' and '-' only.")


def new_path_name(paths: Sequence[PlanPath], named: str = PATH) -> str:
    """'Path 2' and so on: the first that no path has. named: the word before the number."""
    taken = {path.name for path in paths}
    return next(name for n in range(1, len(paths) + 2) if (name := f"{named} {n}") not in taken)
