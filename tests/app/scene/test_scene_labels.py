"""Labels that the page may draw, the ring of the preview, and the floor under a robot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.scene import palette
from app.scene.floor import BELOW_MM, FloorNodes, floor_picture, footprint
from app.scene.labels import SceneLabels
from app.scene.plan import GHOST_RADIUS_MM, GhostNodes
from app.scene.regions import PLACE_RADIUS_MM, DrawingNodes
from app.scene.task_labels import RADIUS_MM, LabelNodes, LabelShape
from vfix_engine.robots import Visual


class Scene:
    """Stands for viser's scene: keeps what is added by name."""

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}
        self.sent: list[tuple[str, int]] = []  # names and numbers of line segments

    def _add(self, name: str, **values: Any) -> Any:
        node = SimpleNamespace(visible=True, removed=False, **values)
        node.remove = lambda: setattr(node, "removed", True)
        self.nodes[name] = node
        return node

    def add_label(self, name: str, text: str, visible: bool = True, **_: Any) -> Any:
        node = self._add(name, text=text, position=None)
        node.visible = visible
        return node

    def add_line_segments(self, name: str, points: Any, colors: Any, **_: Any) -> Any:
        self.sent.append((name, len(points)))
        return self._add(name, points=points, colors=colors)

    def add_image(self, name: str, image: Any, width: float, height: float, **_: Any) -> Any:
        return self._add(name, image=image, width=width, height=height)


def test_labels_are_the_page_s_or_viser_s_and_never_both() -> None:
    scene = Scene()
    labels = SceneLabels(scene)  # type: ignore[arg-type]
    first = labels.add("/a", "A", "letter", (1.0, 2.0, 3.0))
    second = labels.add("/b", "B", "item", visible=False)
    assert [label.text for label in labels.shown()] == ["A"]
    labels.leave_to_page(True)
    assert not scene.nodes["/a"].visible
    second.visible = True
    third = labels.add("/c", "C", "grip")
    assert [scene.nodes[name].visible for name in ("/b", "/c")] == [False, False]
    assert [(label.kind, label.text) for label in labels.shown()] == [("letter", "A"), ("item", "B"), ("grip", "C")]
    labels.leave_to_page(False)
    assert [scene.nodes[name].visible for name in ("/a", "/b", "/c")] == [True, True, True]
    third.remove()
    assert third not in labels.shown()
    assert scene.nodes["/c"].removed
    assert first.position.tolist() == [1.0, 2.0, 3.0]


def test_the_ghost_is_a_ring_with_the_path_as_it_would_be() -> None:
    scene = Scene()
    ghost = GhostNodes(SimpleNamespace(scene=scene))  # type: ignore[arg-type]
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    ghost.show(np.array([5.0, 6.0, 7.0]), path)
    away = np.linalg.norm(scene.nodes["/plan/ghost_ring"].points.reshape(-1, 3) - [5.0, 6.0, 7.0], axis=1)
    assert away == pytest.approx(GHOST_RADIUS_MM, abs=1e-4)
    assert scene.nodes["/plan/ghost_path"].points.reshape(-1, 3)[-1] == pytest.approx([2.0, 1.0, 0.0])
    ghost.show(None)
    assert not any(node.visible for node in scene.nodes.values())
    ghost.show(np.array([5.0, 6.0, 7.0]))  # a target has no path
    assert scene.nodes["/plan/ghost_ring"].visible
    assert not scene.nodes["/plan/ghost_path"].visible


def test_what_is_being_drawn_has_a_ring_at_each_place() -> None:
    scene = Scene()
    drawing = DrawingNodes(SimpleNamespace(scene=scene))  # type: ignore[arg-type]
    drawing.show(())
    assert "/plan/drawing" not in scene.nodes
    drawing.show([(5.0, 6.0, 7.0), (9.0, 6.0, 7.0)])
    points = scene.nodes["/plan/drawing"].points
    assert points[0].tolist() == [[5.0, 6.0, 7.0], [9.0, 6.0, 7.0]]
    for place in ((5.0, 6.0, 7.0), (9.0, 6.0, 7.0)):
        away = np.linalg.norm(points[1:].reshape(-1, 3) - place, axis=1)
        assert away.min() == pytest.approx(PLACE_RADIUS_MM, abs=1e-4)
    drawing.show(())
    assert not scene.nodes["/plan/drawing"].visible


