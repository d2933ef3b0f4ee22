"""What a tab shows, asked again only where something has happened to it."""

from __future__ import annotations

from typing import Any

from app.messages.sections import Sections
from app.tabs.base import Tab
from app.workspace.layers import Layer


class TabView:
    """Sections, layers and hint of one tab as they were asked last. Owned by the session's thread."""

    def __init__(self, tab: Tab) -> None:
        self.tab = tab
        self.sections: Sections = {}
        self._layers: list[Layer[Any]] | None = None
        self._hint: str | None = None
        self._subject: tuple[object, ...] = ()  # of what was asked last; () where it is to be asked again

    def touch(self) -> None:
        """Something has happened to the tab."""
        self._subject, self._layers, self._hint = (), None, None

    def refresh(self) -> None:
        """Ask the tab again where it was touched, or its subject is another one. What failed is tried again."""
        subject = (self.tab.subject(),)
        if subject == self._subject:
            return
        self.touch()
        try:
            self.tab.refresh()
        finally:
            self.ask()
        self._subject = subject

    def ask(self) -> None:
        """Ask the tab again as it is."""
        self._layers = self._hint = None
        self.sections = self.tab.sections()

    @property
    def layers(self) -> list[Layer[Any]]:
        """Asked for once the scene is drawn."""
        if self._layers is None:
            self._layers = self.tab.layers()
        return self._layers

    @property
    def hint(self) -> str:
        """Asked for while the tab is active."""
        if self._hint is None:
            self._hint = self.tab.hint()
        return self._hint
