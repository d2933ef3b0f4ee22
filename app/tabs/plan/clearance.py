"""Clearance along the path: what the page plots of a dry run, and the tool at one place of it in the scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.kit.kept import Same
from app.kit.values import Position, rounded_up
from app.planning.piercing import Pierced
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict_figures import VerdictFigure, verdict_figures
from app.scene.gap import Gap, GapNodes
from app.scene.pierced import PiercedNodes
from app.scene.stop import StopNode
from app.scene.tool_ghost import ToolGhost
from app.tabs.plan.sections import ClearanceProfile, FigureView, ObstacleCurve, PiercedView, VerdictView
from app.workspace.layers import Layer
from vfix_engine.arrays import Array
from vfix_engine.geometry.capsules import Segments
from vfix_engine.proximity.proximity import Proximity

_SAME_MM = 1e-3  # an arc length nearer than this to that of a figure is the figure's


def verdict_view(evaluation: PlanEvaluation) -> VerdictView:
    """The page's view of a verdict."""
    verdict, profile = evaluation.verdict, evaluation.profile
    tissue = profile.tissue
    curves: list[ObstacleCurve] = [
        {
            "name": one.name,
            "margin_mm": round(one.margin_mm, 3),
            "clearance_mm": np.round(one.clearance, 3).tolist(),
        }
        for one in verdict.obstacles
    ]
    plotted: ClearanceProfile = {
        "s_mm": np.round(profile.s, 2).tolist(),
        "curves": curves,
        "exact_to_mm": round(evaluation.run.exact_to_mm, 3),
        "tissue_mm": None if tissue is None else np.round(tissue.length, 1).tolist(),
        "tissue_depth_mm": None if tissue is None else np.round(tissue.depth, 2).tolist(),
        "registration_mm": None if profile.off_mm is None else [rounded_up(off) for off in profile.off_mm.tolist()],
        "sideways_mm": verdict.pierced.at(profile.s),
    }
    figures = verdict_figures(evaluation)
    return {
        "level": verdict.level,
        "short": verdict.short,
        "parts": [{"words": part.words, "s_mm": part.s_mm} for part in verdict.parts],
        "figures": [_figure(figure) for figure in figures],
        "pierced": _pierced(verdict.pierced),
        "show_mm": next(figure.s_mm for figure in figures if figure.s_mm is not None),  # bone has a place
        "nearest": verdict.nearest,
        "nearest_curve": int(np.argmin([one.left_mm for one in verdict.obstacles])),
        "nearest_mm": float(verdict.s_mm or 0.0),
        "length_mm": round(evaluation.length_mm, 3),
        "base_mm": round(float(np.linalg.norm(evaluation.base[:3, 3] - evaluation.path.position(0.0))), 1),
        "profile": plotted,
    }


def _figure(figure: VerdictFigure) -> FigureView:
    return {
        "name": figure.name,
        "value": None if figure.value is None else round(figure.value, 3),
        "level": figure.level,
        "s_mm": figure.s_mm,
        "whole_mm": figure.whole_mm,
        "digits": figure.digits,
        "at_least": figure.at_least,
    }


def _pierced(found: Pierced) -> PiercedView | None:
    ends = found.ends
    return None if ends is None else {"begin": list(ends[0]), "end": list(ends[1])}


def pierced_layer(evaluation: PlanEvaluation | None) -> Layer[Any]:
    """The tissue that the tool of a dry run pierces, in the scene."""
    ends = None if evaluation is None else evaluation.verdict.pierced.ends
    return Layer("plan.pierced", ends, PiercedNodes, lambda nodes: nodes.show(ends))


def stop_layer(evaluation: PlanEvaluation | None) -> Layer[Any]:
    """Where on its path the tool of a dry run is held, in the scene."""
    place: Position | None = None
    if evaluation is not None and not evaluation.completed:
        x, y, z = evaluation.path.position(evaluation.reached_mm).tolist()
        place = (x, y, z)
    return Layer("plan.stop", place, StopNode, lambda node: node.show(place))


class ShownTool:
    """Where along the path the tool is shown, and where bone is nearest to it; nothing until somebody asks for it."""

    def __init__(self) -> None:
        self.s_mm: float | None = None
        self.gap: Gap | None = None

    def clear(self) -> None:
        self.s_mm = self.gap = None

    def at(self, evaluation: PlanEvaluation, s_mm: float, bone: Proximity) -> Position:
        """Show the tool in the pose of the dry run nearest to an arc length; returns what to look at.

        That is where its tip is then, or at the figure of what it pierces, the place that is pierced, and at that of
        the least clearance to bone, the bone there.
        """
        row = _row(evaluation, s_mm)
        run = evaluation.run
        self.s_mm = float(run.s[row])
        nearest = bone.closest(Segments(run.segments_start[row], run.segments_end[row], evaluation.tool_radius))
        radius = evaluation.tool_radius[nearest.segment]
        self.gap = Gap(nearest.on_tool - radius * nearest.normal, nearest.on_surface, nearest.distance)
        verdict, pierced = evaluation.verdict, evaluation.verdict.pierced
        if pierced.ends is not None and pierced.s_mm is not None and abs(pierced.s_mm - s_mm) < _SAME_MM:
            return pierced.ends[0]
        at_bone = row == verdict.obstacles[0].row
        x, y, z = (nearest.on_surface if at_bone else run.tip[row]).tolist()
        return (x, y, z)

    def layers(self, evaluation: PlanEvaluation | None) -> list[Layer[Any]]:
        """The tool in that pose, and the gap between it and bone."""
        pose: tuple[Array, Array, Array] | None = None
        gap: Gap | None = None
        if evaluation is not None and self.s_mm is not None:
            row = _row(evaluation, self.s_mm)
            run = evaluation.run
            pose = run.segments_start[row], run.segments_end[row], evaluation.tool_radius
            gap = self.gap
        key = Same(evaluation), self.s_mm
        return [
            Layer("plan.tool", key, ToolGhost, lambda nodes: nodes.show(pose)),
            Layer("plan.gap", key, GapNodes, lambda nodes: nodes.show(gap)),
        ]


def _row(evaluation: PlanEvaluation, s_mm: float) -> int:
    return int(np.abs(evaluation.run.s - s_mm).argmin())
