"""Study: a study of real people is led; the tab is there while one is open."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import ClientMessage, Identifier
from app.tabs.spec import TabSpec
from app.tabs.study.sections import StudySections


class ShowStudy(ClientMessage):
    """Open a stored study; None closes the one that is open."""

    type: Literal["study.show"]
    study_id: Identifier | None


SPEC = TabSpec("study", "Study", 50, __name__, "StudyTab", (ShowStudy,), StudySections, documents=("study",))
