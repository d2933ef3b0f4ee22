"""Callbacks that report the progress of long computations."""

from __future__ import annotations

from collections.abc import Callable

ProgressCallback = Callable[[str, float], None]
"""Accepts the name of a stage and the completed fraction of the whole, from 0 to 1."""


def no_progress(stage: str, share: float) -> None:
    """Ignore the progress."""
