"""The content of a note, and what can be done to it."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from app.documents import Document
from app.operations import Context, Creation, Edit
from app.operations.fields import Name, Position
from app.operations.standard import STANDARD

Words = Annotated[str, Meta(max_length=200)]
Urgency = Annotated[int, Meta(ge=0, le=3)]


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    words: Words = ""
    urgency: Urgency = 0
    at: Position | None = None
    tags: tuple[Name, ...] = ()


class CreateNote(Creation, frozen=True):
    """Make a note."""

    rest = "POST /cases/{case_id}/notes"
    message = "note.new"
    verb = "note new"
    name: Name
    words: Words = ""

    def create(self, context: Context[Note, Any], case_id: str) -> Document[Note]:
        return context.documents.create(case_id, self.name, Note(self.words))


class SetUrgency(Edit, frozen=True):
    """Say how urgent it is. From 0 to 3."""

    rest = "PUT /notes/{id}/urgency"
    message = "note.urgency"
    verb = "note urgency"
    urgency: Urgency

    def apply(self, content: Note, context: Context[Note, Any]) -> Note:
        return replace(content, urgency=self.urgency)


class PinNote(Edit, frozen=True):
    """Say where it belongs, and under which words it is found."""

    rest = "PUT /notes/{id}/place"
    message = "note.pin"
    verb = "note pin"
    at: Position
    tags: tuple[Name, ...]

    def apply(self, content: Note, context: Context[Note, Any]) -> Note:
        return replace(content, at=self.at, tags=self.tags)


OPERATIONS = (CreateNote, *STANDARD, SetUrgency, PinNote)
