"""What a log may hold of an error: its type and where it was raised, never its message (HAZ-33).

A message quotes values, such as names in a file or of a file, and people put the patient's name there.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Iterator


def error_places(error: BaseException) -> str:
    """Type and places of an error and of what it came from, one a line; an error of the system with its own words."""
    lines = list[str]()
    for known in _chain(error):
        lines.append(f"{'  from ' if lines else ''}{error_kind(known)}")
        frames = traceback.extract_tb(known.__traceback__)
        lines += [f"    {frame.filename}:{frame.lineno} {frame.name}" for frame in frames]
    return "\n".join(lines)


def error_kind(error: BaseException) -> str:
    """The type of an error, on one line; of the system's own what the system says, such as that no room is left."""
    numbers = (known.errno for known in _chain(error) if isinstance(known, OSError) and known.errno is not None)
    number = next(numbers, None)
    # The system's words for the number: the text of an error may be anything.
    return type(error).__name__ if number is None else f"{type(error).__name__} ({os.strerror(number)})"


def _chain(error: BaseException) -> Iterator[BaseException]:
    """An error and what it came from, each once: a chain may be a circle."""
    known: BaseException | None = error
    seen = set[int]()
    while known is not None and id(known) not in seen:
        seen.add(id(known))
        yield known
        known = known.__cause__ or (None if known.__suppress_context__ else known.__context__)
