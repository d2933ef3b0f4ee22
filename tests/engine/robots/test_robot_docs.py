"""The page on robots says what is so: its files load, its code runs, and what is shipped stands in it."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from tests.engine.robots.test_robot import SHIPPED
from tests.engine.robots.test_tools import SHIPPED as TOOLS
from vfix_engine.robots import RobotModel, SnakeModel, Tool

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "robots.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def test_the_robot_of_the_page_is_one(tmp_path: Path) -> None:
    (tmp_path / "gantry.urdf").write_text(blocks("xml")[0])
    (tmp_path / "gantry.json").write_text(blocks("json")[0])
    robot = RobotModel.load(tmp_path / "gantry.json")
    assert robot.upright
    assert robot.home.tolist() == [0.0, -50.0, 0.0, 0.0]
    assert robot.joints[3].name == "roll of the flange"
    assert robot.upper.tolist() == [100.0, 200.0, 100.0, 3.0]
    # The tail stands 12 mm before the flange, the shaft along its z axis, which looks ahead.
    tool = Tool.load("straight_pointer")
    position = robot.placed(np.eye(4), tool).tip(np.zeros(4)).position
    np.testing.assert_allclose(position, [0.0, 12.0 + 165.0, 0.0], atol=1e-9)
    assert "roll" in " ".join(RobotModel.load(tmp_path / "gantry.urdf").notes)


def test_the_tool_of_the_page_is_one(tmp_path: Path) -> None:
    file = tmp_path / "tool.json"
    file.write_text(blocks("json")[1])
    tool = Tool.load(file)
    assert tool.segment_names == ("tip", "shaft")
    assert tool.camera is not None
    np.testing.assert_allclose(
        tool.direction(np.eye(3)), tool.segments(np.eye(3), np.zeros(3)).end[0] + tool.camera.view
    )


def test_the_python_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks("python")[0], "robots.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "(6, 6)" in printed
    assert "tool roll" in printed


def test_the_snake_of_the_page_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks("python")[1], "robots.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "(6, 4, 4)" in printed
    assert "(3, 10) (500, 3)" in printed
    assert "mass of a link: 0.015 kg" in printed


def test_every_argument_of_a_snake_is_told_with_its_default() -> None:
    words = {"links": "", "q_max": "45°", "sphere_radius_mm": "that of the cylinder"}
    for argument in dataclasses.fields(SnakeModel):
        default = words.get(argument.name) if argument.name in words else f"{argument.default:g}"
        assert f"| `{argument.name}` | {default}".rstrip() in PAGE


def test_everything_that_is_shipped_is_told() -> None:
    for name in [*SHIPPED, *TOOLS]:
        assert f"`{name}`" in PAGE, name
