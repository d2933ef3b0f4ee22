"""Tools: their capsules, how they are held, the camera of an endoscope, and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.errors import RobotError
from vfix_engine.resources import assets_dir
from vfix_engine.robots import Tool

SHIPPED = sorted(path.stem for path in (assets_dir() / "tools").glob("*.json"))


def test_the_shipped_tools_are_there() -> None:
    assert {
        "bent_30", "straight_pointer", "shaver_40", "endoscope_0", "endoscope_30", "endoscope_45", "endoscope_70",
    } == set(SHIPPED)  # fmt: skip


@pytest.mark.parametrize("name", SHIPPED)
def test_the_parts_of_a_tool_hang_together(name: str) -> None:
    tool = Tool.load(name)
    assert tool.name == name
    assert tool.source
    rotation = Rotation.from_euler("xyz", [0.3, 0.2, -0.5]).as_matrix()
    position = np.array([1.0, 2.0, 3.0])
    segments = tool.segments(rotation, position)
    assert len(segments) == len(tool.segment_names)
    np.testing.assert_allclose(segments.end[0], position)
    np.testing.assert_allclose(segments.end[1:], segments.start[:-1])
    lengths = np.linalg.norm(segments.end - segments.start, axis=1)
    np.testing.assert_allclose(lengths, [part.length for part in tool.parts])
    for part, along in zip(tool.parts, (segments.end - segments.start) / lengths[:, None], strict=True):
        np.testing.assert_allclose(along @ rotation[:, 1], np.cos(part.bend))
    np.testing.assert_allclose(tool.grip(rotation, position), segments.end[-1] - tool.grip_from_bend * rotation[:, 1])


def test_the_bent_pointer_is_the_papers() -> None:
    """15 mm tip (Li 2007, section V.A) at 30 degrees to a shaft of 150 mm."""
    tool = Tool.load("bent_30")
    assert tool.segment_names == ("tip", "shaft")
    np.testing.assert_allclose(tool.radius, [1.0, 1.5])
    assert [part.length for part in tool.parts] == [15.0, 150.0]
    assert np.degrees(np.arccos(tool.direction(np.eye(3))[1])) == pytest.approx(30.0)


def test_how_a_tool_is_held() -> None:
    """By its tip: the tip's foot on the shaft's axis is the flange's origin. By its tail: the rear end is."""
    tool = Tool.load("bent_30")
    np.testing.assert_allclose(tool.transform_tip_to_flange("tip")[:3, 3], [0.0, 0.0, 7.5], atol=1e-12)
    np.testing.assert_allclose(tool.tip_in_flange, [0.0, 0.0, 7.5], atol=1e-12)
    tail = tool.transform_tip_to_flange("tail")
    segments = tool.segments(tail[:3, :3], tail[:3, 3])
    np.testing.assert_allclose(segments.start[-1], 0.0, atol=1e-12)
    np.testing.assert_allclose(segments.end[-1], [0.0, 150.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("angle", [0, 30, 45, 70])
def test_an_endoscope_looks_where_its_angle_says(angle: int) -> None:
    """The view, not the shaft, is the direction of inspection; x right, y down, z ahead in the picture."""
    tool = Tool.load(f"endoscope_{angle}")
    camera = tool.camera
    assert camera is not None
    frame = camera.transform_camera_to_tip
    view = np.array([0.0, np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    np.testing.assert_allclose(frame[:3, 2], view, atol=1e-12)
    np.testing.assert_allclose(frame[:3, 3], 0.0)
    np.testing.assert_allclose(frame[:3, :3].T @ frame[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0)
    assert frame[1, 1] == pytest.approx(np.sin(np.radians(angle)))  # down in the picture leans towards the shaft's end
    assert frame[2, 1] == pytest.approx(-np.cos(np.radians(angle)))
    assert 60 < np.degrees(camera.field_of_view) < 120
    rotation = Rotation.from_euler("xyz", [0.3, 0.2, -0.5]).as_matrix()
    np.testing.assert_allclose(tool.direction(rotation), rotation @ view, atol=1e-12)
    assert tool.radius.tolist() == [2.0]


def changed(tmp_path: Path, name: str, change: Any) -> Path:
    data = json.loads((assets_dir() / "tools" / f"{name}.json").read_text())
    change(data)
    file = tmp_path / "tool.json"
    file.write_text(json.dumps(data))
    return file


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda d: d["parts"][0].update(length=0), "length"),
        (lambda d: d["parts"][0].update(radius=float("inf")), "Infinity is no number"),
        (lambda d: d["parts"][0].update(length=float("nan")), "NaN is no number"),
        (lambda d: d["parts"][0].update(bend=175), "bend"),
        (lambda d: d["parts"][1].update(bend=10), "shaft"),
        (lambda d: d["parts"][1].update(name="tip"), "same name"),
        (lambda d: d.update(parts=[]), "0 parts"),
        (lambda d: d.update(parts=7), "usable|missing"),
        (lambda d: d.update(grip_from_bend=1000), "grip"),
        (lambda d: d.pop("grip_from_bend"), "grip_from_bend"),
        (lambda d: d.update(grip_from_bend=10**400), "too large"),
        (lambda d: d.pop("source"), "source"),
        (lambda d: d.update(camera={"tilt": 30}), "field_of_view"),
        (lambda d: d.update(camera={"tilt": 30, "field_of_view": 180}), "180"),
        (lambda d: d.update(camera={"tilt": 170, "field_of_view": 80}), "tilted"),
        (lambda d: d.update(camera={"tilt": 0, "field_of_view": 80, "up": [0, 1, 0]}), "up direction"),
        (lambda d: d.update(camera={"tilt": 0, "field_of_view": 80, "up": [0, 1]}), "three"),
        (lambda d: d.update(camera={"tilt": 0, "field_of_view": 80, "position": [0, "x", 1]}), "x"),
        (lambda d: d.update(units={"length": "m", "angle": "deg"}), "mm and deg"),
        (lambda d: d.update(shape="round"), "shape"),
        (lambda d: d.update(schema="vfix-tool/1"), "vfix-tool/2"),
    ],
)
def test_nonsense_tools_are_refused_with_the_reason(tmp_path: Path, change: Any, word: str) -> None:
    """HAZ-23."""
    with pytest.raises(RobotError, match=word):
        Tool.load(changed(tmp_path, "bent_30", change))


def test_unknown_tools_say_what_there_is() -> None:
    with pytest.raises(RobotError, match="bent_30"):
        Tool.load("spoon")
