"""The planner that the gateway's tests knock at."""

from collections.abc import Iterator

import pytest
from knocking import Planner, listening, other_routes


@pytest.fixture(scope="session")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    with listening(tmp_path_factory.mktemp("home"), [other_routes()]) as running:
        yield running
