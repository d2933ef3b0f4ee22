"""Control of the page by its visible names, so that they are those of the tutorials."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Locator
from workstation import Workstation

from .album import Album

PATIENCE_S = 400.0  # for a busy machine that computes distance fields for the first time


class NamedPage:
    """Buttons, fields and texts of one page; a missing one is awaited for `PATIENCE_S`, then an error is raised.

    album: of the pictures; None takes none.
    """

    def __init__(self, station: Workstation, album: Album | None) -> None:
        self.station, self.page, self.album = station, station.page, album

    def wait(self, what: str, check: Callable[[], Any]) -> Any:
        return self.station.wait_for(what, check, PATIENCE_S)

    def _seen(self, what: str, found: Locator) -> Locator:
        shown = found.filter(visible=True)
        self.wait(what, lambda: shown.count())
        return shown.first

    def button(self, name: str) -> Locator:
        """Return a visible button by its full name."""
        return self._seen(f"the button {name!r}", self.page.get_by_role("button", name=name, exact=True))

    def press(self, name: str) -> None:
        button = self.button(name)
        self.wait(f"{name!r} to be enabled", button.is_enabled)
        button.click()

    def field(self, label: str) -> Locator:
        """Return a visible field by the beginning of its label, which may be followed by a unit."""
        return self._seen(f"the field {label!r}", self.page.get_by_label(re.compile(rf"^{re.escape(label)}")))

    def choose(self, label: str, option: str) -> None:
        """Choose an option of a list by its text."""
        field = self.field(label)
        self.wait(f"{option!r} in {label!r}", lambda: option in field.locator("option").all_inner_texts())
        field.select_option(label=option)

    def fill(self, label: str, value: str) -> None:
        """Type into a text field: a checkbox may have a label that begins alike."""
        named = re.compile(rf"^{re.escape(label)}")
        self._seen(f"the field {label!r}", self.page.get_by_role("textbox", name=named)).fill(value)

    def check(self, label: str) -> None:
        self.field(label).check()

    def heading(self, title: str) -> Locator:
        """Return a visible heading by its text; that of a step says whether the step is done."""
        named = re.compile(rf"^{re.escape(title)}(\s*, done)?$")
        return self._seen(f"the heading {title!r}", self.page.get_by_role("heading", name=named))

    def unfold(self, title: str) -> None:
        """Open a collapsed part of the panel."""
        heading = self.heading(title)
        if heading.evaluate("(title) => title.closest('details')?.open === false"):
            heading.click()

    def says(self, words: str) -> None:
        """Wait until the page shows a text."""
        self._seen(f"the words {words!r}", self.page.get_by_text(words))

    def scroll_to(self, title: str) -> None:
        """Scroll a part of the panel to the panel's top."""
        self.heading(title).evaluate(
            "(title) => { const panel = document.getElementById('panel');"
            " panel.scrollTop += title.getBoundingClientRect().top - panel.getBoundingClientRect().top - 12; }"
        )

    def go_to(self, step: str) -> None:
        """Switch to another tab by its name in the title bar."""
        self.page.locator("#steps").get_by_role("button", name=step, exact=True).click()
        self.wait(step, lambda: self.station.state("step")["name"] == step.lower())

    def judged(self) -> None:
        """Wait until the dry run of the plan has ended."""
        self.wait("the dry run", lambda: (self.station.state("corridor") or {}).get("state") == "current")

    def take(self, name: str) -> None:
        """Take a picture of the page once it is idle and temporary notes have disappeared."""
        if self.album is None:
            return
        self.page.mouse.move(1000, 66)  # nothing there reacts to the pointer
        self.wait("the notes to go", lambda: not self.page.locator("#notes .toast").count())
        self.station.settle()
        self.add(name, self.page.screenshot())

    def add(self, name: str, png: bytes) -> None:
        """Store a picture that was taken."""
        if self.album is not None:
            self.album.add(name, png)
            print(f"{name}.png", flush=True)
