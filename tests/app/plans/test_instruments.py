"""Robot and tool of a plan: chosen, shaped, undone, kept across files, and robots of URDFs of one's own."""

import hashlib
import json
import math

import pytest
from plan_editor import PlanEditor

from app.cases.service import Case
from app.exchange.plan_files import from_native_json, to_native_json
from app.kit.errors import PlanLocked
from app.plans.instruments import (
    CarriedUrdf,
    Instruments,
    plan_robot,
    plan_tool,
    robot_words,
    shipped_robots,
    shipped_tools,
    tool_words,
)
from app.plans.model import check_robot, content_from_json, content_to_json
from app.plans.operations.document import LockPlan, RedoPlan, UndoPlan
from app.plans.operations.instruments import ChooseRobot, ChooseTool, KeepPlacement, RobotChoice, ToolChoice
from app.plans.operations.points import AddPoint
from app.plans.service import PlanService
from app.store import Store
from tests.engine.urdf_texts import GOOD, joint, links, urdf
from vfix_engine.errors import InputError, PlanError, RobotError
from vfix_engine.robots import Tool

PLACED = {"name": "steady_hand", "base": [float(n) for n in range(16)], "q_start": [0.0] * 7}
FORKED = urdf(links("a", "b", "c", "d"), joint("one", "a", "b"), joint("two", "b", "c"), joint("three", "b", "d"))


@pytest.fixture
def instruments(store: Store) -> Instruments:
    return Instruments(store.files)


@pytest.fixture
def editor(plans: PlanService, case: Case) -> PlanEditor:
    return PlanEditor(plans, plans.create(case.id, "Corridor").id)


def test_all_that_come_along_are_told_in_words() -> None:
    robots, tools = {one.name: one for one in shipped_robots()}, {one.name: one for one in shipped_tools()}
    assert set(robots) == {"arm_6", "arm_7", "dvrk_psm", "dvrk_psm_rigid", "steady_hand"}
    assert robot_words(robots["arm_6"]) == "6 turning joints; its base stands upright."
    assert robot_words(robots["dvrk_psm"]) == "6 joints, 1 of them sliding; its base is held as the path asks."
    assert len(tools) == 7
    assert tool_words(tools["bent_30"]) == "Bent by 30°, shaft of radius 1.5 mm, 165 mm long."
    assert tool_words(tools["endoscope_45"]).endswith("looks 45° to its side.")


def test_another_robot_or_tool_drops_the_placing_and_is_undone(editor: PlanEditor) -> None:
    editor.do(KeepPlacement(robot=PLACED))
    assert editor.do(ChooseRobot(robot=RobotChoice("arm_6"))).content.robot == {
        "name": "arm_6",
        "base": None,
        "q_start": None,
    }
    editor.do(UndoPlan())
    assert editor.plan.content.robot == PLACED
    plan = editor.do(ChooseTool(tool=ToolChoice("bent_30", 45.0, 1.0)))
    assert plan.content.robot["base"] is None
    tool = plan_tool(plan.content)
    assert (tool.bend, tool.shaft_radius) == (pytest.approx(math.radians(45.0)), 1.0)
    assert tool.parts[0].radius == pytest.approx(1.0 / 1.5)
    assert content_from_json(content_to_json(plan.content)) == plan.content
    editor.do(UndoPlan())
    assert (editor.plan.content.tool_shape, editor.plan.content.robot) == ({}, PLACED)
    editor.do(RedoPlan())
    editor.do(LockPlan(locked=True))
    with pytest.raises(PlanLocked):
        editor.do(ChooseTool(tool=ToolChoice("straight_pointer")))


