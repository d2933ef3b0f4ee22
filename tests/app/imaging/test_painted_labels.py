"""Painted labels: strokes as edits with a history, voxels, files and structures, by service, REST and command line."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rest_client import Client
from session_doubles import case_of_ct

from app.cases.model import CaseFrame
from app.cli import main
from app.documents import Document
from app.imaging.label_document import MOST_STROKES, PaintedLabel
from app.imaging.label_operations import SPEC, DrawStroke
from app.kit.errors import DocumentLocked, JobCancelled
from app.services import Services, build_services
from vfix_engine.anatomy.labels.painting import Stroke, draw_stroke, mask_of_runs
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume

SHAPE = (24, 28, 32)


def ct() -> Volume:
    """A ball of bone in air."""
    k, j, i = np.indices(SHAPE).astype(float)
    near = np.sqrt((i - 16) ** 2 + (j - 14) ** 2 + (k - 12) ** 2) < 8
    return Volume(np.where(near, 900, -1000).astype(np.int16), [1.0, 2.0, 3.0], [0.5, 0.5, 1.0], np.eye(3))


@pytest.fixture
def services(phantom_services: Services) -> Services:
    return phantom_services


@pytest.fixture
def case_id(services: Services) -> str:
    return case_of_ct(services, "Ball", ct()).id


def ball(x: float, y: float, z: float, radius: float = 1.6, mode: str = "paint") -> Stroke:
    return Stroke(mode, "ball", radius, ((x, y, z),))  # type: ignore[arg-type]


def draw(services: Services, label_id: str, stroke: Stroke) -> Document[PaintedLabel]:
    operation = DrawStroke(
        mode=stroke.mode, brush=stroke.brush, radius_mm=stroke.radius_mm, points=stroke.points, normal=stroke.normal
    )
    return operation.run(SPEC.context(services), label_id)


def drawn(*strokes: Stroke) -> np.ndarray:
    mask = np.zeros(SHAPE, dtype=bool)
    for stroke in strokes:
        draw_stroke(mask, ct().transform_index_to_lps, stroke)
    return mask


def voxels(services: Services, label_id: str) -> np.ndarray:
    document = services.labels.documents.get(label_id)
    return services.labels.mask(services.cases.get(document.case_id), document.content)


def test_strokes_are_edits_with_a_history(services: Services, case_id: str) -> None:
    made = services.labels.create(case_id, "Wall")
    one, two, gone = ball(5, 6, 10), ball(8, 8, 12), ball(5, 6, 10, 0.8, "erase")
    for stroke in (one, two, gone):
        draw(services, made.id, stroke)
    np.testing.assert_array_equal(voxels(services, made.id), drawn(one, two, gone))
    editor = services.labels.documents.editor(made.id)
    editor.undo()
    assert editor.undo().can_redo
    np.testing.assert_array_equal(voxels(services, made.id), drawn(one))
    editor.redo()
    np.testing.assert_array_equal(voxels(services, made.id), drawn(one, two))
    editor.set_locked(True)
    with pytest.raises(DocumentLocked):
        draw(services, made.id, one)


def test_many_strokes_begin_a_new_mask_and_undo_goes_back_over_it(services: Services, case_id: str) -> None:
    made = services.labels.create(case_id, "Many")
    strokes = [ball(3 + 0.2 * n, 6, 10) for n in range(MOST_STROKES + 2)]
    for stroke in strokes:
        after = draw(services, made.id, stroke)
    assert (len(after.content.strokes), bool(after.content.start)) == (2, True)
    np.testing.assert_array_equal(voxels(services, made.id), drawn(*strokes))
    editor = services.labels.documents.editor(made.id)
    for left in range(1, 4):
        editor.undo()
        np.testing.assert_array_equal(voxels(services, made.id), drawn(*strokes[:-left]))


def test_a_label_begins_with_a_structure_and_becomes_one(services: Services, case_id: str) -> None:
    made = services.labels.create(case_id, "Bone and more", structure_id="bone")
    bone = ct().hu > 0
    start = voxels(services, made.id)
    assert (start != bone).mean() < 0.01, "the surface lies at the threshold, not half-way"
    draw(services, made.id, ball(3, 4, 5))
    job = services.jobs.wait(services.labels.start(made.id).id, 60.0)
    assert job.state == "done", job
    case = services.cases.get(case_id)
    structure = case.structure(job.result or "")
    assert (structure.name, structure.role, structure.has_inside) == ("Bone and more", "spare", True)
    assert structure.provenance.origin == "painted"
    assert structure.deviation_mm == 0.0
    again = services.labels.create(case_id, "Again", structure_id=structure.id)
    np.testing.assert_array_equal(voxels(services, again.id), start | drawn(ball(3, 4, 5)))
    assert services.labels.structure(case, services.labels.documents.get(made.id)) == (structure, False)
    edited = draw(services, made.id, ball(12, 12, 20))
    assert services.labels.structure(case, edited)[1], "painted since"
    services.structures.change(case_id, structure.id, name="Kept name")
    newer = services.labels.run(made.id)
    stored = services.cases.get(case_id).structure(structure.id)
    assert (newer.id, stored.name) == (structure.id, "Kept name")
    assert stored.geometry != structure.geometry
    assert len(services.cases.get(case_id).protectable) == 1


def test_what_cannot_be_painted_is_refused(services: Services, case_id: str) -> None:
    empty = services.labels.create(case_id, "Empty")
    with pytest.raises(InputError, match="empty"):
        services.labels.run(empty.id)
    surface = services.cases.create("Surface", frame=CaseFrame("LPS", False), surfaces={"bone": extract_surface(ct())})
    with pytest.raises(InputError, match="only on a CT"):
        services.labels.create(surface.id, "x")
    with pytest.raises(InputError, match="no volume"):
        services.labels.create(case_id, "x", volume="fine")


def test_an_acknowledged_stroke_is_in_the_store_of_a_planner_that_starts_later(
    services: Services, case_id: str
) -> None:
    made = services.labels.create(case_id, "Wall")
    draw(services, made.id, ball(5, 6, 10))
    other = build_services(services.settings)  # reads what is on the disk
    try:
        np.testing.assert_array_equal(voxels(other, made.id), drawn(ball(5, 6, 10)))
    finally:
        other.close()


def test_over_rest(client: Client, case_id: str) -> None:
    answer = client.post(f"/api/v1/cases/{case_id}/labels", json={"name": "Wall"})
    made = answer.json()
    assert answer.headers["ETag"] == f'"{made["revision"]}"'
    address = f"/api/v1/labels/{made['id']}"
    assert (made["volume"], made["strokes"], made["structure"]) == ("ct", 0, None)
    stroke = {"brush": "disc", "radius_mm": 2.0, "points": [[5, 6, 10], [8, 6, 10]], "normal": [0, 0, 1]}
    painted = client.post(f"{address}/strokes", json=stroke)
    assert (painted.status_code, painted.json()["revision"], painted.headers["ETag"]) == (201, 2, '"2"')
    runs = client.get(f"{address}/voxels")
    mask = mask_of_runs(np.frombuffer(runs.content, dtype="<u4"), SHAPE)
    expected = drawn(Stroke("paint", "disc", 2.0, ((5.0, 6.0, 10.0), (8.0, 6.0, 10.0))))
    np.testing.assert_array_equal(mask, expected)
    assert runs.headers["ETag"] == '"2"'
    assert client.post(f"{address}/strokes", json=stroke, headers={"If-Match": '"1"'}).status_code in (409, 412)
    assert client.post(f"{address}/strokes", json=stroke | {"radius_mm": 900}).status_code == 422
    assert client.post(f"{address}/strokes", json=stroke | {"normal": [0, 0, 2]}).status_code == 422
    assert client.post(f"{address}/strokes", json=stroke | {"points": [[True, 0, 0]]}).status_code == 422
    bare = {name: value for name, value in stroke.items() if name != "normal"}
    assert "needs its normal" in client.post(f"{address}/strokes", json=bare | {"brush": "disc"}).text
    assert not client.post(f"{address}/undo").json()["can_undo"]
    assert client.get(f"{address}/file").status_code == 422, "empty"
    client.post(f"{address}/redo")
    assert client.get(f"{address}/file?form=seg.nrrd").content.startswith(b"NRRD0005")
    job = client.post(f"{address}/surface").json()
    for _ in range(600):
        job = client.get(f"/api/v1/jobs/{job['id']}").json()
        if job["state"] in ("done", "failed"):
            break
        time.sleep(0.05)
    assert job["state"] == "done", job
    (listed,) = client.get(f"/api/v1/cases/{case_id}/labels").json()
    assert (listed["structure"], listed["changed"]) == (job["result"], False)
    assert client.patch(address, json={"colour": "#0072b2"}).json()["colour"] == "#0072b2"
    assert client.patch(address, json={"locked": True}).json()["locked"]
    assert client.post(f"{address}/strokes", json=stroke).status_code == 423
    client.patch(address, json={"locked": False})
    assert client.patch(address, json={"deleted": True}).json()["deleted_at"]
    assert client.get(f"/api/v1/cases/{case_id}/labels").json() == []


def test_on_the_command_line(
    services: Services,
    case_id: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))

    def told(*options: str) -> list[dict[str, object]]:
        assert main(["case", "labels", case_id, *options, "--json"]) == 0
        labels: list[dict[str, object]] = json.loads(capsys.readouterr().out)["labels"]
        return labels

    assert told("--new", "Wall")[0]["voxels"] == 0
    assert told("--paint", "Wall", "5,6,10", "8,6,10", "--radius-mm", "1.5")[0]["voxels"] == int(
        drawn(Stroke("paint", "ball", 1.5, ((5.0, 6.0, 10.0), (8.0, 6.0, 10.0)))).sum()
    )
    assert told("--undo", "Wall")[0]["voxels"] == 0
    assert told("--redo", "Wall")[0]["can_undo"]
    assert str(told("--surface", "Wall")[0]["structure"]).startswith("painted-")
    assert told("--export", "Wall", str(tmp_path / "wall.nii.gz"))
    assert (tmp_path / "wall.nii.gz").read_bytes()[:2] == b"\x1f\x8b"
    assert main(["case", "labels", case_id, "--undo", "Nobody"]) == 2
    assert main(["case", "labels", case_id, "--export", "Wall", str(tmp_path / "wall.stl")]) == 2
    assert told("--delete", "Wall") == []


def test_a_stroke_beyond_the_scan_and_the_surface_of_a_deleted_label_are_refused(
    services: Services, case_id: str
) -> None:
    label = services.labels.create(case_id, "Gone")
    with pytest.raises(InputError, match="reaches no voxel"):
        draw(services, label.id, ball(900.0, 6.0, 10.0))
    assert not services.labels.documents.get(label.id).can_undo
    draw(services, label.id, ball(5.0, 6.0, 10.0))
    services.labels.documents.delete(label.id)
    with pytest.raises(InputError, match="restore it first"):
        services.labels.start(label.id)


def test_drawing_can_be_ended_and_goes_on_from_what_is_drawn(
    services: Services, case_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    label, places = services.labels.create(case_id, "Long"), [(5.0 + n, 6.0, 10.0) for n in range(4)]
    for place in places:
        draw(services, label.id, ball(*place))
    document = services.labels.documents.get(label.id)
    shares: list[float] = []

    def ended(stage: str, share: float) -> None:
        shares.append(share)
        if len(shares) == 3:
            raise JobCancelled

    with pytest.raises(JobCancelled):
        services.labels.run(label.id, ended)
    assert shares == sorted(set(shares))
    np.testing.assert_array_equal(voxels(services, label.id), drawn(*(ball(*place) for place in places)))
    asked: list[Stroke] = []

    def noted(*given: Any) -> None:
        asked.append(given[2])
        draw_stroke(*given)

    monkeypatch.setattr("app.imaging.labels.draw_stroke", noted)
    further = ball(9.0, 8.0, 10.0)
    draw(services, label.id, further)
    np.testing.assert_array_equal(
        voxels(services, label.id), drawn(*(one.stroke for one in document.content.strokes), further)
    )
    assert asked == [further], "what was drawn before is not drawn again"
