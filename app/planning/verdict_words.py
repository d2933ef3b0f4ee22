"""The words of a verdict: sentences, and the places along the path that they refer to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from app.kit.values import rounded_up
from app.planning.obstacles import Obstacle
from app.planning.piercing import Pierced
from app.planning.soft_depths import SoftDepth
from vfix_engine.worlds.rigid.dry_run import DryRun

SHORT_MM = 0.5  # a shorter length is not reported in figures
_REPORTED_DEPTH_MM = 0.05  # a smaller depth in a soft structure is not reported
_REPORTED_MARGIN_MM = 0.005  # a smaller addition to a margin is not reported, since margins have two decimals


class VerdictPhrase(NamedTuple):
    """A part of a sentence, and the arc length of the tip that it refers to, None if it refers to no place."""

    words: str
    s_mm: float | None = None


class Stated(NamedTuple):
    """Conditions of a dry run that its verdict states: the fixtures of the rehearsal options, and the removed bone."""

    standing: str = ""
    removed_mm3: float = 0.0


class Doubt(NamedTuple):
    """Where the registration error leaves least clearance.

    off_mm: registration error (95 %). clearance_mm, margin_mm: to and of the nearest obstacle, named by nearest. s_mm:
    arc length of the tip there.
    """

    off_mm: float
    clearance_mm: float
    margin_mm: float
    nearest: str
    s_mm: float

    @property
    def left_mm(self) -> float:
        """The clearance minus the registration error; negative where the tool may touch."""
        return self.clearance_mm - self.off_mm


def held_parts(run: DryRun) -> tuple[VerdictPhrase, ...]:
    """Describe where a run stops before the end of its path, and what stops the tool there."""
    if run.completed:
        return ()
    at = VerdictPhrase(f"at {run.reached_mm:.0f} of {run.length_mm:.0f} mm", run.reached_mm)
    return (VerdictPhrase(" Held "), at, VerdictPhrase(f": {run.reason.rstrip('.')}."))


def nearest_parts(nearest: Obstacle, s_mm: float, part: str, added_mm: float) -> tuple[VerdictPhrase, ...]:
    """Describe the obstacle with the least clearance above its margin.

    part: of the tool; '' where the sentence before names what stops the tool, which may be another part.
    added_mm: the part of the margin that covers the error of the thinned surface.
    """
    who = f" The {part} is nearest." if part else ""
    scan = f" The margin includes {added_mm:.2f} mm for the error of the scan’s surface."
    more = scan if added_mm >= _REPORTED_MARGIN_MM else ""
    return (
        VerdictPhrase(f" {nearest.least_mm:.2f} mm to {nearest.name} "),
        VerdictPhrase(f"at {s_mm:.0f} mm", s_mm),
        VerdictPhrase(f" (margin {nearest.margin_mm:.2f})."),
        VerdictPhrase(f"{who}{more}"),
    )


def surface_parts(bone: Obstacle, run: DryRun, off_mm: float, reported: bool) -> tuple[VerdictPhrase, ...]:
    """Describe where bone may be nearer than its surface. reported: its least clearance is already in the words."""
    if bone.least_mm > off_mm:
        return ()
    off = f"{off_mm:.2f} mm off its surface."
    if reported:
        return (VerdictPhrase(f" {bone.name[:1].upper()}{bone.name[1:]} may lie {off}"),)
    s_mm = float(run.s[bone.row])
    at = VerdictPhrase(f"at {s_mm:.0f} mm", s_mm)
    return (VerdictPhrase(f" {bone.least_mm:.2f} mm to {bone.name} "), at, VerdictPhrase(f", which may lie {off}"))


def stated_parts(stated: Stated) -> tuple[VerdictPhrase, ...]:
    """Describe the fixtures that the tool was driven with, and the bone that is removed before."""
    standing = (VerdictPhrase(f" Simulated with {stated.standing}."),) if stated.standing else ()
    removed = (
        (VerdictPhrase(f" {stated.removed_mm3:.0f} mm³ of bone are removed first."),) if stated.removed_mm3 else ()
    )
    return (*standing, *removed)


def pierced_parts(pierced: Pierced, before: bool) -> tuple[VerdictPhrase, ...]:
    """Describe what is pierced: before all other sentences if something is, after them if it is not known."""
    if not pierced.words or before != (pierced.state in ("room", "wall")):
        return ()
    if not before:
        return (VerdictPhrase(f" {pierced.words}"),)
    at = VerdictPhrase(f"at {pierced.s_mm:.0f} mm", pierced.s_mm)
    return (VerdictPhrase(f" {pierced.words.rstrip('.')} ("), at, VerdictPhrase(")."))


def doubt_parts(worst: Doubt | None, unknown: bool) -> tuple[VerdictPhrase, ...]:
    """Describe what the registration error leaves of the clearance where it leaves least."""
    if unknown:
        return (VerdictPhrase(" How far the registration may be off is not known."),)
    if worst is None:
        return ()
    at = VerdictPhrase(f"at {worst.s_mm:.0f} mm", worst.s_mm)
    if worst.left_mm < 0.0:
        return (
            VerdictPhrase(f" The registration may be off by {rounded_up(worst.off_mm):.2f} mm (95 %) "),
            at,
            VerdictPhrase(f", more than the {max(worst.clearance_mm, 0.0):.2f} mm to {worst.nearest}."),
        )
    less = f", less than the margin of {worst.margin_mm:.2f} mm." if worst.left_mm < worst.margin_mm else "."
    off = f" With the registration error of {rounded_up(worst.off_mm):.2f} mm there (95 %), "
    return (VerdictPhrase(f"{off}{worst.left_mm:.2f} mm to {worst.nearest} are left "), at, VerdictPhrase(less))


def soft_parts(soft: Sequence[SoftDepth]) -> tuple[VerdictPhrase, ...]:
    deep = [one for one in soft if one.depth_mm >= _REPORTED_DEPTH_MM]
    parts = list[VerdictPhrase]()
    for first, one in zip([True] + [False] * len(deep), deep, strict=False):
        parts.append(VerdictPhrase(f"{' Goes ' if first else ', '}{one.depth_mm:.1f} mm deep into {one.name} ("))
        parts += [VerdictPhrase(f"at {one.s_mm:.0f} mm", one.s_mm), VerdictPhrase(")")]
    return (*parts, VerdictPhrase(".")) if deep else ()


def tissue_parts(
    length: float | None, at_nostril: float | None, depth: float | None, s_mm: float | None, complete: bool
) -> tuple[VerdictPhrase, ...]:
    if length is None or at_nostril is None or depth is None or s_mm is None:
        return (VerdictPhrase(" Soft tissue is not known: no CT shows the tool's path."),)
    beyond = "" if complete else " The scan ends in tissue beside the tool; what lies there is not known."
    if length < SHORT_MM:
        return (VerdictPhrase(f" Presses no soft tissue.{beyond}"),)
    part = "all" if at_nostril > length - SHORT_MM else f"{at_nostril:.0f} mm"
    nostril = f"; {part} of it at the nostril" if at_nostril >= SHORT_MM else ""
    at_least = "" if complete else "at least "
    return (
        VerdictPhrase(
            f" Presses soft tissue along {at_least}{length:.0f} mm of the tool, {depth:.1f} mm deep at most ("
        ),
        VerdictPhrase(f"at {s_mm:.0f} mm", s_mm),
        VerdictPhrase(f"){nostril}.{beyond}"),
    )
