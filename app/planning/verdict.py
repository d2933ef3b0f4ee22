"""The verdict on a path: whether the tool fits among bone, what soft tissue it presses, and where.

It is computed once, in `Planning`; page, REST and command line report the same value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from app.cases.model import Case
from app.kit.values import Position
from app.planning.obstacles import Obstacle, nearest_part, structures_of
from app.planning.piercing import NOT_KNOWN, Pierced
from app.planning.soft_depths import SoftDepth, soft_depths
from app.planning.verdict_words import (
    SHORT_MM,
    Doubt,
    Stated,
    VerdictPhrase,
    doubt_parts,
    held_parts,
    nearest_parts,
    pierced_parts,
    soft_parts,
    stated_parts,
    surface_parts,
    tissue_parts,
)
from app.plans.model import Plan
from app.plans.paths import Midplane, ends_words, side_caution
from vfix_engine.arrays import Array
from vfix_engine.errors import StartRefused
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.fields.distance_field import DistanceField
from vfix_engine.proximity.fields.tool_depth import ToolDepth, tool_depth
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import Tool
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid.dry_run import STATION_MM, TIGHT_MM, DryRun

Level = Literal["fits", "tight", "pierces", "blocked", "unknown"]
Reason = Literal[
    "clear", "spent", "margin", "surface", "registration", "registration_unknown", "scan_ends", "side",
    "held", "refused", "pierced", "wall",
]  # fmt: skip
TissueLevel = Literal["none", "pressed", "deep", "unknown"]

NOSTRIL_MM = 20.0  # from the entry: vestibule and rim of the nose, which yield further than mucosa
DEEP_MM = 3.0  # in soft tissue, assumed: a greater depth is reported as deep
_NONE_PROTECTED = ZoneSet()

WORDS: dict[Level, str] = {
    "fits": "Fits", "tight": "Tight", "unknown": "Unknown", "blocked": "Blocked", "pierces": "Blocked",
}  # fmt: skip

_REASONS: dict[Reason, tuple[Level, str]] = {
    "clear": ("fits", ""),
    "spent": ("fits", ", but registration may use up the margin"),
    "margin": ("tight", ""),
    "surface": ("tight", ": bone may be nearer than shown"),
    "registration": ("tight", ": the registration error exceeds the clearance"),
    "registration_unknown": ("unknown", ": the registration error is not known"),
    "scan_ends": ("unknown", ": the scan ends beside the tool"),
    "side": ("unknown", ": the entry is on the other side"),
    "held": ("blocked", ""),
    "refused": ("blocked", " at the entry"),
    "pierced": ("blocked", ": the tool pierces skin"),
    "wall": ("pierces", ": the tool pierces a wall"),
}  # the level that a reason decides, and what follows its word
_LEVELS: dict[Reason, Level] = {reason: level for reason, (level, _) in _REASONS.items()}
IN_SHORT: dict[Reason, str] = {reason: f"{WORDS[level]}{why}" for reason, (level, why) in _REASONS.items()}
"""The head of the verdict by the reason that decided its level; every text of a verdict starts with it."""

_NOTHING_STATED = Stated()


@dataclass(frozen=True, eq=False)
class Profile:
    """The dry run at one pose for every 0.5 mm of the path; lengths in mm.

    s (n,): arc length of the tip. clearance (n,): from the whole tool to bone. rows (n,): rows of the dry run.
    structures: the hard protected structures, with the clearance of the whole tool to each. soft: the soft ones that
    the tool touches.
    tissue: the tool in soft tissue; None without a CT.
    off_mm (n,): 95 % bound of the registration error at the tip; None without a registration, or if it is not known.
    off_unknown: there is a registration whose error is not known.
    """

    s: Array
    clearance: Array
    rows: npt.NDArray[np.intp]
    tissue: ToolDepth | None
    structures: tuple[Obstacle, ...] = ()
    soft: tuple[SoftDepth, ...] = ()
    off_mm: Array | None = None
    off_unknown: bool = False

    def obstacles(self, run: DryRun, anatomy: str, margin_mm: float) -> tuple[Obstacle, ...]:
        """Return the anatomy with its name and margin, and the hard protected structures."""
        return (Obstacle(anatomy, margin_mm, self.clearance, int(run.clearance.argmin())), *self.structures)


@dataclass(frozen=True)
class Verdict:
    """The verdict on a dry run of a path; lengths in mm.

    level: 'fits'; 'tight' if the clearance is within 0.2 mm of the margin, less than the registration error (95 %), or
    less than the uncertainty of the bone surface in the scan; 'unknown' if the scan ends beside the tool, the
    registration error is not known, or the entry lies on the other side than the path states; 'blocked' if bone stops
    the tool or the tool pierces tissue from the room's air; 'pierces' if it pierces a wall inside the body.
    nearest: bone or the protected structure with the least clearance above its margin. least_clearance_mm: the least
    clearance to it. margin_mm: its margin. part: name of the nearest part of the tool. s_mm: arc length of the tip
    there. None and '' if the tool does not fit at the entry.
    tissue_mm: largest length of the tool whose surface is in soft tissue; nostril_mm: the part of it within 20 mm of
    the entry. tissue_depth_mm: the greatest depth; tissue_s_mm: arc length of the tip there. None without a CT.
    body: the verdict in words, without its head. soft: the soft protected structures that the tool touches, the
    deepest first.
    doubt: the worst place where the registration error exceeds the clearance; None if there is none.
    pierced: the skin and walls that the tool goes through.
    reason: what decided the level; 'spent' fits, though the registration error leaves less than the margin.
    side_caution: a sentence if the entry lies on the other side than the path states, also at the end of the words.
    obstacles: bone and each hard protected structure, with the clearance along the path.
    """

    level: Level
    tissue_level: TissueLevel
    least_clearance_mm: float | None
    nearest: str
    part: str
    s_mm: float | None
    tissue_mm: float | None
    nostril_mm: float | None
    tissue_depth_mm: float | None
    tissue_s_mm: float | None
    body: tuple[VerdictPhrase, ...]
    soft: tuple[SoftDepth, ...] = ()
    doubt: Doubt | None = None
    reason: Reason = "clear"
    pierced: Pierced = NOT_KNOWN
    side_caution: str = ""
    margin_mm: float | None = None
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def word(self) -> str:
        """The level as the first word of every text of the verdict: 'Fits', 'Tight', 'Unknown' or 'Blocked'."""
        return WORDS[self.level]

    @property
    def short(self) -> str:
        """The verdict in a few words, with its reason; every text of the verdict starts with it."""
        return IN_SHORT[self.reason]

    @property
    def pierced_place(self) -> tuple[float, Position] | None:
        """If what the tool pierces decides: arc length of the tip there, and where on the tool's axis it begins."""
        found = self.pierced
        if self.reason not in ("pierced", "wall") or found.begin is None or found.s_mm is None:
            return None
        return found.s_mm, found.begin

    @property
    def parts(self) -> tuple[VerdictPhrase, ...]:
        """The verdict in words."""
        return (VerdictPhrase(f"{self.short}."), *self.body)

    def with_remarks(self, plan: Plan, midplane: Midplane) -> Verdict:
        """Return the verdict with the remarks on a plan: the side of its entry, and its targets.

        Neither affects the dry run, so that changing them does not repeat it.
        """
        caution, ends = plan_remarks(plan, midplane)
        if not caution and not ends:
            return self
        reason: Reason = "side" if caution and self.level not in ("blocked", "pierces") else self.reason
        added = (
            *((VerdictPhrase(f" {ends}"),) if ends else ()),
            *((VerdictPhrase(f" {caution}"),) if caution else ()),
        )
        return replace(self, level=_LEVELS[reason], reason=reason, body=(*self.body, *added), side_caution=caution)

    @property
    def words(self) -> str:
        """The verdict as text."""
        return "".join(part.words for part in self.parts)


