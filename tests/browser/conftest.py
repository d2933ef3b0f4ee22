"""One planner for all tests, since its first dry run takes long, and real Chromium in front of it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from page_scripts import HOLD_SCENE, NO_ANTIALIASING, SAID
from playwright.sync_api import Browser, Playwright, expect, sync_playwright
from workstation import PATIENCE_MS, ROOT, TOKEN, VIEWPORT, Planner, Rest, Workstation, launch

expect.set_options(timeout=PATIENCE_MS)

# The page opens the sample, as it does in a home where nobody has planned yet.
SAMPLE_OPEN = """
try {
  const opened = JSON.stringify({ case: "head-phantom", plan: "head-phantom-sample" });
  if (!sessionStorage.getItem("vfix-open")) sessionStorage.setItem("vfix-open", opened);
} catch { /* a frame without storage */ }
"""


@pytest.fixture(scope="session")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    """Tests work on copies of the sample; those that stop the planner or need a fresh home start their own."""
    started = Planner(tmp_path_factory.mktemp("home"))
    yield started
    started.stop()


@pytest.fixture(scope="module")
def rest(planner: Planner) -> Iterator[Rest]:
    face = Rest(planner.base, TOKEN)
    yield face
    face.client.close()


@pytest.fixture(autouse=True)
def no_plans_left(request: pytest.FixtureRequest) -> Iterator[None]:
    """Lists are as short for each test as in a home where nobody has planned yet."""
    yield
    if "rest" in request.fixturenames:
        request.getfixturevalue("rest").delete_plans()


@pytest.fixture(scope="session")
def artefacts() -> Path:
    """Folder of the screenshots: VFIX_ARTEFACTS, else build/browser of the checkout, which is not committed."""
    folder = Path(os.environ.get("VFIX_ARTEFACTS", ROOT / "build" / "browser"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


_CLOSING = contextlib.ExitStack()


@cache
def _playwright() -> Playwright:
    return _CLOSING.enter_context(sync_playwright())


@cache
def _browser() -> Browser:
    started = launch(_playwright())
    _CLOSING.callback(started.close)
    return started


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """One browser serves all files of this folder; its loop would be in the way of tests that come after."""
    if nextitem is None or Path(__file__).parent not in nextitem.path.parents:
        for started in (_browser, _playwright):
            started.cache_clear()
        _CLOSING.close()


@pytest.fixture(scope="module")
def playwright() -> Playwright:
    return _playwright()


@pytest.fixture(scope="module")
def browser() -> Browser:
    return _browser()


@contextlib.contextmanager
def pages(browser: Browser, planner: Planner, artefacts: Path) -> Iterator[Callable[..., Workstation]]:
    """Opens pages, each in a fresh profile, so that nothing of another one is remembered."""
    contexts = []

    def open_one(
        path: str = "/", viewport: dict[str, int] | None = None, script: str = "", sample: bool = True
    ) -> Workstation:
        """sample: the sample is open, else what the planner opens by itself. The scene is held until asked for."""
        context = browser.new_context(viewport=viewport or VIEWPORT, accept_downloads=True)
        context.add_init_script(NO_ANTIALIASING + HOLD_SCENE + SAID + (SAMPLE_OPEN if sample else "") + script)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        station = Workstation(page, artefacts, scene_held=True)
        page.goto(f"{planner.base}{path}?token={TOKEN}")
        return station

    yield open_one
    for context in contexts:
        context.close()


@pytest.fixture
def open_page(browser: Browser, planner: Planner, artefacts: Path) -> Iterator[Callable[..., Workstation]]:
    """Opens pages that are closed after the test."""
    with pages(browser, planner, artefacts) as open_one:
        yield open_one


@pytest.fixture(scope="module")
def open_shared(browser: Browser, planner: Planner, artefacts: Path) -> Iterator[Callable[..., Workstation]]:
    """Opens pages that the tests of a module share, since software takes seconds to draw a page for the first time."""
    with pages(browser, planner, artefacts) as open_one:
        yield open_one
