"""Ends and contours that are not in the lumen: refused by operation, REST and command, and nothing stored."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import pytest
from lumen_cases import END, ENTRY, RADIUS_MM, route_in, tube
from rest_client import Client

from app.cli import main
from app.lumen.contour_operations import AddContour, MoveContour, ResizeContour
from app.lumen.document import ROUTE, Route, StoredRoute
from app.lumen.operations import SPEC, SetEnd, SetEntry
from app.services import Services
from vfix_engine.errors import InputError

ASIDE = (210.0, 0.0, 80.0)  # 195 mm from the tube's wall
NAN = math.nan


def now(services: Services, route: StoredRoute) -> StoredRoute:
    return services.lumen_routes.documents.get(route.id)


@pytest.mark.parametrize(
    ("operation", "words"),
    [
        (SetEntry(at=ASIDE), r"the entry .*210.* lies 195 mm outside the lumen.*Click on its wall"),
        (SetEnd(at=ASIDE), r"the end .* lies 195 mm outside the lumen"),
        (SetEntry(at=(0.0, 0.0, -30.0)), "30 mm outside the lumen"),
        (SetEntry(at=END), r"entry and end would be 0\.0 mm apart.*at least 8 mm"),
        (SetEnd(at=(2.0, 0.0, ENTRY[2] + 1.0)), r"2\.2 mm apart"),
        (SetEntry(at=(NAN, 0.0, 10.0)), "finite"),
        (AddContour(at_mm=71.4, radius_mm=NAN), "finite"),
        (AddContour(at_mm=71.4, radius_mm=1e9), "150 mm"),
        (AddContour(at_mm=71.4, radius_mm=-1.0), "positive"),
        (AddContour(at_mm=71.4, radius_mm=0.0), "positive"),
        (AddContour(at_mm=NAN, radius_mm=5.0), "not on the way"),
        (AddContour(at_mm=71.4, radius_mm=80.0), r"80 mm reaches 6\d mm behind the wall.*About 1\d mm reach it"),
        (ResizeContour(at_mm=71.0, radii_mm=(5.0, 60.0, 5.0)), r"60 mm reaches 4\d mm behind the wall"),
        (ResizeContour(at_mm=71.0, radii_mm=(5.0, NAN, 5.0)), "finite"),
        (MoveContour(at_mm=71.0, to=(25.0, 0.0, 80.0)), r"the centre .*25.* lies 10 mm outside the lumen"),
        (MoveContour(at_mm=71.0, to=(500.0, 0.0, 80.0)), "at most 60 mm"),
        (MoveContour(at_mm=71.0, to=(NAN, 0.0, 80.0)), "no point"),
    ],
)  # fmt: skip
def test_what_is_not_in_the_lumen_is_refused_and_nothing_is_stored(
    phantom_services: Services, operation: Any, words: str
) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    with pytest.raises(InputError, match=words):
        operation.run(SPEC.context(phantom_services), route.id)
    after = now(phantom_services, route)
    assert (after.revision, after.content, after.can_undo) == (route.revision, route.content, False)


def test_what_is_in_the_lumen_or_next_to_its_wall_is_taken(phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    context = SPEC.context(phantom_services)
    SetEntry(at=(0.0, 0.0, -5.0)).run(context, route.id)  # a click is not on the surface to the millimetre
    SetEntry(at=(RADIUS_MM, 0.0, 12.0)).run(context, route.id)
    MoveContour(at_mm=71.0, to=(12.0, 0.0, 80.0)).run(context, route.id)
    wide = ResizeContour(at_mm=71.0, radii_mm=(RADIUS_MM,)).run(context, route.id)  # 12 mm aside: 12 mm behind the wall
    assert len(wide.content.contours) == 1
    with pytest.raises(InputError, match="behind the wall"):
        ResizeContour(at_mm=71.0, radii_mm=(40.0,)).run(context, route.id)
    assert now(phantom_services, route).content == wide.content  # the other contour stays as it was, and undo
    assert now(phantom_services, route).can_undo


def test_ends_are_refused_over_rest_and_the_undo_stays(client: Client, phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    address = f"/api/v1/routes/{route.id}"
    moved = client.request("PUT", f"{address}/entry", json={"at": [0.0, 5.0, 20.0]}).json()
    for name, at, words in (
        ("entry", list(ASIDE), "195 mm outside the lumen"),
        ("end", [0.0, 5.0, 20.0], "entry and end would be 0.0 mm apart"),
        ("entry", ["NaN", 0.0, 0.0], ""),
        ("entry", [1e9, 0.0, 0.0], ""),
    ):
        answer = client.request("PUT", f"{address}/{name}", json={"at": at})
        assert (answer.status_code, words in answer.text) == (422, True), answer.text
    assert client.get(address).json()["revision"] == moved["revision"]
    assert client.post(f"{address}/undo").json()["entry"] == list(ENTRY)


def test_ends_are_refused_by_the_command(
    phantom_services: Services, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))
    for words, told in (
        (["entry", route.id, "210,0,80"], "195 mm outside the lumen"),
        (["end", route.id, "nan,0,80"], ""),
        (["contour", "resize", route.id, "71", "1e9"], "150 mm"),
    ):
        with contextlib.suppress(SystemExit):  # of what is no number to the parser
            assert main(["route", *words]) == 2
        assert told in capsys.readouterr().err
    assert now(phantom_services, route).revision == route.revision


def test_a_stored_contour_that_no_lumen_has_is_not_read(phantom_services: Services) -> None:
    contour = {"at": [0.0, 0.0, 80.0], "radii_mm": [1e9], "centre": None, "of_fit": True}
    stored = ROUTE.write(Route(entry=ENTRY, end=END)) | {"contours": [contour]}
    with pytest.raises(InputError):
        ROUTE.read(stored)
