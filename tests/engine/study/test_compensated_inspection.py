"""On a target a robot that knows how a hand bends it holds the bent view point there, not the unbent one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import curved_tube
from vfix_engine.control import ControlSettings
from vfix_engine.control.tasks import view_point
from vfix_engine.errors import InputError
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.requests import SetTask
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.error_chain import Compliance, ErrorChain
from vfix_engine.study.metrics import score_run
from vfix_engine.study.series import series_of
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

C = 0.15  # mm/N
MESH, POINTS = curved_tube(radius=6.0)
SETTINGS = ControlSettings(dt_s=0.002, gain_mm_per_s_per_n=4.0)
HELD = 1200  # steps on the target


def _spec(compensated: float) -> RigidSpec:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange

    def scene(target: np.ndarray) -> SceneSpec:
        tube = MESH.vertices, MESH.faces
        return SceneSpec(*tube, "steady_hand", "bent_30", base, np.zeros(7), POINTS, target[None], ("target",))

    start = RigidSpec(scene(POINTS[-1]), SETTINGS).build()
    ahead = view_point(start.start("free").tool, start.scene.tool, SETTINGS.view_distance_mm)
    return RigidSpec(scene(ahead + np.array([0.6, 0.3, 0.4])), replace(SETTINGS, compliance_mm_per_n=compensated))


def _drive(
    compensated: float, folder: Path, rate: bool = False, of: RigidSpec | None = None
) -> tuple[list[RigidSnapshot], Run, RigidSpec]:
    """To the target, then a hand that swings the tool about it, with a force that turns and comes and goes."""
    spec = of or _spec(compensated)
    system = spec.build()
    writer = RunWriter(folder, spec, system.row_layout)
    driver, found, held = Driver(system, log=writer), list[RigidSnapshot](), 0
    driver.apply(SetTask("inspect"))
    while held < HELD and len(found) < 12_000:
        i = held
        swing = np.array([np.sin(0.004 * i), np.cos(0.004 * i), 0.3 * np.sin(0.01 * i)])
        force = np.zeros(3) if not held else (1.5 + np.sin(0.006 * i)) * swing
        driver.step(Command(force, drive=0 if held else 1, rate=rate))
        found.append(system.snapshot(driver.state))
        held += bool(held) or found[-1].phase == "inspect_hold"
    writer.close()
    return found, Run.read(folder), spec


@cache
def _made(place: Path) -> dict[float, tuple[list[RigidSnapshot], Run, RigidSpec]]:
    return {value: _drive(value, place / f"run-{value}") for value in (0.0, C)}


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> dict[float, tuple[list[RigidSnapshot], Run, RigidSpec]]:
    return _made(tmp_path_factory.mktemp("inspected"))


def _true_errors(snapshots: list[RigidSnapshot], spec: RigidSpec) -> np.ndarray:
    """Distance of the target to the bent view point, which is C f from the unbent one, by hand."""
    target = spec.scene.targets[0]
    held = [one for one in snapshots if one.phase == "inspect_hold"]
    return np.array([np.linalg.norm(one.virtual_point + C * one.force - target) for one in held])


def test_the_bent_view_point_stays_on_the_target_only_where_the_robot_compensates(
    drives: dict[float, tuple[list[RigidSnapshot], Run, RigidSpec]],
) -> None:
    without, with_it = (_true_errors(snapshots, spec) for snapshots, _, spec in (drives[0.0], drives[C]))
    assert min(len(without), len(with_it)) > 0.9 * HELD, "held all the time"
    assert without.mean() == pytest.approx(C * 1.5, rel=0.3), "the deflection under the hand"
    assert with_it[200:].mean() < 0.1 * without.mean()
    assert with_it[200:].max() < 0.05


def test_score_and_series_say_what_the_drive_saw(
    drives: dict[float, tuple[list[RigidSnapshot], Run, RigidSpec]],
) -> None:
    for snapshots, run, spec in drives.values():
        seen = np.array([one.target_error_mm for one in snapshots if one.phase == "inspect_hold"])
        score = score_run(run, spec, errors=ErrorChain(compliance=Compliance(C)))
        assert score.target_error_mm is not None
        assert score.target_error_mm.robot_frame.mean == pytest.approx(seen.mean(), abs=1e-9)
        truth = _true_errors(snapshots, spec)
        assert score.target_error_mm.true_frame.mean == pytest.approx(truth.mean(), abs=1e-9)
        series = series_of(run, spec)
        np.testing.assert_allclose(series.error[series.phase == 5], seen, atol=1e-9)
        assert replay(run, spec, keep_states=False).same


def test_a_tool_that_is_not_bent_by_a_hand_is_not_led_beside_the_target(tmp_path: Path) -> None:
    snapshots, _, spec = _drive(C, tmp_path / "rate", rate=True)
    held = [one for one in snapshots if one.phase == "inspect_hold"]
    assert len(held) > 0.9 * HELD
    assert max(one.target_error_mm for one in held) <= SETTINGS.target_tolerance_mm + 1e-9
    assert not any(one.deflection.any() for one in held)
    assert spec.build().first_settings.kept_mm == pytest.approx(SETTINGS.kept_mm + C * SETTINGS.force_cap_n)


def test_a_run_of_before_holds_the_unbent_view_point(tmp_path: Path) -> None:
    """A recorded scene without the value ``bent_inspection`` is replayed and scored as it was driven."""
    spec = _spec(C)
    snapshots, run, _ = _drive(C, tmp_path / "run", of=replace(spec, scene=replace(spec.scene, bent_inspection=False)))
    assert run.manifest["spec"].pop("bent_inspection") is False
    read = spec_of(run)
    held = [one for one in snapshots if one.phase == "inspect_hold"]
    assert len(held) > 0.9 * HELD
    assert not any(one.deflection.any() for one in held)
    assert replay(run, read, keep_states=False).same
    score = score_run(run, read)
    assert score.target_error_mm is not None
    seen = [one.target_error_mm for one in held]
    assert score.target_error_mm.robot_frame.mean == pytest.approx(np.mean(seen), abs=1e-9)
    assert score.target_error_mm.robot_frame.max <= SETTINGS.target_tolerance_mm + 1e-9
    assert not replay(run, spec, keep_states=False).same


def test_a_scene_says_by_a_truth_value_which_view_point_is_held() -> None:
    spec = _spec(C)
    values, arrays = spec.to_parts()
    assert RigidSpec.from_parts(values, arrays).scene.bent_inspection is True
    with pytest.raises(InputError, match="bent_inspection of a scene is true or false"):
        RigidSpec.from_parts(values | {"bent_inspection": 1}, arrays)
    assert not SceneSpec.of(replace(spec.scene.build(), bent_inspection=False)).build().bent_inspection
