"""Documents of any kind: registered with a schema, checked, brought up from older schemas, with a history of edits."""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import pytest
from msgspec import Meta

from app.cases.service import Case
from app.documents import DocumentKind, Ref, new_in, struct_kind
from app.documents.documents import Documents
from app.kit.errors import DocumentConflict, DocumentLocked, NotFound
from app.plans.service import PlanService
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.kind import REGISTRATION
from app.store import Store
from app.store.models import DocumentStateRow
from vfix_engine.errors import InputError

QUARTER = (0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def registrations(store: Store) -> Documents[RegistrationContent]:
    return Documents(store, REGISTRATION)


def test_a_registration_is_the_identity_until_it_is_edited(
    registrations: Documents[RegistrationContent], case: Case
) -> None:
    made = registrations.create(case.id, "Beads")
    np.testing.assert_array_equal(made.content.registration.transform, np.eye(4))
    assert (made.content.to, made.content.pairs, made.content.fre_mm) == ("patient", (), None)
    assert (made.kind, made.schema, made.case_hash) == ("registration", "vfix-registration/4", case.content_hash)
    assert (made.revision, made.refs, made.id[:13]) == (1, (), "registration-")


def test_the_fre_of_a_registration_is_that_of_its_pairs(
    registrations: Documents[RegistrationContent], case: Case
) -> None:
    """A quarter turn about z and a shift; the second pair is 3 mm off along x, the third 4 mm along y."""
    pairs = (
        FiducialPair("A", (1.0, 0.0, 0.0), (5.0, 1.0, -2.0)),
        FiducialPair("B", (0.0, 1.0, 0.0), (7.0, 0.0, -2.0)),
        FiducialPair("C", (0.0, 0.0, 1.0), (5.0, 4.0, -1.0)),
    )
    editor = registrations.editor(registrations.create(case.id, "Beads").id)
    edited = editor.edit(lambda c: replace(c, to="base", transform=QUARTER, pairs=pairs), expected_revision=1)
    assert edited.content == RegistrationContent("base", QUARTER, pairs)
    assert edited.content.fre_mm == pytest.approx(np.sqrt((9 + 16) / 3), abs=1e-12)
    assert registrations.get(edited.id) == edited
    assert editor.undo().content.fre_mm is None


@pytest.mark.parametrize(
    "change",
    [
        {"transform": (*QUARTER[:-1], 2.0)},
        {"transform": (*(2.0 * value for value in QUARTER[:15]), 1.0)},
        {"to": "moon"},
        {"pairs": (FiducialPair("A", (float("nan"), 0.0, 0.0), (0.0, 0.0, 0.0)),)},
        {"fle_mm": float("nan")},
        {"pairs": (FiducialPair("A", (float("inf"), 0.0, 0.0), None),)},
        {"pairs": (FiducialPair("A\n", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),)},
        {"pairs": (FiducialPair("A", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),) * 101},
    ],
)
def test_a_registration_that_is_none_is_refused(
    registrations: Documents[RegistrationContent], case: Case, change: dict[str, Any]
) -> None:
    made = registrations.create(case.id, "Beads")
    with pytest.raises(InputError):
        registrations.editor(made.id).edit(lambda content: replace(content, **change))
    assert registrations.get(made.id) == made


@pytest.mark.parametrize(
    "stored",
    [
        {"to": "patient", "transform": [0.0] * 15, "pairs": []},
        {"to": "patient", "transform": [*QUARTER[:-1], "1"], "pairs": []},
        {"to": "patient", "pairs": []},
        {"to": "patient", "transform": list(QUARTER), "pairs": [{"label": "A", "in_image": [0, 0, 0]}]},
        {"to": "patient", "transform": list(QUARTER), "pairs": [{"label": "A", "in_image": 1, "measured": 2}]},
    ],
)
def test_a_stored_registration_that_is_damaged_says_so_and_can_be_taken_back(
    store: Store, registrations: Documents[RegistrationContent], case: Case, stored: dict[str, Any]
) -> None:
    made = registrations.create(case.id, "Beads")
    editor = registrations.editor(made.id)
    editor.edit(lambda content: replace(content, transform=QUARTER))
    with store.writing() as session:
        state = session.get(DocumentStateRow, (made.id, 1))
        assert state is not None
        state.content = stored
    with pytest.raises(InputError, match="the registration 'Beads' cannot be read"):
        registrations.get(made.id)
    assert registrations.list(case.id)[0].unreadable
    assert editor.undo().content == made.content


def test_the_kinds_share_one_table_and_do_not_meet(
    registrations: Documents[RegistrationContent], plans: PlanService, case: Case
) -> None:
    plan, registration = plans.create(case.id, "Plan"), registrations.create(case.id, "Beads")
    assert [listed.id for listed in registrations.list(case.id)] == [registration.id]
    assert [title.id for title in plans.titles(case.id)] == [plan.id]
    with pytest.raises(NotFound, match="no registration"):
        registrations.editor(plan.id)
    with pytest.raises(NotFound, match="no plan"):
        plans.documents.rename(registration.id, "other")


def test_locks_and_revisions_hold_for_every_kind(registrations: Documents[RegistrationContent], case: Case) -> None:
    made = registrations.create(case.id, "Beads")
    editor = registrations.editor(made.id)
    with pytest.raises(DocumentConflict, match="at revision 1, not 7"):
        editor.edit(lambda content: replace(content, transform=QUARTER), expected_revision=7)
    editor.set_locked(True)
    for act in (lambda: editor.edit(lambda content: content), lambda: registrations.delete(made.id)):
        with pytest.raises(DocumentLocked, match="registration is locked"):
            act()
    with pytest.raises(InputError, match="has no settings"):
        editor.set_settings({"margin_mm": 1.0})


@dataclass(frozen=True)
class Note:
    """A kind of this test alone: a length that was in metres once, and a word that was added later."""

    length_mm: float = 0.0
    word: str = ""


def note_kind(schema: str = "note/3") -> DocumentKind[Note]:
    return DocumentKind(
        name="note",
        noun="note",
        schema=schema,
        empty=Note,
        read=lambda data: Note(**data),
        write=lambda note: dict(vars(note)),
        check=lambda note: note,
        refs=lambda note: (Ref("document", note.word),) if note.word else (),
        upgrades={
            "note/1": ("note/2", lambda data: {"length_mm": 1000.0 * data["length_m"]}),
            "note/2": ("note/3", lambda data: {**data, "word": "old"}),
        },
    )


def test_an_older_schema_is_brought_up_step_by_step_when_it_is_read(store: Store, case: Case) -> None:
    notes = Documents(store, note_kind())
    made = notes.create(case.id, "Note")
    with store.writing() as session:
        state = session.get(DocumentStateRow, (made.id, 0))
        assert state is not None
        state.schema, state.content = "note/1", {"length_m": 0.25}
    read = notes.get(made.id)
    assert (read.content, read.schema, read.refs) == (Note(250.0, "old"), "note/3", (Ref("document", "old"),))
    edited = notes.editor(made.id).edit(lambda note: replace(note, word="new"))
    assert edited.content == Note(250.0, "new")
    with store.reading() as session:
        rows = [session.get(DocumentStateRow, (made.id, at)) for at in (0, 1)]
        assert [(row.schema, row.content) for row in rows if row] == [
            ("note/1", {"length_m": 0.25}),
            ("note/3", {"length_mm": 250.0, "word": "new"}),
        ]
        assert rows[1] is not None
        assert rows[1].refs == [{"kind": "document", "id": "new"}]
    assert notes.editor(made.id).undo().content == Note(250.0, "old")


@dataclass(frozen=True)
class Memo:
    """A kind whose fields say what came when: a length was in metres once, a word and its marks came later."""

    length_mm: float = 0.0
    word: Annotated[str | None, new_in(2)] = None
    marks: Annotated[tuple[Annotated[int, Meta(ge=0)], ...], Meta(max_length=3), new_in(3)] = ()


def test_fields_that_came_later_have_their_defaults_in_older_content() -> None:
    kind = struct_kind(
        Memo, name="memo", noun="memo", schema="memo/3",
        changed={1: lambda data: {"length_mm": 1000.0 * data["length_m"], "word": data["word"]}},
    )  # fmt: skip
    assert kind.content("memo/1", {"length_m": 0.25}, None) == Memo(250.0)
    assert kind.content("memo/2", {"length_mm": 1.0, "word": "a"}, None) == Memo(1.0, "a")
    assert kind.content("memo/3", {"length_mm": 1.0, "word": "a", "marks": [2]}, None) == Memo(1.0, "a", (2,))
    for schema, data in (
        ("memo/2", {"length_mm": 1.0}), ("memo/3", {"length_mm": 1.0, "word": "a"}),
        ("memo/3", {"length_mm": 1.0, "word": "a", "marks": [-1]}), ("memo/2", {"word": "a", "more": 1}),
    ):  # fmt: skip
        with pytest.raises(InputError):
            kind.content(schema, data, None)
    with pytest.raises(InputError, match="newer vfix"):
        kind.content("memo/4", {}, None)


def test_a_newer_schema_is_told(store: Store, case: Case) -> None:
    made = Documents(store, note_kind("note/4")).create(case.id, "Note")
    notes = Documents(store, note_kind())
    with pytest.raises(InputError, match=r"'note/4' cannot be read.*newer vfix"):
        notes.get(made.id)
    assert "newer vfix" in notes.list(case.id)[0].unreadable
