"""REST: a run as a file, equal to the one that the command line writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rest_client import Client, opened_client

from app.exchange.runs import export
from app.exchange.runs.export import export_run
from app.exchange.runs.python import run_python
from app.services import Services
from vfix_engine.runtime.run import Run


def runs_of(old_home: Services) -> dict[str, str]:
    """Ids of the stored runs by their world."""
    return {run.world: run.id for run in old_home.runs.list()}


def test_files_are_those_of_the_command_line(old_home: Services, tmp_path: Path) -> None:
    client: Client = opened_client(old_home)
    run_id = runs_of(old_home)["rigid"]
    with old_home.runs.laid_out(run_id) as folder:
        run = Run.read(folder)
    path = f"/api/v1/runs/{run_id}/export"
    for form in ("csv", "parquet", "mcap"):
        export_run(run, tmp_path / f"run.{form}", run_id)
        answer = client.get(path, params={"format": form})
        assert answer.status_code == 200
        assert answer.headers["content-disposition"] == f'attachment; filename="{run_id}.{form}"'
        assert answer.headers["x-notice"] == "Not for clinical use"
        assert answer.content == (tmp_path / f"run.{form}").read_bytes()
    about = client.get(path, params={"format": "about.json"})
    assert f'filename="{run_id}.csv.about.json"' in about.headers["content-disposition"]
    assert about.json() == json.loads((tmp_path / "run.csv.about.json").read_text(encoding="utf-8"))
    assert client.get(path, params={"format": "py"}).text == run_python(run, run_id)
    assert not any(old_home.store.exports.open().iterdir()), "temporary files are gone once they are sent"
    client.close()


def test_what_cannot_be_exported_is_refused(old_home: Services, monkeypatch: pytest.MonkeyPatch) -> None:
    client: Client = opened_client(old_home)
    runs = runs_of(old_home)
    path = f"/api/v1/runs/{runs['snake']}/export"
    refused = client.get(path, params={"format": "py"})
    assert (refused.status_code, "no scene of a rigid tool" in refused.json()["error"]["message"]) == (422, True)
    assert client.get(path, params={"format": "xlsx"}).status_code == 422
    assert client.get("/api/v1/runs/nobody/export").status_code == 404
    monkeypatch.setattr(export, "find_spec", lambda name: None)
    for form, extra in (("parquet", "tables"), ("mcap", "mcap")):
        refused = client.get(path, params={"format": form})
        error = refused.json()["error"]
        assert (refused.status_code, error["code"]) == (400, "extra_missing")
        assert f"pip install 'vfix[{extra}]'" in error["message"]
    assert client.get(path, params={"format": "csv"}).status_code == 200, "which needs no extra"
    client.close()
