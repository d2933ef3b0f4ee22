from __future__ import annotations

import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.services import Services, build_services
from app.settings import Settings

OLD_HOME = Path(__file__).resolve().parents[2] / "data" / "old_home" / "home.tar.xz"


@pytest.fixture
def old_home(tmp_path: Path) -> Iterator[Services]:
    """A home of an earlier version, which holds a run of each world."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(tmp_path, filter="data")
    opened = build_services(Settings(home=tmp_path / "home", port=0))
    yield opened
    opened.close()
