"""What really happens, live on the page: the chain of one client beside the drive that it shows."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from session_doubles import SAMPLE, sections_of, workspace_of

from app.drives.shared_drives import SharedDrives
from app.services import Services
from app.tabs.rehearse import truth
from app.tabs.rehearse.commands import SetErrors
from app.tabs.rehearse.tab import RehearseTab
from app.tabs.rehearse.truth import STAGES, LiveTruth
from tests.engine.scenes import CoalJudge, curved_tube
from vfix_engine.control import ControlSettings
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import Command
from vfix_engine.study.error_chain import RegistrationError
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

MESH, POINTS = curved_tube()
SETTINGS = ControlSettings(dt_s=0.02)


@pytest.fixture(scope="module")
def driven() -> tuple[Any, list[RigidSnapshot]]:
    """What a tab knows of a drive in a tube, and its snapshots under a hand that pulls along it and across."""
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange
    spec = RigidSpec(
        SceneSpec(MESH.vertices, MESH.faces, "steady_hand", "bent_30", base, np.zeros(7), POINTS), SETTINGS
    )
    system = spec.build()
    state, found = system.start(), []
    for _ in range(40):
        state = system.step(state, Command(np.array([1.0, 3.0, 0.0])))
        found.append(system.snapshot(state))
    return SimpleNamespace(spec=spec, tree=system.scene.tree), found


def asked(**stages: Any) -> SetErrors:
    return SetErrors(type="rehearsal.errors", **stages)


def test_nothing_is_shown_of_a_chain_that_is_off(driven: tuple[Any, list[RigidSnapshot]]) -> None:
    prepared, snapshots = driven
    live = LiveTruth()
    live.follow(snapshots[-1], prepared)
    section = live.section(SETTINGS, True).build()
    assert (section["believed"], section["true"], section["difference_mm"]) == (None, None, None)
    assert [stage["on"] for stage in section["stages"]] == [False] * 5
    assert [stage["value"] for stage in section["stages"]] == [stage.value for stage in STAGES]
    assert not section["may_compensate"]
    assert live.layers() == []


def test_the_true_tip_and_tool_are_those_of_the_chain(driven: tuple[Any, list[RigidSnapshot]]) -> None:
    prepared, snapshots = driven
    live = LiveTruth()
    live.choose(asked(registration=0.5, compliance=0.2))
    for one in snapshots:
        live.follow(one, prepared)
    section, last = live.section(SETTINGS, True).build(), snapshots[-1]
    assert live.now is not None
    assert section["believed"] == pytest.approx(last.tip.tolist(), abs=1e-3)
    moved = np.array(section["true"]) - last.tip
    away = np.linalg.norm(moved - 0.2 * last.force)
    assert 0.3 < away < 0.8, "half a millimetre at the middle of the path, and a turn about it"
    assert section["difference_mm"] == pytest.approx(np.linalg.norm(moved), abs=1e-3)
    assert section["clearance_mm"] == pytest.approx(min(CoalJudge(MESH).clearance(live.now.segments), 3.0), abs=2e-3)
    assert section["may_compensate"]
    assert not section["below_margin"]
    (layer,) = live.layers()
    assert layer.key == (*live.now.believed.tolist(), *live.now.true.tolist())
    # The registration that was measured in practice has its own error, whatever number stands there.
    live.known = RegistrationError((0.0, 0.0, 5.5))
    live.choose(asked(registration=0.5))
    live.follow(last, prepared)
    section = live.section(SETTINGS, False).build()
    assert section["difference_mm"] == 5.5
    assert section["stages"][0]["value"] == 5.5
    assert section["stages"][0]["known"]
    assert section["below_margin"]
    assert not section["may_compensate"]


def test_a_registration_that_is_no_small_error_is_told_and_stops_nothing(
    phantom_services: Services, driven: tuple[Any, list[RigidSnapshot]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by beads that were interchanged: it is read whenever something is published, also while no stage is on."""
    plan = phantom_services.plans.get(SAMPLE)
    plan = replace(plan, content=replace(plan.content, registration="made"))
    off = np.eye(4)
    off[0, 3] = 51.0
    use: Any = SimpleNamespace(state="ready", document=SimpleNamespace(content=None))
    monkeypatch.setattr(phantom_services.registering, "registration_of", lambda _: use)
    monkeypatch.setattr(truth, "simulated_error", lambda *_: off)
    prepared, snapshots = driven
    live = LiveTruth()
    live.know(phantom_services, plan)
    live.choose(asked(registration=0.5, head=0.3))
    live.follow(snapshots[-1], prepared)
    section = live.section(SETTINGS, True).build()
    assert section["difference_mm"] <= 0.3, "that of the head alone"
    first, *others = section["stages"]
    assert (first["on"], first["known"], "Measure it anew" in first["refusal"]) == (False, False, True)
    assert [stage["refusal"] for stage in others] == [""] * 4
    off[0, 3] = 2.0
    live.know(phantom_services, plan)
    live.follow(snapshots[-1], prepared)
    assert live.section(SETTINGS, True).build()["stages"][0]["value"] == 2.0
    use.state = "misfit"
    live.know(phantom_services, plan)
    assert live.known is None, "no robot is placed by it"


def test_what_the_robot_compensates_is_told(driven: tuple[Any, list[RigidSnapshot]]) -> None:
    prepared, snapshots = driven
    live = LiveTruth()
    live.choose(asked(compliance=0.2, head=0.4, followed=True, servo=50.0, encoders=0.1))
    live.follow(snapshots[-1], prepared)
    section = live.section(replace(SETTINGS, compliance_mm_per_n=0.2), True).build()
    assert section["compensated_mm_per_n"] == 0.2
    assert section["followed"]


def test_a_number_that_is_no_error_is_refused() -> None:
    for stages in ({"registration": -0.1}, {"servo": float("nan")}, {"compliance": 2.0}, {"head": "much"}):
        with pytest.raises(ValidationError):
            asked(**stages)


def test_the_tab_takes_a_chain_without_a_handle(phantom_services: Services) -> None:
    """It changes what this client sees, not the drive."""
    plan = phantom_services.plans.get(SAMPLE)
    workspace = workspace_of(phantom_services)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: plan)
    workspace.plan.opened()
    tab.active = True
    tab.handle(asked(head=0.7))
    tab.tick()
    shown = sections_of(tab)["truth"]
    assert {stage["name"]: stage["on"] for stage in shown["stages"]}["head"]
    assert shown["difference_mm"] is None, "there is no robot"
