"""Documents: named, revisioned values of a case with a history of edits, of any number of kinds.

What needs the store is in `app.documents.documents` and `app.documents.editor`: a document of a file is read without.
"""

from app.documents.document import Document, DocumentTitle, Ref
from app.documents.kind import DocumentErrors, DocumentKind, new_in, read_as, struct_kind, written

__all__ = [
    "Document",
    "DocumentErrors",
    "DocumentKind",
    "DocumentTitle",
    "Ref",
    "new_in",
    "read_as",
    "struct_kind",
    "written",
]
