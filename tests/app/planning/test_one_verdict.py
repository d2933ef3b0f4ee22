"""HAZ-40: card, REST and command line report the same verdict, with everything that it depends on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from session_doubles import SAMPLE, open_sample

from app.api.plan_reports import PathReportPublic
from app.cases.model import Case
from app.cases.settings import settings_in_case
from app.commands import plan_evaluate
from app.planning import evaluation as planning_module
from app.planning.drive import Drive
from app.planning.evaluation import Planning
from app.planning.path_evaluations import PathEvaluations
from app.planning.piercing import NOT_KNOWN, Pierced
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict import IN_SHORT
from app.plans.model import Plan
from app.plans.zones import PlanZone
from app.registration.driven import DrivenRegistration
from app.services import Services
from app.tabs.plan.dry_runs import ShownEvaluation, answered
from app.tabs.rehearse.drive_figures import DryRunFigures
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import StartRefused
from vfix_engine.frames import ImageRegistration
from vfix_engine.robots import Tool
from vfix_engine.worlds.rigid.dry_run import TIGHT_MM, DryRun
from vfix_engine.worlds.rigid.placing import Placing

Floats = NDArray[np.float64]
WORD = {"fits": "Fits", "tight": "Tight", "blocked": "Blocked", "pierces": "Blocked", "unknown": "Unknown"}
TRIALS = 500


class World:
    """Random plans along the sample path: drives, structures, surfaces and registrations as a seed has them."""

    def __init__(self, services: Services, monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
        self.services, self.patch, self.random = services, monkeypatch, np.random.default_rng(seed)
        self.sample = services.plans.get(SAMPLE)
        self.found = services.planning.evaluate(self.sample)
        self.tool = Tool.load(self.sample.content.tool)
        self.planned = Planning(
            services.cases, services.instruments, services.distance_fields, lambda plan: self.registered
        )
        self.registered: DrivenRegistration | None = None
        self.off: float | None = 0.0
        asked = SimpleNamespace(evaluate=lambda plan, options: self.planned.evaluate(plan, options=options))
        self.reports = PathEvaluations(self.planned, asked, services.removed_volumes, services.rehearsal_options)  # type: ignore[arg-type]
        passed, told = planning_module.tissue_passed, lambda: self.complete
        monkeypatch.setattr(planning_module, "tissue_passed", lambda *given: replace(passed(*given), complete=told()))
        monkeypatch.setattr(Drive, "run", lambda *given: self._driven())
        monkeypatch.setattr(planning_module, "pierced_along", lambda *given: self.pierced)

    def next(self) -> Plan:
        """Another plan; its drive, surface, scan and registration are those of this world from now on."""
        draw, some = self.random.uniform, lambda share: bool(self.random.random() < share)
        self.refused, self.complete = some(0.06), not some(0.15)
        run = self.found.run
        rows = np.sort(self.random.choice(len(run.s), 12, replace=False))
        clearance = np.maximum(run.clearance[rows] * draw(0.2, 3.0), 0.01)
        done = not some(0.15)
        self.run = DryRun(
            run.s[rows], run.tip[rows], clearance, run.q[rows], run.segments_start[rows], run.segments_end[rows],
            done, "" if done else "bone on the shaft, 0.3 mm away", run.length_mm, 9.0,
        )  # fmt: skip
        self.surface = SurfaceUncertainty(float(draw(0.0, 0.1)), float(draw(0.0, 3.0)) if some(0.5) else 0.0)
        self.patch.setattr(Case, "uncertainty", self.surface)
        state = self.random.choice(["none", "room", "wall", "unknown"], p=[0.7, 0.1, 0.1, 0.1])
        self.pierced = Pierced(state, 12.0, 8.0, s_mm=30.0, where="on the left") if state != "unknown" else NOT_KNOWN
        self._register(some)
        zones, self.ball = (), None
        if some(0.4):
            row = int(self.random.integers(len(rows)))
            away = self.random.normal(size=3)
            radius = float(draw(0.5, 3.0))
            at = run.tip[rows[row]] + (radius + draw(0.5, 4.0)) * away / np.linalg.norm(away)
            self.ball = at, radius
            shape = {"kind": "sphere", "centre": at.tolist(), "radius": radius}
            zones = (PlanZone("z", "optic nerve", shape, float(draw(0.1, 2.0))),)
        side = str(self.random.choice(["", "", "left", "right"]))
        used = None if self.registered is None else self.registered.id
        settings = {"margin_mm": float(draw(0.1, 0.8))}
        plan = replace(
            self.sample,
            content=replace(self.sample.content, targets=(), zones=zones, settings=settings, registration=used),
        )
        return replace(plan, content=replace(plan.content, paths=(replace(plan.content.path, entry_side=side),)))

    def _register(self, some: Callable[[float], bool]) -> None:
        self.registered, self.off = None, 0.0
        if some(0.4):
            self.off = None if some(0.25) else float(self.random.uniform(0.02, 1.5))
            told = None if self.off is None else self.off
            self.registered = DrivenRegistration("r", "OR", ImageRegistration(np.eye(4)))
            off = lambda places: None if told is None else np.full(len(places), told)  # noqa: E731
            object.__setattr__(self.registered, "off_mm", off)

    def _driven(self) -> Placing:
        if self.refused:
            raise StartRefused("the tip would start 0.1 mm from bone, less than the margin of 0.3 mm")
        return Placing(self.found.base, self.found.q_start, self.run)

    def expected(self, plan: Plan) -> str:
        """The level, from the inputs: clearance by samples of the tool, one error and one margin after the other."""
        if self.refused or not self.run.completed or self.pierced.state == "room":
            return "blocked"
        if self.pierced.state == "wall":
            return "pierces"
        x = plan.content.points[0].position[0]
        if (plan.content.entry_side == "left" and x < -2.0) or (plan.content.entry_side == "right" and x > 2.0):
            return "unknown"
        kept = settings_in_case(plan.content.settings, self.surface).kept_mm
        away = [(float(self.run.clearance.min()), kept)]
        if self.ball is not None:
            away.append((self._from_ball(*self.ball), plan.content.zones[0].margin_mm))
        near = any(clearance < margin + TIGHT_MM for clearance, margin in away)
        touched = self.off is not None and any(clearance < self.off for clearance, _ in away)
        if near or touched or away[0][0] <= self.surface.off_mm:
            return "tight"
        return "unknown" if self.off is None or not self.complete else "fits"

    def _from_ball(self, centre: Floats, radius: float) -> float:
        along = np.linspace(0.0, 1.0, 400)[:, None, None, None]
        start, end = self.run.segments_start, self.run.segments_end
        away = np.linalg.norm(start + along * (end - start) - centre, axis=-1) - self.tool.radius
        return float(away.min()) - radius

    def on_the_border(self, plan: Plan) -> bool:
        """Whether the samples of a shape decide by less than they are exact."""
        if self.ball is None or self.refused:
            return False
        clearance, margin = self._from_ball(*self.ball), plan.content.zones[0].margin_mm
        edges = [margin + TIGHT_MM, *([] if self.off is None else [self.off])]
        return any(abs(clearance - edge) < 0.05 for edge in edges)


def told(world: World, plan: Plan, step: Any) -> dict[str, str]:
    """By place, the text that it tells of a plan."""
    kept = settings_in_case(plan.content.settings, world.surface).kept_mm
    shown: ShownEvaluation = answered(world.services, plan, kept, lambda: world.planned.evaluate(plan))
    step._evaluations.stored.current = shown
    view = shown.view()
    panel = view["words"] if view["verdict"] is None else "".join(part["words"] for part in view["verdict"]["parts"])
    report = world.reports.of_plan(plan)
    public = PathReportPublic.model_validate(report.chosen, from_attributes=True)
    line = plan_evaluate._lines(report)[0]
    assert public.verdict == view["level"] == plan_evaluate.as_json(report)["verdict"]
    assert public.word == view["word"] == plan_evaluate.as_json(report)["word"]
    assert public.reason == plan_evaluate.as_json(report)["reason"]
    assert panel == view["words"] == public.words == line.removeprefix(f"* {plan.content.path.name}: ")
    assert view["short"] == public.short == plan_evaluate.as_json(report)["short"]
    if view["verdict"] is not None:  # its figures too: the one that decides comes first
        assert view["verdict"]["figures"][0]["level"] == public.verdict, (view["verdict"]["figures"], public.words)
    return {"card": view["short"] + ".", "sentences": panel, "REST": public.words, "command": line}


def test_every_place_tells_one_verdict(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of random drives, margins, structures, surfaces, registrations, scans and sides of the entry."""
    step = open_sample(phantom_services)
    world, reasons, levels = World(phantom_services, monkeypatch, 40), Counter[str](), Counter[str]()
    assert step._edited is not None
    step._edited.add_mode = "target"
    for _ in range(TRIALS):
        plan = world.next()
        places = told(world, plan, step)
        report = world.reports.of_plan(plan).chosen
        for place, text in places.items():
            text = text.removeprefix(f"* {plan.content.path.name}: ")
            assert text.startswith(f"{report.short}."), (place, text)
            assert text.startswith(WORD[report.verdict]), (place, text)
        assert report.word == WORD[report.verdict]
        if not world.on_the_border(plan):
            assert report.verdict == world.expected(plan), report.words
        if report.verdict == "blocked":
            assert "to be inspected" not in step.hint()
        elif isinstance(found := world.planned.evaluate(plan), PlanEvaluation):
            assert DryRunFigures.of(found, None).doubtful == (report.verdict != "fits")
        reasons[report.reason] += 1
        levels[report.verdict] += 1
    assert min(levels.values()) > 25, levels
    assert set(reasons) == set(IN_SHORT), reasons
