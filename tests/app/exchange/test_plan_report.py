"""The report to print: the figures of the evaluation, outlines that lie on bone, no scan of a patient unless asked."""

import base64
import html
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from rest_client import Client

from app.cases.model import HEAD_PHANTOM
from app.cli import main
from app.exchange.report.cut import HALF_MM, PLANES, Outlined, Shown, cut_picture
from app.plans.operations.points import MovePoint
from app.services import Services
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

SAMPLE = "head-phantom-sample"


class Tags(HTMLParser):
    """Checks that tags are closed, and keeps what refers to something outside of the page."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href")]
        if tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def page(phantom_services: Services) -> str:
    return phantom_services.plan_reports.html(phantom_services.plans.get(SAMPLE), with_images=True)


def test_it_says_what_the_evaluation_says(phantom_services: Services, page: str) -> None:
    report = phantom_services.path_evaluations.of_plan(phantom_services.plans.get(SAMPLE)).chosen
    text = html.unescape(re.sub(r"<style>.*</style>|<[^>]+>", " ", page, flags=re.DOTALL))
    assert report.words.removeprefix(f"{report.short}.").strip() in text
    assert f"{report.least_clearance_mm:.2f} mm" in text
    assert "Not for clinical use" in text
    for target in report.targets:
        assert re.search(rf"{re.escape(target.label)} .*{target.cone_deg:.0f}°", text)


def test_it_is_whole_in_itself(page: str) -> None:
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert tags.references
    assert all(one.startswith("data:image/png;base64,") for one in tags.references)
    assert not re.search(r"https?://|url\(|@import|<script", page)


def test_no_scan_unless_it_is_asked_for(phantom_services: Services) -> None:
    page = phantom_services.plan_reports.html(phantom_services.plans.get(SAMPLE), with_images=False)
    assert ("<image" in page, "<svg" in page) == (False, True)


def test_names_and_notes_are_text(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "<b>&\"' plan")
    page = phantom_services.plan_reports.html(plan, with_images=False)
    assert "<b>&" not in page
    assert "<h1>&lt;b&gt;&amp;&quot;&#x27; plan</h1>" in page


def shown(mesh: TriangleMesh, **more: Any) -> Shown:
    axis = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    return Shown(
        centre=np.array([1.0, 2.0, 3.0]), surfaces=(Outlined(mesh, "#123456"),), path=axis, start=axis[:1],
        end=axis[1:], radius=np.array([2.0]), **more,
    )  # fmt: skip


@pytest.mark.parametrize("plane", PLANES, ids=[plane.name for plane in PLANES])
def test_an_outline_lies_on_the_surface_and_in_the_plane(plane: Any) -> None:
    made = trimesh.creation.icosphere(subdivisions=4, radius=20.0).apply_translation([5.0, -3.0, 4.0])
    mesh = TriangleMesh(np.asarray(made.vertices), np.asarray(made.faces))
    picture = shown(mesh)
    data = re.search(r'style="stroke:#123456" d="([^"]+)"', cut_picture(plane, picture))
    assert data is not None
    flat = np.array([[float(x) for x in pair.split()] for pair in re.split("[ML]", data[1])[1:]])
    places = np.tile(picture.centre, (len(flat), 1))
    places[:, plane.right] += flat[:, 0]
    places[:, plane.down[0]] += plane.down[1] * flat[:, 1]
    assert len(places) > 100
    away = np.abs(np.linalg.norm(places - [5.0, -3.0, 4.0], axis=1) - 20.0)
    assert away.max() < 0.05  # the middle of a facet lies that far below the sphere
    radius = np.sqrt(20.0**2 - (picture.centre - [5.0, -3.0, 4.0])[plane.through] ** 2)
    turns = np.linalg.norm(flat[::2] - flat[1::2], axis=1).sum()
    assert turns == pytest.approx(2.0 * np.pi * radius, rel=0.01)  # all around, and nothing twice


@pytest.mark.parametrize("plane", PLANES, ids=[plane.name for plane in PLANES])
def test_the_scan_lies_where_the_outline_is(plane: Any) -> None:
    """A bright ball in a scan of uneven voxels is drawn where it is."""
    spacing, origin, ball = np.array([0.7, 0.9, 1.3]), np.array([-30.0, -31.0, -32.0]), np.array([6.0, -4.0, 8.0])
    grid = np.stack(np.meshgrid(*(np.arange(64) for _ in range(3)), indexing="ij"), axis=-1) * spacing + origin
    hu = np.where(np.linalg.norm(grid - ball, axis=-1) < 9.0, 3000, -1000).astype(np.int16)  # (I, J, K)
    volume = Volume(hu.T.copy(), origin=origin, spacing=spacing, direction=np.eye(3))
    text = cut_picture(plane, shown(TriangleMesh(np.eye(3), np.array([[0, 1, 2]])), volume=volume))
    found = re.search(r'<image x="(.+?)" y="(.+?)" width="(.+?)" height="(.+?)" .*?base64,(.+?)"', text)
    assert found is not None
    x, y, width, height = (float(found[index]) for index in range(1, 5))
    encoded = np.frombuffer(base64.b64decode(found[5]), np.uint8)
    image = cv2.imdecode(encoded, cv2.IMREAD_GRAYSCALE)
    assert image is not None
    rows, columns = np.nonzero(image > 127)
    middle = [
        x + (columns.mean() + 0.5) * width / image.shape[1],
        y + (rows.mean() + 0.5) * height / image.shape[0],
    ]
    assert middle == pytest.approx(plane.project(ball, np.array([1.0, 2.0, 3.0])).tolist(), abs=0.3)
    assert width <= 2.0 * HALF_MM + 3.0


def test_a_plan_that_is_refused_at_its_entry_has_its_verdict(phantom_services: Services) -> None:
    """There are no figures along the path then."""
    sample = phantom_services.plans.get(SAMPLE)
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "into bone")
    bone = phantom_services.cases.case_surface(HEAD_PHANTOM)
    deep = bone.vertices[np.argmin(np.linalg.norm(bone.vertices - sample.content.points[0].position, axis=1))]
    x, y, z = deep.tolist()
    moved = phantom_services.plans.do(plan.id, MovePoint(point_id=plan.content.points[0].id, position=(x, y, z)))
    page = phantom_services.plan_reports.html(moved, with_images=False)
    assert 'class="verdict blocked"' in page
    assert "<svg" not in page


def test_rest_writes_it(client: Client) -> None:
    answer = client.get(f"/api/v1/plans/{SAMPLE}/report/page")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert "attachment" in answer.headers["content-disposition"]
    assert "<image" in answer.text  # the synthetic head shows nobody


def test_the_command_line_wants_html(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("app.commands.plan.build_services", lambda settings: phantom_services)
    assert main(["plan", "report", SAMPLE, "-o", str(tmp_path / "plan.pdf")]) == 2
    assert main(["plan", "report", SAMPLE, "-o", str(tmp_path / "plan.html"), "--json"]) == 0
    assert (tmp_path / "plan.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.iterdir()] == ["plan.html"]
