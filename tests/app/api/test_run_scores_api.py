"""REST: score and series of stored runs, computed once, and gone with the run."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rest_client import Client, opened_client

from app.api.run_scores import report_name
from app.drives.run_scores import RunScores, score_file
from app.services import Services
from vfix_engine.runtime.run import Run
from vfix_engine.study.holds import holds_of
from vfix_engine.study.lumen import lumen_holds_of, lumen_series_of, score_lumen_run
from vfix_engine.study.metrics import score_run
from vfix_engine.study.series import series_of


def commented_over_rest(client: Client, path: str, snake: str) -> None:
    """Comments on a rigid run and on a snake's; the report and the list of what belongs to an export have them."""
    said = client.post(f"{path}/comments", json={"at_s": 0.05, "text": "<i>Slower</i> & here"})
    assert (said.status_code, said.json()["t_s"]) == (201, 0.05)
    comment = f"{path}/comments/{said.json()['id']}"
    assert client.patch(comment, json={"at_s": 0.1}).json()["t_s"] == 0.1
    assert client.patch(comment, json={"text": "<i>Slow</i>"}).json()["text"] == "<i>Slow</i>"
    shown = client.get(path).json()["comments"]
    assert shown == client.get(f"{path}/comments").json() == client.get("/api/v1/runs").json()[-1]["comments"]
    assert [(one["text"], one["t_s"]) for one in shown] == [("<i>Slow</i>", 0.1)]
    assert "<td>0.1 s</td><td>&lt;i&gt;Slow&lt;/i&gt;</td>" in client.get(f"{path}/report").text
    assert client.get(f"{path}/export", params={"format": "about.json"}).json()["comments"] == shown
    for wrong in ({"text": None}, {"at_s": True}, {"text": "x" * 301}, {"at_s": 1e9}, {"text": "a\nb"}, {"by": 1}):
        refused = {"at_s": 0.0, "text": "x", **wrong}
        assert client.post(f"{path}/comments", json=refused).status_code == 422, refused
    assert client.delete(comment).status_code == 204
    assert client.delete(comment).status_code == client.patch(comment, json={"text": "x"}).status_code == 404
    assert client.get(path).json()["comments"] == []
    other = client.post(f"/api/v1/runs/{snake}/comments", json={"at_s": 0.01, "text": "The bend"})
    assert (other.status_code, other.json()["t_s"]) == (201, 0.01)
    assert client.post("/api/v1/runs/nobody/comments", json={"at_s": 0.0, "text": "x"}).status_code == 404


def in_a_lumen(client: Client, home: Services, snake: dict[str, Any]) -> None:
    """The run of a snake, recorded before its rows had the link nearest to its bound, has a score and series too."""
    assert (snake["mode"], snake["arm"], snake["score"]) == (None, "certified", None)
    path = f"/api/v1/runs/{snake['id']}"
    with home.runs.laid_out(snake["id"]) as place:
        run = Run.read(place)
    expected, score = score_lumen_run(run).to_dict(), client.get(f"{path}/score").json()
    same = (
        "arm",
        "certified",
        "depth_mm",
        "length_mm",
        "share",
        "path_length_mm",
        "beyond_bound_mm",
        "force_n",
        "task",
    )
    assert {key: score[key] for key in same} == {key: expected[key] for key in same}
    assert [one["t_s"] for one in score["holds"]] == [one.t_s for one in lumen_holds_of(run)]
    short = client.get(path).json()["score"]
    assert (short["depth_mm"], short["beyond_bound_mm"]) == (score["depth_mm"], 0.0)
    told, series = client.get(f"{path}/series").json(), lumen_series_of(run, 20.0)
    assert np.array(told["chain_mm"]) == pytest.approx(series.chain, abs=0.006)
    assert np.array(told["eye"]) == pytest.approx(series.eye, abs=1e-3)
    assert told["t_s"] == pytest.approx(series.t, abs=1e-4)
    assert np.array(told["guidance_xy_n"], dtype=float) == pytest.approx(series.guidance_xy, abs=0.006, nan_ok=True)
    assert (told["world"], told["arm"], told["limits"][0]) == ("snake", "certified", "")
    assert client.get(f"{path}/export", params={"format": "csv"}).status_code == 200
    assert client.post(f"{path}/swept").status_code == client.patch(path, json={"teacher": True}).status_code == 422