@pytest.mark.parametrize(
    ("name", "shape", "words"),
    [
        ("bent_30", {"bend_deg": 121.0}, "between 0 and 120°"),
        ("bent_30", {"shaft_radius_mm": 9.0}, "between 0.3 and 5 mm"),
        ("straight_pointer", {"bend_deg": 10.0}, "is straight"),
        ("spoon", {}, "no tool 'spoon'"),
    ],
)
def test_a_tool_that_cannot_be_is_refused_in_words(
    editor: PlanEditor, name: str, shape: dict[str, float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        editor.do(ChooseTool(tool=ToolChoice(name, **shape)))
    assert editor.plan.content.tool == "bent_30"


def test_a_bend_is_shared_among_the_parts() -> None:
    shaver = Tool.load("shaver_40").shaped(bend=math.radians(20.0))
    assert [round(math.degrees(part.bend), 6) for part in shaver.parts] == [20.0, 10.0, 0.0]
    assert Tool.load("shaver_40").shaped().parts == Tool.load("shaver_40").parts


def test_an_older_plan_reads_as_before() -> None:
    content = content_from_json({"points": [], "targets": [], "tool": "bent_30", "robot": {"name": "arm_7"}})
    assert content.tool_shape == {}
    assert content.robot == {"name": "arm_7", "base": None, "q_start": None}


def test_a_urdf_of_ones_own_is_kept_by_its_hash_and_travels_with_the_plan(
    instruments: Instruments, editor: PlanEditor, plans: PlanService, store: Store
) -> None:
    data = FORKED.encode()
    own = instruments.add_urdf("My arm (2).urdf", data)
    assert own.urdf == hashlib.sha256(data).hexdigest()
    assert (own.name, own.links, own.ends, own.tool_frame) == ("My_arm__2", ("b", "c", "d"), ("c", "d"), "c")
    plan = editor.do(ChooseRobot(robot=RobotChoice(own.name, own.urdf, "d")))
    robot = plan_robot(plan.content, instruments)
    assert [j.name for j in robot.joints] == ["one", "three"]
    editor.do(AddPoint(position=(0.0, 0.0, 0.0)))
    assert editor.plan.content.robot["tool_frame"] == "d"  # points drop the placing, not the robot

    text = to_native_json(plan, instruments.carried(plan.content, "json"))
    store.files.remove(own.urdf)
    file = from_native_json(text)
    assert [j.name for j in plan_robot(plan.content, CarriedUrdf(file.urdf)).joints] == ["one", "three"]
    again = plans.add_file(plan.case_id, file)
    assert [j.name for j in instruments.robot(again.content.robot).joints] == ["one", "three"]


def test_a_plan_without_its_urdf_or_with_another_one_says_so(
    instruments: Instruments, editor: PlanEditor, plans: PlanService, store: Store
) -> None:
    own = instruments.add_urdf("arm.urdf", GOOD.encode())
    plan = editor.do(ChooseRobot(robot=RobotChoice(own.name, own.urdf, own.tool_frame)))
    data = json.loads(to_native_json(plan, GOOD.encode()))
    with pytest.raises(PlanError, match="not the one that its robot names"):
        from_native_json(json.dumps(data | {"urdf": FORKED}))
    store.files.remove(own.urdf)
    with pytest.raises(PlanError, match="not stored here"):
        instruments.robot(plan.content.robot)
    del data["urdf"]
    with pytest.raises(PlanError, match="does not carry"):
        plans.add_file(plan.case_id, from_native_json(json.dumps(data)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tool": "spoon"}, "no tool 'spoon'"),
        ({"tool_shape": {"bend_deg": 1e9}}, "not between 0 and 120"),
        ({"tool_frame": "hand"}, "no link 'hand'"),
        ({"urdf": "<robot>"}, "XML"),
    ],
)
def test_a_file_brings_no_robot_or_tool_that_cannot_be(
    editor: PlanEditor, plans: PlanService, store: Store, change: dict[str, object], words: str
) -> None:
    text = str(change.pop("urdf", GOOD))
    frame = change.pop("tool_frame", "tool")
    data = json.loads(to_native_json(editor.plan)) | change | {"urdf": text}
    data["robot"] |= {"urdf": hashlib.sha256(text.encode()).hexdigest(), "tool_frame": frame}
    before = store.files.keys()
    with pytest.raises(RobotError, match=words):
        plans.add_file(editor.plan.case_id, from_native_json(json.dumps(data)))
    assert store.files.keys() == before


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot>", "XML"),
        (urdf(links("a"), joint("one", "a", "b")), "'b'"),
        (urdf(links("a")), "no joint"),
        (GOOD.replace("test", "t\udce4st").encode("latin-1", "surrogateescape"), "UTF-8"),
    ],
)
def test_a_bad_urdf_is_refused_in_words(instruments: Instruments, store: Store, text: str | bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        instruments.add_urdf("bad.urdf", text if isinstance(text, bytes) else text.encode())
    assert store.files.keys() == []


def test_a_link_that_is_none_is_refused(instruments: Instruments) -> None:
    with pytest.raises(RobotError, match="no link 'hand'"):
        instruments.add_urdf("arm.urdf", GOOD.encode(), "hand")


@pytest.mark.parametrize("robot", [{"name": "a", "urdf": "../x", "tool_frame": "b"}, {"name": "a", "tool_frame": "b"}])
def test_a_urdf_is_named_by_a_hash_only(robot: dict[str, str]) -> None:
    with pytest.raises(PlanError, match="SHA-256"):
        check_robot(robot)


def test_a_urdf_needs_its_tool_frame() -> None:
    with pytest.raises(PlanError, match="needs a tool_frame"):
        check_robot({"name": "a", "urdf": "0" * 64})
