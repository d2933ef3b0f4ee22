"""`vfix plan python` and `vfix run python`: the printed text is executed, and does what the planner does."""

from __future__ import annotations

import ast
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import main
from app.exchange.scene_code import SceneUse, scene_code
from app.services import build_services
from app.settings import Settings
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.runtime import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.run import RunWriter
from vfix_engine.virtual_fixtures import SoftZone, Zone
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.rigid.spec import SceneSpec

SAMPLE = "head-phantom-sample"


def executed(text: str) -> dict[str, Any]:
    """The names of a script that was run."""
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(text, "printed.py", "exec"), names)
    return names


def printed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(arguments) == 0
    return capsys.readouterr().out


def test_the_script_of_a_plan_follows_it_as_the_command_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    text = printed(["plan", "python", SAMPLE], capsys)
    assert "Not for clinical use" in text
    assert 'RobotModel.load("steady_hand")' in text
    own = executed(text)
    told = json.loads(
        printed(["rehearse", "--case", "head-phantom", "--plan", SAMPLE, "--json"], capsys).splitlines()[-1]
    )
    assert own["last"].phase == "done"
    assert own["last"].progress_mm == told["reached_mm"]
    report = own["run"].tally.report()
    for key in ("steps", "held_steps", "tip_error_mm", "min_bone_clearance_mm", "qp_rows"):
        assert report[key] == told[key], key
    assert json.loads(printed(["plan", "python", SAMPLE, "--json"], capsys))["python"] == text


def test_the_script_of_a_run_replays_it(old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    """Of all shapes of a protected structure, with a surface and a soft layer that have no line of their own."""
    text = printed(["run", "python", old_runs["rigid"]], capsys)
    for words in ("Sphere(", "CapsuleShape(", "Box(", "HalfSpace(", "recorded.zones[", "recorded.fixtures"):
        assert words in text
    own = executed(text)
    services = build_services(Settings.from_environment())
    spec = services.runs.get(old_runs["rigid"]).manifest["spec"]
    services.close()
    assert [zone.name for zone in own["zones"]] == [zone["name"] for zone in spec["zones"]]
    assert own["again"].same or own["again"].largest_difference < 1e-9, "where kernels were compiled on the way"
    assert len(own["again"].rows) == 750
    assert main(["run", "python", old_runs["snake"]]) == 2
    assert "no scene of a rigid tool" in capsys.readouterr().err


def test_the_script_of_a_folder_of_a_free_hand_replays_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = FreehandSpec(SceneSpec.of(straight_scene(wall(4.0))), ControlSettings(dt_s=0.02), 17.5)
    system = spec.build()
    writer = RunWriter(tmp_path / "one", spec, system.row_layout)
    driver = Driver(system, log=writer)
    for _ in range(60):
        driver.step(Command(np.array([0.3, 6.0, 0.0])))
    writer.close()
    text = printed(["run", "python", str(tmp_path / "one")], capsys)
    assert "app." not in text, "a folder needs the engine alone"
    own = executed(text)
    assert own["again"].same
    assert "17.5" in text


def test_the_script_of_a_run_of_before_inspects_as_it_did() -> None:
    scene = SceneSpec.of(straight_scene(wall(4.0)))
    for there, other in ((True, scene), (False, replace(scene, bent_inspection=False))):
        text = scene_code(SceneUse("one", (), ("tree = None",), ()), other, ControlSettings())
        assert executed(text)["scene"].bent_inspection is there


HOSTILE = (
    'a""" ; print("run") #',
    "x\\",
    'y"',
    "two\nimport os",
    "''' + str() #",
    "\u202e \x00 \ud800",
    'é "" \\N{DASH}',
)


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_becomes_a_statement_of_the_script(name: str) -> None:
    """Names come with plans, archives and runs of others."""
    scene = replace(SceneSpec.of(straight_scene(wall(4.0))), structure_names={name: name})
    zone = Zone("nerve", Sphere((0.0, 0.0, 50.0), 1.0), margin_mm=0.5)
    object.__setattr__(zone, "name", name)
    scene = replace(scene, zones=(zone,), targets=np.zeros((1, 3)), target_names=(name,))
    text = scene_code(SceneUse(name, (), ("tree = None",), ()), scene, ControlSettings())
    text.encode()
    tree = ast.parse(text)
    assert ast.get_docstring(tree, clean=False) == f"{name}. Not for clinical use."
    kinds = {type(one) for one in tree.body[1:]}
    assert kinds == {ast.Import, ast.ImportFrom, ast.Assign}
    assert {one.names[0].name for one in tree.body if isinstance(one, ast.Import)} == {"numpy"}
    literals = [one.value for one in ast.walk(tree) if isinstance(one, ast.Constant)]
    assert literals.count(name) == 4, "zone, target, and structure with its name"


def test_a_run_of_a_mode_that_there_is_not_has_no_script(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = FreehandSpec(SceneSpec.of(straight_scene(wall(4.0))), ControlSettings(dt_s=0.02), 17.5)
    RunWriter(tmp_path / "one", spec, spec.build().row_layout).close()
    (tmp_path / "one" / "end.json").unlink()  # it has the manifest's digest
    manifest = json.loads((tmp_path / "one" / "manifest.json").read_text())
    (tmp_path / "one" / "manifest.json").write_text(json.dumps(manifest | {"mode": 'x"""\nimport os'}))
    assert main(["run", "python", str(tmp_path / "one")]) == 2
    assert "is not one of" in capsys.readouterr().err


def test_a_plan_with_a_part_that_has_no_line_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    from app.commands import scene_python

    def soft(*arguments: Any) -> Any:
        scene = straight_scene(wall(4.0))
        object.__setattr__(scene, "fixtures", (SoftZone("mucosa", thickness_mm=1.0, stiffness_n_per_mm=0.5),))
        return scene, ControlSettings(), "", "", ()

    monkeypatch.setattr(scene_python, "build_scene", soft)
    assert main(["plan", "python", SAMPLE]) == 2
    assert "use `vfix run python`" in capsys.readouterr().err
