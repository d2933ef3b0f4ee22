"""Previews of dragged points: evaluated as the stored path, with the robot's base unchanged, and nothing stored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_doubles import SAMPLE, Later, open_sample, sections_of, send

from app.cases.settings import settings_in_case
from app.kit.errors import JobCancelled
from app.planning.drive import PREVIEW_STEP_MM
from app.planning.placement import StoredPlacement
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.previews import Dragged, with_points
from app.planning.rehearsal_options import NO_OPTIONS
from app.scene.dragging import DragEvent
from app.services import Services
from app.tabs.plan import commands as c
from app.tabs.plan.dry_runs import ShownEvaluation
from app.tabs.plan.live_previews import LivePreviews
from app.workspace.latest import Act
from vfix_engine.errors import PlanError, StartRefused
from vfix_engine.geometry.capsules import Segments
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.placing import started_at


def nobody(stage: str, fraction: float) -> None:
    """Listen to no progress."""


@pytest.fixture(scope="module")
def stored(phantom_services: Services) -> PlanEvaluation:
    return phantom_services.planning.evaluate(phantom_services.plans.get(SAMPLE))


def test_a_point_under_a_hand_is_judged_as_its_release_would_be_with_that_base(
    phantom_services: Services, stored: PlanEvaluation
) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    placing = StoredPlacement(stored.base, stored.q_start)
    point = plan.content.points[1]
    x, y, z = point.position
    wanted = (x + 0.8, y, z + 0.6)
    found = phantom_services.previews.of(plan, Dragged(point.id, wanted), placing, nobody).evaluation
    place = phantom_services.planning.snap(phantom_services.cases.get(plan.case_id), wanted, plan).position
    moved = with_points(plan, [replace(p, position=place) if p.id == point.id else p for p in plan.content.points])
    robot = {**plan.content.robot, "base": stored.base.reshape(-1).tolist(), "q_start": stored.q_start.tolist()}
    exact = phantom_services.planning.evaluate(
        replace(moved, content=replace(moved.content, robot=robot))
    )  # 0.1 mm steps, placed there
    assert np.array_equal(found.base, stored.base)
    assert found.completed == exact.completed
    assert {found.verdict.level, exact.verdict.level} <= {"fits", "tight"}  # it may lie on the border of both
    assert found.verdict.nearest == exact.verdict.nearest
    assert found.min_clearance_mm == pytest.approx(exact.min_clearance_mm, abs=0.05)
    assert len(found.run.s) < 0.7 * len(exact.run.s)  # in steps of 0.2 mm
    # Every clearance is the exact one of the whole tool in that pose, as far as the controller looks.
    reach_mm = settings_in_case(plan.content.settings, phantom_services.cases.get(plan.case_id).uncertainty).reach_mm
    tree, tool = phantom_services.planning.bone(moved).tree, Tool.load(plan.content.tool)
    for row in range(0, len(found.run.s), 40):
        tool_there = Segments(found.run.segments_start[row], found.run.segments_end[row], tool.radius)
        assert found.run.clearance[row] == pytest.approx(min(tree.closest(tool_there).distance, reach_mm), abs=1e-6)
    assert phantom_services.plans.get(SAMPLE).revision == plan.revision


def test_an_entry_that_is_dragged_takes_the_robot_along_with_its_base_kept(
    phantom_services: Services, stored: PlanEvaluation
) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    entry = plan.content.points[0]
    x, y, z = entry.position
    hand = Dragged(entry.id, (x, y - 2.0, z - 1.0))
    placing = StoredPlacement(stored.base, stored.q_start)
    found = phantom_services.previews.of(plan, hand, placing, nobody).evaluation
    assert np.array_equal(found.base, stored.base)
    assert np.linalg.norm(found.run.tip[0] - found.positions[0]) < 1e-3  # it begins there
    assert PREVIEW_STEP_MM == 0.2


def test_a_shaft_that_is_turned_is_driven_in_that_direction(phantom_services: Services, stored: PlanEvaluation) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    run = stored.run
    tail = run.segments_end[0, -1] - run.tip[0]
    tail /= np.linalg.norm(tail)
    turned = tail + np.array([0.05, 0.0, 0.0])
    x, y, z = (turned / np.linalg.norm(turned)).tolist()
    placing = StoredPlacement(stored.base, stored.q_start)
    found = phantom_services.previews.of(plan, Dragged(plan.content.points[0].id, direction=(x, y, z)), placing, nobody)
    start, end = found.evaluation.run.segments_start[0], found.evaluation.run.segments_end[0]
    straight = Tool.load(plan.content.tool).bend == 0.0
    along = (end[-1] - start[0 if straight else -1]) / np.linalg.norm(end[-1] - start[0 if straight else -1])
    before = (run.segments_end[0, -1] - run.segments_start[0, -1]) / np.linalg.norm(
        run.segments_end[0, -1] - run.segments_start[0, -1]
    )
    assert np.degrees(np.arccos(np.clip(along @ before, -1.0, 1.0))) > 0.5


def test_a_robot_that_does_not_reach_the_new_entry_says_so(stored: PlanEvaluation) -> None:
    from vfix_engine.geometry.path import SplinePath

    placed = RobotModel.load("steady_hand").placed(stored.base, Tool.load("bent_30"))
    far = SplinePath(np.array([[900.0, 0.0, 0.0], [910.0, 0.0, 0.0]]))
    with pytest.raises(StartRefused, match="does not reach the entry from where it stands"):
        started_at(placed, stored.q_start, far)


def test_a_run_for_an_older_place_of_the_hand_ends(phantom_services: Services, stored: PlanEvaluation) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    placing, steps = StoredPlacement(stored.base, stored.q_start), list[float]()

    def moves_on(stage: str, fraction: float) -> None:
        steps.append(fraction)
        if len(steps) > 20:
            raise JobCancelled

    with pytest.raises(JobCancelled):
        phantom_services.previews.of(
            plan, Dragged(plan.content.points[1].id, plan.content.points[1].position), placing, moves_on
        )
    assert len(steps) == 21
    assert max(steps) < 0.5


def test_the_newest_place_alone_is_judged_and_what_is_old_is_greyed(
    phantom_services: Services, stored: PlanEvaluation
) -> None:
    plan, executor, ran = phantom_services.plans.get(SAMPLE), Later(), list[Act]()
    live = LivePreviews(phantom_services, executor, ran.append)
    known = ShownEvaluation("done", evaluation=stored, margin_mm=0.3)
    placing, point = StoredPlacement(stored.base, stored.q_start), plan.content.points[1]
    x, y, z = point.position
    for step in range(4):
        live.ask(plan, Dragged(point.id, (x, y, z + 0.1 * step)), known, placing, NO_OPTIONS)
    view = live.current.view()
    assert (view["status"], view["state"], view["level"]) == ("computing", "drag_waits", None)
    assert view["verdict"] is not None  # greyed, of the stored path
    assert live.current.samples() is None  # the path has no colours of another one
    while executor.work:
        executor.work.pop(0)()
    assert len(ran) == 2, "the place that was judged already and the newest; two places between are left out"
    ran[0]()
    view = live.current.view()
    assert (view["status"], view["state"]) == ("computing", "drag_waits")
    assert live.current.before not in (stored, None), "greyed, of the place where the hand was"
    ran[1]()
    view = live.current.view()
    assert (view["status"], view["state"]) == ("done", "drag")
    assert "While you drag" in view["state_words"]
    live.ask(plan, Dragged(point.id, (x, y, z + 1.0)), known, placing, NO_OPTIONS)
    assert live.current.before is not stored, "the last place of the hand is what is greyed"
    ran[1]()
    assert live.current.status == "computing", "an answer to an older place stays grey"
    live.ask(plan, Dragged(plan.content.points[2].id, (x, y, z + 1.0)), known, placing, NO_OPTIONS)
    kept = live.current.before
    ran[0]()
    assert live.current.before is kept, "an answer to a drag of another point is dropped"


def test_a_drag_is_live_and_its_release_is_one_edit(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Live")
    step = open_sample(phantom_services, plan.id)
    judged, evaluation = step._evaluations, phantom_services.planning.evaluate(plan)
    sections_of(step)
    judged.stored.current = ShownEvaluation("done", evaluation=evaluation)
    sections_of(step)
    point = plan.content.points[1]
    x, y, z = point.position
    step.handle(c.DragItem(type="item.drag", item_id=point.id, position=(x, y, z + 0.4)))
    shown = sections_of(step)["corridor"]
    assert shown["state"] == "drag_waits"
    assert phantom_services.plans.get(plan.id).revision == plan.revision
    step.handle(c.ItemCommand(type="item.drop", item_id=point.id))
    shown = sections_of(step)["corridor"]
    assert shown["state"] == "waits"  # placed again, the picture of the hand's last place greyed
    assert phantom_services.plans.get(plan.id).revision == plan.revision + 1
    send(step, "undo")
    assert phantom_services.plans.get(plan.id).content.points == plan.content.points
    # A target that is dragged changes nothing of the path.
    judged.stored.current = ShownEvaluation("done", evaluation=evaluation)
    sections_of(step)
    judged.stored.current = ShownEvaluation("done", evaluation=evaluation)
    step.handle(c.DragItem(type="item.drag", item_id=plan.content.targets[0].id, position=(x, y, z)))
    assert sections_of(step)["corridor"]["state"] == "current"
    phantom_services.plans.documents.delete(plan.id)


def test_a_place_within_bone_far_from_air_is_told(phantom_services: Services, stored: PlanEvaluation) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    placing = StoredPlacement(stored.base, stored.q_start)
    with pytest.raises(PlanError):
        phantom_services.previews.of(plan, Dragged(plan.content.points[1].id, (1e5, 0.0, 0.0)), placing, nobody)


def test_a_shaft_is_dragged_live_and_stored_as_one_edit(phantom_services: Services, stored: PlanEvaluation) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Shaft")
    point = plan.content.points[0]
    step = open_sample(phantom_services, plan.id)
    assert step._edited is not None
    step._edited.set_shaft(point.id, (0.0, -1.0, 0.0), None)
    step._edited.selected = point.id
    sections_of(step)
    step._evaluations.stored.current = ShownEvaluation("done", evaluation=stored)
    sections_of(step)
    before = phantom_services.plans.get(plan.id)
    x, y, z = point.position
    handle = (x + 3.0, y - 30.0, z - 4.0)
    step.dragged(DragEvent(f"shaft:{point.id}", "start", handle))
    sections = sections_of(step)
    assert sections["corridor"]["state"] == "drag_waits"
    assert sections["shaft"]["words"].startswith("The shaft leaves towards the front (A), ")
    assert phantom_services.plans.get(plan.id).revision == before.revision
    step.dragged(DragEvent(f"shaft:{point.id}", "end", handle))
    wanted = np.array([3.0, -30.0, -4.0]) / np.linalg.norm([3.0, -30.0, -4.0])
    assert phantom_services.plans.get(plan.id).content.points[0].direction == pytest.approx(wanted.tolist())
    assert phantom_services.plans.get(plan.id).revision == before.revision + 1
    send(step, "undo")
    assert phantom_services.plans.get(plan.id).content.points == before.content.points
    # A hand that does not move stores nothing, and one on a locked plan neither.
    revision = phantom_services.plans.get(plan.id).revision
    for phase in ("start", "end"):
        step.dragged(DragEvent(f"shaft:{point.id}", phase, (x, y - 30.0, z)))
    send(step, "lock", locked=True)
    locked = phantom_services.plans.get(plan.id).revision
    for phase in ("start", "end"):
        step.dragged(DragEvent(f"shaft:{point.id}", phase, handle))
    assert phantom_services.plans.get(plan.id).revision == locked
    assert locked == revision + 1  # of the lock itself
    send(step, "lock", locked=False)
    phantom_services.plans.documents.delete(plan.id)
