"""The counters by which whoever read the store knows that it is still so."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from plan_editor import PlanEditor

from app.cases.service import Case, CaseService
from app.plans.operations.document import UndoPlan
from app.plans.operations.points import AddPoint
from app.plans.service import PlanService
from app.settings import Settings
from app.store import Store
from app.store.changes import CASES
from vfix_engine.errors import PlanError

KINDS = (CASES, "plan", "registration")


@pytest.fixture
def elsewhere(settings: Settings, store: Store) -> Iterator[Store]:
    """The same data folder, opened by another process."""
    opened = Store(settings)
    yield opened
    opened.close()


def test_a_commit_counts_for_the_kinds_and_the_documents_that_it_stores(
    store: Store, cases: CaseService, plans: PlanService, case: Case
) -> None:
    changes = store.changes
    first, second = plans.create(case.id, "One").id, plans.create(case.id, "Two").id
    before, of_second = {kind: changes.of(kind) for kind in KINDS}, changes.of_document(second)
    made = plans.do(first, AddPoint(position=(1.0, 2.0, 3.0)))
    assert {kind for kind in KINDS if changes.of(kind) != before[kind]} == {"plan"}
    assert changes.of_document(first)[1] == made.revision
    assert changes.of_document(second) == of_second
    cases.rename(case.id, "Another name")
    assert {kind for kind in KINDS if changes.of(kind) != before[kind]} == {CASES, "plan"}


def test_what_was_refused_counts_nothing(store: Store, plans: PlanService, case: Case) -> None:
    editor, count = PlanEditor(plans, plans.create(case.id, "One").id), store.changes.count
    with pytest.raises(PlanError):
        editor.do(AddPoint(position=(1e9, 0.0, 0.0)))
    with pytest.raises(PlanError):
        editor.do(UndoPlan())
    assert store.changes.count == count


def test_what_another_process_stores_or_is_deleted_for_good_counts_for_everything(
    store: Store, elsewhere: Store, plans: PlanService, case: Case
) -> None:
    changes, plan = store.changes, plans.create(case.id, "One").id
    store.look()
    count, before = changes.count, {kind: changes.of(kind) for kind in KINDS}
    store.look()
    assert changes.count == count, "one's own are none of another process"
    PlanService(elsewhere).documents.rename(plan, "Elsewhere")
    assert changes.count == count, "nobody has looked"
    store.look()
    assert all(changes.of(kind) != before[kind] for kind in KINDS)
    count, of_plan = changes.count, changes.of_document(plan)
    PlanService(elsewhere).documents.rename(plan, "Elsewhere again")
    plans.create(case.id, "Two")  # a writer looks as well
    assert changes.count == count + 2
    assert changes.of_document(plan) != of_plan
    before = {kind: changes.of(kind) for kind in KINDS}
    plans.documents.discard(plan)
    assert all(changes.of(kind) != before[kind] for kind in KINDS)


def test_a_case_that_is_shown_is_read_again_once_one_was_stored(
    store: Store, elsewhere: Store, cases: CaseService, case: Case
) -> None:
    shown = cases.shown(case.id)
    assert cases.shown(case.id) is shown
    cases.rename(case.id, "Here")
    assert cases.shown(case.id).name == "Here"
    CaseService(elsewhere).rename(case.id, "Elsewhere")
    store.look()
    assert cases.shown(case.id).name == "Elsewhere"
