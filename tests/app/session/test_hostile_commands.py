"""Commands of regions, shafts, suggestions, versions and second volumes with bad bodies: refused, and nothing lost."""

import json
from typing import Any

import pytest

from app.session.commands import InvalidMessage, parse_command

TRANSFORM = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
LAID = {"case_id": "head-phantom", "transform": TRANSFORM, "opacity": 0.5, "window": 400.0, "level": 40.0}
GOOD: dict[str, dict[str, Any]] = {
    "region.draw": {"purpose": "spare", "kind": "sphere", "sizes_mm": [3.0]},
    "region.change": {"region_id": "zone-1", "margin_mm": 1.0, "place": [1.0, 2.0, 3.0], "sizes_mm": [3.0]},
    "region.delete": {"region_id": "zone-1"},
    "region.structure": {"structure": "structure-1"},
    "path.rename": {"path_id": "path-1", "name": "Path"},
    "version.save": {"name": "Version"},
    "version.go_back": {"version_id": "version-1"},
    "suggestion.use": {"suggestion_id": "job-1", "alternative": 0},
    "second_volume.lay": LAID,
}
BAD = [
    float("nan"),
    float("inf"),
    -1e300,
    "x" * 100_000,
    {"a": [1] * 10_000},
    [[0.0] * 1000] * 10,
    None,
    "../../etc",
    "",
]


@pytest.mark.parametrize("kind", GOOD)
def test_each_field_is_bounded(kind: str) -> None:
    body = {"type": kind, **GOOD[kind]}
    assert parse_command(json.dumps(body)).type == kind  # type: ignore[attr-defined]
    for field in GOOD[kind]:
        refused = 0
        for bad in BAD:
            try:
                parse_command(json.dumps({**body, field: bad}))
            except InvalidMessage:
                refused += 1
        # Some fields may be left out with a null, and a name may be any short text.
        assert refused >= len(BAD) - 2, (kind, field, refused)


@pytest.mark.parametrize("kind", GOOD)
def test_a_hundred_thousand_keys_are_refused(kind: str) -> None:
    many = {f"key{n}": n for n in range(100_000)}
    with pytest.raises(InvalidMessage):
        parse_command(json.dumps({**many, "type": kind, **GOOD[kind]}))
