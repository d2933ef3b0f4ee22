"""What one step through a document's history says of itself."""

from __future__ import annotations

from collections.abc import Sequence


def step_words(by: int, edits: Sequence[str]) -> str:
    """'Undone: Path ‘Way’: point ‘P3’ is new.'; of an edit of many parts the first, and how many more.

    by: -1 of an undo, +1 of a redo. edits: sentences on what the edit did that was taken back or done again.
    """
    what = "Undone" if by < 0 else "Redone"
    if not edits:
        return f"{what}."
    more = f" And {len(edits) - 1} more." if len(edits) > 1 else ""
    return f"{what}: {edits[0]}{more}"