def test_a_run_is_scored_once_and_its_series_are_downloaded(old_home: Services) -> None:
    client: Client = opened_client(old_home)
    runs = {one["world"]: one for one in client.get("/api/v1/runs").json()}
    rigid, snake = runs["rigid"], runs["snake"]
    assert (rigid["mode"], rigid["score"]) == ("hands-on", None), "nobody has asked yet"
    assert (rigid["certified"], snake["certified"]) == (True, True)
    path = f"/api/v1/runs/{rigid['id']}"

    score = client.get(f"{path}/score").json()
    with old_home.runs.laid_out(rigid["id"]) as place:
        run = Run.read(place)
    expected = score_run(run).to_dict()
    same = ("samples", "time_s", "contacts", "held_s", "mode", "certified", "whole", "lost", "led_by")
    assert {key: score[key] for key in same} == {key: expected[key] for key in same}
    assert (score["whole"], score["lost"], score["led_by"]) == (True, 0, {"hand": 1.0, "position": 0.0, "rate": 0.0})
    assert score["holds"] == [{**one.to_dict(), "place": list(one.place)} for one in holds_of(run)]
    short = next(one["score"] for one in client.get("/api/v1/runs").json() if one["id"] == rigid["id"])
    assert short["time_s"] == score["time_s"]
    assert short["clearance_mm"] == min(score["least_clearance_mm"].values())
    assert short["certified"] is True

    told, series = client.get(f"{path}/series").json(), series_of(run)
    assert len(told["t_s"]) == len(told["segments"]) == len(told["speed"][0]) <= 30 * series.t[-1] + 1
    assert told["t_s"][-1] == pytest.approx(series.t[-1], abs=1e-4)
    assert np.array(told["segments"])[-1, 0, 3:] == pytest.approx(series.tip[-1], abs=1e-3)
    shaft = np.diff(np.array(told["segments"])[:, 0].reshape(-1, 2, 3), axis=1)[:, 0]
    assert np.abs((np.array(told["side"]) * shaft).sum(axis=1)).max() < 1e-3
    near = series.clearance[series.clearance < series.reach[:, None]]
    least = min((v for row in told["clearance_mm"] for v in row if v is not None), default=np.inf)
    assert least == pytest.approx(near.min(initial=np.inf), abs=1e-4)

    for on in (True, False):
        assert client.patch(path, json={"teacher": on}).json()["teacher"] is on
        assert client.get(path).json()["teacher"] is on
    assert client.patch(path, json={"teacher": 1}).status_code == 422
    assert client.patch("/api/v1/runs/nobody", json={"teacher": True}).status_code == 404

    commented_over_rest(client, path, runs["snake"]["id"])

    for what in ("score", "series"):
        assert client.get(f"/api/v1/runs/nobody/{what}").status_code == 404
    in_a_lumen(client, old_home, snake)

    page = client.get(f"{path}/report", params={"beside": rigid["id"]})
    assert page.headers["content-type"].startswith("text/html")
    assert f'filename="{rigid["id"]}-hands-on.html"' in page.headers["content-disposition"]
    free = replace(old_home.runs.get(rigid["id"]), manifest={"world": "freehand", "mode": "freehand"})
    assert report_name(free).endswith("-freehand-without-certificate.html"), "HAZ-41"
    odd = replace(free, manifest={"world": "freehand", "mode": 'a"\r\nb'})
    assert report_name(odd).endswith("-freehand-without-certificate.html"), "no word of a manifest is in a file's name"
    assert "Not for clinical use" in page.text
    assert client.get(f"{path}/report", params={"beside": snake["id"]}).status_code == 422
    folder = old_home.runs.new_folder()
    with old_home.runs.laid_out(rigid["id"]) as place:
        shutil.copytree(place, folder)
    again = old_home.runs.keep(folder, origin="page")
    both = client.get(f"{path}/report", params={"beside": again.id})
    assert (both.status_code, "<h1>2 runs" in both.text, again.id in both.text) == (200, True, True)

    key = rigid["files"]["ticks.f64"]["sha256"]
    old_home.sweep()
    file = score_file(old_home.runs.get(rigid["id"]))
    kept = old_home.store.derived.path(key, file)
    assert kept is not None
    changed = kept.read_text(encoding="utf-8").replace('"contacts": 0', '"contacts": "none"')
    for damage in ("{", "[]", "{}", '"x"', "null", '{"score": {}, "sha256": ""}', changed):
        kept.write_text(damage, encoding="utf-8")
        assert RunScores(old_home.store, old_home.runs).known(old_home.runs.get(rigid["id"])) is None, damage
    anew = RunScores(old_home.store, old_home.runs).of(rigid["id"])
    assert anew == old_home.run_scores.of(rigid["id"])
    for run_id in (rigid["id"], again.id):
        assert client.delete(f"/api/v1/runs/{run_id}").status_code == 204
    old_home.sweep()
    assert old_home.store.derived.path(key, file) is None
    client.close()


def test_two_runs_of_the_same_steps_have_their_own_series_and_scores(old_home: Services) -> None:
    """A scripted drive that is repeated, once after a structure was renamed: steps are equal, the rest is not."""
    client: Client = opened_client(old_home)
    rigid = next(one for one in old_home.runs.list() if one.world == "rigid")
    kept = []
    for renamed in (None, "renamed"):
        with old_home.runs.laid_out(rigid.id) as place:
            folder = old_home.runs.new_folder()
            shutil.copytree(place, folder)
        if renamed is not None:
            manifest = json.loads((folder / "manifest.json").read_text())
            manifest["spec"]["zones"][0]["name"] = renamed
            (folder / "manifest.json").write_text(json.dumps(manifest))
        kept.append(old_home.runs.keep(folder, origin="study"))
    first = rigid.manifest["spec"]["zones"][0]["name"]
    assert len({one.files["ticks.f64"].sha256 for one in (rigid, *kept)}) == 1
    for one, name in zip((rigid, *kept), (first, first, "renamed"), strict=True):
        series = client.get(f"/api/v1/runs/{one.id}/series").json()
        assert series["run"] == one.id
        assert name in series["structures"]
        score = client.get(f"/api/v1/runs/{one.id}/score").json()
        assert name in score["least_clearance_mm"]
    again = RunScores(old_home.store, old_home.runs)
    assert "renamed" in again.of(kept[1].id)["least_clearance_mm"]
    assert "renamed" not in again.of(rigid.id)["least_clearance_mm"]
    client.close()
