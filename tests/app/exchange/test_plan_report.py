"""The report to print: the figures of the evaluation, outlines that lie on bone, no scan of a patient unless asked."""

import base64
import html
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from rest_client import Client

from app.api import plan_files
from app.cases.model import HEAD_PHANTOM
from app.cli import main
from app.exchange.report import report as module
from app.exchange.report.cut import HALF_MM, PLANES, Outlined, Shown, cut_picture
from app.planning.piercing import Pierced
from app.planning.protected_structures import structure_of
from app.plans.operations.points import MovePoint
from app.plans.points import PlanPoint
from app.plans.zones import COLOURS, PlanZone, RemovedBone
from app.services import Services
from app.tabs.plan.clearance import verdict_view
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.runtime.snapshot import Blocker
from vfix_engine.virtual_fixtures import Zone

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
    rows = dict(re.findall(r"<tr[^>]*><td>([^<]*)</td><td>[^<]*</td><td>([^<]*)</td>", page))
    for target in report.targets:
        cone = f"{target.cone_deg:.0f}° cone" if target.cone_deg else "not seen"
        assert rows[html.escape(target.label)] == cone
    assert len({target.cone_deg for target in report.targets}) > 2


def test_its_figures_are_those_of_the_card(phantom_services: Services, page: str) -> None:
    sample = phantom_services.plans.get(SAMPLE)
    view = verdict_view(phantom_services.planning.evaluate(sample))
    told = re.findall(r"<dt>(.+?)</dt><dd><b>(.+?)</b>", page)
    assert [name.lower() for name, _ in told] == [figure["name"] for figure in view["figures"]]
    for (_, value), figure in zip(told, view["figures"], strict=True):
        assert value.startswith(f"{figure['value']:.{figure['digits']}f} ")


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


def test_the_whole_head_is_shown_with_its_path_and_without_skin_or_scan(phantom_services: Services, page: str) -> None:
    """Also where the scan was asked for: a face would be seen in it."""
    figures = re.findall(r"<figure>(<svg.*?</svg>)<figcaption>(.*?)</figcaption>", page, flags=re.DOTALL)
    assert len(figures) == 4
    svg, caption = figures[-1]
    assert caption.startswith("Whole head, sagittal")
    assert ("<image" in svg, "<image" in figures[0][0]) == (False, True)
    skull = phantom_services.cases.case_surface(HEAD_PHANTOM, "skull")
    half = float(re.findall(r'viewBox="-([0-9.]+)', svg)[0])
    low, high = (float(one) for one in np.array(skull.bounds)[:, 2])
    assert half > 0.5 * (high - low)  # all of it
    found = re.search(rf'style="stroke:{module.BONE}" d="([^"]+)"', svg)
    assert found is not None
    bone = np.array([[float(x) for x in pair.split()] for pair in re.split("[ML]", found[1])[1:]])
    skin = phantom_services.cases.case_surface(HEAD_PHANTOM, "skin").bounds
    front = float(np.array(skull.bounds)[:, 1].min())
    assert np.array(skin)[:, 1].min() < front - 5.0, "the nose stands out of the bone"
    middle = 0.5 * sum(np.array(skull.bounds)[:, 1])
    assert middle + bone[:, 0].min() > front - 10.0, "no outline of it"
    assert re.search(r'<path class="path( beyond)?" d="', svg)


@pytest.mark.parametrize(
    ("stored", "drawn"),
    [("#e0b04c", COLOURS[0]), ("#C97BD1", COLOURS[1]), ("#b8a1e3", COLOURS[5]), (COLOURS[2], COLOURS[2]),
     ("#123456", "#123456")],
)  # fmt: skip
def test_a_former_default_colour_is_drawn_in_the_present_one(
    phantom_services: Services, stored: str, drawn: str
) -> None:
    sample = phantom_services.plans.get(SAMPLE)
    x, y, z = sample.content.points[-1].position
    zone = PlanZone("z1", "nerve", {"kind": "sphere", "centre": (x, y, z), "radius": 4.0}, colour=stored)
    assert (zone.colour, zone.drawn_colour) == (stored, drawn)
    plan = replace(sample, content=replace(sample.content, zones=(zone,)))
    page = phantom_services.plan_reports.html(plan, with_images=False)
    assert f"color:{drawn}" in page


