"""The verdict on a path: whether the tool fits among bone, what soft tissue it presses, and where."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from app.services.case_model import Case
from app.services.piercing import NOT_KNOWN, Pierced
from app.services.soft_depths import SoftDepth, soft_depths
from vfix_engine.fixtures import Zone
from vfix_engine.fixtures.zone_file import ZoneSet
from vfix_engine.fixtures.zones import SHAPES
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.distance_field import DistanceField
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.proximity import ProximityTree
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.tool_depth import ToolDepth, axis_samples, tool_depth
from vfix_engine.robots import Tool
from vfix_engine.simulation.dry_run import STATION_MM, TIGHT_MM, DryRun

Floats = npt.NDArray[np.float64]
Level = Literal["fits", "tight", "pierces", "blocked", "unknown"]
Reason = Literal[
    "clear", "spent", "margin", "surface", "registration", "registration_unknown", "scan_ends", "held",
    "pierced", "wall",
]  # fmt: skip
TissueLevel = Literal["none", "pressed", "deep", "unknown"]

NOSTRIL_MM = 20.0  # of the entry: vestibule and rim of the nose, which give way further than mucosa
DEEP_MM = 3.0  # of soft tissue, assumed: what is deeper is told as deep
_SHORT_MM = 0.5  # a shorter length is not told in figures
_WORTH_DEPTH_MM = 0.05  # a smaller depth in a soft structure is not told in words
_WORTH_SAYING_MM = 0.005  # of a margin, in hundredths of a mm
_NONE_SPARED = ZoneSet()

IN_SHORT: dict[Reason, str] = {
    "clear": "Fits",
    "spent": "Fits, but the registration may use up the margin",
    "margin": f"Tight: within {TIGHT_MM:g} mm of the margin",
    "surface": "Fits the surface only: bone may be nearer",
    "registration": "Tight: the registration may be off by more than the clearance",
    "registration_unknown": "Not known: nothing tells how far the registration may be off",
    "scan_ends": "Not known: the scan ends beside the tool",
    "held": "Blocked",
    "pierced": "Blocked: the tool pierces skin",
    "wall": "Pierces a wall between two airs of the body",
}  # what the bar says: the head of the verdict, with the reason that decided its level


class Part(NamedTuple):
    """A piece of a sentence, and the arc length of the tip that it is about, None where it is about no place."""

    words: str
    s_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Profile:
    """The dry run at one pose for every 0.5 mm of the path; lengths in mm.

    s (n,): of the tip. clearance (n,): of the whole tool to bone. rows (n,): of the dry run.
    zones: the hard structures to spare, and zone_clearance (Z, n) of the whole tool to each. soft: the soft ones that
    it touches.
    tissue: the tool in soft tissue; None without a CT.
    off_mm (n,): what the registration is off by at the tip, 95 of 100 times at most; None without a registration, or
    where that is not known. off_unknown: there is a registration, and its error is not known.
    """

    s: Floats
    clearance: Floats
    rows: npt.NDArray[np.intp]
    tissue: ToolDepth | None
    zones: tuple[Zone, ...] = ()
    zone_clearance: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    soft: tuple[SoftDepth, ...] = ()
    off_mm: Floats | None = None
    off_unknown: bool = False


class Doubt(NamedTuple):
    """Where the registration leaves least: its error, clearance and margin in mm, what is near, and s_mm of the tip."""

    off_mm: float
    clearance_mm: float
    margin_mm: float
    nearest: str
    s_mm: float

    @property
    def left_mm(self) -> float:
        """Of the clearance, where the registration is off by that much; negative where it may touch."""
        return self.clearance_mm - self.off_mm


@dataclass(frozen=True)
class Verdict:
    """What a dry run says of a path; lengths in mm.

    level: from bone and reach: 'tight' is within 0.2 mm of the margin, or nearer than the registration's error (95 %)
    or than the scan tells where bone is,
    'unknown' that the scan ends beside the tool, or that nothing is known of the registration's error;
    'blocked' that bone holds the tool or that it pierces tissue from the room's air, 'pierces' a wall within the body.
    nearest, part: names of the structure and of the part of the tool at the least clearance, and s_mm of the tip there.
    tissue_mm: largest length of the tool whose surface is in soft tissue, nostril_mm the share of it within 20 mm of
    the entry; tissue_depth_mm: the greatest depth, and tissue_s_mm of the tip there. None without a CT.
    parts: the verdict in words. soft: the soft structures to spare that the tool touches, the deepest touched first.
    doubt: where the registration leaves it open whether the tool is clear, at the worst such place; None elsewhere.
    pierced: what of skin and walls the tool goes through.
    reason: what decided the level; 'spent' fits, though the registration's error leaves less than the margin.
    """

    level: Level
    tissue_level: TissueLevel
    least_clearance_mm: float
    nearest: str
    part: str
    s_mm: float
    tissue_mm: float | None
    nostril_mm: float | None
    tissue_depth_mm: float | None
    tissue_s_mm: float | None
    parts: tuple[Part, ...]
    soft: tuple[SoftDepth, ...] = ()
    doubt: Doubt | None = None
    reason: Reason = "clear"
    pierced: Pierced = NOT_KNOWN

    @property
    def short(self) -> str:
        """The verdict in a few words, with its reason."""
        return IN_SHORT[self.reason]

    @property
    def words(self) -> str:
        """The verdict as text."""
        return "".join(part.words for part in self.parts)


def profile_of(
    run: DryRun,
    tool: Tool,
    path: SplinePath,
    tissue: DistanceField | None,
    spared: ZoneSet = _NONE_SPARED,
    off_mm: Callable[[Floats], Floats | None] | None = None,
) -> Profile:
    """The dry run at one pose for every 0.5 mm; each with the least bone clearance of the poses around it.

    off_mm: of the registration that the path is driven through: what it may be off by (n,) at places (n, 3) of the
    image, 95 of 100 times at most, or None where that is not known.
    """
    stations = np.rint(run.s / STATION_MM)
    _, rows, group = np.unique(stations, return_index=True, return_inverse=True)
    least = np.full(len(rows), np.inf)
    np.minimum.at(least, group, run.clearance)
    start, end, pressed = run.segments_start[rows], run.segments_end[rows], None
    if tissue is not None:
        pressed = tool_depth(tissue, start, end, tool.radius, path.position(0.0), NOSTRIL_MM)
    away = np.array([_zone_clearance(zone, start, end, tool.radius) for zone in spared.zones])
    soft = soft_depths(run, rows, tool, spared.soft_zones)
    off = None if off_mm is None else off_mm(run.tip[rows])
    unknown = off_mm is not None and off is None
    return Profile(run.s[rows], least, rows, pressed, spared.zones, away.reshape(-1, len(rows)), soft, off, unknown)


def _zone_clearance(zone: Zone, start: Floats, end: Floats, radius: Floats) -> Floats:
    """Clearance (n,) of the tool to a zone; to a shape from samples of its axis, at most 0.03 mm too large."""
    solid = zone.solid
    if isinstance(solid, SHAPES):
        points, _, segment = axis_samples(start, end)
        away = signed_distance(solid, points.reshape(-1, 3)).reshape(points.shape[:2]) - radius[segment]
        least: Floats = away.min(axis=1)
        return least
    return np.array([solid.closest(Segments(a, b, radius)).distance for a, b in zip(start, end, strict=True)])


def verdict_of(
    run: DryRun,
    profile: Profile,
    tool: Tool,
    tree: ProximityTree,
    case: Case,
    margin_mm: float,
    complete: bool,
    pierced: Pierced = NOT_KNOWN,
) -> Verdict:
    """The verdict on a dry run.

    margin_mm: kept from bone. complete: the scan holds all of the tissue beside the tool.
    """
    least, s_mm, part, nearest, kept_mm = _nearest(run, profile, tool, tree, case, margin_mm)
    off = case.uncertainty.off_mm if nearest in case.structure_names().values() else -np.inf
    worst = _worst(profile, case.structure_names()[case.anatomy.id], margin_mm)
    near = least < kept_mm + TIGHT_MM
    reason = _reason(run, profile, worst, least <= off, near, complete or not case.has_volume, pierced)
    level = _LEVELS[reason]
    found = profile.tissue
    longest, deepest = (0, 0) if found is None else (int(found.length.argmax()), int(found.depth.argmax()))
    length = None if found is None else float(found.length[longest])
    depth = None if found is None else float(found.depth[deepest])
    at_nostril = None if found is None else float(found.near_length[longest])
    deepest_s = None if found is None else float(profile.s[deepest])
    margin = _margin_words(kept_mm, margin_mm, case) if near else ""
    parts = (
        *_pierced_parts(pierced, before=True),
        *_bone_parts(run, level, least, nearest, part, s_mm, off, margin),
        *_doubt_parts(worst, profile.off_unknown),
        *_soft_parts(profile.soft),
        *_tissue_parts(length, at_nostril, depth, deepest_s, complete),
        *_pierced_parts(pierced, before=False),
    )
    return Verdict(
        level, tissue_level(length, depth, complete), least, nearest, part, s_mm, length, at_nostril, depth, deepest_s,
        parts, profile.soft, worst if worst is not None and worst.left_mm < 0.0 else None, reason, pierced,
    )  # fmt: skip


_LEVELS: dict[Reason, Level] = {
    "clear": "fits", "spent": "fits", "margin": "tight", "surface": "tight", "registration": "tight",
    "registration_unknown": "unknown", "scan_ends": "unknown", "held": "blocked",
    "pierced": "blocked", "wall": "pierces",
}  # fmt: skip


def _reason(
    run: DryRun, profile: Profile, worst: Doubt | None, surface: bool, near: bool, complete: bool, pierced: Pierced
) -> Reason:
    """What decides the level, the gravest first."""
    found: tuple[tuple[bool, Reason], ...] = (
        (not run.completed, "held"),
        (pierced.state == "room", "pierced"),
        (pierced.state == "wall", "wall"),
        (surface, "surface"),
        (worst is not None and worst.left_mm < 0.0, "registration"),
        (near, "margin"),
        (profile.off_unknown, "registration_unknown"),
        (not complete, "scan_ends"),
        (worst is not None and worst.left_mm < worst.margin_mm, "spent"),
    )
    return next((reason for applies, reason in found if applies), "clear")


def _worst(profile: Profile, bone: str, margin_mm: float) -> Doubt | None:
    """Where the registration's error leaves least of a clearance; None where it is not known or there is none.

    A place where it exceeds the clearance goes before one where it leaves less than the margin.
    """
    if profile.off_mm is None:
        return None
    left = np.vstack([profile.clearance, profile.zone_clearance]) - profile.off_mm
    margins = np.array([margin_mm, *(zone.margin_mm for zone in profile.zones)])
    over = left if (left < 0.0).any() else left - margins[:, None]
    index, at = np.unravel_index(int(over.argmin()), over.shape)
    off_mm, name = float(profile.off_mm[at]), (bone, *(zone.name for zone in profile.zones))[index]
    return Doubt(off_mm, float(left[index, at]) + off_mm, float(margins[index]), name, float(profile.s[at]))


def _nearest(
    run: DryRun, profile: Profile, tool: Tool, tree: ProximityTree, case: Case, margin_mm: float
) -> tuple[float, float, str, str, float]:
    """The structure that leaves least above its margin: clearance, arc length, part of the tool, name, and margin."""
    row = int(run.clearance.argmin())
    if profile.zones:
        slack = profile.zone_clearance - np.array([zone.margin_mm for zone in profile.zones])[:, None]
        index, at = np.unravel_index(int(slack.argmin()), slack.shape)
        if slack[index, at] < run.clearance[row] - margin_mm:
            zone, pose = profile.zones[int(index)], int(profile.rows[at])
            part = tool.segment_names[_nearest_segment(zone, run, pose, tool)]
            least = float(profile.zone_clearance[index, at])
            return least, float(run.s[pose]), part, zone.name, zone.margin_mm
    pair = tree.closest(Segments(run.segments_start[row], run.segments_end[row], tool.radius))
    part, name = tool.segment_names[pair.segment], case.structure_names()[case.anatomy.id]
    return float(run.clearance[row]), float(run.s[row]), part, name, margin_mm


def _nearest_segment(zone: Zone, run: DryRun, row: int, tool: Tool) -> int:
    """The part of the tool that is nearest to a zone in one pose."""
    start, end = run.segments_start[row : row + 1], run.segments_end[row : row + 1]
    each = [_zone_clearance(zone, start[:, [s]], end[:, [s]], tool.radius[[s]])[0] for s in range(len(tool.radius))]
    return int(np.argmin(each))


def tissue_level(length: float | None, depth: float | None, complete: bool) -> TissueLevel:
    """How a tool presses soft tissue that it is in along a length and to a depth in mm, None where not known."""
    if length is None or depth is None:
        return "unknown"
    if depth > DEEP_MM:
        return "deep"
    if length >= _SHORT_MM:
        return "pressed"
    return "none" if complete else "unknown"


def _bone_parts(
    run: DryRun, level: Level, least: float, nearest: str, part: str, s_mm: float, off_mm: float, margin: str
) -> tuple[Part, ...]:
    at = (Part(f"{nearest} {least:.2f} mm ({part}, "), Part(f"at {s_mm:.0f} mm", s_mm))
    if not run.completed:
        reached = Part(f"at {run.reached_mm:.0f} of {run.length_mm:.0f} mm", run.reached_mm)
        return (Part("Blocked "), reached, Part(f": {run.reason}. Least clearance on the way: "), *at, Part(")."))
    if least <= off_mm:
        doubt = f"), and {nearest} may lie {off_mm:.2f} mm off its surface."
        return (Part("Fits the surface only: "), *at, Part(doubt))
    if level == "tight":
        return (Part("Tight: "), *at, Part(f"), with {margin}." if margin else ")."))
    if level in ("blocked", "pierces"):  # said before, by what it pierces
        return (Part(" Clear of bone: "), *at, Part(")."))
    return (Part("Not known whether it fits: " if level == "unknown" else "Fits: "), *at, Part(")."))


def _pierced_parts(pierced: Pierced, before: bool) -> tuple[Part, ...]:
    """What is pierced, said before all else; that it is not known, after it."""
    if not pierced.words or before != (pierced.state in ("room", "wall")):
        return ()
    if not before:
        return (Part(f" {pierced.words}"),)
    head = "Blocked. " if pierced.state == "room" else ""
    return (Part(f"{head}{pierced.words.rstrip('.')} ("), Part(f"at {pierced.s_mm:.0f} mm", pierced.s_mm), Part(")."))


def _doubt_parts(worst: Doubt | None, unknown: bool) -> tuple[Part, ...]:
    if unknown:
        return (Part(" How far the registration may be off is not known."),)
    if worst is None or worst.left_mm >= worst.margin_mm:
        return ()
    at = Part(f"at {worst.s_mm:.0f} mm", worst.s_mm)
    if worst.left_mm < 0.0:
        return (
            Part(f" The registration may be off by {worst.off_mm:.2f} mm (95 %) "),
            at,
            Part(f", more than the {max(worst.clearance_mm, 0.0):.2f} mm to {worst.nearest}."),
        )
    return (
        Part(f" With what the registration may be off by (95 %), {worst.left_mm:.2f} mm to {worst.nearest} are left "),
        at,
        Part(f", less than the margin of {worst.margin_mm:.2f} mm."),
    )


def _margin_words(kept_mm: float, bone_mm: float, case: Case) -> str:
    """The margin of what is nearest, and the share of it that is there for the scan: that makes a path tight too."""
    added = case.uncertainty.added_mm if kept_mm == bone_mm else 0.0
    scan = f", {added:.2f} mm of it since the scan’s surface may be that far off" if added >= _WORTH_SAYING_MM else ""
    return f"a margin of {kept_mm:.2f} mm{scan}"


def _soft_parts(soft: Sequence[SoftDepth]) -> tuple[Part, ...]:
    told = [one for one in soft if one.depth_mm >= _WORTH_DEPTH_MM]
    parts = list[Part]()
    for first, one in zip([True] + [False] * len(told), told, strict=False):
        parts.append(Part(f"{' Goes ' if first else ', '}{one.depth_mm:.1f} mm deep into {one.name} ("))
        parts += [Part(f"at {one.s_mm:.0f} mm", one.s_mm), Part(")")]
    return (*parts, Part(".")) if told else ()


def _tissue_parts(
    length: float | None, at_nostril: float | None, depth: float | None, s_mm: float | None, complete: bool
) -> tuple[Part, ...]:
    if length is None or at_nostril is None or depth is None or s_mm is None:
        return (Part(" Soft tissue is not known: no CT shows the tool's path."),)
    beyond = "" if complete else " The scan ends in tissue beside the tool; what lies there is not known."
    if length < _SHORT_MM:
        return (Part(f" Presses no soft tissue.{beyond}"),)
    share = "all" if at_nostril > length - _SHORT_MM else f"{at_nostril:.0f} mm"
    nostril = f"; {share} of it at the nostril" if at_nostril >= _SHORT_MM else ""
    at_least = "" if complete else "at least "
    return (
        Part(f" Presses soft tissue along {at_least}{length:.0f} mm of the tool, {depth:.1f} mm deep at most ("),
        Part(f"at {s_mm:.0f} mm", s_mm),
        Part(f"){nostril}.{beyond}"),
    )
