"""How many links a stored run's robot has, by a manifest that may say anything."""

from __future__ import annotations

from typing import Any

import pytest

from app.drives.stored_run import StoredRun

DRIVE = {"arm": "guided"}


@pytest.mark.parametrize(
    ("world", "spec", "links"),
    [
        ("snake", {"drive": DRIVE, "snake": {"links": 12}}, 12),
        ("rigid", {"snake": {"links": 12}}, None),
        ("snake", None, None),
        ("snake", [], None),
        ("snake", {"drive": DRIVE}, None),
        ("snake", {"drive": DRIVE, "snake": None}, None),
        ("snake", {"drive": DRIVE, "snake": {"links": "many"}}, None),
        ("snake", {"drive": DRIVE, "snake": {"links": True}}, None),
    ],
)
def test_links_are_a_number_or_not_known(world: str, spec: Any, links: int | None) -> None:
    run = StoredRun("run-1", None, None, "page", "", 1, {"world": world, "spec": spec}, None, {})
    assert run.links == links
