"""The sessions that tests of this folder use."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from session_doubles import Tabs

from app.services import Services
from app.session.client_sessions import ClientSessions


@pytest.fixture
def sessions(phantom_services: Services) -> Iterator[ClientSessions]:
    """Its clock stands; a test lets it tick."""
    made = ClientSessions(phantom_services, Tabs(), lambda: "")
    yield made
    made.close()
