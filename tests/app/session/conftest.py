"""The sessions that tests of this folder use."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from session_doubles import Tabs

from app.services import Services
from app.session import client_sessions
from app.session.client_sessions import ClientSessions


@pytest.fixture(autouse=True)
def short_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The dry run that a session began goes on for others, since the services of these tests do not end."""
    monkeypatch.setattr(client_sessions, "CLOSE_S", 0.5)


@pytest.fixture
def sessions(phantom_services: Services) -> Iterator[ClientSessions]:
    """Its clock stands; a test lets it tick."""
    made = ClientSessions(phantom_services, Tabs(), lambda: "")
    yield made
    made.close()
