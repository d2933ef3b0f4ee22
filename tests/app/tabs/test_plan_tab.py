"""The Plan tab: which plan may be opened, what a drag leaves behind, whose dry run is shown."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest
from session_doubles import HEAD, SAMPLE, Later, fail, open_sample, other_case, sections_of, send

from app.cases.service import Case
from app.documents import DocumentKind
from app.documents.rows import touch
from app.kit.cache import Cache
from app.kit.jobs import Job
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.planning.remote_centre import PathPlace
from app.plans.operations.document import RedoPlan, SetPlanSettings, UndoPlan
from app.plans.operations.paths import SetShaft
from app.plans.operations.points import AddTarget, DeletePoint, RenamePoint
from app.scene import palette
from app.services import Services
from app.store.errors import StorageError
from app.store.models import DocumentRow, DocumentStateRow
from app.tabs.plan import commands as c
from app.tabs.plan.dry_runs import DryRuns, ShownEvaluation, failed_run
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.hints import plan_hint
from app.workspace.latest import Act
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import InputError, PlanError


def test_the_dry_run_of_an_older_plan_is_not_shown_for_a_newer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer waits in the inbox behind the very edit that makes it old."""
    waiting: list[Act] = []
    executor = Later()
    runs = DryRuns(SimpleNamespace(), executor, waiting.append)  # type: ignore[arg-type]
    monkeypatch.setattr(runs, "_answer", lambda plan, *rest: ShownEvaluation("done", plan.id, completed=True))
    runs.ask(SimpleNamespace(id="old"), 0.3)
    executor.work.pop()()
    runs.ask(SimpleNamespace(id="new"), 0.3)
    waiting.pop()()
    assert runs.current.status == "computing"
    executor.work.pop()()
    waiting.pop()()
    assert runs.current.words == "new"


