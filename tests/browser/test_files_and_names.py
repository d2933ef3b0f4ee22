"""Files out and in, hostile names, and a line that breaks."""

from __future__ import annotations

import csv
import functools
import hashlib
import http.server
import json
import re
import threading
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from workstation import TOKEN, Planner, Rest, Workstation

from app.browsers import private_page

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


@pytest.fixture(scope="module")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    """One that is stopped, and that has no other heads and jobs."""
    started = Planner(tmp_path_factory.mktemp("home"))
    yield started
    started.stop()


NAME = r"CT \d+, \d{1,2} [A-Z][a-z]{2} \d\d:\d\d"  # of an import that nobody names
HOSTILE = (
    "<img src=x onerror=window.executed=1>",
    "<script>window.executed=1</script>",
    '"><svg onload=window.executed=1>',
    "javascript:window.executed=1",
    "{{constructor.constructor('window.executed=1')()}}",
)


def _download(station: Workstation, form: str, folder: Path) -> Path:
    with station.page.expect_download(timeout=120_000) as waiting:
        station.page.click(f"button[data-format='{form}']")
    path = folder / f"plan.{form}"
    waiting.value.save_as(path)
    return path


def _near(positions: list[Any]) -> list[Any]:
    return [pytest.approx(position, abs=1e-6) for position in positions]


