"""The figures of a verdict: each obstacle, soft tissue, registration error and reach, the one that decides first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict import Level
from vfix_engine.worlds.rigid.dry_run import TIGHT_MM

_SEVERITY: dict[Level, int] = {"blocked": 0, "pierces": 1, "unknown": 2, "tight": 3, "fits": 4}


@dataclass(frozen=True)
class VerdictFigure:
    """A figure of a verdict, with its level.

    name: what it is of, such as 'bone'. value: in mm, None if it is not known or has none. whole_mm: of which it is a
    part, such as the length of the path. digits: of the value. s_mm: arc length of the tip at its place, None without.
    """

    name: str
    value: float | None
    level: Level
    s_mm: float | None = None
    whole_mm: float | None = None
    digits: int = 2


def verdict_figures(evaluation: PlanEvaluation) -> tuple[VerdictFigure, ...]:
    """Return the figures of an evaluation: those with the level of the verdict first, then the most severe."""
    level = evaluation.verdict.level
    return tuple(sorted(_figures(evaluation), key=lambda figure: (figure.level != level, _SEVERITY[figure.level])))


def _figures(evaluation: PlanEvaluation) -> Iterator[VerdictFigure]:
    verdict, profile, run = evaluation.verdict, evaluation.profile, evaluation.run
    if verdict.pierced.state in ("room", "wall"):
        skin = verdict.pierced.state == "room"
        yield VerdictFigure(
            "skin pierced" if skin else "wall pierced", None, "blocked" if skin else "pierces", verdict.pierced.s_mm
        )
    for index, one in enumerate(verdict.obstacles):
        hidden = verdict.reason == "surface" and index == 0
        tight = hidden or one.left_mm < TIGHT_MM
        yield VerdictFigure(one.name, one.least_mm, "tight" if tight else "fits", float(run.s[one.row]))
    cut = verdict.reason == "scan_ends"
    if cut or verdict.tissue_mm is not None:
        level: Level = "unknown" if cut else "fits"
        yield VerdictFigure("soft tissue", verdict.tissue_mm, level, verdict.tissue_s_mm, digits=0)
    if profile.off_unknown:
        yield VerdictFigure("registration error", None, "unknown")
    elif profile.off_mm is not None:
        doubt = verdict.doubt
        at = float(profile.s[int(np.argmax(profile.off_mm))]) if doubt is None else doubt.s_mm
        worst = float(profile.off_mm.max()) if doubt is None else doubt.off_mm
        yield VerdictFigure("registration error", worst, "fits" if doubt is None else "tight", at)
    if verdict.side_caution:
        yield VerdictFigure("side of the entry", None, "unknown", 0.0)
    reach: Level = "fits" if evaluation.completed else "blocked"
    reached = evaluation.reached_mm
    yield VerdictFigure("reach", reached, reach, reached, evaluation.length_mm, digits=0)
