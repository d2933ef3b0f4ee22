"""The figures of a verdict: each obstacle, soft tissue, registration error and reach, the one that decides first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.kit.values import rounded_up
from app.planning.obstacles import Obstacle
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.protected_structures import structure_name
from app.planning.verdict import Level
from vfix_engine.worlds.rigid.dry_run import TIGHT_MM

_ROUNDED_MM = 1e-3
_SEVERITY: dict[Level, int] = {"blocked": 0, "pierces": 1, "unknown": 2, "tight": 3, "fits": 4}


@dataclass(frozen=True)
class VerdictFigure:
    """A figure of a verdict, with its level.

    name: what it is of, such as 'bone'. value: in mm, None if it is not known or has none. whole_mm: of which it is a
    part, such as the length of the path. digits: of the value. s_mm: arc length of the tip at its place, None without;
    of an obstacle that stops the tool, where it does.
    margin_mm: of an obstacle. at_least: it is farther away than clearances are measured, which is the value.
    """

    name: str
    value: float | None
    level: Level
    s_mm: float | None = None
    whole_mm: float | None = None
    digits: int = 2
    margin_mm: float | None = None
    at_least: bool = False


def verdict_figures(evaluation: PlanEvaluation) -> tuple[VerdictFigure, ...]:
    """Return the figures of an evaluation: those with the level of the verdict first, then the most severe."""
    level = evaluation.verdict.level
    return tuple(sorted(_figures(evaluation), key=lambda figure: (figure.level != level, _SEVERITY[figure.level])))


def _figures(evaluation: PlanEvaluation) -> Iterator[VerdictFigure]:
    """Yield the figures, of one level in the order in which they decide the verdict."""
    verdict, profile = evaluation.verdict, evaluation.profile
    if verdict.pierced.state in ("room", "wall"):
        skin = verdict.pierced.state == "room"
        yield VerdictFigure(
            "skin pierced" if skin else "wall pierced", None, "blocked" if skin else "pierces", verdict.pierced.s_mm
        )
    if verdict.side_caution:
        yield VerdictFigure("side of the entry", None, "unknown", 0.0)
    registration, obstacles = _registration(evaluation), _obstacles(evaluation)
    doubtful = verdict.doubt is not None and verdict.reason != "surface"
    yield from (*registration, *obstacles) if doubtful else (*obstacles, *registration)
    cut, tissue = verdict.reason == "scan_ends", profile.tissue
    if cut or tissue is not None:
        longest = None if tissue is None else float(profile.s[int(tissue.length.argmax())])
        yield VerdictFigure("in soft tissue", verdict.tissue_mm, "unknown" if cut else "fits", longest, digits=0)
    if evaluation.run.stopped_by is not None and evaluation.run.stopped_by.kind == "joint":
        yield VerdictFigure("joint limit", None, "blocked", evaluation.reached_mm)
    reached = evaluation.reached_mm
    reach: Level = "fits" if evaluation.completed else "blocked"
    yield VerdictFigure("reach", reached, reach, reached, evaluation.length_mm, digits=0)


def _obstacles(evaluation: PlanEvaluation) -> Iterator[VerdictFigure]:
    """Yield bone and each hard structure, the least above its margin first.

    Before all is the one that stops the tool, then bone that the scan may hide.
    """
    bone, stops = evaluation.verdict.obstacles[0], _stopping(evaluation)
    hidden = bone if evaluation.verdict.reason == "surface" else None
    for one in sorted(evaluation.verdict.obstacles, key=lambda one: (one is not stops, one is not hidden, one.left_mm)):
        level: Level = "tight" if one is hidden or one.left_mm < TIGHT_MM else "fits"
        at = float(evaluation.run.s[one.row])
        if one is stops:
            level, at = "blocked", evaluation.reached_mm
        far = one is bone and one.least_mm >= evaluation.run.exact_to_mm - _ROUNDED_MM
        yield VerdictFigure(one.name, one.least_mm, level, at, margin_mm=one.margin_mm, at_least=far)


def _stopping(evaluation: PlanEvaluation) -> Obstacle | None:
    """Return the obstacle that stops the tool before the end of the path, None if none does."""
    stop, (bone, *structures) = evaluation.run.stopped_by, evaluation.verdict.obstacles
    if stop is None or stop.kind not in ("bone", "zone"):
        return None
    named = (one for one in structures if one.name == structure_name(stop.structure))
    return bone if stop.kind == "bone" else next(named, None)


def _registration(evaluation: PlanEvaluation) -> Iterator[VerdictFigure]:
    """Yield the registration error (95 %) where it leaves least, else where it is greatest; none without one."""
    profile, doubt = evaluation.profile, evaluation.verdict.doubt
    if profile.off_unknown:
        yield VerdictFigure("registration error", None, "unknown")
    elif doubt is not None:
        yield VerdictFigure("registration error", rounded_up(doubt.off_mm), "tight", doubt.s_mm)
    elif profile.off_mm is not None:
        at = int(np.argmax(profile.off_mm))
        yield VerdictFigure("registration error", rounded_up(float(profile.off_mm[at])), "fits", float(profile.s[at]))