def test_every_export_says_what_the_plan_says_and_comes_back(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    """JSON, Slicer markups and CSV from the page's buttons, read back here and through the page's import (HAZ-35)."""
    station = open_page().ready()
    plan_id = rest.copy_of_sample("Exported")
    station.open_plan(plan_id)
    station.page.click("#export")
    plan = rest.plan(plan_id)
    labels = [point["label"] for point in plan["points"]]
    positions = [point["position"] for point in plan["points"]]

    native = json.loads(_download(station, "json", tmp_path).read_text(encoding="utf-8"))
    assert [point["label"] for point in native["points"]] == labels
    assert [point["position"] for point in native["points"]] == _near(positions)
    assert "clinical" in native["notice"]

    markups = json.loads(_download(station, "mrk.json", tmp_path).read_text(encoding="utf-8"))
    assert {markup["coordinateSystem"] for markup in markups["markups"]} == {"LPS"}
    controls = markups["markups"][0]["controlPoints"]
    assert [control["position"] for control in controls] == _near(positions)

    table = _download(station, "csv", tmp_path).read_text(encoding="utf-8")
    assert "clinical" in table
    assert all(label in table for label in labels)
    assert any(row for row in csv.reader(table.splitlines()))

    with zipfile.ZipFile(_download(station, "slicer", tmp_path)) as packed:
        names = packed.namelist()
        assert "Exported/scene.mrml" in names
        assert {name.rsplit("/", 1)[1].split("-")[0] for name in names} >= {"volume", "surface", "mark"}

    for name in ("plan.json", "plan.mrk.json", "plan.csv"):
        station.page.set_input_files("input[accept='.json,.csv,.fcsv']", tmp_path / name)
        station.wait_for(name, lambda: station.state("plan")["id"] != plan_id)
        back = rest.plan(station.state("plan")["id"])
        assert [point["position"] for point in back["points"]] == _near(positions), name
        assert [point["label"] for point in back["points"]] == labels, name
        station.open_plan(plan_id)
    assert station.errors == []


def test_a_head_that_comes_in_is_offered_and_not_opened(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    """What is open, and perhaps runs, stays until somebody chooses the new head."""
    station = open_page().ready()
    hu = np.full((60, 60, 60), -1000, dtype="<i2")
    hu[10:50, 10:50, 10:50] = 1000
    header = (
        "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 60 60 60\n"
        "space directions: (3,0,0) (0,3,0) (0,0,3)\nendian: little\nencoding: raw\nspace origin: (0,0,0)\n\n"
    )
    (tmp_path / "Block.nrrd").write_bytes(header.encode() + hu.tobytes())
    station.page.click("[data-step=patient]")
    station.wait_for("Patient", lambda: station.state("step")["name"] == "patient")
    before = station.state("case")["id"]
    station.page.set_input_files("input[type='file'][accept*='.nii']", tmp_path / "Block.nrrd")
    offer = station.page.get_by_role("button", name="Open it")
    offer.hover()  # it stays while it is pointed at
    expect(station.page.locator("#cases")).to_contain_text(re.compile(NAME))
    assert station.state("case")["id"] == before
    offer.click()
    station.wait_for("the new head", lambda: re.fullmatch(NAME, station.state("case")["name"]))
    rest.client.delete(f"/api/v1/cases/{station.state('case')['id']}").raise_for_status()
    assert station.errors == []


def test_an_import_that_goes_on_is_found_after_a_reload_and_cancelled(
    open_page: Open, rest: Rest, tmp_path: Path
) -> None:
    """Its stage and share are there again; cancelled, it says so and leaves no head."""
    station = open_page().ready()
    heads = [case["id"] for case in rest.client.get("/api/v1/cases").raise_for_status().json()]
    others = [job["id"] for job in rest.client.get("/api/v1/jobs").raise_for_status().json()]
    u = np.arange(256, dtype=np.float32) * 0.4
    sines, cosines = np.sin(u), np.cos(u)
    walls = sines[:, None, None] * cosines[None, :, None] + sines[None, :, None] * cosines[None, None, :]
    hu = np.where(walls + sines[None, None, :] * cosines[:, None, None] > 0, 1000, -1000).astype("<i2")
    header = (
        "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 256 256 256\n"
        "space directions: (0.8,0,0) (0,0.8,0) (0,0,0.8)\nendian: little\nencoding: raw\nspace origin: (0,0,0)\n\n"
    )
    (tmp_path / "Sponge.nrrd").write_bytes(header.encode() + hu.tobytes())
    page, row = station.page, station.page.locator("[data-job=import]")
    page.click("[data-step=patient]")
    station.wait_for("Patient", lambda: station.state("step")["name"] == "patient")
    page.set_input_files("input[type='file'][accept*='.nii']", tmp_path / "Sponge.nrrd")
    expect(row).to_be_visible()
    expect(row).to_be_in_viewport()

    page.reload()
    expect(row).to_have_text(re.compile("‘CT’.*(%|waiting)"), use_inner_text=True)
    row.get_by_role("button", name="Cancel").click()
    station.wait_for("the word", lambda: station.said("cancelled. Nothing of it is kept"))
    assert not row.is_visible()
    jobs = rest.client.get("/api/v1/jobs").json()
    (job,) = (job for job in jobs if job["kind"] == "import" and job["id"] not in others)
    assert (job["state"], job["error"]["code"], job["result"]) == ("cancelled", "job_cancelled", None)
    assert [case["id"] for case in rest.client.get("/api/v1/cases").raise_for_status().json()] == heads
    station.drawn()
    assert not re.search(NAME, page.locator("#cases").inner_text())
    assert station.errors == []


def test_hostile_names_are_text_and_nothing_else(open_page: Open, rest: Rest) -> None:
    """HAZ-32: names of head, plan, points and targets that are markup are shown, never run."""
    station = open_page().see_scene()
    case = rest.client.get("/api/v1/cases/head-phantom").json()["name"]
    try:
        for payload in HOSTILE:
            plan_id = rest.short_plan(payload, 2)
            rest.client.patch("/api/v1/cases/head-phantom", json={"name": payload}).raise_for_status()
            item = rest.plan(plan_id)["points"][0]["id"]
            rest.client.patch(f"/api/v1/plans/{plan_id}/points/{item}", json={"label": payload}).raise_for_status()
            station.open_plan(plan_id)
            station.page.evaluate("(id) => vfix.request('item.select', { item_id: id })", item)
            expect(station.page.locator("#where")).to_contain_text(payload, use_inner_text=True)
            expect(station.page.locator("#points-table")).to_contain_text(payload, use_inner_text=True)
            for step in ("patient", "plan"):
                station.page.click(f"[data-step={step}]")
                station.wait_for(step, lambda step=step: station.state("step")["name"] == step)
        station.drawn()
        assert station.page.evaluate("window.executed") is None
        assert station.page.frames[-1].evaluate("window.executed") is None
        assert station.errors == []
    finally:
        rest.client.patch("/api/v1/cases/head-phantom", json={"name": case}).raise_for_status()


ELSEWHERE = """<!doctype html><title>elsewhere</title><a href="{base}/">the planner</a>
<img src="{base}/api/v1/plans/head-phantom-sample/evaluation">"""


def test_other_ports_may_link_to_the_planner_and_nothing_more(
    open_page: Open, planner: Planner, tmp_path: Path
) -> None:
    """A page of the same machine has the cookie sent along; only a visit to the page itself is let in (HAZ-28)."""
    station = open_page()
    page = station.page
    (tmp_path / "index.html").write_text(ELSEWHERE.format(base=planner.base), encoding="utf-8")
    statuses: list[int] = []
    network = page.context.new_cdp_session(page)  # a page is not told of answers that are kept from it
    network.send("Network.enable")
    network.on("Network.responseReceivedExtraInfo", lambda answer: statuses.append(answer["statusCode"]))
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as elsewhere:
        threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
        for name in ("127.0.0.1", "localhost"):  # another port of the same site, and another site
            page.goto(f"http://{name}:{elsewhere.server_port}/")
            station.wait_for("the refusal", lambda: statuses.count(403) == 1)
            page.click("a")
            page.wait_for_url(f"{planner.base}/")
            station.wait_for("the page", lambda: page.evaluate("window.vfix?.connected"))
            statuses.clear()
        elsewhere.shutdown()


def test_a_file_of_the_user_s_own_leads_to_the_page_and_the_scene_is_sandboxed(
    open_page: Open, planner: Planner
) -> None:
    """As `vfix serve` opens it: from a file, whose redirection counts as another site's (HAZ-27)."""
    station = open_page()
    station.page.context.clear_cookies()
    station.page.goto(f"{planner.base}/")
    assert "locked" in station.page.content()
    with private_page(f"{planner.base}/?token={TOKEN}") as file:
        station.page.goto(file.as_uri())
        station.page.wait_for_url(f"{planner.base}/")
    station.see_scene()
    frame = next(frame for frame in station.page.frames if "/scene/" in frame.url)
    assert frame.evaluate("window.open('about:blank') === null")
    leave = "() => { try { top.location.href = 'about:blank'; return 'left'; } catch (error) { return error.name; } }"
    assert frame.evaluate(leave) == "SecurityError"


def test_a_lost_planner_is_said_and_the_same_state_comes_back(open_page: Open, rest: Rest, planner: Planner) -> None:
    """The planner ends and is started again: a banner meanwhile, then the same plan in the same step."""
    plan_id = rest.short_plan("Kept", 2)
    station = open_page(sample=False).see_scene()
    station.wait_for("the newest plan", lambda: station.state("plan")["id"] == plan_id)
    station.page.click("[data-step=patient]")
    station.wait_for("Patient", lambda: station.state("step")["name"] == "patient")
    planner.stop()
    expect(station.page.locator("#banner")).to_be_visible()
    expect(station.page.locator("#banner")).to_contain_text("Connection lost")
    station.picture("connection-lost")
    planner.start()
    expect(station.page.locator("#banner")).to_be_hidden()
    station.see_scene()
    assert station.state("plan")["id"] == plan_id
    assert station.state("step")["name"] == "patient"


def test_a_window_that_is_locked_out_says_what_to_do(open_page: Open, rest: Rest, planner: Planner) -> None:
    """The planner comes back with another token: no promise to reconnect, no hot retries, and a way back in."""
    rest.short_plan("Locked out", 2)
    station = open_page(sample=False).ready()
    banner = station.page.locator("#banner")
    row = station.page.locator("#points-table tbody tr").first
    row.click()
    station.wait_for("the selection", lambda: station.state("plan")["selected"])
    asked: list[str] = []
    planner.stop()
    planner.start("another-token-" + "1" * 20)
    try:
        expect(banner).to_contain_text("another token")
        expect(banner).to_contain_text("paste the address that it printed")
        station.page.on("request", lambda request: asked.append(request.url))
        station.page.wait_for_timeout(3000)
        assert asked == []
        assert station.page.locator("#panel").evaluate("(panel) => panel.inert")
        reading = station.page.locator(".hint")
        station.wait_for("grey", lambda: reading.evaluate("(one) => getComputedStyle(one).opacity < 0.5"))
        station.picture("locked-out")
    finally:
        planner.stop()
        planner.start()
    station.page.click("#retry")
    expect(banner).to_be_hidden()
    assert not station.page.locator("#panel").evaluate("(panel) => panel.inert")
    expect(row, "the focus is where it was before").to_be_focused()
    station.ready()


# Whether there is a line three seconds after the page was told why it has none, by the page's own clock.
REFUSED = """async (flood) => {
  const pause = (ms) => new Promise((go) => setTimeout(go, ms));
  flood();
  while (!document.getElementById("banner").innerText.includes("Too many messages")) await pause(20);
  await pause(3000);
  return vfix.connected;
}"""


def test_a_window_that_is_refused_waits_and_says_so(open_page: Open, rest: Rest) -> None:
    """A page that floods the planner is shut out; neither the line nor the scene is asked for again at once."""
    rest.short_plan("Refused", 2)
    station = open_page(sample=False).see_scene()
    banner = station.page.locator("#banner")
    loads: list[str] = []
    station.page.on("framenavigated", lambda frame: loads.append(frame.url))
    flood = "() => { for (let n = 0; n < 600; n += 1) vfix.request('project', { points: [] }).catch(() => {}); }"
    connected = station.page.evaluate(f"({REFUSED})({flood})")
    assert [url for url in loads if "/scene/" in url] == []
    assert connected is False
    station.page.click("#retry")
    expect(banner).to_be_hidden()
    station.see_scene()
    assert station.errors == []


def test_a_head_is_saved_as_one_zip_and_such_a_zip_is_imported(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    rest.short_plan("Saved", 2)
    station = open_page(sample=False).ready()
    station.page.click("[data-step=patient]")
    station.wait_for("Patient", lambda: station.state("step")["name"] == "patient")
    page = station.page
    row = page.locator("#cases li", has_text="Head phantom").first
    row.hover()
    with page.expect_download(timeout=60_000) as waiting:
        row.get_by_role("button", name="Save case (zip)").click()
    path = tmp_path / "Head.zip"
    waiting.value.save_as(path)
    with zipfile.ZipFile(path) as packed:
        sums = dict(line.split("  ")[::-1] for line in packed.read("SHA256SUMS").decode().splitlines())
        assert all(hashlib.sha256(packed.read(name)).hexdigest() == digest for name, digest in sums.items())
    before = page.locator("#cases li").count()
    page.set_input_files("input[type=file][accept*='.zip']", path)
    station.wait_for("the copy", lambda: page.locator("#cases li").count() == before + 1)
    assert "Head phantom 2" in page.locator("#cases").inner_text()
    assert station.errors == []
