"""What long work calls to say how far it is."""

from __future__ import annotations

from collections.abc import Callable

ProgressCallback = Callable[[str, float], None]
"""Takes the name of a stage and the share of the whole that is done, from 0 to 1."""


def no_progress(stage: str, share: float) -> None:
    """For work that nobody waits for."""
