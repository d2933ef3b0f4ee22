"""Commands that are no operations with bad bodies, of cases, structures, drawing and suggestions: all are refused."""

import json
from typing import Any

import pytest

from app.session.commands import InvalidMessage, parse_command

GOOD: dict[str, dict[str, Any]] = {
    "case.open": {"case_id": "head-phantom"},
    "case.rename": {"case_id": "head-phantom", "name": "Case"},
    "case.delete": {"case_id": "head-phantom"},
    "case.restore": {"case_id": "head-phantom"},
    "structure.show": {"structure_id": "structure-1", "shown": True},
    "structure.change": {"structure_id": "structure-1", "name": "Structure", "colour": "#00ff00"},
    "structure.delete": {"structure_id": "structure-1"},
    "region.draw": {"purpose": "spare", "kind": "sphere", "sizes_mm": [3.0]},
    "suggestion.use": {"suggestion_id": "job-1", "alternative": 0},
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