def plan_remarks(plan: Plan, midplane: Midplane) -> tuple[str, str]:
    """Return sentences on a path that do not depend on its dry run.

    The first states that it enters on another side than it states, the second how far before a target it ends; ''
    if they do not apply.
    """
    return side_caution(plan.content.path, midplane), ends_words(plan.content.points, plan.content.targets)


def profile_of(
    run: DryRun,
    tool: Tool,
    path: SplinePath,
    tissue: DistanceField | None,
    protected: ZoneSet = _NONE_PROTECTED,
    off_mm: Callable[[Array], Array | None] | None = None,
) -> Profile:
    """Return the dry run at one pose for every 0.5 mm, each with the least bone clearance of the poses around it.

    off_mm: returns the 95 % bound (n,) of the registration error at places (n, 3) of the image in mm, or None if it
    is not known.
    """
    stations = np.rint(run.s / STATION_MM)
    _, rows, group = np.unique(stations, return_index=True, return_inverse=True)
    least = np.full(len(rows), np.inf)
    np.minimum.at(least, group, run.clearance)
    start, end, pressed = run.segments_start[rows], run.segments_end[rows], None
    if tissue is not None:
        pressed = tool_depth(tissue, start, end, tool.radius, path.position(0.0), NOSTRIL_MM)
    structures = structures_of(run, rows, group, tool, protected.zones)
    soft = soft_depths(run, rows, tool, protected.soft_zones)
    off = None if off_mm is None else off_mm(run.tip[rows])
    unknown = off_mm is not None and off is None
    return Profile(run.s[rows], least, rows, pressed, structures, soft, off, unknown)


