"""What several commands are tried on."""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest

from app.services import build_services
from app.settings import Settings

OLD_HOME = Path(__file__).resolve().parents[2] / "data" / "old_home" / "home.tar.xz"


@pytest.fixture
def old_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A home of an earlier version; the ids of its runs by their world."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(tmp_path, filter="data")
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    services = build_services(Settings.from_environment())
    found = {run.world: run.id for run in services.runs.list()}
    services.close()
    return found
