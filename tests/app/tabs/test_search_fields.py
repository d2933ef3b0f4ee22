"""What a search needs is measured before it is asked for: the whole head, then about both ends."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from app.tabs.plan import search_fields
from app.tabs.plan.search_fields import SearchFields
from vfix_engine.errors import InputError

ENTRY, TARGET = (7.5, -14.0, -6.0), (3.0, 65.0, -3.5)


class Measured:
    """Distance fields that say what was asked of them."""

    def __init__(self) -> None:
        self.asked: list[Any] = []

    def whole(self, case: Any) -> None:
        self.asked.append("whole")

    def around(self, case: Any, places: Any) -> Measured:
        self.asked.append(tuple(map(tuple, places.tolist())))
        return self

    def both(self) -> None:
        self.asked.append("both")


def edited(points: int, targets: int, locked: bool = False, has_volume: bool = True) -> Any:
    one, other = SimpleNamespace(position=ENTRY), SimpleNamespace(position=TARGET)
    content = SimpleNamespace(points=(one,) * points, targets=(other,) * targets)
    case = SimpleNamespace(id="head", has_volume=has_volume, volumes=(), surfaces=())
    return SimpleNamespace(plan=SimpleNamespace(content=content), locked=locked, case=case)


@pytest.fixture
def fields(monkeypatch: pytest.MonkeyPatch) -> tuple[SearchFields, Measured]:
    monkeypatch.setattr(search_fields, "check_ends", lambda case, entry, target: None)
    monkeypatch.setattr(search_fields.preparation, "wait", lambda go_on: go_on())
    measured = Measured()
    executor = SimpleNamespace(submit=lambda work, *given: work(*given))
    workspace: Any = SimpleNamespace(
        services=SimpleNamespace(distance_fields=measured), executor=executor, post=lambda act: act()
    )
    return SearchFields(workspace), measured


def test_the_head_is_measured_once_and_about_both_ends_once_they_are_there(
    fields: tuple[SearchFields, Measured],
) -> None:
    search, measured = fields
    for plan in (edited(0, 0), edited(0, 0), edited(1, 0), edited(0, 1)):
        search.refresh(plan)
    assert measured.asked == ["whole"]
    search.refresh(edited(1, 1))
    search.refresh(edited(1, 1))
    assert measured.asked[1:] == [(ENTRY, TARGET), "both"]


@pytest.mark.parametrize(
    "plan", [None, edited(2, 1), edited(1, 1, locked=True), edited(1, 1, has_volume=False)]
)  # fmt: skip
def test_nothing_is_measured_where_no_path_is_to_be_found(fields: tuple[SearchFields, Measured], plan: Any) -> None:
    search, measured = fields
    search.refresh(plan)
    assert measured.asked == []


def test_ends_that_no_search_takes_are_not_measured(
    fields: tuple[SearchFields, Measured], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*given: object) -> None:
        raise InputError("too far apart")

    monkeypatch.setattr(search_fields, "check_ends", refuse)
    search, measured = fields
    search.refresh(edited(1, 1))
    assert measured.asked == []
