"""A hand of an installed package does the tasks of Kwok 2013: it has the picture and the force, and is checked."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.study.test_endoscopy import colon, tube
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.driver import Driver
from vfix_engine.study.diathermy.oracle import OracleView
from vfix_engine.study.diathermy.task import first_state
from vfix_engine.study.endoscopy.cavity_picture import LabelEye
from vfix_engine.study.endoscopy.own_hand import (
    LumenHandAtWork,
    LumenMotion,
    LumenView,
    OwnLabelOperator,
    OwnPolypOperator,
    hand_named,
)
from vfix_engine.study.experiment.cavity import cavity_of
from vfix_engine.study.polyps.sight import LumenSight

OWN = '''
import math
import numpy as np
from vfix_engine.study.endoscopy.own_hand import LumenMotion

class Gazer:
    """Turns to the polyp nearest to the picture's centre, and inserts or draws back to 15 mm; else it inserts."""
    def __init__(self, at):
        self.at, self.seen = at, []
    def __call__(self, seen):
        self.seen.append(seen)
        polyps = seen.picture.polyps
        if not polyps:
            return LumenMotion(insert_mm_per_s=12.0)
        one = min(polyps, key=lambda polyp: float(np.hypot(*polyp.off_deg)))
        off, away = float(np.hypot(*one.off_deg)), one.distance_mm
        if away > 24.0 and off < 30.0:
            return LumenMotion(insert_mm_per_s=12.0)
        if off < 6.0 and abs(away - 15.0) > 3.0:
            return LumenMotion(insert_mm_per_s=math.copysign(6.0, away - 15.0))
        return LumenMotion(camera_mm_per_s=tuple(one.off_deg.tolist()))

def broken(at):
    return lambda seen: seen.state

tool = "no hand"
'''
POINTS = """
[vfix.lumen_operators]
gazer = own_hand_of_a_test:Gazer
broken = own_hand_of_a_test:broken
tool = own_hand_of_a_test:tool
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with hands, as pip would install it."""
    (tmp_path / "own_hand_of_a_test.py").write_text(OWN, encoding="utf-8")
    info = tmp_path / "own_hand-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own-hand\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(POINTS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    sys.modules.pop("own_hand_of_a_test", None)


@pytest.fixture(scope="module")
def mesh() -> TriangleMesh:
    return tube()


def operator_of(mesh: TriangleMesh, name: str, maker: Callable[[LumenHandAtWork], Any]) -> tuple[OwnPolypOperator, Any]:
    """Study I in a tube with two polyps, and its system."""
    place = colon(mesh, "guided")
    system = place.spec.build()
    return OwnPolypOperator(name, maker, place.task, LumenSight(mesh, place.task), mesh, "guided"), system


def test_an_installed_hand_clears_polyps_by_the_picture_alone(installed: Path, mesh: TriangleMesh) -> None:
    hands: list[Any] = []

    def kept(at: LumenHandAtWork) -> Any:
        hands.append(hand_named("gazer")(at))
        return hands[-1]

    operator, system = operator_of(mesh, "gazer", kept)
    driver: Driver[Any] = Driver(system)
    while driver.state.t < 60.0 and (act := operator(system, driver.state)) is not None:
        driver.act(act)
    assert operator.progress.cleared >= 1
    assert operator.attempts == []
    (hand,) = hands
    assert (hand.at.study, hand.at.arm, hand.at.step_s) == ("kwok1", "guided", 0.01)
    pictures = {id(seen.picture) for seen in hand.seen}
    assert len(pictures) == pytest.approx(0.2 * len(hand.seen), rel=0.05)  # a new one every 0.05 s
    assert set(vars(hand.seen[0])) == {"t", "picture", "force"}
    assert max(float(np.linalg.norm(seen.force)) for seen in hand.seen) > 0.0


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        ("forward", "returned 'forward'; a LumenMotion or None"),
        (LumenMotion(camera_mm_per_s=(np.nan, 0.0)), "three finite numbers"),
        (LumenMotion(insert_mm_per_s=1e9), "at most 1000"),
        (LumenMotion(joint=3), "chose joint 3; there are 1 to 2"),
        (LumenMotion(joint=1.5), "chose joint 1.5; there are 1 to 2"),  # type: ignore[arg-type]
        (LumenMotion(camera_mm_per_s=5.0), "failed: TypeError"),  # type: ignore[arg-type]
    ],
)
def test_what_no_hand_can_do_is_refused_by_name(mesh: TriangleMesh, returned: Any, words: str) -> None:
    operator, system = operator_of(mesh, "mine", lambda at: lambda seen: returned)
    with pytest.raises(InputError, match=words) as refused:
        operator(system, Driver(system).state)
    assert "'mine'" in str(refused.value)


def test_a_hand_that_fails_or_cannot_be_found_is_told(installed: Path, mesh: TriangleMesh) -> None:
    operator, system = operator_of(mesh, "broken", hand_named("broken"))
    with pytest.raises(InputError, match=r"the operator 'broken' failed: AttributeError: .*'state'"):
        operator(system, Driver(system).state)
    with pytest.raises(InputError, match="'tool' cannot be called"):
        hand_named("tool")
    with pytest.raises(InputError, match="there is no operator 'gaser'; did you mean 'gazer'"):
        hand_named("gaser")

    def of_a_tool(at: Any) -> Any:
        return at.guide.path

    with pytest.raises(InputError, match="the operator 'puller' failed: AttributeError"):
        operator_of(mesh, "puller", of_a_tool)


def test_a_hand_of_study_two_cuts_and_its_end_is_the_end() -> None:
    cavity = cavity_of("guided")
    seen: list[LumenView] = []

    def hand(view: LumenView) -> LumenMotion | None:
        seen.append(view)
        return LumenMotion(camera_mm_per_s=(10.0, 0.0), cut=True) if len(seen) < 4 else None

    eye = LabelEye(cavity.labels, Wall(cavity.mesh))
    operator = OwnLabelOperator("mine", lambda at: hand, eye, "guided", 5, 0.01, 3)
    system = cavity.spec.build()
    driver: Driver[Any] = Driver(system)
    buttons = []
    while (act := operator(OracleView(system, driver.state, first_state(cavity.labels)))) is not None:
        buttons.append(act.command.buttons)
        driver.act(act)
    assert buttons == [2, 2, 2]
    assert seen[0].picture is seen[3].picture  # within 0.05 s
    assert (operator.given_up, operator.choices) == ({}, 0)
