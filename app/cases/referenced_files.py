"""The files of the store that any row names."""

from __future__ import annotations

import re

from sqlalchemy import text
from sqlalchemy.orm import Session

# A file is referred to by its hash, wherever in a row that stands.
_HASH = re.compile(r"[0-9a-f]{64}")
_ROWS = (
    "SELECT document FROM cases",
    "SELECT content FROM document_states",
    "SELECT settings FROM documents",
    "SELECT files FROM runs",
    "SELECT manifest FROM runs",
)


def referred_files(session: Session) -> set[str]:
    """The hashes that any row names, read as text, so that a row that is damaged keeps its files too."""
    found: set[str] = set()
    for query in _ROWS:
        for (value,) in session.execute(text(query)):
            found.update(_HASH.findall(str(value)))
    return found
