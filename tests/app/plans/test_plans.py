"""Plans: edits, undo and redo against a model of them, locks, conflicts, recovery."""

import threading
from typing import Any

import pytest
from hypothesis import HealthCheck
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test
from plan_editor import PlanEditor
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from app.cases.model import COLON_PHANTOM, HEAD_PHANTOM
from app.cases.service import Case, CaseFrame, CaseService
from app.kit.errors import NotFound, PlanConflict, PlanLocked, TooLarge
from app.plans.model import MAX_POINTS, PlanContent, PlanPoint, content_to_json
from app.plans.operations import PlanEdit
from app.plans.operations.document import LockPlan, RedoPlan, SetPlanSettings, UndoPlan
from app.plans.operations.instruments import KeepPlacement
from app.plans.operations.points import AddPoint, AddTarget, DeletePoint, MovePoint, RenamePoint, TakeTargets
from app.plans.service import Plan, PlanService
from app.services import Services
from app.store import Store
from app.store.errors import StorageError
from app.store.models import DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError, PlanError

PLACED = {"name": "steady_hand", "base": [float(n) for n in range(16)], "q_start": [0.0] * 7}


@pytest.fixture
def plan(plans: PlanService, case: Case) -> Plan:
    return plans.create(case.id, "Corridor")


@pytest.fixture
def editor(plans: PlanService, plan: Plan) -> PlanEditor:
    return PlanEditor(plans, plan.id)


def labels(editor: PlanEditor) -> list[str]:
    return [point.label for point in editor.plan.content.points]


def test_a_new_plan_knows_its_case(plan: Plan, case: Case) -> None:
    assert (plan.case_id, plan.case_hash) == (case.id, case.content_hash)
    assert plan.content.robot["base"] is None


def test_editors_of_two_programs_see_each_others_edits(store: Store, editor: PlanEditor, plan: Plan) -> None:
    """What an editor knows of a revision is not taken for another one's; undo and settings count as well."""
    other = PlanEditor(PlanService(store), plan.id)
    for turn in range(2):
        editor.do(AddPoint(position=(1, 2, turn)))
        other.do(AddPoint(position=(4, 5, turn)))
    assert labels(editor) == labels(other) == ["P1", "P2", "P3", "P4"]
    other.do(UndoPlan())
    other.do(SetPlanSettings(settings={"margin_mm": 0.5}))
    made = editor.do(AddPoint(position=(7, 8, 9)))
    assert [point.position for point in made.content.points[2:]] == [(1.0, 2.0, 1.0), (7.0, 8.0, 9.0)]
    assert made.content.settings == {"margin_mm": 0.5}
    assert made == editor.plan == other.plan


