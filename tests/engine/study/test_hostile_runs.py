"""Runs that were damaged or written by others: what they claim is checked, and refused in words."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from tests.engine.study.test_series import ASIDE, CALM, recorded, scene
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.requests import SetSettings, SetTask
from vfix_engine.runtime.run import Run, RunEvent
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.spec import RigidSpec

WORLDS = (RigidSpec, FreehandSpec)


def pushed(driver: Driver[Any], step: Any) -> None:
    driver.apply(SetTask("free"))
    step(ASIDE, count=60)


@pytest.fixture(scope="module", params=WORLDS, ids=lambda kind: kind.world)
def driven(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of each world."""
    folder, spec = tmp_path_factory.mktemp("driven"), request.param(scene(), CALM)
    recorded(folder, spec, pushed)
    return folder / str(spec.world)


def forged(**changes: Any) -> ControlSettings:
    """Settings as a run is read: without their constructor."""
    one = object.__new__(ControlSettings)
    for field in fields(ControlSettings):
        object.__setattr__(one, field.name, changes.get(field.name, getattr(CALM, field.name)))
    return one


@pytest.mark.parametrize("changes", [{"margin_mm": -3.0}, {"dt_s": float("nan")}, {"force_cap_n": "5"}])
def test_recorded_settings_out_of_their_ranges_drive_nothing(driven: Path, changes: dict[str, Any]) -> None:
    run = Run.read(driven)
    request = SetSettings(forged(**changes))
    driver: Driver[Any] = Driver(spec_of(run).build())
    before = driver.state
    with pytest.raises(InputError, match="allowed is"):
        driver.apply(request)
    assert driver.state is before
    object.__setattr__(run, "events", (RunEvent(0, "request", request), *run.events))
    with pytest.raises(InputError, match="allowed is"):
        replay(run, spec_of(run), keep_states=False)
    with pytest.raises(InputError, match="allowed is"):
        score_run(run)
    driver.apply(SetSettings(forged()))
    assert driver.settings == CALM
