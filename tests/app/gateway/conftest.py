"""The planner that the gateway's tests knock at."""

from collections.abc import Iterator

import pytest
from knocking import Planner, listening, other_routes

from app.api import router as api_router
from app.api.moved import router as moved_router
from app.session import router as session_router


@pytest.fixture(scope="session")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    with listening(tmp_path_factory.mktemp("home"), [other_routes()]) as running:
        yield running


@pytest.fixture(scope="module")
def whole_planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    """The planner's own routers over no services at all: nothing may get as far as a service."""
    with listening(tmp_path_factory.mktemp("home"), [api_router, session_router, moved_router]) as running:
        yield running
