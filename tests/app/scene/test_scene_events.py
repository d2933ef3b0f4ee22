"""Values reported by a browser: non-finite numbers never reach a plan or a robot (HAZ-05)."""

from __future__ import annotations

import asyncio
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.scene.checks import MAX_MM, finite_position
from app.scene.dragging import DragEvent
from app.scene.hand import GripDrag, HandNodes
from app.scene.plan import ItemNode, PlanItem
from app.scene.view import ClickRay, SceneEvents, SceneView, read_lens

NAN = math.nan
NO_PLACES: list[Any] = [
    None,
    "abc",
    (1.0, 2.0),
    (1.0, 2.0, 3.0, 4.0),
    ((1.0, 2.0, 3.0),),
    (NAN, 0.0, 0.0),
    (0.0, math.inf, 0.0),
    (0.0, 0.0, 1.1 * MAX_MM),
    (10**400, 0, 0),
]


class _Node:
    """Stands for whatever viser hands out."""

    def __getattr__(self, name: str) -> Any:
        return _Node()

    def __call__(self, *args: Any, **options: Any) -> Any:
        return _Node()


def _event(phase: str, place: Any) -> Any:
    return SimpleNamespace(phase=phase, end_position=place, modifier=None)


@pytest.mark.parametrize("place", NO_PLACES)
def test_a_place_is_three_finite_numbers_near_the_head(place: Any) -> None:
    assert finite_position(place) is None


def test_a_place_near_the_head_is_taken_as_it_is() -> None:
    place = finite_position((1, 2.5, -MAX_MM))
    assert place is not None
    assert place.tolist() == [1.0, 2.5, -MAX_MM]


@pytest.mark.parametrize("place", NO_PLACES)
def test_a_bad_drag_moves_nothing_and_still_ends(place: Any) -> None:
    drags: list[DragEvent] = []
    item = ItemNode(_Node(), _Node(), PlanItem("p-1", "point", "P1", (1.0, 2.0, 3.0)), drags.append)  # type: ignore[arg-type]
    grips: list[GripDrag] = []
    hand = HandNodes(_Node(), _Node(), grips.append)  # type: ignore[arg-type]
    for phase in ("start", "update", "end"):
        asyncio.run(item.drag.dragged(_event(phase, place)))
        asyncio.run(hand._dragged(_event(phase, place)))
    assert drags == [DragEvent("p-1", "end", (1.0, 2.0, 3.0))]
    assert grips == [GripDrag("end", (0.0, 0.0, 0.0))]
    assert hand._hand is None


def _camera(**changes: Any) -> Any:
    camera = {
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (0.0, -400.0, 0.0),
        "look_at": (0.0, 0.0, 0.0),
        "fov": 0.5,
        "image_width": 800,
        "image_height": 600,
    }
    return SimpleNamespace(**camera | changes)


def test_a_camera_is_read_as_it_was_reported() -> None:
    lens = read_lens(_camera())
    assert lens is not None
    assert (lens.width, lens.height, lens.field_of_view) == (800, 600, 0.5)
    assert np.array_equal(lens.rotation_camera_to_lps, np.eye(3))


@pytest.mark.parametrize(
    "changes",
    [
        {"wxyz": (NAN, 0.0, 0.0, 0.0)},
        {"position": (0.0, 0.0, math.inf)},
        {"look_at": (0.0, 1e9, 0.0)},
        {"fov": NAN},
        {"fov": 0.0},
        {"image_width": NAN},
        {"image_height": -5},
        {"image_height": 1e300},
    ],
)
def test_a_camera_that_is_none_is_not_read(changes: dict[str, Any]) -> None:
    assert read_lens(_camera(**changes)) is None


def test_a_click_goes_through_the_camera_that_was_reported_last() -> None:
    """HAZ-05: before there is one, and after a report that is none, a click goes nowhere."""
    rays: list[ClickRay] = []
    ignored: Any = lambda value: None  # noqa: E731
    camera = _camera(_state=SimpleNamespace(update_timestamp=0.0), on_update=ignored)
    client: Any = SimpleNamespace(gui=_Node(), scene=_Node(), camera=camera, atomic=_Node(), flush=_Node())
    view = SceneView(client, SceneEvents(rays.append, ignored, ignored, ignored))
    click: Any = SimpleNamespace(screen_pos=(0.5 + 0.5 / 800, 0.5 + 0.5 / 600))
    asyncio.run(view._clicked(click))
    assert rays == []
    for position in ((0.0, 0.0, -400.0), (10.0, 20.0, -300.0)):
        asyncio.run(view._camera_updated(_camera(position=position)))
        asyncio.run(view._clicked(click))
        assert rays[-1].origin.tolist() == list(position)
        assert np.allclose(rays[-1].direction, (0.0, 0.0, 1.0))
    asyncio.run(view._camera_updated(_camera(fov=NAN)))
    asyncio.run(view._clicked(click))
    assert len(rays) == 2
