"""`vfix score`: stored runs and folders, in one answer; what cannot be scored is refused."""

from __future__ import annotations

import json
import tarfile
from pathlib import Path

import pytest

from app.cli import main
from app.services import build_services
from app.settings import Settings

OLD_HOME = Path(__file__).resolve().parents[2] / "data" / "old_home" / "home.tar.xz"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A home of an earlier version; the ids of its runs by their world."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(tmp_path, filter="data")
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    services = build_services(Settings.from_environment())
    found = {run.world: run.id for run in services.runs.list()}
    services.close()
    return found


def test_runs_of_before_are_scored_by_id_and_by_folder(
    home: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    services = build_services(Settings.from_environment())
    with services.runs.laid_out(home["rigid"]) as place:
        folder = place.rename(tmp_path / "run")
    services.close()
    assert main(["score", home["rigid"], str(folder), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    stored, own = answer["runs"]
    assert answer["notice"] == "Not for clinical use."
    assert stored["run"] == home["rigid"]
    assert stored["case"]
    assert (own["run"], own["case"], own["recorded"]) == (str(folder), None, None)
    about = {"run", "case", "plan", "recorded"}
    assert {key: stored[key] for key in stored.keys() - about} == {key: own[key] for key in own.keys() - about}
    assert (own["world"], own["mode"], own["certified"], own["contacts"]) == ("rigid", "hands-on", True, 0)
    assert own["samples"] == 100, "of 750: the drive returned to its start"
    assert main(["score", home["rigid"]]) == 0
    assert "least_clearance_mm" in capsys.readouterr().out


def test_what_cannot_be_scored_ends_the_command(home: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", home["rigid"], home["snake"], "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert "no rigid tool" in told["error"]["message"]
    assert main(["score", "run-nobody"]) == 2
    assert "run-nobody" in capsys.readouterr().err
