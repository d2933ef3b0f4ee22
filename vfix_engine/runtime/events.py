"""What the control process says once, over its pipe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """kind: 'ready', 'refused' (the start), 'note' (a command that could not be done) or 'failed'; text says why.

    'unrecorded': nothing more is written to the run, and why; the drive goes on.
    'record' answers the question for the clock's record: text is JSON of it.
    'settings' answers each change of the settings: text is JSON of those in force, the old ones after a refusal.
    """

    kind: str
    text: str = ""
