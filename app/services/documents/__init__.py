"""Documents: named, revisioned values of a case with a history of edits, of any number of kinds."""

from app.services.documents.document import Document, DocumentTitle, Ref
from app.services.documents.documents import Documents
from app.services.documents.editor import DocumentEditor, check_still_newest
from app.services.documents.kind import DocumentErrors, DocumentKind

__all__ = [
    "Document",
    "DocumentEditor",
    "DocumentErrors",
    "DocumentKind",
    "DocumentTitle",
    "Documents",
    "Ref",
    "check_still_newest",
]