def test_an_edit_that_fails_is_not_known(editor: PlanEditor, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk refuses the commit: the next edit begins from what is stored."""
    editor.do(AddPoint(position=(1, 2, 3)))

    def full(session: Any) -> None:
        raise OperationalError("COMMIT", {}, Exception("database or disk is full"))

    with monkeypatch.context() as patch:
        patch.setattr("sqlalchemy.orm.Session.commit", full)
        with pytest.raises(StorageError):
            editor.do(AddPoint(position=(4, 5, 6)))
    assert editor.do(AddPoint(position=(7, 8, 9))) == editor.plan
    assert [point.position[0] for point in editor.plan.content.points] == [1.0, 7.0]


def test_points_are_added_inserted_moved_renamed_and_deleted(editor: PlanEditor) -> None:
    first = editor.add(AddPoint(position=(1, 2, 3)))
    last = editor.add(AddPoint(position=(7, 8, 9), label="end"))
    middle = editor.add(AddPoint(position=(4, 5, 6), index=1))
    assert labels(editor) == ["P1", "P2", "end"]
    editor.do(MovePoint(point_id=middle, position=(4.5, 5.5, 6.5)))
    editor.do(RenamePoint(point_id=middle, label="<b>middle</b>"))
    editor.do(DeletePoint(point_id=first))
    target = editor.add(AddTarget(position=(0, 0, 0), label="ostium"))
    editor.do(MovePoint(point_id=target, position=(1, 1, 1)))
    plan = editor.plan
    assert plan.content.points == (
        PlanPoint(middle, "<b>middle</b>", (4.5, 5.5, 6.5)),
        PlanPoint(last, "end", (7.0, 8.0, 9.0)),
    )
    assert plan.content.targets == (PlanPoint(target, "ostium", (1.0, 1.0, 1.0)),)
    assert plan.revision == 9
    editor.do(RenamePoint(point_id=target, label="sinus"))
    editor.do(DeletePoint(point_id=target))
    assert editor.plan.content.targets == ()


def test_targets_of_another_plan_are_taken_as_one_edit(
    plans: PlanService, cases: CaseService, case: Case, editor: PlanEditor
) -> None:
    other = PlanEditor(plans, plans.create(case.id, "Other").id)
    other.do(AddTarget(position=(1, 2, 3), label="ostium"))
    other.do(AddTarget(position=(4, 5, 6)))
    editor.do(AddTarget(position=(1, 2, 3), label="ostium"))  # here already
    taken = editor.do(TakeTargets(plan=other.plan.id)).content.targets
    assert [(one.label, one.position) for one in taken] == [("ostium", (1, 2, 3)), ("T1", (4, 5, 6))]
    assert not {one.id for one in taken} & {one.id for one in other.plan.content.targets}
    with pytest.raises(PlanError, match="not here already"):
        editor.do(TakeTargets(plan=other.plan.id))
    assert len(editor.do(UndoPlan()).content.targets) == 1
    other_head = cases.create(
        "Other", frame=CaseFrame("LPS", assumed=False), surfaces=dict(cases.display_meshes(case.id))
    )
    elsewhere = plans.create(other_head.id, "Elsewhere")
    with pytest.raises(PlanError, match="another head"):
        editor.do(TakeTargets(plan=elsewhere.id))


def test_the_history_outlives_the_process(store: Store, editor: PlanEditor, plan: Plan) -> None:
    for x in range(3):
        editor.do(AddPoint(position=(x, 0, 0)))
    editor.do(UndoPlan())
    again = PlanEditor(PlanService(store), plan.id)
    assert again.history() == (True, True)
    again.do(RedoPlan())
    assert labels(again) == ["P1", "P2", "P3"]
    for _ in range(3):
        again.do(UndoPlan())
    assert labels(again) == []
    assert not again.plan.can_undo
    assert again.plan.can_redo
    with pytest.raises(PlanError, match="nothing to undo"):
        again.do(UndoPlan())


@pytest.mark.parametrize(
    "position",
    [(float("nan"), 0, 0), (float("inf"), 0, 0), (1e4, 0, 0), (0, 0), (0, 0, 0, 0), ("1", 0, 0), (True, 0, 0)],
)
def test_positions_that_are_none_are_refused(editor: PlanEditor, position: tuple[float, ...]) -> None:
    """HAZ-05."""
    before = editor.plan
    point = editor.add(AddPoint(position=(0, 0, 0)))
    place: Any = position
    for edit in (AddPoint(position=place), AddTarget(position=place), MovePoint(point_id=point, position=place)):
        with pytest.raises(PlanError):
            editor.do(edit)
    assert len(editor.plan.content.points) == len(before.content.points) + 1


def test_a_locked_plan_stays_as_it_is(plans: PlanService, editor: PlanEditor) -> None:
    point = editor.add(AddPoint(position=(0, 0, 0)))
    editor.do(LockPlan(locked=True))
    assert (editor.plan.locked, editor.history()) == (True, (False, False))
    locked = editor.plan
    for act in (
        lambda: editor.do(MovePoint(point_id=point, position=(1, 1, 1))),
        lambda: editor.do(AddPoint(position=(1, 1, 1))),
        lambda: editor.do(UndoPlan()),
        lambda: plans.documents.delete(locked.id),
    ):
        with pytest.raises(PlanLocked):
            act()
    assert editor.plan == locked
    plans.documents.rename(locked.id, "Left")  # its name is no part of what is kept
    assert editor.plan.content == locked.content
    assert plans.documents.duplicate(locked.id, "Copy").locked is False
    editor.do(LockPlan(locked=False))
    editor.do(UndoPlan())
    assert labels(editor) == []


def test_a_stale_revision_changes_nothing(plans: PlanService, editor: PlanEditor) -> None:
    seen = editor.revision
    editor.do(AddPoint(position=(0, 0, 0)), expected_revision=seen)
    for act in (
        lambda: editor.do(AddPoint(position=(1, 1, 1)), expected_revision=seen),
        lambda: editor.do(UndoPlan(), expected_revision=seen),
        lambda: plans.documents.rename(editor.plan.id, "late", expected_revision=seen),
    ):
        with pytest.raises(PlanConflict):
            act()
    assert labels(editor) == ["P1"]


def test_of_many_writers_of_one_revision_one_wins(store: Store, plan: Plan) -> None:
    """Several editors, as of several processes."""
    outcomes: list[str] = []

    def write(n: int) -> None:
        try:
            PlanService(store).do(plan.id, AddPoint(position=(n, 0, 0)), expected_revision=plan.revision)
            outcomes.append("won")
        except PlanConflict:
            outcomes.append("lost")

    threads = [threading.Thread(target=write, args=(n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(outcomes) == ["lost"] * 7 + ["won"]


def test_another_path_drops_the_robots_placing(editor: PlanEditor) -> None:
    point = editor.add(AddPoint(position=(0, 0, 0)))
    editor.do(KeepPlacement(robot=PLACED))
    editor.do(AddTarget(position=(5, 5, 5)))
    editor.do(RenamePoint(point_id=point, label="entry"))
    assert editor.plan.content.robot == PLACED
    editor.do(MovePoint(point_id=point, position=(1, 0, 0)))
    assert editor.plan.content.robot == {"name": "steady_hand", "base": None, "q_start": None}
    editor.do(UndoPlan())
    assert editor.plan.content.robot == PLACED


@pytest.mark.parametrize(
    "robot",
    [{"name": "../x"}, {"base": [1.0] * 16}, {**PLACED, "base": [0.0] * 15}, {**PLACED, "q_start": [float("nan")]}],
)
def test_a_placing_that_is_none_is_refused(editor: PlanEditor, robot: dict[str, object]) -> None:
    with pytest.raises(InputError):
        editor.do(KeepPlacement(robot=robot))


def test_settings_are_checked(editor: PlanEditor) -> None:
    editor.do(SetPlanSettings(settings={"margin_mm": 0.5}))
    for wrong in ({"margin_mm": float("nan")}, {"margin_mm": -1.0}, {"speed": 1.0}):
        with pytest.raises(InputError):
            editor.do(SetPlanSettings(settings=wrong))
    assert editor.plan.content.settings == {"margin_mm": 0.5}


def test_a_plan_stored_with_a_retired_setting_stays_open(store: Store, editor: PlanEditor, plan: Plan) -> None:
    _store(store, plan, settings={"margin_mm": 0.5, "group_flat_mm": 4.0})
    assert editor.plan.content.settings == {"margin_mm": 0.5}
    editor.do(SetPlanSettings(settings={"k_d": 0.3}))
    assert editor.plan.content.settings == {"margin_mm": 0.5, "k_d": 0.3}


def test_settings_are_no_step_of_the_points_history(editor: PlanEditor) -> None:
    """A slider moved in a rehearsal takes no redo away, and undo takes back points alone."""
    editor.do(AddPoint(position=(1, 0, 0)))
    editor.do(AddPoint(position=(2, 0, 0)))
    editor.do(UndoPlan())
    seen = editor.revision
    editor.do(SetPlanSettings(settings={"margin_mm": 0.1 + 0.2}), expected_revision=seen)
    assert editor.revision == seen + 1
    editor.do(RedoPlan())
    assert labels(editor) == ["P1", "P2"]
    editor.do(UndoPlan())
    editor.do(UndoPlan())
    assert labels(editor) == []
    assert not editor.plan.can_undo
    assert editor.plan.content.settings == {"margin_mm": 0.1 + 0.2}


def _store(store: Store, plan: Plan, **changes: Any) -> None:
    """Write into the newest state of a plan behind the editor's back."""
    with store.writing() as session:
        row = session.get(DocumentRow, plan.id)
        assert row is not None
        state = session.get(DocumentStateRow, (plan.id, row.cursor))
        assert state is not None
        row.settings = {**row.settings, **changes.pop("settings", {})}
        state.content = {**state.content, **changes}


def test_a_state_that_no_longer_validates_leaves_the_other_plans_alone(
    store: Store, plans: PlanService, editor: PlanEditor, plan: Plan, case: Case
) -> None:
    """It is listed with the reason, refused by name, and can be taken back, deleted and restored."""
    other = plans.create(case.id, "Sound")
    editor.do(AddPoint(position=(1, 2, 3)))
    sound = editor.plan.content.points
    editor.do(AddPoint(position=(4, 5, 6)))
    _store(store, plan, points=[{"id": "p", "label": "P1", "position": [99_999.0, 0.0, 0.0]}])
    listed = {listed.id: listed for listed in plans.list(case.id)}
    assert listed[other.id] == other
    assert (listed[plan.id].name, listed[plan.id].content.points) == ("Corridor", ())
    assert "10000 mm" in listed[plan.id].unreadable
    assert [(row.id, row.name) for row in plans.titles(case.id)] == [(plan.id, "Corridor"), (other.id, "Sound")]
    with pytest.raises(PlanError, match=r"'Corridor' cannot be read: .*10000 mm.*undo"):
        plans.get(plan.id)
    plans.documents.delete(plan.id)
    plans.documents.restore(plan.id)
    again = PlanEditor(PlanService(store), plan.id)
    again.do(LockPlan(locked=True))
    again.do(LockPlan(locked=False))
    again.do(UndoPlan())
    assert plans.get(plan.id).content.points == sound


@pytest.mark.parametrize("column", ["content", "settings"])
def test_what_is_nested_without_end_leaves_the_other_plans_alone(
    store: Store, plans: PlanService, plan: Plan, case: Case, column: str
) -> None:
    other = plans.create(case.id, "Sound")
    table, key = ("document_states", "document_id") if column == "content" else ("documents", "id")
    with store.writing() as session:
        deep = f"UPDATE {table} SET {column} = :deep WHERE {key} = :id"
        session.execute(text(deep), {"deep": "[" * 100_000 + "]" * 100_000, "id": plan.id})
    listed = {one.id: one for one in plans.list(case.id)}
    assert listed[other.id] == other
    assert "damaged" in listed[plan.id].unreadable


@pytest.mark.parametrize("stored", ["{", "[1]", '{"margin_mm": "wide"}', '{"no_setting": 1, "margin_mm": 2}'])
def test_a_plan_whose_settings_cannot_be_read_opens_once_it_is_given_new_ones(
    store: Store, editor: PlanEditor, plan: Plan, stored: str, caplog: pytest.LogCaptureFixture
) -> None:
    """As the refusal says; until then it does not open with a margin that nobody chose."""
    with store.writing() as session:
        session.execute(text("UPDATE documents SET settings = :stored"), {"stored": stored})
    with pytest.raises(PlanError, match=r"cannot be read.*set its settings anew with PATCH"):
        _ = editor.plan
    with pytest.raises(InputError, match=r"damaged|float|no_setting"):
        editor.do(SetPlanSettings(settings={}))
    assert not caplog.records
    assert editor.do(SetPlanSettings(settings={"view_distance_mm": 9.0})).content.settings == {"view_distance_mm": 9.0}
    assert plan.id in caplog.text
    assert editor.plan.content.settings == {"view_distance_mm": 9.0}
    with pytest.raises(InputError, match="margin_mm"):
        editor.do(SetPlanSettings(settings={"margin_mm": -1.0}))
    assert editor.plan.content.settings == {"view_distance_mm": 9.0}


def test_a_plan_that_was_locked_meanwhile_is_not_deleted(store: Store, plans: PlanService, plan: Plan) -> None:
    """The lock is looked at where the deletion is written: another process may have set it since."""
    refused: list[BaseException] = []

    def delete() -> None:
        try:
            plans.documents.delete(plan.id)
        except PlanLocked as error:
            refused.append(error)

    thread = threading.Thread(target=delete)
    with store.writing() as session:
        row = session.get(DocumentRow, plan.id)
        assert row is not None
        row.locked = True
        session.flush()
        thread.start()
        thread.join(0.3)  # it waits for the writer
    thread.join()
    after = plans.get(plan.id)
    assert (after.locked, after.deleted_at, len(refused)) == (True, None, 1)


@pytest.mark.parametrize("kind", ["points", "targets"])
def test_a_plan_has_some_hundreds_of_points_at_most(store: Store, plans: PlanService, case: Case, kind: str) -> None:
    """More are refused with the numbers; a plan stored with more can still be read and exported."""
    full = [PlanPoint(f"p-{n}", f"P{n}", (float(n), 0.0, 0.0)) for n in range(MAX_POINTS)]

    def having(points: list[PlanPoint]) -> PlanContent:
        return PlanContent().with_points(points) if kind == "points" else PlanContent(targets=tuple(points))

    plan = plans.create(case.id, "Full", having(full))
    editor = PlanEditor(plans, plan.id)
    add: PlanEdit = AddPoint(position=(0, 0, 1)) if kind == "points" else AddTarget(position=(0, 0, 1))
    with pytest.raises(TooLarge, match=f"{MAX_POINTS + 1} .*{MAX_POINTS} at most"):
        editor.do(add)
    more = having([*full, PlanPoint("p-more", "", (0.0, 0.0, 1.0))])
    with pytest.raises(TooLarge, match=f"{MAX_POINTS + 1}"):
        plans.create(case.id, "More", more)
    _store(store, plan, **content_to_json(more))
    assert len(getattr(plans.get(plan.id).content, kind)) == MAX_POINTS + 1


def test_plans_are_copied_renamed_deleted_and_restored(plans: PlanService, editor: PlanEditor, case: Case) -> None:
    editor.do(AddPoint(position=(1, 2, 3), label="entry"))
    plan = editor.plan
    copy = plans.documents.duplicate(plan.id)
    assert (copy.name, copy.content.points) == ("Corridor (copy)", plan.content.points)
    assert not plans.get(copy.id).can_undo
    plans.documents.rename(plan.id, "Left")
    plans.documents.delete(plan.id)
    assert [p.id for p in plans.list(case.id)] == [copy.id]
    with pytest.raises(PlanError, match="restore"):
        editor.do(AddPoint(position=(0, 0, 0)))
    plans.documents.restore(plan.id)
    assert plans.get(plan.id).name == "Left"
    assert plans.get(plan.id).content.points == plan.content.points
    with pytest.raises(InputError):
        plans.documents.rename(plan.id, "a\nb")
    with pytest.raises(NotFound):
        PlanEditor(plans, "nobody")
    with pytest.raises(PlanError):
        plans.create("no-case", "Plan")


class Editing(RuleBasedStateMachine):
    """Random edits with undo and redo, beside a plain list of states."""

    store: Store
    case_id: str

    def __init__(self) -> None:
        super().__init__()
        plan = PlanService(self.store).create(self.case_id, "stateful")
        self.editor = PlanEditor(PlanService(self.store), plan.id)
        self.states: list[PlanContent] = [plan.content]
        self.at = 0

    def record(self) -> None:
        self.states = [*self.states[: self.at + 1], self.editor.plan.content]
        self.at += 1

    coordinates = st.tuples(*[st.floats(-9999, 9999)] * 3)

    @rule(position=coordinates, index=st.integers(0, 3))
    def add(self, position: tuple[float, float, float], index: int) -> None:
        count = len(self.states[self.at].points)
        point = self.editor.add(AddPoint(position=position, index=min(index, count)))
        assert self.editor.plan.content.points[min(index, count)].id == point
        self.record()

    @rule(position=coordinates)
    def add_target(self, position: tuple[float, float, float]) -> None:
        self.editor.do(AddTarget(position=position))
        self.record()

    @precondition(lambda self: self.states[self.at].points)
    @rule(data=st.data(), position=coordinates)
    def move(self, data: st.DataObject, position: tuple[float, float, float]) -> None:
        point = data.draw(st.sampled_from(self.states[self.at].points))
        self.editor.do(MovePoint(point_id=point.id, position=position))
        assert position in [p.position for p in self.editor.plan.content.points]
        self.record()

    @precondition(lambda self: self.states[self.at].points)
    @rule(data=st.data())
    def delete(self, data: st.DataObject) -> None:
        self.editor.do(DeletePoint(point_id=data.draw(st.sampled_from(self.states[self.at].points)).id))
        self.record()

    @precondition(lambda self: self.at > 0)
    @rule()
    def undo(self) -> None:
        self.editor.do(UndoPlan())
        self.at -= 1

    @precondition(lambda self: self.at < len(self.states) - 1)
    @rule()
    def redo(self) -> None:
        self.editor.do(RedoPlan())
        self.at += 1

    @rule()
    def refused(self) -> None:
        with pytest.raises(NotFound):
            self.editor.do(DeletePoint(point_id="nobody"))

    @invariant()
    def as_the_model_says(self) -> None:
        assert self.editor.plan.content == self.states[self.at]
        assert self.editor.history() == (self.at > 0, self.at < len(self.states) - 1)


def test_undo_and_redo_follow_the_model(store: Store, case: Case) -> None:
    machine = type("EditingHere", (Editing,), {"store": store, "case_id": case.id})
    budget = hypothesis_settings(
        max_examples=12,
        stateful_step_count=25,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
    )
    run_state_machine_as_test(machine, settings=budget)


def test_a_lumen_takes_no_plan(phantom_services: Services) -> None:
    with pytest.raises(InputError, match="make a route instead"):
        phantom_services.plans.refuse_lumen(COLON_PHANTOM)
    phantom_services.plans.refuse_lumen(HEAD_PHANTOM)
