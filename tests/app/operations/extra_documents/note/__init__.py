"""Note: a kind of document in one folder; a line of text, and how urgent it is."""

from app.documents import struct_kind
from app.operations.spec import DocumentSpec
from extra_documents.note.operations import OPERATIONS, Note

SPEC = DocumentSpec(
    kind=struct_kind(name="note", noun="note", schema="vfix-note/1", content=Note),
    path="notes",
    id="note_id",
    operations=OPERATIONS,
)
