"""The figures of a verdict: the one that decides first, each with its place; the card's 'Show me' goes to the first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_doubles import SAMPLE

from app.planning.piercing import Pierced
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict_figures import VerdictFigure, verdict_figures
from app.planning.verdict_words import Doubt
from app.services import Services
from app.tabs.plan.clearance import ShownTool, verdict_view
from vfix_engine.runtime.snapshot import Blocker


@pytest.fixture(scope="module")
def found(phantom_services: Services) -> PlanEvaluation:
    return phantom_services.planning.evaluate(phantom_services.plans.get(SAMPLE))


def first(found: PlanEvaluation) -> VerdictFigure:
    assert verdict_view(found)["show_mm"] == next(one.s_mm for one in verdict_figures(found) if one.s_mm is not None)
    return verdict_figures(found)[0]


def test_the_gap_to_bone_is_shown_with_the_tool(found: PlanEvaluation, phantom_services: Services) -> None:
    """Its ends are as far apart as the dry run says that bone is, and at the least one the bone is looked at."""
    bone, least = phantom_services.planning.bone(phantom_services.plans.get(SAMPLE)).tree, found.verdict.obstacles[0]
    shown = ShownTool()
    place = shown.at(found, float(found.run.s[least.row]), bone)
    gap = shown.gap
    assert gap is not None
    assert gap.length_mm == pytest.approx(least.least_mm, abs=1e-6)
    assert np.linalg.norm(gap.on_tool - gap.on_bone) == pytest.approx(gap.length_mm, abs=1e-6)
    assert place == tuple(gap.on_bone)
    assert shown.at(found, 10.0, bone) == tuple(found.run.tip[np.abs(found.run.s - 10.0).argmin()])
    shown.clear()
    assert shown.gap is None


def test_a_pierced_wall_comes_first_at_its_place(found: PlanEvaluation, phantom_services: Services) -> None:
    bone = phantom_services.planning.bone(phantom_services.plans.get(SAMPLE)).tree
    wall = Pierced("wall", 12.0, 5.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 31.0, "on the left")
    verdict = replace(found.verdict, level="pierces", reason="wall", pierced=wall)
    assert verdict.short.startswith("Blocked: ")
    assert first(replace(found, verdict=verdict)) == VerdictFigure("wall pierced", None, "pierces", 31.0)
    tip = ShownTool().at(found, 31.0, bone)
    shown = ShownTool()
    assert shown.at(replace(found, verdict=verdict), 31.0, bone) == (0.0, 0.0, 0.0) != tip
    assert shown.at(replace(found, verdict=verdict), 40.0, bone) == ShownTool().at(found, 40.0, bone)
    assert verdict.pierced_place == (31.0, (0.0, 0.0, 0.0))
    assert replace(verdict, reason="held").pierced_place is None
    skin = replace(found.verdict, level="blocked", reason="pierced", pierced=replace(wall, state="room"))
    assert first(replace(found, verdict=skin)) == VerdictFigure("skin pierced", None, "blocked", 31.0)


def test_the_side_of_the_entry_comes_before_what_else_is_unknown(found: PlanEvaluation) -> None:
    verdict = replace(found.verdict, level="unknown", reason="side", side_caution="The entry is on the right.")
    doubtful = replace(found, verdict=verdict, profile=replace(found.profile, off_unknown=True))
    assert [one.name for one in verdict_figures(doubtful)[:2]] == ["side of the entry", "registration error"]
    assert first(doubtful).s_mm == 0.0


def test_the_registration_error_is_where_it_leaves_least(found: PlanEvaluation) -> None:
    s = found.profile.s
    profile = replace(found.profile, off_mm=np.linspace(0.1, 0.5, len(s)))
    names = {one.name: one for one in verdict_figures(replace(found, profile=profile))}
    assert names["registration error"] == VerdictFigure("registration error", 0.5, "fits", float(s[-1]))
    doubt = Doubt(0.3, 0.2, 0.3, "bone", 12.0)
    verdict = replace(found.verdict, level="tight", reason="registration", doubt=doubt)
    assert first(replace(found, profile=profile, verdict=verdict)) == VerdictFigure(
        "registration error", 0.3, "tight", 12.0
    )


def test_soft_tissue_is_shown_where_the_tool_is_longest_in_it(found: PlanEvaluation) -> None:
    tissue = found.profile.tissue
    assert tissue is not None
    (figure,) = (one for one in verdict_figures(found) if one.name == "in soft tissue")
    assert figure.value == tissue.length.max() == tissue.length[found.profile.s == figure.s_mm][0]
    assert figure.s_mm != found.verdict.tissue_s_mm, "the deepest place is another one"


def test_the_obstacle_that_leaves_least_above_its_margin_comes_first(found: PlanEvaluation) -> None:
    bone = found.verdict.obstacles[0]
    nerve = replace(bone, name="nerve", margin_mm=bone.margin_mm + 0.1)
    both = replace(found, verdict=replace(found.verdict, obstacles=(bone, nerve)))
    assert [one.name for one in verdict_figures(both)[:2]] == ["nerve", "bone"]
    hidden = replace(both.verdict, level="tight", reason="surface")
    assert first(replace(found, verdict=hidden)).name == "bone"


def test_what_stops_the_tool_comes_first_where_it_does(found: PlanEvaluation) -> None:
    bone = found.verdict.obstacles[0]
    nerve = replace(bone, name="nerve", margin_mm=bone.margin_mm - 0.1)
    verdict = replace(found.verdict, level="blocked", reason="held", obstacles=(bone, nerve))

    def stopped(stop: Blocker | None) -> list[tuple[str, str, float | None]]:
        run = replace(found.run, completed=False, stopped_by=stop)
        figures = verdict_figures(replace(found, run=run, verdict=verdict))
        return [(one.name, one.level, one.s_mm) for one in figures if one.level == "blocked"]

    reach = ("reach", "blocked", found.reached_mm)
    assert stopped(Blocker("bone", "bone", "shaft")) == [("bone", *reach[1:]), reach]
    assert stopped(Blocker("zone", "nerve (2 of 4)", "tip")) == [("nerve", *reach[1:]), reach]
    assert stopped(Blocker("joint", "insertion")) == [("joint limit", *reach[1:]), reach]
    assert stopped(None) == [reach]


def test_bone_beyond_what_is_measured_is_at_least_that_far(found: PlanEvaluation) -> None:
    bone, reach = found.verdict.obstacles[0], found.run.exact_to_mm
    for least, at_least in ((reach - 0.1, False), (reach, True)):
        far = replace(bone, clearance=np.maximum(bone.clearance, least))
        verdict = replace(found.verdict, obstacles=(far, replace(far, name="nerve")))
        figures = {one.name: one for one in verdict_figures(replace(found, verdict=verdict))}
        assert (figures["bone"].at_least, figures["nerve"].at_least) == (at_least, False)
