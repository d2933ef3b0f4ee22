"""The page by the names that stand on it: whoever reads the tutorial finds the same words."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Locator
from workstation import Workstation

from .album import Album

PATIENCE_S = 400.0  # a busy machine that measures fields for the first time


class NamedPage:
    """Buttons, fields and words of one page; whatever is not there is waited for, and then an error."""

    def __init__(self, station: Workstation, album: Album) -> None:
        self.station, self.page, self.album = station, station.page, album

    def wait(self, what: str, check: Callable[[], Any]) -> Any:
        return self.station.wait_for(what, check, PATIENCE_S)

    def _seen(self, what: str, found: Locator) -> Locator:
        shown = found.filter(visible=True)
        self.wait(what, lambda: shown.count())
        return shown.first

    def button(self, name: str) -> Locator:
        """A button in sight by all of its name."""
        return self._seen(f"the button {name!r}", self.page.get_by_role("button", name=name, exact=True))

    def press(self, name: str) -> None:
        button = self.button(name)
        self.wait(f"{name!r} to be enabled", button.is_enabled)
        button.click()

    def field(self, label: str) -> Locator:
        """A field in sight by the beginning of its label, which a unit may follow."""
        return self._seen(f"the field {label!r}", self.page.get_by_label(re.compile(rf"^{re.escape(label)}")))

    def choose(self, label: str, option: str) -> None:
        """Choose one of a list by its words."""
        field = self.field(label)
        self.wait(f"{option!r} in {label!r}", lambda: option in field.locator("option").all_inner_texts())
        field.select_option(label=option)

    def fill(self, label: str, value: str) -> None:
        self.field(label).fill(value)

    def check(self, label: str) -> None:
        self.field(label).check()

    def heading(self, title: str) -> Locator:
        return self._seen(f"the heading {title!r}", self.page.get_by_role("heading", name=title, exact=True))

    def unfold(self, title: str) -> None:
        """Open a part of the panel that is folded away."""
        heading = self.heading(title)
        if heading.evaluate("(title) => title.closest('details')?.open === false"):
            heading.click()

    def says(self, words: str) -> None:
        """Wait until the page shows these words."""
        self._seen(f"the words {words!r}", self.page.get_by_text(words))

    def scroll_to(self, title: str) -> None:
        """Bring a part of the panel to the panel's upper end."""
        self.heading(title).evaluate(
            "(title) => { const panel = document.getElementById('panel');"
            " panel.scrollTop += title.getBoundingClientRect().top - panel.getBoundingClientRect().top - 12; }"
        )

    def go_to(self, step: str) -> None:
        """Another step, by its name in the title bar."""
        self.page.locator("#steps").get_by_role("button", name=step).click()
        self.wait(step, lambda: self.station.state("step")["name"] == step.lower())

    def judged(self) -> None:
        """Wait until the plan was driven dry."""
        self.wait("the dry run", lambda: (self.station.state("corridor") or {}).get("state") == "current")

    def take(self, name: str) -> None:
        """A picture of the page, once it rests and short notes have gone."""
        self.page.mouse.move(1000, 66)  # nothing there answers to the pointer
        self.wait("the notes to go", lambda: not self.page.locator("#notes .toast").count())
        self.station.settle()
        self.album.add(name, self.page.screenshot())
        print(f"{name}.png", flush=True)
