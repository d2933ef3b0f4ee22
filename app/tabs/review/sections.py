"""Sections of the Review tab."""

from __future__ import annotations

from typing import TypedDict

from app.workspace.sections import ScopeSection


class ReviewSections(TypedDict):
    """The endoscope of a robot whose runs are replayed; None where the page makes one of the open plan."""

    scope: ScopeSection | None
