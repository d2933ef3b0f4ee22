"""Layers of the scene: which nodes are made, shown and removed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from app.workspace.layers import Layer, LayerStack


class Nodes:
    """Notes what is shown of it, and whether it was removed."""

    def __init__(self, view: Any) -> None:
        self.shown: list[Any] = []
        self.removed = False

    def remove(self) -> None:
        self.removed = True


@pytest.fixture
def stack() -> LayerStack:
    return LayerStack(SimpleNamespace())  # type: ignore[arg-type]


def layer(name: str, key: object, made_for: object = None) -> Layer[Nodes]:
    return Layer(name, key, Nodes, lambda nodes: nodes.shown.append(key), made_for)


def nodes_of(stack: LayerStack) -> dict[str, Any]:
    return {name: nodes for name, (_, nodes) in stack._drawn.items()}


def test_a_layer_is_shown_again_only_with_another_key(stack: LayerStack) -> None:
    stack.draw([layer("a", 1), layer("b", 1)])
    stack.draw([layer("a", 2), layer("b", 1)])
    assert {name: nodes.shown for name, nodes in nodes_of(stack).items()} == {"a": [1, 2], "b": [1]}


def test_of_two_layers_with_one_name_the_later_is_drawn(stack: LayerStack) -> None:
    stack.draw([layer("a", "first"), layer("a", "second")])
    assert nodes_of(stack)["a"].shown == ["second"]


def test_what_is_not_wanted_any_more_is_removed(stack: LayerStack) -> None:
    stack.draw([layer("a", 1), layer("b", 1)])
    gone = nodes_of(stack)["a"]
    stack.draw([layer("b", 1)])
    assert gone.removed
    assert list(nodes_of(stack)) == ["b"]


def test_an_update_leaves_the_other_layers_alone(stack: LayerStack) -> None:
    stack.draw([layer("a", 1), layer("b", 1)])
    stack.update([layer("b", 2), layer("c", 1)])
    nodes = nodes_of(stack)
    assert {name: each.shown for name, each in nodes.items()} == {"a": [1], "b": [1, 2], "c": [1]}
    assert not any(each.removed for each in nodes.values())


def test_nodes_that_were_made_for_something_else_are_made_anew(stack: LayerStack) -> None:
    stack.draw([layer("robot", 1, made_for="one")])
    before = nodes_of(stack)["robot"]
    stack.update([layer("robot", 1, made_for="another")])
    assert before.removed
    assert nodes_of(stack)["robot"].shown == [1]


def test_what_fails_while_it_is_shown_can_still_be_removed(stack: LayerStack) -> None:
    made: list[Nodes] = []

    def make(view: Any) -> Nodes:
        made.append(Nodes(view))
        return made[-1]

    def fail(nodes: Nodes) -> None:
        raise OSError("the browser is gone")

    with pytest.raises(OSError, match="browser"):
        stack.draw([Layer("a", 1, make, fail)])
    stack.draw([])
    assert made[0].removed
