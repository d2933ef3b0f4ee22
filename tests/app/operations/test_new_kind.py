"""A kind of document in one folder, and a line of the registry: it is had over REST, as messages and as a verb."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from extra_documents import note
from fastapi import FastAPI
from rest_client import CASE, Client

from app.cases.model import HEAD_PHANTOM
from app.cli import main
from app.gateway.error_answers import install_error_answers
from app.operations import registry, spec_named
from app.operations.messages import OperationMessage
from app.operations.rest import OperationRoutes
from app.services import Services
from app.session.commands import parse_command


@pytest.fixture(autouse=True)
def registered(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(registry, "DOCUMENTS", [*registry.DOCUMENTS, "extra_documents.note"])
    yield
    documents = phantom_services.documents_of(note.SPEC.kind)  # the home is that of other tests too
    for one in documents.titles(include_deleted=True):
        documents.discard(one.id)


@pytest.fixture
def routes() -> OperationRoutes:
    return OperationRoutes(lambda request: request.app.state.services)


@pytest.fixture
def notes(phantom_services: Services, routes: OperationRoutes) -> Iterator[Client]:
    app = FastAPI()
    app.state.services = phantom_services
    install_error_answers(app)
    app.include_router(routes.router, prefix="/api/v1")
    opened = Client(app)
    yield opened
    opened.close()


def test_over_rest(notes: Client, routes: OperationRoutes) -> None:
    made = notes.post(f"{CASE}/notes", json={"name": "First", "words": "Look at it"})
    assert (made.status_code, made.headers["ETag"]) == (201, '"1"')
    assert (made.json()["words"], made.json()["urgency"], made.json()["case_id"]) == ("Look at it", 0, HEAD_PHANTOM)
    address = f"/api/v1/notes/{made.json()['id']}"
    urgent = notes.request("PUT", f"{address}/urgency", json={"urgency": 2, "revision": 1})
    assert (urgent.json()["urgency"], urgent.json()["can_undo"]) == (2, True)
    late = notes.request("PUT", f"{address}/urgency", json={"urgency": 1, "revision": 1})
    assert (late.status_code, late.json()["error"]["code"]) == (409, "document_conflict")
    late = notes.request("PUT", f"{address}/urgency", json={"urgency": 1}, headers={"If-Match": '"1"'})
    assert late.status_code == 412
    assert notes.post(f"{address}/undo").json()["urgency"] == 0
    assert notes.post(f"{address}/redo").json()["urgency"] == 2
    assert notes.patch(address, json={"name": "Second", "locked": True}).status_code == 422
    assert notes.patch(address, json={"locked": True}).json()["locked"]
    assert notes.request("PUT", f"{address}/urgency", json={"urgency": 1}).status_code == 423
    notes.patch(address, json={"locked": False})
    assert notes.delete(f"{address}?revision=2").status_code == 409
    assert notes.delete(address).json()["deleted_at"]
    assert notes.get(f"{CASE}/notes").json() == []
    assert notes.get(f"{CASE}/notes?include_deleted=true").json()[0]["name"] == "First"
    assert notes.post(f"{address}/restore").json()["deleted_at"] is None
    assert notes.get("/api/v1/cases/nobody/notes").status_code == 404
    assert routes.components["SetUrgency"]["properties"]["urgency"] == {"type": "integer", "minimum": 0, "maximum": 3}
    assert "words" in routes.components["NotePublic"]["properties"]


def test_as_a_message(phantom_services: Services) -> None:
    def asked(**message: object) -> str:
        command = parse_command(json.dumps(message))
        assert isinstance(command, OperationMessage)
        document = command.perform(command.spec.context(phantom_services, command.revision), HEAD_PHANTOM)
        assert document is not None
        return document.id

    made = asked(type="note.new", name="First")
    asked(type="note.urgency", note_id=made, urgency=3)
    asked(type="note.rename", note_id=made, name="Second")
    document = spec_named("note").context(phantom_services).documents.get(made)
    assert (document.name, document.content) == ("Second", note.operations.Note(urgency=3))
    asked(type="note.undo", note_id=made)
    assert phantom_services.documents_of(note.SPEC.kind).get(made).content.urgency == 0


def test_as_a_verb(
    phantom_services: Services, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))
    assert main(["note", "new", HEAD_PHANTOM, "First"]) == 0
    assert main(["note", "urgency", "First", "3"]) == 0
    capsys.readouterr()
    assert main(["note", "list", HEAD_PHANTOM, "--json"]) == 0
    (listed,) = json.loads(capsys.readouterr().out)["notes"]
    assert (listed["name"], listed["urgency"]) == ("First", 3)
    assert main(["note", "urgency", "First", "9"]) == 2
    assert "urgency" in capsys.readouterr().err
    assert main(["note", "pin", "First", "1,2,3.5", "nerve", "left"]) == 0  # one place, and as many words as are said
    (stored,) = phantom_services.documents_of(note.SPEC.kind).list()
    assert stored.content == note.operations.Note(urgency=3, at=(1.0, 2.0, 3.5), tags=("nerve", "left"))
    assert main(["note", "pin", "First", "1,2", "nerve"]) == 2
    assert "is not a place" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["note", "--help"])
    assert "say how urgent it is" in capsys.readouterr().out