NASTY = "<b>&\"' {}"


def test_every_name_that_a_user_gives_is_text(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of plan, case, paths, points, targets, structures, removed bone, tool, robot, registration and notes."""
    sample = phantom_services.plans.get(SAMPLE)
    x, y, z = sample.content.points[-1].position
    ball = {"kind": "sphere", "centre": (x + 9.0, y, z), "radius": 2.0}
    path = replace(sample.content.path, name=NASTY.format("path"))
    content = replace(
        sample.content,
        paths=(path, replace(path, id="path-2", name=NASTY.format("other path"))),
        targets=tuple(replace(one, label=NASTY.format(f"target {one.id}")) for one in sample.content.targets),
        zones=(
            PlanZone("z1", NASTY.format("structure"), ball, 0.5),
            PlanZone("z2", NASTY.format("soft"), ball, 1.0, "soft", 0.5, 0.5),
        ),
        removed_bone=(RemovedBone("r1", NASTY.format("removed"), {**ball, "centre": (x, y, z - 20.0)}),),
        notes=NASTY.format("notes"),
    )
    reports, case = phantom_services.plan_reports, phantom_services.cases.get(HEAD_PHANTOM)
    named = replace(case, name=NASTY.format("case"), notes=(NASTY.format("caution"),))
    monkeypatch.setattr(phantom_services.cases, "get", lambda case_id: named)
    for one in ("plan_tool", "plan_robot"):
        monkeypatch.setattr(module, one, lambda *given, name=one: SimpleNamespace(title=NASTY.format(name)))
    registered = SimpleNamespace(words=NASTY.format("registration"), doubts=(NASTY.format("doubt"),))
    monkeypatch.setattr(reports._registering, "registration_of", lambda plan: registered)
    page = reports.html(replace(sample, name=NASTY.format("plan"), content=content), with_images=False)
    given = ("plan", "path", "other path", "structure", "soft", "notes", "case", "caution", "plan_tool", "plan_robot",
             "registration", "doubt", *(f"target {one.id}" for one in content.targets))  # fmt: skip
    for name in given:
        assert html.escape(NASTY.format(name)) in page, name
    assert "<b>&" not in page
    tags = Tags()
    tags.feed(page)
    assert tags.open == []


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


def test_the_cuts_go_through_what_blocks_the_tool(phantom_services: Services) -> None:
    """Behind the tip as well, where the shaft is stopped or pierces."""
    found = phantom_services.planning.evaluate(phantom_services.plans.get(SAMPLE))
    skin = Pierced("room", 12.0, 5.0, (1.0, 2.0, 3.0), (2.0, 2.0, 3.0), 31.0)
    pierces = replace(found, verdict=replace(found.verdict, reason="pierced", level="blocked", pierced=skin))
    assert module._pictured(pierces) == (31.0, "the skin that is pierced", (1.0, 2.0, 3.0))
    stop = Blocker("bone", "bone", "shaft", point=np.array([4.0, 5.0, 6.0]))
    held = replace(found, run=replace(found.run, completed=False, stopped_by=stop))
    assert module._pictured(held) == (found.reached_mm, "what stops the tool", (4.0, 5.0, 6.0))
    assert module._pictured(found) == (found.verdict.s_mm, "the tip", None)


def test_rest_writes_it_without_the_scan_of_a_patient(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    address = f"/api/v1/plans/{SAMPLE}/report/page"
    answer = client.get(address)
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert "attachment" in answer.headers["content-disposition"]
    assert "<image" in answer.text  # the synthetic head shows nobody
    monkeypatch.setattr(plan_files, "holds_images", lambda case: True)
    assert "<image" not in client.get(address).text
    assert "<image" in client.get(address, params={"with_images": True}).text


def test_the_command_line_wants_html(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("app.commands.plan.build_services", lambda settings: phantom_services)
    assert main(["plan", "report", SAMPLE, "-o", str(tmp_path / "plan.pdf")]) == 2
    assert main(["plan", "report", SAMPLE, "-o", str(tmp_path / "plan.html"), "--json"]) == 0
    assert (tmp_path / "plan.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.iterdir()] == ["plan.html"]


def test_what_lies_outside_of_a_cut_is_faded() -> None:
    """A path across the plane, and a tool that crosses it at a slant."""
    line = np.array([[0.0, y, 3.0] for y in np.linspace(-20.0, 20.0, 401)])
    start, end = np.array([[1.0, -8.0, 3.0]]), np.array([[1.0, 12.0, 3.0]])
    picture = Shown(np.array([0.0, 2.0, 3.0]), (), line, start, end, np.array([2.0]))
    axial, coronal, sagittal = (cut_picture(plane, picture) for plane in PLANES)

    def places(svg: str, name: str) -> np.ndarray[Any, Any]:
        found = re.findall(rf'<path class="{name}" d="([^"]+)"', svg)
        return np.array([[float(x) for x in pair.split()] for one in found for pair in re.split("[ML]", one)[1:]])

    for within in (axial, sagittal):
        assert places(within, "path") == pytest.approx(places(within, "path beyond"))
    assert np.ptp(places(coronal, "path"), axis=0).max() == 0.0
    cut = [float(width) for width in re.findall(r"stroke-width:(.+?)\"", coronal.split('<g class="tool">')[1])]
    assert max(cut) == pytest.approx(4.0, abs=0.05)  # its diameter, where its axis meets the plane
    beside = cut_picture(PLANES[1], replace(picture, centre=np.array([0.0, 18.0, 3.0])))
    assert ('<g class="tool beyond">' in beside, '<g class="tool">' in beside) == (True, False)


def test_the_colour_of_a_curve_belongs_to_its_obstacle() -> None:
    """Also of a structure that is called bone, of links of a chain, and of the hard core of a soft one."""
    zones = [
        PlanZone(name, name, {}, colour=colour) for name, colour in (("bone", "#111111"), ("bone, old", "#222222"))
    ]
    for name, colour in (("bone", "#111111"), ("bone (2 of 3)", "#111111"), ("bone, 0.5 mm deep", "#111111"),
                         ("bone, old", "#222222"), ("bone, old (1 of 2), 1 mm deep", "#222222")):  # fmt: skip
        assert structure_of(Zone(name, Sphere(np.zeros(3), 1.0), 1.0), zones).colour == colour


def test_a_large_plan_stays_small(phantom_services: Services) -> None:
    """40 targets, 12 structures, notes, a tangled path and a long dry run."""
    sample = phantom_services.plans.get(SAMPLE)
    x, y, z = sample.content.points[-1].position
    random = np.random.default_rng(1)
    spread = random.normal(size=(40, 3))
    targets = tuple(PlanPoint(f"t{n}", f"T{n}", (x + dx, y + dy, z + dz)) for n, (dx, dy, dz) in enumerate(spread))
    chains = random.normal(size=(12, 32, 3)) * 3.0 + (x + 20.0, y + 12.0, z + 12.0)
    zones = tuple(
        PlanZone(f"z{n}", f"chain {n}", {"kind": "capsules", "radius": 0.5, "points": points})
        for n, points in enumerate(chains.tolist())
    )
    page = phantom_services.plan_reports.html(
        replace(sample, content=replace(sample.content, targets=targets, zones=zones)), with_images=False
    )
    assert len(page) < 1_500_000
    assert "… and 30 more" in page
    assert page.count('<li style="color:') == 8
    assert "Other structures" in page
