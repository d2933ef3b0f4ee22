"""Series and holds of a run are those that were seen during the drive that recorded it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.study.test_metrics import NARROW, POINTS, QUICK
from vfix_engine.errors import InputError
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import Command, Master
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.requests import Reset, SetSettings, SetTask
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.runtime.system import SystemSpec
from vfix_engine.study.holds import holds_of
from vfix_engine.study.metrics import score_run
from vfix_engine.study.series import series_of
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

ASIDE, NOTHING = np.array([3.0, 0.0, 0.0]), np.zeros(3)
CALM = replace(QUICK, dt_s=0.005)


def scene() -> SceneSpec:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange
    zone = Zone("nerve", Sphere(POINTS[3] + [3.0, 0.0, 0.0], 1.0), 0.5)
    return SceneSpec(
        NARROW.vertices, NARROW.faces, "steady_hand", "bent_30", base, np.zeros(7), POINTS, POINTS[-1:], ("end",),
        (zone,), structure_names={"bone": "the tube"},
    )  # fmt: skip


def recorded(folder: Path, spec: SystemSpec, act: Any) -> tuple[Run, list[Any]]:
    """A run and the snapshots after each of its steps."""
    system = spec.build()
    writer = RunWriter(folder / spec.world, spec, system.row_layout)
    driver: Driver[Any] = Driver(system, log=writer)
    seen: list[Any] = []

    def step(force: np.ndarray = NOTHING, count: int = 1, **more: Any) -> None:
        for _ in range(count):
            driver.step(Command(force, **more))
            seen.append(system.snapshot(driver.state))

    act(driver, step)
    writer.close()
    return Run.read(folder / spec.world), seen


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, list[Any]]:
    """Along the path and into the wall, by hand and by a master; back at the entry and with other settings between."""

    def act(driver: Driver[Any], step: Any) -> None:
        step(drive=1.0, count=40)
        driver.apply(Reset())
        step(drive=1.0, count=170)
        driver.apply(SetTask("free"))
        step(ASIDE, count=200)
        driver.apply(SetSettings(replace(CALM, dt_s=0.004)))
        step(count=100)
        step(ASIDE, count=60)  # held at once
        step(-ASIDE, count=100)
        step(count=100)
        driver.apply(SetTask("path"))
        step(drive=1.0, count=150)
        step(master=Master(np.array([0.0, -0.1, 0.0])), count=100)
        driver.apply(SetTask("free"))
        step(master=Master(np.array([0.1, 0.0, 0.0])), count=200)

    return recorded(tmp_path_factory.mktemp("driven"), RigidSpec(scene(), CALM), act)


@pytest.fixture(scope="module")
def by_hand(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, list[Any]]:
    """A free hand that pushes into the wall twice."""

    def act(driver: Driver[Any], step: Any) -> None:
        for side in (ASIDE, -ASIDE):
            step(side, count=80)
            step(-side, count=40)

    return recorded(tmp_path_factory.mktemp("by_hand"), FreehandSpec(scene(), CALM), act)


def test_series_are_what_was_seen(driven: tuple[Run, list[Any]], by_hand: tuple[Run, list[Any]]) -> None:
    for run, seen in (driven, by_hand):
        series, since = series_of(run), seen[40:] if run is driven[0] else seen
        assert len(series.t) == len(since)
        assert series.t[-1] == pytest.approx(score_run(run).time_s)
        for name in ("tip", "grip", "force", "side"):
            np.testing.assert_allclose(getattr(series, name), [getattr(one, name) for one in since], atol=1e-9)
        np.testing.assert_allclose(series.start, [one.segments_start for one in since], atol=1e-9)
        np.testing.assert_allclose(series.end, [one.segments_end for one in since], atol=1e-9)
        np.testing.assert_allclose(series.clearance[:, 0], [one.clearance_mm for one in since], atol=1e-9)
        assert series.held.tolist() == [one.held for one in since]
        on_path = np.array([one.mode == "path" for one in since])
        np.testing.assert_allclose(
            series.error[on_path], [one.tip_error_mm for one in since if one.mode == "path"], atol=1e-9
        )
        assert np.isnan(series.error[~on_path]).all()
        inner = on_path & (series.progress > 0.01) & (series.progress < series.progress[on_path].max() - 0.01)
        np.testing.assert_allclose(np.linalg.norm(series.across, axis=1)[inner], series.error[inner], atol=1e-6)
        assert np.isnan(series.across[~on_path]).all()
        assert series.plane is not None
        np.testing.assert_allclose(series.flat, series.plane.flat(series.tip), atol=1e-12)
        np.testing.assert_allclose(
            series.progress[on_path], [one.progress_mm for one in since if one.mode == "path"], atol=1e-9
        )
        assert series.structures == ("bone", "nerve")
        near = series.nearest >= 0
        assert (series.clearance[near, series.nearest[near]] == series.clearance[near].min(axis=1)).all()
        assert (series.clearance[~near] >= series.reach[~near, None]).all()
    assert [one.unit for one in series_of(driven[0]).joints][:4] == ["mm", "mm", "mm", "rad"]
    assert series_of(by_hand[0]).q.shape[1] == 0


def test_thinned_series_keep_the_extremes(driven: tuple[Run, list[Any]]) -> None:
    whole = series_of(driven[0])
    short = whole.thinned(30.0)
    assert len(short.t) == math.ceil(30.0 * whole.t[-1])
    assert np.diff(short.t).max() < 1.2 / 30.0
    assert short.t[-1] == whole.t[-1]
    np.testing.assert_array_equal(short.tip[-1], whole.tip[-1])
    np.testing.assert_array_equal(short.clearance.min(axis=0), whole.clearance.min(axis=0))
    assert np.nanmax(short.error) == np.nanmax(whole.error)
    worst = np.nanargmax(whole.error)
    np.testing.assert_array_equal(short.across[np.nanargmax(short.error)], whole.across[worst])
    assert short.held.sum() < whole.held.sum()
    same = whole.thinned(1e9)
    np.testing.assert_array_equal(same.clearance, whole.clearance)
    with pytest.raises(InputError, match="positive"):
        whole.thinned(0.0)


def test_holds_are_told_with_the_reason_of_their_first_step(driven: tuple[Run, list[Any]]) -> None:
    run, seen = driven
    seen, holds, time = seen[40:], holds_of(run), series_of(run).t
    begins = [i for i, one in enumerate(seen) if one.held and not any(two.held for two in seen[max(i - 70, 0) : i])]
    assert len(holds) == len(begins) == 3
    for hold, first in zip(holds, begins, strict=True):
        assert hold.t_s == pytest.approx(time[first - 1])
        assert hold.reason == seen[first].reason
        np.testing.assert_allclose(hold.place, seen[first].blocking_point, atol=1e-6)
    assert {(hold.kind, hold.structure) for hold in holds} == {("bone", "bone")}
    assert holds[0].reason == "the tube on the tip, 0.3 mm away"
    last = holds[-1]
    assert seen[begins[-1]].teleoperated
    assert last.t_s + last.duration_s == pytest.approx(time[-1])


def test_a_hold_of_another_control_has_no_reason(driven: tuple[Run, list[Any]]) -> None:
    """Nothing is told of a step that was not recorded so."""
    moved = driven[0].ticks.copy()
    names = [name for name, _ in driven[0].manifest["columns"]]
    moved[40 + 470, names.index("q0")] += 1e-3
    first, *others = holds_of(replace(driven[0], ticks=moved))
    assert (first.kind, first.reason[:9]) == ("", "not known")
    assert {one.kind for one in others} == {"bone"}


def test_contacts_of_a_free_hand(by_hand: tuple[Run, list[Any]]) -> None:
    run, seen = by_hand
    holds, score = holds_of(run), score_run(run)
    assert {(one.structure, one.part) for one in holds} == {(one.structure, one.part) for one in score.contacts_by}
    assert max(one.depth_mm for one in holds) == pytest.approx(score.max_depth_mm)
    first = next(i for i, one in enumerate(seen) if one.contacts)
    assert holds[0].kind == "contact"
    assert holds[0].t_s == pytest.approx(seen[first - 1].t)
    assert [one.t_s for one in holds] == sorted(one.t_s for one in holds)
