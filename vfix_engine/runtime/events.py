"""Events that the control process sends once, over its pipe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """kind: 'ready', 'refused' (the start), 'note' (a request that could not be carried out), 'failed'; text: reason.

    'compiled': while it starts, text is the number of kernels compiled so far.
    'unrecorded': recording has stopped, with the reason; the drive continues.
    'record' answers the request for the clock's statistics: text is their JSON.
    'settings' answers each change of the settings: text is the JSON of those in force, the old ones after a refusal.
    """

    kind: str
    text: str = ""
