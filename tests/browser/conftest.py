"""One planner on a home of its own, and real Chromium in front of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Playwright, sync_playwright
from workstation import NO_ANTIALIASING, ROOT, TOKEN, VIEWPORT, Planner, Rest, Workstation, launch


@pytest.fixture(scope="module")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    started = Planner(tmp_path_factory.mktemp("home"))
    yield started
    started.stop()


@pytest.fixture(scope="module")
def rest(planner: Planner) -> Iterator[Rest]:
    face = Rest(planner.base, TOKEN)
    yield face
    face.client.close()


@pytest.fixture(scope="session")
def artefacts() -> Path:
    """Folder of the screenshots: VFIX_ARTEFACTS, else build/browser of the checkout, which is not committed."""
    folder = Path(os.environ.get("VFIX_ARTEFACTS", ROOT / "build" / "browser"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    started = launch(playwright)
    yield started
    started.close()


@pytest.fixture
def open_page(browser: Browser, planner: Planner, artefacts: Path) -> Iterator[Callable[..., Workstation]]:
    """Open the page in a fresh profile, so that nothing of another test is remembered."""
    contexts = []

    def open_one(path: str = "/", viewport: dict[str, int] | None = None) -> Workstation:
        context = browser.new_context(viewport=viewport or VIEWPORT, accept_downloads=True)
        context.add_init_script(NO_ANTIALIASING)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(60_000)
        station = Workstation(page, artefacts)
        page.goto(f"{planner.base}{path}?token={TOKEN}")
        return station

    yield open_one
    for context in contexts:
        context.close()
