"""Documents: named, revisioned values of a case with a history of edits, of any number of kinds."""

from app.documents.document import Document, DocumentTitle, Ref
from app.documents.documents import Documents
from app.documents.editor import DocumentEditor, check_still_newest
from app.documents.kind import DocumentErrors, DocumentKind, new_in, struct_kind

__all__ = [
    "Document",
    "DocumentEditor",
    "DocumentErrors",
    "DocumentKind",
    "DocumentTitle",
    "Documents",
    "Ref",
    "check_still_newest",
    "new_in",
    "struct_kind",
]
