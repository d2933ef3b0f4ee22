"""What a log may contain of an error: its type and where it was raised, never its message (HAZ-33).

A message can quote values, such as names in a file or of a file, which users often derive from the patient's name.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Iterator


def error_places(error: BaseException) -> str:
    """Types and locations of an error and its causes, one per line; for an OSError also the system's own text."""
    lines = list[str]()
    for known in _chain(error):
        lines.append(f"{'  from ' if lines else ''}{error_kind(known)}")
        frames = traceback.extract_tb(known.__traceback__)
        lines += [f"    {frame.filename}:{frame.lineno} {frame.name}" for frame in frames]
    return "\n".join(lines)


def error_kind(error: BaseException) -> str:
    """Type of an error, on one line; for an OSError with the system's own text, such as that no space is left."""
    numbers = (known.errno for known in _chain(error) if isinstance(known, OSError) and known.errno is not None)
    number = next(numbers, None)
    # The text of the error number: the error's own text can contain anything.
    return type(error).__name__ if number is None else f"{type(error).__name__} ({os.strerror(number)})"


def _chain(error: BaseException) -> Iterator[BaseException]:
    """Iterate over an error and its causes, each once, since a chain can be cyclic."""
    known: BaseException | None = error
    seen = set[int]()
    while known is not None and id(known) not in seen:
        seen.add(id(known))
        yield known
        known = known.__cause__ or (None if known.__suppress_context__ else known.__context__)
