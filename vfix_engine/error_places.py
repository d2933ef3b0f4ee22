"""What a log may hold of an error: its type and where it was raised, never its message (HAZ-33).

A message quotes values, such as names in a file or of a file, and people put the patient's name there.
"""

from __future__ import annotations

import os
import traceback


def error_places(error: BaseException) -> str:
    """Type and places of an error and of what it came from, one a line; an error of the system with its own words."""
    lines = list[str]()
    known: BaseException | None = error
    seen = set[int]()
    while known is not None and id(known) not in seen:
        seen.add(id(known))
        lines.append(f"{'  from ' if lines else ''}{error_kind(known)}")
        frames = traceback.extract_tb(known.__traceback__)
        lines += [f"    {frame.filename}:{frame.lineno} {frame.name}" for frame in frames]
        known = known.__cause__ or (None if known.__suppress_context__ else known.__context__)
    return "\n".join(lines)


def error_kind(error: BaseException) -> str:
    """The type of an error, on one line; of the system's own what the system says, such as that no room is left."""
    cause: BaseException | None = error
    while cause is not None and not (isinstance(cause, OSError) and cause.errno is not None):
        cause = cause.__cause__
    # the system's words for the number: the text of an error may be anything
    words = "" if not isinstance(cause, OSError) or cause.errno is None else f" ({os.strerror(cause.errno)})"
    return f"{type(error).__name__}{words}"