def verdict_of(
    run: DryRun,
    profile: Profile,
    tool: Tool,
    tree: ProximityTree,
    case: Case,
    margin_mm: float,
    complete: bool,
    pierced: Pierced = NOT_KNOWN,
    stated: Stated = _NOTHING_STATED,
) -> Verdict:
    """Return the verdict on a dry run.

    margin_mm: margin kept from bone. complete: whether the scan shows all of the tissue beside the tool.
    """
    obstacles = profile.obstacles(run, case.structure_names()[case.anatomy.id], margin_mm)
    bone, nearest = obstacles[0], min(obstacles, key=lambda one: one.left_mm)
    least, off = nearest.least_mm, case.uncertainty.off_mm
    worst, near = _worst(profile, obstacles), nearest.left_mm < TIGHT_MM
    reason = _reason(run, profile, worst, bone.least_mm <= off, near, complete or not case.has_volume, pierced)
    found = profile.tissue
    longest, deepest = (0, 0) if found is None else (int(found.length.argmax()), int(found.depth.argmax()))
    length = None if found is None else float(found.length[longest])
    depth = None if found is None else float(found.depth[deepest])
    at_nostril = None if found is None else float(found.near_length[longest])
    deepest_s = None if found is None else float(profile.s[deepest])
    part, s_mm = _part_of(nearest, run, tool, tree), float(run.s[nearest.row])
    body = (
        *pierced_parts(pierced, before=True),
        *held_parts(run),
        *nearest_parts(
            nearest, s_mm, part if run.completed else "", case.uncertainty.added_mm if nearest is bone else 0.0
        ),
        *surface_parts(bone, run, off, nearest is bone),
        *doubt_parts(worst, profile.off_unknown),
        *soft_parts(profile.soft),
        *tissue_parts(length, at_nostril, depth, deepest_s, complete),
        *pierced_parts(pierced, before=False),
        *stated_parts(stated),
    )
    return Verdict(
        _LEVELS[reason], tissue_level(length, depth, complete), least, nearest.name, part, s_mm, length, at_nostril,
        depth, deepest_s, body, profile.soft, worst if worst is not None and worst.left_mm < 0.0 else None, reason,
        pierced, margin_mm=nearest.margin_mm, obstacles=obstacles,
    )  # fmt: skip


def refused(error: StartRefused) -> Verdict:
    """Return the verdict if the tool does not fit at the entry or the robot does not reach it."""
    words = str(error)
    return Verdict(
        "blocked", "unknown", None, "", "", None, None, None, None, None,
        (VerdictPhrase(f" {words[:1].upper()}{words[1:].rstrip('.')}."),), reason="refused",
    )  # fmt: skip


def _reason(
    run: DryRun, profile: Profile, worst: Doubt | None, surface: bool, near: bool, complete: bool, pierced: Pierced
) -> Reason:
    """Return what decides the level, the most severe first; `Verdict.with_remarks` handles the side of the entry."""
    found: tuple[tuple[bool, Reason], ...] = (
        (pierced.state == "room", "pierced"),
        (not run.completed, "held"),
        (pierced.state == "wall", "wall"),
        (surface, "surface"),
        (worst is not None and worst.left_mm < 0.0, "registration"),
        (near, "margin"),
        (profile.off_unknown, "registration_unknown"),
        (not complete, "scan_ends"),
        (worst is not None and worst.left_mm < worst.margin_mm, "spent"),
    )
    return next((reason for applies, reason in found if applies), "clear")


def _worst(profile: Profile, obstacles: Sequence[Obstacle]) -> Doubt | None:
    """Return where the registration error leaves least of a clearance; None if the error is not known or absent.

    A place where the error exceeds the clearance precedes one where it leaves less than the margin.
    """
    if profile.off_mm is None:
        return None
    left = np.array([one.clearance for one in obstacles]) - profile.off_mm
    margins = np.array([one.margin_mm for one in obstacles])
    over = left if (left < 0.0).any() else left - margins[:, None]
    index, at = np.unravel_index(int(over.argmin()), over.shape)
    off_mm, one = float(profile.off_mm[at]), obstacles[int(index)]
    return Doubt(off_mm, float(one.clearance[at]), one.margin_mm, one.name, float(profile.s[at]))


def _part_of(nearest: Obstacle, run: DryRun, tool: Tool, tree: ProximityTree) -> str:
    """Return the name of the tool part nearest to an obstacle at the least clearance to it."""
    if nearest.zones:
        return tool.segment_names[nearest_part(nearest, run, tool)]
    segments = Segments(run.segments_start[nearest.row], run.segments_end[nearest.row], tool.radius)
    return tool.segment_names[tree.closest(segments).segment]


def tissue_level(length: float | None, depth: float | None, complete: bool) -> TissueLevel:
    """Return how a tool presses soft tissue. length, depth: of the tool in tissue in mm, None if not known."""
    if length is None or depth is None:
        return "unknown"
    if depth > DEEP_MM:
        return "deep"
    if length >= SHORT_MM:
        return "pressed"
    return "none" if complete else "unknown"
