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


class VerdictPhrase(NamedTuple):
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


def held_parts(run: DryRun) -> tuple[VerdictPhrase, ...]:
    """Where a run ends before its path does, and what holds the tool there."""
    if run.completed:
        return ()
    at = VerdictPhrase(f"at {run.reached_mm:.0f} of {run.length_mm:.0f} mm", run.reached_mm)
    return (VerdictPhrase(" Held "), at, VerdictPhrase(f": {run.reason.rstrip('.')}."))


def nearest_parts(nearest: Obstacle, s_mm: float, part: str, added_mm: float) -> tuple[VerdictPhrase, ...]:
    """What leaves least above its margin. added_mm: of the margin, for what thinning may have moved the surface."""
    scan = f", and {added_mm:.2f} mm of the margin are there since the scan’s surface may be that far off"
    more = scan if added_mm >= _WORTH_SAYING_MM else ""
    return (
        VerdictPhrase(f" {nearest.least_mm:.2f} mm to {nearest.name} "),
        VerdictPhrase(f"at {s_mm:.0f} mm", s_mm),
        VerdictPhrase(f" (margin {nearest.margin_mm:.2f})."),
        VerdictPhrase(f" The {part} is nearest{more}.", detail=True),
    )


def surface_parts(bone: Obstacle, run: DryRun, off_mm: float, told: bool) -> tuple[VerdictPhrase, ...]:
    """Where bone may be nearer than its surface. told: its least clearance is in the words already."""
    if bone.least_mm > off_mm:
        return ()
    off = f"{off_mm:.2f} mm off its surface."
    if told:
        return (VerdictPhrase(f" {bone.name[:1].upper()}{bone.name[1:]} may lie {off}"),)
    s_mm = float(run.s[bone.row])
    at = VerdictPhrase(f"at {s_mm:.0f} mm", s_mm)
    return (VerdictPhrase(f" {bone.least_mm:.2f} mm to {bone.name} "), at, VerdictPhrase(f", which may lie {off}"))


def stated_parts(stated: Stated) -> tuple[VerdictPhrase, ...]:
    """With what the tool was driven, and what is removed before."""
    standing = (VerdictPhrase(f" Simulated with {stated.standing}."),) if stated.standing else ()
    removed = (
        (VerdictPhrase(f" {stated.removed_mm3:.0f} mm³ of bone are removed first."),) if stated.removed_mm3 else ()
    )
    return (*standing, *removed)


def pierced_parts(pierced: Pierced, before: bool) -> tuple[VerdictPhrase, ...]:
    """What is pierced, said before all else; that it is not known, after it."""
    if not pierced.words or before != (pierced.state in ("room", "wall")):
        return ()
    if not before:
        return (VerdictPhrase(f" {pierced.words}"),)
    at = VerdictPhrase(f"at {pierced.s_mm:.0f} mm", pierced.s_mm)
    return (VerdictPhrase(f" {pierced.words.rstrip('.')} ("), at, VerdictPhrase(")."))


def doubt_parts(worst: Doubt | None, unknown: bool) -> tuple[VerdictPhrase, ...]:
    if unknown:
        return (VerdictPhrase(" How far the registration may be off is not known."),)
    if worst is None or worst.left_mm >= worst.margin_mm:
        return ()
    at = VerdictPhrase(f"at {worst.s_mm:.0f} mm", worst.s_mm)
    if worst.left_mm < 0.0:
        return (
            VerdictPhrase(f" The registration may be off by {worst.off_mm:.2f} mm (95 %) "),
            at,
            VerdictPhrase(f", more than the {max(worst.clearance_mm, 0.0):.2f} mm to {worst.nearest}."),
        )
    return (
        VerdictPhrase(
            f" With what the registration may be off by (95 %), {worst.left_mm:.2f} mm to {worst.nearest} are left "
        ),
        at,
        VerdictPhrase(f", less than the margin of {worst.margin_mm:.2f} mm."),
    )


def soft_parts(soft: Sequence[SoftDepth]) -> tuple[VerdictPhrase, ...]:
    told = [one for one in soft if one.depth_mm >= _WORTH_DEPTH_MM]
    parts = list[VerdictPhrase]()
    for first, one in zip([True] + [False] * len(told), told, strict=False):
        parts.append(VerdictPhrase(f"{' Goes ' if first else ', '}{one.depth_mm:.1f} mm deep into {one.name} ("))
        parts += [VerdictPhrase(f"at {one.s_mm:.0f} mm", one.s_mm), VerdictPhrase(")")]
    return (*parts, VerdictPhrase(".")) if told else ()


def tissue_parts(
    length: float | None, at_nostril: float | None, depth: float | None, s_mm: float | None, complete: bool
) -> tuple[VerdictPhrase, ...]:
    if length is None or at_nostril is None or depth is None or s_mm is None:
        return (VerdictPhrase(" Soft tissue is not known: no CT shows the tool's path."),)
    beyond = "" if complete else " The scan ends in tissue beside the tool; what lies there is not known."
    if length < SHORT_MM:
        return (VerdictPhrase(f" Presses no soft tissue.{beyond}"),)
    share = "all" if at_nostril > length - SHORT_MM else f"{at_nostril:.0f} mm"
    nostril = f"; {share} of it at the nostril" if at_nostril >= SHORT_MM else ""
    at_least = "" if complete else "at least "
    return (
        VerdictPhrase(
            f" Presses soft tissue along {at_least}{length:.0f} mm of the tool, {depth:.1f} mm deep at most ("
        ),
        VerdictPhrase(f"at {s_mm:.0f} mm", s_mm),
        VerdictPhrase(f"){nostril}.{beyond}"),
    )
