"""A file in metres that says mm, or says nothing, is told with its figure: paths, targets, measured points."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest
from rest_client import Client

from app.exchange.plan_files import read_plan
from app.plans.imported_places import content_notes, measured_notes
from app.plans.model import PlanContent, PlanPoint
from app.plans.paths import PlanPath

CASE = "/api/v1/cases/head-phantom"
BOX = ((-60.0, -60.0, -60.0), (60.0, 60.0, 60.0))
HALF = "label,x,y,z\na,0.1,0.1,0.1\nb,0.3,0.4,0.2\nc,0.4,0.4,0.4\n"


def content(scale: float, targets: int = 0) -> PlanContent:
    points = tuple(PlanPoint(f"p{n}", "", (n * scale, 10.0, 0.0)) for n in range(3))
    return replace(
        PlanContent(paths=(PlanPath(points=points),)),
        targets=tuple(PlanPoint(f"t{n}", "", (n * scale, 0.0, 0.0)) for n in range(targets)),
    )


def test_small_paths_and_sets_are_told_and_ordinary_ones_are_not() -> None:
    """HAZ-14: to 5 mm for a path and for measured points; targets may lie close together."""
    assert content_notes(content(2.6, 2), BOX) == ()
    assert content_notes(content(2.4, 2), BOX) == (
        "The points of the path lie within 4.8 mm, which is no way into a head. Check the unit.",
    )
    path, targets = content_notes(content(0.1, 3), BOX)
    assert path.startswith(
        "The points of the path lie within 0.2 mm, which is no way into a head. Is the file in metres?"
    )
    assert targets.startswith("The targets lie within 0.2 mm, ")
    assert content_notes(content(0.0, 1), BOX)[0].endswith("a head. Check the unit.")
    assert content_notes(PlanContent(), BOX) == ()
    beside = content(10.0).with_points(tuple(PlanPoint(f"p{n}", "", (500.0, n, 0.0)) for n in range(9)))
    assert "lies outside the head" in content_notes(beside, BOX)[0]
    assert measured_notes([(0.0, 0.0, 0.0), (0.06, 0.0, 0.0)])[0].startswith("The measured points lie within 0.06 mm")
    assert measured_notes([(0.0, 0.0, 0.0), (60.0, 0.0, 0.0)]) == measured_notes([(0.0, 0.0, 0.0)]) == ()


def markups(unit: str | None, kind: str = "Curve") -> bytes:
    points = [{"label": str(n), "position": [n, 30.0, 40.0 + n * 9]} for n in range(3)]
    one: dict[str, Any] = {"type": kind, "coordinateSystem": "LPS", "controlPoints": points}
    return json.dumps({"markups": [one | ({} if unit is None else {"coordinateUnits": unit})]}).encode()


@pytest.mark.parametrize("kind", ["Curve", "Fiducial"])
def test_markups_and_tables_that_name_no_unit_are_told(kind: str) -> None:
    """HAZ-14: mm is the default of the schema, and of a table whose frame the user names."""
    silent = read_plan("a.mrk.json", markups(None, kind), None, "targets")
    assert silent.notes == ("The file does not name its unit; mm was assumed.",)
    assert read_plan("a.mrk.json", markups("mm", kind), None, "targets").notes == ()
    assert read_plan("a.csv", HALF.encode(), "LPS").notes == silent.notes
    assert read_plan("a.csv", b"# frame=LPS\n# unit=mm\n" + HALF.encode()).notes == ()


def test_the_answer_to_an_import_tells_what_is_doubtful(client: Client) -> None:
    files = {"file": ("half.csv", HALF.encode())}
    plan = client.post(f"{CASE}/plans/import", files=files, data={"frame": "LPS"}).json()
    assert plan["told"].startswith(
        "The file does not name its unit; mm was assumed. The points of the path lie within 0.52 mm"
    )
    assert client.get(f"/api/v1/plans/{plan['id']}").json()["told"] == ""
    client.delete(f"/api/v1/plans/{plan['id']}")
    made = client.post(f"{CASE}/registrations", json={"name": "Metres"}).json()
    table = b"# unit=mm\n# frame=patient\n" + HALF.encode()
    read = client.post(f"/api/v1/registrations/{made['id']}/measured", files={"file": ("m.csv", table)}).json()
    assert read["told"].startswith(
        "The measured points lie within 0.52 mm, too close for a registration. Is the file in"
    )
    client.delete(f"/api/v1/registrations/{made['id']}")