def test_a_robot_stands_on_a_floor_under_its_base() -> None:
    box = Visual(0, "box", (100.0, 60.0, 20.0), (0.0, 0.0, 50.0), (1, 2, 3))
    arm = Visual(1, "sphere", (500.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1, 2, 3))
    found = footprint([box, arm])
    assert found is not None
    middle, width = found
    assert middle == pytest.approx([0.0, 0.0, 40.0 - BELOW_MM])
    assert width == 100.0
    scene = Scene()
    floor = FloorNodes(scene, [box, arm])  # type: ignore[arg-type]
    base = np.eye(4)
    base[:3, 3] = [1.0, 2.0, 3.0]
    floor.place(base)
    assert scene.nodes["/robot/floor"].position == pytest.approx([1.0, 2.0, 43.0 - BELOW_MM])
    assert footprint([arm]) is None
    FloorNodes(Scene(), [arm]).place(base)  # type: ignore[arg-type]
    alpha = floor_picture()[:, :, 3].astype(int)
    assert alpha[0, 0] == 0
    assert alpha[96, 96] > alpha[96, 20] > 0


def test_labels_of_a_task_go_with_their_numbers() -> None:
    scene = Scene()
    labels = SceneLabels(scene)  # type: ignore[arg-type]
    nodes = LabelNodes(SimpleNamespace(scene=scene, labels=labels))  # type: ignore[arg-type]
    along, normal = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    shapes = tuple(LabelShape(np.array([0.0, 40.0 * n, 0.0]), normal, along, -10.0, str(n + 1)) for n in range(2))
    way, red = np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [2.0, 0.0, 9.0]]), np.array([False, False, True])
    nodes.show(shapes, way, red)
    nodes.show(shapes, way, red)
    assert [(label.text, label.kind) for label in labels.shown()] == [("1", "bead inside"), ("2", "bead inside")]
    rims = len(scene.nodes["/drive/labels/rims"].points)
    nodes.show((shapes[0], replace(shapes[1], end_mm=10.0)), way, red)
    assert [label.text for label in labels.shown()] == ["1", "2 ✓"]
    assert len(scene.nodes["/drive/labels/rims"].points) == rims // 2
    assert np.abs(scene.nodes["/drive/labels/done"].points[..., 1] - 40.0).max() <= RADIUS_MM + 1e-6
    assert scene.nodes["/drive/labels/done"].colors == palette.DONE
    assert scene.nodes["/drive/labels/cut/0"].points.tolist() == [[[1.0, 0.0, 9.0], [2.0, 0.0, 9.0]]]
    nodes.remove()
    assert labels.shown() == []
    assert all(node.removed for node in scene.nodes.values())


def test_of_the_way_of_a_tip_only_what_is_new_is_sent() -> None:
    """A task takes minutes: with the whole way each time, what is sent would grow with its square."""
    scene = Scene()
    nodes = LabelNodes(SimpleNamespace(scene=scene, labels=SceneLabels(scene)))  # type: ignore[arg-type]
    along, normal = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    shapes = (LabelShape(np.zeros(3), normal, along, -10.0, "1"),)
    way = np.column_stack([np.arange(1001.0), np.zeros(1001), np.full(1001, 9.0)])
    red = np.arange(1001) % 400 > 200
    for count in range(1, 1002):
        nodes.show(shapes, way[:count], red[:count])
    ways = [(name, count) for name, count in scene.sent if name.startswith(("/drive/labels/way", "/drive/labels/cut"))]
    assert max(count for _, count in ways) <= 64
    assert len(ways) == 1000  # each segment with the few of its node
    assert sum(name in ("/drive/labels/rims", "/drive/labels/arrows") for name, _ in scene.sent) == 2
    for kind, wanted in (("way", ~red[1:]), ("cut", red[1:])):
        drawn = [node.points for name, node in scene.nodes.items() if name.startswith(f"/drive/labels/{kind}/")]
        assert np.array_equal(np.concatenate(drawn), np.stack([way[:-1], way[1:]], axis=1)[wanted])
    nodes.remove()
    assert all(node.removed for node in scene.nodes.values())