def test_a_dry_run_whose_case_cannot_be_read_has_failed(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    step, executor = open_sample(phantom_services), Later()
    monkeypatch.setattr(phantom_services.cases, "get", lambda case_id: fail(StorageError("the disk is broken")))
    monkeypatch.setattr(phantom_services.dry_runs, "evaluate", lambda *given: SimpleNamespace())
    runs = DryRuns(phantom_services, executor, lambda act: act())
    runs.ask(step.plan, 0.3)
    executor.work.pop()()
    assert (runs.current.status, runs.current.words) == ("failed", "the disk is broken")


def test_the_pages_dry_run_is_the_one_that_others_ask_for(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One job drives the plan for the page and for REST; cancelled, the page says so."""
    services = phantom_services
    plan = services.plans.documents.duplicate(SAMPLE, "Shared")
    services.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.45}))
    plan = services.plans.get(plan.id)
    job, executor, ran, wait = services.dry_runs.start(plan), Later(), list[ShownEvaluation](), services.jobs.wait

    def cancelled_while_awaited(job_id: str) -> Job:
        services.jobs.cancel(job_id)
        return wait(job_id)

    monkeypatch.setattr(services.jobs, "wait", cancelled_while_awaited)
    runs = DryRuns(services, executor, lambda act: (act(), ran.append(runs.current)))
    runs.ask(plan, 0.45)
    executor.work.pop()()
    began, ended = ran
    assert (began.status, began.job) == ("computing", job.id)  # the page shows how far it is, and can cancel it
    assert (ended.status, ended.cancelled, ended.view()["job"]) == ("failed", True, None)
    assert ended.words == "Simulation cancelled: fit unknown."
    assert [known.id for known in services.jobs.list(plan.case_id) if known.subject == "Shared"] == [job.id]
    services.plans.documents.delete(plan.id)


def test_a_dry_run_is_made_again_when_somebody_asks_and_with_the_options_of_the_rehearsal(
    phantom_services: Services,
) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Again")
    step, asked = open_sample(phantom_services, plan.id), list[RehearsalOptions]()
    step._evaluations.stored.ask = lambda plan, kept, options, before: asked.append(options)  # type: ignore[method-assign]
    step._evaluations.again()
    sections_of(step)
    sections_of(step)
    assert asked == [NO_OPTIONS]
    step.handle(c.EditCommand(type="dry_run.again"))
    sections_of(step)
    phantom_services.rehearsal_options.choose(plan.id, RehearsalOptions(centre=PathPlace(at_mm=3.0)))
    sections_of(step)  # where the remote centre would be is nothing while it is off
    phantom_services.rehearsal_options.choose(plan.id, RehearsalOptions(speed_limit=True))
    sections_of(step)
    assert asked == [NO_OPTIONS, NO_OPTIONS, RehearsalOptions(speed_limit=True)]
    phantom_services.plans.documents.delete(plan.id)


def test_a_plan_of_another_head_or_a_deleted_one_is_not_opened(phantom_services: Services) -> None:
    services = phantom_services
    other = other_case(services)
    foreign = services.plans.create(other.id, "Foreign")
    gone = services.plans.create(HEAD, "Gone")
    services.plans.documents.delete(gone.id)
    step = open_sample(services)
    for plan_id, words in ((foreign.id, "another head"), (gone.id, "deleted")):
        for kind in ("plan.open", "plan.duplicate"):
            with pytest.raises(PlanError, match=words):
                send(step, kind, plan_id=plan_id)
            assert step.plan_id == SAMPLE
    services.cases.delete(other.id)


def test_the_newest_plan_of_a_head_is_opened(phantom_services: Services) -> None:
    newest = phantom_services.plans.create(HEAD, "Newest")
    step = open_sample(phantom_services)
    step.open(HEAD, None)
    assert step.plan_id == newest.id
    phantom_services.plans.documents.delete(newest.id)


@pytest.mark.parametrize("end", ["cancel", "let_go", "undo", "delete", "elsewhere"])
def test_a_drag_that_never_ends_leaves_nothing_behind(phantom_services: Services, end: str) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    edited = EditedPlan(phantom_services, plan.id)
    first, second = plan.content.points[0].id, plan.content.points[1].id
    edited.perform(RenamePoint(point_id=second, label="Second"))
    edited.drag(first, (1.0, 2.0, 3.0))
    assert edited.dragging
    if end == "delete":
        edited.perform(DeletePoint(point_id=second))
    elif end == "elsewhere":
        phantom_services.plans.do(plan.id, DeletePoint(point_id=first))
        edited.refresh()
    elif end == "undo":
        edited.perform(UndoPlan())
    else:
        getattr(edited, end)()
    assert not edited.dragging
    assert (1.0, 2.0, 3.0) not in edited.points()
    phantom_services.plans.documents.delete(plan.id)


def test_the_path_is_coloured_with_what_an_export_says(phantom_services: Services) -> None:
    step = open_sample(phantom_services)
    evaluation = phantom_services.planning.evaluate(step.plan)
    step._evaluations.stored.current = ShownEvaluation("done", evaluation=evaluation)
    places, clearance = step.curve()
    samples, _ = phantom_services.planning.curve(step.plan)
    assert places is not None
    assert clearance is not None
    assert [tuple(place) for place in places.tolist()] == [sample.position for sample in samples]
    assert clearance.min() == min(sample.clearance_mm for sample in samples if sample.clearance_mm is not None)


def test_the_verdict_names_bone_soft_tissue_and_what_the_margin_leaves_open(phantom_services: Services) -> None:
    step = open_sample(phantom_services)
    ran: list[ShownEvaluation] = []
    executor = Later()
    shown = DryRuns(phantom_services, executor, lambda act: (act(), ran.append(shown.current)))
    for margin in (0.3, 0.4):
        shown.ask(step.plan, margin)
        executor.work.pop()()
    ran = [answer for answer in ran if answer.status == "done"]
    assert re.fullmatch(
        r"Fits\. 1\.\d\d mm to bone at \d+ mm \(margin 0\.38\)\. The shaft is nearest\. The margin includes "
        r"0\.08 mm for the error of the scan’s surface\. Presses soft tissue along \d\d mm of the tool, "
        r"\d\.\d mm deep at most \(at \d+ mm\); all of it at the nostril\. "
        r"The path ends 8\.\d mm before the nearest target, ‘opening of the auditory tube left’\.",
        ran[0].words,
    )
    assert [answer.warning for answer in ran] == ["", ""]  # what the surface may be off is kept as well
    assert ran[1].level == "fits"


def test_a_clearance_within_what_the_scan_leaves_open_is_no_fit(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """4 mm slices leave two millimetres open: 1.4 mm from the surface may be bone."""
    monkeypatch.setattr(Case, "uncertainty", SurfaceUncertainty(0.0, 4.0))
    monkeypatch.setattr(phantom_services.planning, "_evaluations", Cache(1))  # those known are of the case as it is
    step, executor = open_sample(phantom_services), Later()
    runs = DryRuns(phantom_services, executor, lambda act: act())
    runs.ask(step.plan, 0.3)
    executor.work.pop()()
    answer = runs.current
    assert re.match(
        r"Tight: bone may be nearer than shown\. 1\.\d\d mm to bone at \d+ mm \(margin 0\.30\)\. "
        r"The shaft is nearest\. Bone may lie 2\.00 mm off its surface\. ",
        answer.words,
    )
    assert answer.completed
    assert answer.evaluation is not None
    assert (answer.evaluation.verdict.level, answer.evaluation.verdict.reason) == ("tight", "surface")


def test_choosing_the_chosen_point_again_brings_the_slices_back_to_it(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = open_sample(phantom_services)
    point, went = step.items()[2], list[object]()
    monkeypatch.setattr(step.workspace.case, "go_to", went.append)
    for number in (1, 2):
        step.handle(c.ItemCommand(type="item.select", item_id=point.id))
        assert went == number * [point.position]


def test_the_list_of_plans_does_not_read_what_they_contain(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = open_sample(phantom_services)
    read: list[str] = []
    monkeypatch.setattr(DocumentKind, "content", lambda *_: read.append("content"))
    listed = step.sections()["plans"].build()
    assert read == []
    assert SAMPLE in [plan["id"] for plan in listed["items"]]  # type: ignore[index]


def test_a_plan_that_cannot_be_read_does_not_keep_its_head_closed(phantom_services: Services) -> None:
    """The newest plan that can be read is opened, and the reason is said; one that goes bad while open is closed."""
    services = phantom_services
    good, bad = services.plans.documents.duplicate(SAMPLE, "Good"), services.plans.documents.duplicate(SAMPLE, "Bad")
    step = open_sample(services)
    step.handle(c.OpenPlan(type="plan.open", plan_id=bad.id))
    with services.store.writing() as session:
        state = session.get(DocumentStateRow, (bad.id, 0))
        assert state is not None
        state.content = {**state.content, "points": "none"}
        row = session.get(DocumentRow, bad.id)
        assert row is not None
        touch(row)
    with pytest.raises(InputError, match="'Bad' cannot be read"):
        sections_of(step)
    sections_of(step)
    assert step.plan_id is None
    assert "'Bad' cannot be read" in step.open(HEAD, None)
    assert step.plan_id == good.id
    assert step.open(HEAD, SAMPLE) == ""
    for plan in (good, bad):
        services.plans.documents.delete(plan.id)


def test_undo_pressed_once_too_often_is_no_error(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    edited = EditedPlan(phantom_services, plan.id)
    assert (edited.perform(UndoPlan()), edited.perform(RedoPlan())) == (
        "There is nothing to undo.",
        "There is nothing to redo.",
    )
    phantom_services.plans.documents.delete(plan.id)


def test_undo_says_what_it_took_back(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    edited = EditedPlan(phantom_services, plan.id)
    was = plan.content.points[0].label
    edited.perform(RenamePoint(point_id=plan.content.points[0].id, label="Entry"))
    way = f"Path ‘{plan.content.path.name}’: point ‘Entry’: renamed from ‘{was}’."
    assert (edited.perform(UndoPlan()), edited.perform(RedoPlan())) == (f"Undone: {way}", f"Redone: {way}")
    edited.perform(DeletePoint(point_id=plan.content.targets[0].id))
    assert edited.perform(UndoPlan()) == f"Undone: Target ‘{plan.content.targets[0].label}’ is gone."
    phantom_services.plans.documents.delete(plan.id)


def test_the_hint_says_whether_the_tool_was_stopped_or_not_driven_at_all() -> None:
    held, clear = ("blocked", "held"), ("fits", "clear")
    for mode in ("point", "target"):  # a click that is waited for does not hide that the path is blocked
        hint = plan_hint(3, 0, mode, False, False, held)  # type: ignore[arg-type]
        assert hint == "Move the grey points, or change the tool."
    failed = failed_run("The simulation failed: the disk is broken.", 0.3)
    said = "Unknown: the simulation failed: the disk is broken"
    view = failed.view()
    assert (failed.short, view["short"], view["level"], view["word"]) == (said, said, "unknown", "Unknown")
    assert plan_hint(3, 1, "point", False, False, None).startswith("Drag a point")
    assert plan_hint(1, 0, "point", False, False, None).startswith("Click further in, or add a target")
    assert plan_hint(1, 1, "point", False, False, None) == "Suggest a path, or click further in."
    assert plan_hint(1, 1, "target", False, False, None) == "Suggest a path, or click another target."
    assert plan_hint(1, 1, "point", False, False, None, "runs") == ""
    assert plan_hint(1, 1, "point", False, False, None, "none").startswith("No way: move entry")
    assert plan_hint(3, 1, "point", False, False, held, "ways") == "Choose a way and use it."  # type: ignore[arg-type]
    skin, wall = ("blocked", "pierced"), ("pierces", "wall")
    hints = [plan_hint(3, 1, "point", False, False, skin, "", nostril) for nostril in (False, True)]  # type: ignore[arg-type]
    assert [re.split("[:,]", hint)[0] for hint in hints] == [
        "Lead the path through the nostril",
        "Turn the shaft",
    ]
    hint = plan_hint(3, 1, "point", False, False, wall, "", True, 42.6)  # type: ignore[arg-type]
    assert hint == "Pierces a wall between air spaces at 43 mm: go round."
    assert (ShownEvaluation("computing").short, ShownEvaluation("computing").level) == ("", None)
    hint = plan_hint(3, 0, "target", False, False, clear)  # type: ignore[arg-type]
    assert hint.startswith("Click a target")
    assert plan_hint(3, 1, "target", False, False, clear) == "Go to Rehearse."  # type: ignore[arg-type]
    hint = plan_hint(3, 1, "point", False, True, held)  # type: ignore[arg-type]
    assert hint.startswith("Locked.")


def test_the_scale_names_the_colour_of_what_the_tool_does_not_reach() -> None:
    def unknown(completed: bool) -> str | None:
        scale = ShownEvaluation("done", completed=completed).view()["scale"]
        assert scale is not None
        assert scale["blocked"] == palette.hex_colour(palette.PIERCED)
        return scale["unknown"]

    assert unknown(True) is None
    assert unknown(False) == palette.hex_colour(palette.UNKNOWN)


def test_a_version_that_differs_in_settings_alone_is_not_gone_back_to(phantom_services: Services) -> None:
    """Settings are no step of the history: going back would leave them."""
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Versions")
    version = phantom_services.versions.save(plan.id, "Before")
    phantom_services.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.5}))
    step = open_sample(phantom_services, plan.id)
    step.handle(c.CompareVersion(type="version.compare", version_id=version.id))
    view = sections_of(step)["versions"]
    assert (len(view["changes"]), view["differs"]) == (1, False)
    phantom_services.plans.do(plan.id, DeletePoint(point_id=plan.content.points[1].id))
    assert sections_of(step)["versions"]["differs"] is True
    phantom_services.plans.documents.delete(plan.id)


def test_the_plan_that_was_opened_last_is_known_to_the_link(phantom_services: Services) -> None:
    live = phantom_services.live
    live.opened("another page", "its plan")
    step = open_sample(phantom_services)
    assert live.plan_id == step.plan_id == SAMPLE
    step.close()
    assert live.plan_id == "its plan"
    live.opened("another page", None)
    assert live.plan_id is None


def test_a_page_without_a_head_leaves_the_plan_of_another_page_to_the_link(phantom_services: Services) -> None:
    live = phantom_services.live
    live.opened("another page", "its plan")
    phantom_services.cases.delete(HEAD)
    try:
        assert open_sample(phantom_services).plan_id is None
        assert live.plan_id == "its plan"
    finally:
        phantom_services.cases.restore(HEAD)
        live.opened("another page", None)


def test_a_shaft_is_rolled_about_its_direction_and_left_open(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Shaft")
    tab = open_sample(phantom_services, plan.id)
    item_id = plan.content.points[1].id
    send(tab, "shaft.clear", item_id=item_id)
    with pytest.raises(PlanError, match="aim the shaft first"):
        send(tab, "shaft.roll", item_id=item_id, roll_deg=30.0)
    phantom_services.plans.do(plan.id, SetShaft(point_id=item_id, direction=(0.0, 0.0, 1.0)))
    sections_of(tab)
    send(tab, "shaft.roll", item_id=item_id, roll_deg=30.0)
    point = phantom_services.plans.get(plan.id).content.points[1]
    assert (point.direction, point.roll_deg) == ((0.0, 0.0, 1.0), 30.0)
    send(tab, "shaft.clear", item_id=item_id)
    assert phantom_services.plans.get(plan.id).content.points[1].direction is None
    phantom_services.plans.documents.delete(plan.id)


def test_a_click_on_a_target_leads_the_path_there_and_one_more_selects_what_is_there(
    phantom_services: Services,
) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Clicked")
    tab = open_sample(phantom_services, plan.id)
    gone = plan.content.points[-2]
    assert tab._edited is not None
    tab._edited.perform(AddTarget(position=gone.position))
    assert tab.plan is not None
    target = tab.plan.content.targets[-1]
    send(tab, "item.delete", item_id=gone.id)  # the target is where the tool fits
    edited, points = tab._edited, len(plan.content.points)
    edited.add_mode = "none"
    edited.click_item(target.id)
    assert (edited.selected, len(edited.points())) == (target.id, points - 1)
    edited.add_mode = "point"
    edited.click_item(target.id)
    assert edited.points()[-1] == pytest.approx(target.position, abs=1e-6)
    ending = edited.selected
    assert ending == edited.plan.content.points[-1].id
    send(tab, "pick.slice", position=list(target.position))  # as a slice says it
    assert (edited.selected, len(edited.points())) == (ending, points)
    edited.add_mode = "target"
    targets = len(edited.plan.content.targets)
    send(tab, "pick.slice", position=list(target.position))
    assert (edited.selected, len(edited.plan.content.targets)) == (target.id, targets)
    phantom_services.plans.documents.delete(plan.id)
