"""Parts of a session: commands at the door, the view model, the inbox."""

from __future__ import annotations

import json
import math
import queue

import pytest

from app.messages.sections import Section
from app.session.commands import InvalidMessage, parse_command
from app.session.inbox import MAX_WAITING, Inbox
from app.session.router import to_text
from app.session.view_model import ViewModel
from app.tabs.plan.commands import DragItem


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[]",
        '{"type": "unheard-of"}',
        '{"type": "undo", "extra": 1}',
        '{"type": "item.drag", "item_id": "p-1", "position": [1, 2]}',
        '{"type": "item.drag", "item_id": "p-1", "position": [NaN, 2, 3]}',
        '{"type": "item.drag", "item_id": "p-1", "position": [1e999, 2, 3]}',
        '{"type": "item.drag", "item_id": "p-1", "position": [1e9, 2, 3]}',
        '{"type": "item.drag", "item_id": "../p", "position": [1, 2, 3]}',
        '{"type": "view.set", "opacity": 1e9}',
        '{"type": "view.set", "opacity": 0}',
        '{"type": "drive", "direction": 5}',
        '{"type": "slice.window", "name": "bone", "window": 0, "level": 0}',
        '{"type": "rehearsal.settings", "values": {"margin_mm": Infinity}}',
        '{"type": "plan.new", "name": "   "}',
        '{"type": "plan.new", "name": "' + "x" * 500 + '"}',
        '{"type": "project", "points": ' + str([[0, 0, 0]] * 1001) + "}",
    ],
)
def test_commands_that_make_no_sense_are_refused_at_the_door(text: str) -> None:
    """HAZ-05: nothing that is not a known command with bounded, finite numbers reaches a workspace."""
    with pytest.raises(InvalidMessage):
        parse_command(text)


def test_a_command_is_parsed_into_its_own_type() -> None:
    command = parse_command('{"type": "item.drag", "item_id": "p-1", "position": [1, 2.5, -3], "id": 4}')
    assert isinstance(command, DragItem)
    assert command.position == (1.0, 2.5, -3.0)
    assert command.id == 4


def test_the_view_model_tells_what_changed_and_only_that() -> None:
    """HAZ-31: a reader that comes late gets the newest value of each section, once."""
    model, calls = ViewModel(), []
    unsubscribe = model.subscribe(lambda: calls.append(1))
    model.publish("plan", Section.of({"n": 1}))
    model.publish("case", Section.of(None))
    assert model.changed_since(0) == (0, {}), "nothing is shown before it is committed"
    model.commit()
    first, sections = model.changed_since(0)
    assert sections == {"plan": {"n": 1}, "case": None}
    for n in (1, 2, 3, 3):
        model.publish("plan", Section.of({"n": n}))
        model.commit()
    assert model.changed_since(first)[1] == {"plan": {"n": 3}}
    assert len(calls) == 3
    unsubscribe()
    model.publish("plan", Section.of({"n": 4}))
    model.commit()
    assert len(calls) == 3


def test_the_inbox_keeps_the_order_and_the_newest_of_a_stream() -> None:
    inbox, done = Inbox(), []
    inbox.put(lambda: done.append("a"))
    for n in range(100):
        inbox.put(lambda n=n: done.append(n), "drag")
    inbox.put(lambda: done.append("b"))
    inbox.close()
    while (request := inbox.get(0.1)) is not None:
        request()
    assert done == ["a", 99, "b"]
    with pytest.raises(queue.Empty):
        inbox.get(0.01)


def test_the_inbox_of_a_page_gone_mad_is_bounded() -> None:
    inbox = Inbox()
    taken = [inbox.offer(lambda: None) for _ in range(MAX_WAITING + 10)]
    assert sum(taken) == MAX_WAITING
    done = list[str]()
    assert not inbox.offer(lambda: done.append("stream"), "stream")
    inbox.put(lambda: done.append("release"))  # of the planner itself: a hand that is let go of
    inbox.close()
    while (request := inbox.get(0.1)) is not None:
        request()
    assert done == ["release"]


def test_a_non_finite_number_does_not_cost_the_page_its_connection(caplog: pytest.LogCaptureFixture) -> None:
    message = {"type": "state", "sections": {"plan": {"points": [[math.nan, 1.0, -math.inf]], "name": "nan"}}}
    told = json.loads(to_text(message))
    assert told["sections"]["plan"] == {"points": [[None, 1.0, None]], "name": "nan"}
    assert "non-finite numbers" in caplog.text
