"""The verdict on a path in words: sentences, and the places along the path that they are about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from app.planning.obstacles import Obstacle
from app.planning.piercing import Pierced
from app.planning.soft_depths import SoftDepth
from vfix_engine.worlds.rigid.dry_run import DryRun

SHORT_MM = 0.5  # a shorter length is not told in figures
_WORTH_DEPTH_MM = 0.05  # a smaller depth in a soft structure is not told in words
_WORTH_SAYING_MM = 0.005  # of a margin, in hundredths of a mm


class VerdictPart(NamedTuple):
    """A piece of a sentence, and the arc length of the tip that it is about, None where it is about no place.

    detail: the page shows it on request only.
    """

    words: str
    s_mm: float | None = None
    detail: bool = False


class Stated(NamedTuple):
    """What a plan has besides its path: the standing fixtures of its drive in words, and the bone that it removes."""

    standing: str = ""
    removed_mm3: float = 0.0


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


def held_parts(run: DryRun) -> tuple[VerdictPart, ...]:
    """Where a run ends before its path does, and what holds the tool there."""
    if run.completed:
        return ()
    at = VerdictPart(f"at {run.reached_mm:.0f} of {run.length_mm:.0f} mm", run.reached_mm)
    return (VerdictPart(" Held "), at, VerdictPart(f": {run.reason.rstrip('.')}."))


def nearest_parts(nearest: Obstacle, s_mm: float, part: str, added_mm: float) -> tuple[VerdictPart, ...]:
    """What leaves least above its margin. added_mm: of the margin, for what thinning may have moved the surface."""
    scan = f", and {added_mm:.2f} mm of the margin are there since the scan’s surface may be that far off"
    more = scan if added_mm >= _WORTH_SAYING_MM else ""
    return (
        VerdictPart(f" {nearest.least_mm:.2f} mm to {nearest.name} "),
        VerdictPart(f"at {s_mm:.0f} mm", s_mm),
        VerdictPart(f" (margin {nearest.margin_mm:.2f})."),
        VerdictPart(f" The {part} is nearest{more}.", detail=True),
    )


def surface_parts(bone: Obstacle, run: DryRun, off_mm: float, told: bool) -> tuple[VerdictPart, ...]:
    """Where bone may be nearer than its surface. told: its least clearance is in the words already."""
    if bone.least_mm > off_mm:
        return ()
    off = f"{off_mm:.2f} mm off its surface."
    if told:
        return (VerdictPart(f" {bone.name[:1].upper()}{bone.name[1:]} may lie {off}"),)
    s_mm = float(run.s[bone.row])
    at = VerdictPart(f"at {s_mm:.0f} mm", s_mm)
    return (VerdictPart(f" {bone.least_mm:.2f} mm to {bone.name} "), at, VerdictPart(f", which may lie {off}"))


def stated_parts(stated: Stated) -> tuple[VerdictPart, ...]:
    """With what the tool was driven, and what is removed before."""
    standing = (VerdictPart(f" Simulated with {stated.standing}."),) if stated.standing else ()
    removed = (VerdictPart(f" {stated.removed_mm3:.0f} mm³ of bone are removed first."),) if stated.removed_mm3 else ()
    return (*standing, *removed)


def pierced_parts(pierced: Pierced, before: bool) -> tuple[VerdictPart, ...]:
    """What is pierced, said before all else; that it is not known, after it."""
    if not pierced.words or before != (pierced.state in ("room", "wall")):
        return ()
    if not before:
        return (VerdictPart(f" {pierced.words}"),)
    at = VerdictPart(f"at {pierced.s_mm:.0f} mm", pierced.s_mm)
    return (VerdictPart(f" {pierced.words.rstrip('.')} ("), at, VerdictPart(")."))


def doubt_parts(worst: Doubt | None, unknown: bool) -> tuple[VerdictPart, ...]:
    if unknown:
        return (VerdictPart(" How far the registration may be off is not known."),)
    if worst is None or worst.left_mm >= worst.margin_mm:
        return ()
    at = VerdictPart(f"at {worst.s_mm:.0f} mm", worst.s_mm)
    if worst.left_mm < 0.0:
        return (
            VerdictPart(f" The registration may be off by {worst.off_mm:.2f} mm (95 %) "),
            at,
            VerdictPart(f", more than the {max(worst.clearance_mm, 0.0):.2f} mm to {worst.nearest}."),
        )
    return (
        VerdictPart(
            f" With what the registration may be off by (95 %), {worst.left_mm:.2f} mm to {worst.nearest} are left "
        ),
        at,
        VerdictPart(f", less than the margin of {worst.margin_mm:.2f} mm."),
    )


def soft_parts(soft: Sequence[SoftDepth]) -> tuple[VerdictPart, ...]:
    told = [one for one in soft if one.depth_mm >= _WORTH_DEPTH_MM]
    parts = list[VerdictPart]()
    for first, one in zip([True] + [False] * len(told), told, strict=False):
        parts.append(VerdictPart(f"{' Goes ' if first else ', '}{one.depth_mm:.1f} mm deep into {one.name} ("))
        parts += [VerdictPart(f"at {one.s_mm:.0f} mm", one.s_mm), VerdictPart(")")]
    return (*parts, VerdictPart(".")) if told else ()


def tissue_parts(
    length: float | None, at_nostril: float | None, depth: float | None, s_mm: float | None, complete: bool
) -> tuple[VerdictPart, ...]:
    if length is None or at_nostril is None or depth is None or s_mm is None:
        return (VerdictPart(" Soft tissue is not known: no CT shows the tool's path."),)
    beyond = "" if complete else " The scan ends in tissue beside the tool; what lies there is not known."
    if length < SHORT_MM:
        return (VerdictPart(f" Presses no soft tissue.{beyond}"),)
    share = "all" if at_nostril > length - SHORT_MM else f"{at_nostril:.0f} mm"
    nostril = f"; {share} of it at the nostril" if at_nostril >= SHORT_MM else ""
    at_least = "" if complete else "at least "
    return (
        VerdictPart(f" Presses soft tissue along {at_least}{length:.0f} mm of the tool, {depth:.1f} mm deep at most ("),
        VerdictPart(f"at {s_mm:.0f} mm", s_mm),
        VerdictPart(f"){nostril}.{beyond}"),
    )
