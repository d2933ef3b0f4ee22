"""`vfix rehearse --preset`: a paper's parameters on a tube, as its user would."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import trimesh

from app.cli import main
from app.commands.rehearse_freehand import NO_PRESET
from app.services import build_services
from app.settings import Settings
from tests.engine.scenes import curved_tube
from vfix_engine.control import ControlSettings


@pytest.fixture
def tube(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The arguments that name a curved tube and a path along its middle, in a home of their own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    mesh, points = curved_tube()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / "tube.ply")
    rows = "".join(f"point,p{i},{x!r},{y!r},{z!r}\n" for i, (x, y, z) in enumerate(points[:4].tolist()))
    (tmp_path / "plan.csv").write_text(f"# frame=LPS\n# unit=mm\nkind,label,x,y,z\n{rows}")
    return ["--case", str(tmp_path / "tube.ply"), "--plan", str(tmp_path / "plan.csv")]


@pytest.mark.parametrize("preset", ["li2004", "li2007"])
def test_a_preset_drives_and_says_what_is_printed_and_what_is_not(
    tube: list[str], preset: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["rehearse", *tube, "--preset", preset, "--approach", "0", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["completed"]
    assert report["preset"] == preset
    assert report["printed"]["k_d"] == 0.2
    assert "k of (10)" in report["assumed"]
    assert any("certificate" in words for words in report["ours"])
    assert report["servo"]["ticks"] == 33 * report["steps"]
    assert report["servo"]["min_bone_clearance_mm"] >= report["margin_mm"] - 1e-3
    assert report["tip_error_mm"]["mean"] < 0.1
    assert 0 <= report["progress_fallbacks"] < report["steps"]
    assert main(["rehearse", *tube, "--preset", preset, "--speed-limit", "--json"]) == 2
    assert "--preset goes without" in capsys.readouterr().err
    for more in (["--view-distance", "5"], ["--operator", "pushing", "--free"]):
        assert main(["rehearse", *tube, "--preset", preset, *more, "--json"]) == 2
        assert "which would change its parameters" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "labels"),
    [
        (["--preset", "li2004"], ("hands-on", None, "li2004")),
        (["--mode", "teleoperated"], ("teleoperated", "position", None)),
        (["--mode", "teleoperated", "--preset", "li2007"], ("teleoperated", "position", "li2007")),
        (["--mode", "teleoperated", "--device", "rate", "--preset", "li2004"], ("teleoperated", "rate", "li2004")),
        (["--mode", "freehand", "--preset", "li2004", "--steady"], ("freehand", None, None)),
    ],
)
def test_every_mode_arrives_with_a_preset_and_says_what_it_is(
    tube: list[str],
    arguments: list[str],
    labels: tuple[str, str | None, str | None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["rehearse", *tube, *arguments, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["completed"]
    assert (report["mode"], report["device"], report["preset"]) == labels
    assert report["certified"] == (labels[0] != "freehand")
    assert report["time_s"] > 1.0
    assert ("printed" in report) == (labels[2] is not None)
    if report["certified"]:
        assert report["tip_error_mm"]["mean"] <= 0.02
    run = build_services(Settings.from_environment()).runs.get(report["run"])
    assert (run.mode, run.manifest["device"], run.manifest["preset"]) == labels
    own = run.manifest["spec"]["settings"]
    if labels[0] == "freehand":
        own_default = ControlSettings()
        assert (own["gain_mm_per_s_per_n"], own["view_distance_mm"]) == (
            own_default.gain_mm_per_s_per_n,
            own_default.view_distance_mm,
        )
        assert NO_PRESET in report["notes"]


def test_a_device_is_of_a_teleoperated_drive(tube: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rehearse", *tube, "--device", "rate"]) == 2
    assert "--device goes with --mode teleoperated" in capsys.readouterr().err


def test_soft_zones_that_a_preset_drops_are_told(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball = {"kind": "sphere", "centre": [0, 38, 6], "radius": 6.0}
    soft = {"name": "gland", "thickness_mm": 0.0, "stiffness_n_per_mm": 0.2, "shape": ball}
    body = {"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm", "soft_zones": [soft, soft | {"name": "other"}]}
    file = tmp_path / "zones.json"
    file.write_text(json.dumps(body))
    main(["rehearse", *tube, "--preset", "li2007", "--zones", str(file), "--json"])
    told = capsys.readouterr()
    note = "2 soft zones of the plan or --zones: off, the papers have none"
    assert note in json.loads(told.out)["notes"]
    assert f"vfix: {note}" in told.err
