"""Parts of the page's session: commands at the door, the lease, the board, the inbox, the room."""

from __future__ import annotations

import json
import math
import queue
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from pydantic import ValidationError

from app.scene.plan import PlanItem
from app.session.commands import parse_command
from app.session.inbox import MAX_WAITING, Inbox
from app.session.router import to_text
from app.session.view_model import ViewModel
from app.steps.plan.commands import DragItem
from app.steps.plan.lanes import Lanes
from app.steps.rehearse import shared_drive
from app.steps.rehearse.lease import Lease
from app.steps.rehearse.shared_drive import Prepared, SharedDrive, SharedDrives
from app.views.slice_view import SliceView
from tests.locks import Beside
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, InputError, PlanError
from vfix_engine.imaging.volume import Volume
from vfix_engine.runtime.events import Event

TABS = ("tab-one-0", "tab-two-0", "tab-three")


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
    with pytest.raises(ValidationError):
        parse_command(text)


def test_a_command_is_parsed_into_its_own_type() -> None:
    command = parse_command('{"type": "item.drag", "item_id": "p-1", "position": [1, 2.5, -3], "id": 4}')
    assert isinstance(command, DragItem)
    assert command.position == (1.0, 2.5, -3.0)
    assert command.id == 4


class LeaseMachine(RuleBasedStateMachine):
    """HAZ-12: whatever tabs do, there are never two holders."""

    def __init__(self) -> None:
        super().__init__()
        self.lease, self.believed = Lease(), ""

    @rule(tab=st.sampled_from(TABS))
    def take(self, tab: str) -> None:
        taken = self.lease.take(tab)
        assert taken == (self.believed in ("", tab))
        if taken:
            self.believed = tab

    @rule(tab=st.sampled_from(TABS))
    def let_go(self, tab: str) -> None:
        assert self.lease.let_go(tab) == (self.believed == tab and tab != "")
        if self.believed == tab:
            self.believed = ""

    @invariant()
    def one_holder_at_most(self) -> None:
        assert [tab for tab in TABS if self.lease.held_by(tab)] == ([self.believed] if self.believed else [])
        assert self.lease.holder == (self.believed or None)


LeaseMachine.TestCase.settings = hypothesis_settings(max_examples=60, stateful_step_count=30, deadline=None)
TestLease = LeaseMachine.TestCase


def test_the_board_tells_what_changed_and_only_that() -> None:
    """HAZ-31: a reader that comes late gets the newest value of each section, once."""
    board, calls = ViewModel(), []
    unsubscribe = board.subscribe(lambda: calls.append(1))
    board.publish({"plan": {"n": 1}})
    board.publish({"case": None})
    assert board.changed_since(0) == (0, {}), "nothing is shown before it is committed"
    board.commit()
    first, sections = board.changed_since(0)
    assert sections == {"plan": {"n": 1}, "case": None}
    for n in (1, 2, 3, 3):
        board.publish({"plan": {"n": n}})
        board.commit()
    assert board.changed_since(first)[1] == {"plan": {"n": 3}}
    assert len(calls) == 3
    unsubscribe()
    board.publish({"plan": {"n": 4}})
    board.commit()
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
    taken = [inbox.put(lambda: None) for _ in range(MAX_WAITING + 10)]
    assert sum(taken) == MAX_WAITING


class _Process:
    """Stands for the control process and notes what it is told."""

    refuses = False
    silence_s = 0.0
    hand_lost = False

    def __init__(self, *_: Any) -> None:
        self.told: list[Any] = []
        self.alive = True
        _Process.last = self

    last: _Process

    def start(self) -> None:
        pass

    def wait_ready(self) -> None:
        if self.refuses:
            raise ControlError("the tool does not fit at the entry")

    def close(self) -> None:
        self.alive = False

    def events(self) -> list[Any]:
        return []

    def snapshot(self) -> None:
        return None

    def __getattr__(self, name: str) -> Any:
        return lambda *values: self.told.append((name, *values))


class _Now(Executor):
    """Does the work at once."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        fn(*args, **kwargs)
        return Future()


def _prepared() -> Prepared:
    spec: Any = SimpleNamespace(robot="steady_hand", base=np.eye(4))
    targets = [PlanItem(name, "target", name, (0.0, 0.0, 0.0)) for name in ("t-1", "t-2")]
    return Prepared(spec, ControlSettings(), (PlanItem("p-1", "point", "P1", (0.0, 0.0, 0.0)), *targets))


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> SharedDrive:
    monkeypatch.setattr(shared_drive, "RehearsalProcess", _Process)
    monkeypatch.setattr(_Process, "refuses", False)
    made = SharedDrive()
    made.open("plan", _prepared, _Now())
    return made


def test_only_the_holder_moves_the_robot(room: SharedDrive) -> None:
    """HAZ-12: everything that another tab sends is ignored."""
    assert room.lease.take("one")
    for tab in ("two", "one"):
        room.set_grip(tab, (1.0, 2.0, 3.0))
        room.drive(tab, 1)
        room.twist(tab, -1)
        room.run(tab)
        room.pause(tab)
        room.reset(tab)
        room.set_mode(tab, "inspect", "t-2")
        room.change_settings(tab, {"margin_mm": 1.0})
        if tab == "two":
            assert _Process.last.told == []
    names = [name for name, *_ in _Process.last.told]
    assert names == ["set_grip", "drive", "twist", "run", "pause", "reset", "set_mode", "set_settings"]


def test_a_target_is_named_by_its_id_and_must_be_one_that_is_driven(room: SharedDrive) -> None:
    """The process has the targets of the plan that it was started for, in their order."""
    room.lease.take("one")
    room.set_mode("one", "inspect", "t-2")
    assert (_Process.last.told, room.target_id) == ([("set_mode", "inspect", 1)], "t-2")
    with pytest.raises(PlanError, match="not part of this rehearsal"):
        room.set_mode("one", "inspect", "p-1")
    assert room.target_id == "t-2"


def test_a_heartbeat_never_takes_hold(room: SharedDrive) -> None:
    """HAZ-11: only a press or a moved pointer does, whatever heartbeats come before, between and after."""
    room.lease.take("one")
    room.heartbeat("one")
    room.set_grip("one", (1.0, 2.0, 3.0))
    room.heartbeat("one")
    room.release("one")
    room.heartbeat("one")
    beat, grip = ("heartbeat",), ("set_grip", (1.0, 2.0, 3.0))
    assert _Process.last.told == [beat, grip, beat, ("release",), beat]


def test_a_click_beside_the_grip_leaves_the_keys_alone(room: SharedDrive) -> None:
    room.lease.take("one")
    room.drive("one", 1)
    room.release_grip("one")
    assert _Process.last.told == [("drive", 1)]
    room.set_grip("one", (1.0, 2.0, 3.0))
    room.release_grip("one")
    assert _Process.last.told[-1] == ("release",)


def _answer(room: SharedDrive, monkeypatch: pytest.MonkeyPatch, *events: Event) -> None:
    monkeypatch.setattr(_Process, "events", lambda self: list(events))
    room.check()
    monkeypatch.setattr(_Process, "events", lambda self: [])


def _sent(room: SharedDrive) -> list[ControlSettings]:
    return [told[1] for told in _Process.last.told if told[0] == "set_settings"]


def _told(settings: ControlSettings) -> Event:
    return Event("settings", json.dumps(settings.to_dict()))


def test_a_setting_that_is_refused_is_not_shown_as_in_force(room: SharedDrive, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said once, beside the slider, without a word of a start; what was wished meanwhile does not carry it."""
    room.lease.take("one")
    old = room.settings
    room.change_settings("one", {"margin_mm": 1.5})
    room.change_settings("one", {"force_cap_n": 2.0})
    assert (room.settings, len(_sent(room))) == (old, 1)
    monkeypatch.setattr(_Process, "snapshot", lambda self: SimpleNamespace(clearance_mm=0.35))
    _answer(room, monkeypatch, Event("note", "no such target"), Event("note", "would start too near"), _told(old))
    assert (room.settings, room.settings_answered) == (old, 1)
    assert (
        room.settings_refusal
        == "Safety margin stays at 0.3 mm: the tool is 0.35 mm from bone here. Draw it back first."
    )
    assert (_sent(room)[-1].margin_mm, _sent(room)[-1].force_cap_n) == (old.margin_mm, 2.0)
    _answer(room, monkeypatch, _told(_sent(room)[-1]))
    assert (room.settings_refusal, room.settings.force_cap_n) == ("", 2.0)
    assert room.take_words("two") == []
    assert room.take_words("one") == ["no such target"]
    assert room.accepted("one") == {"force_cap_n": 2.0}
    with pytest.raises(InputError, match="no setting is called 'self'"):
        room.change_settings("one", {"self": 1.0})


def test_settings_count_once_the_process_has_confirmed_them(room: SharedDrive, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two changes in a row both hold, and each is handed to the plan until that has kept it."""
    room.lease.take("one")
    room.change_settings("one", {"margin_mm": 0.5})
    room.change_settings("one", {"force_cap_n": 2.0})
    for number in (1, 2):
        assert len(_sent(room)) == number
        _answer(room, monkeypatch, _told(_sent(room)[-1]))
    assert (room.settings.margin_mm, room.settings.force_cap_n, room.settings_answered) == (0.5, 2.0, 2)
    assert room.accepted("two") == {}
    assert room.accepted("one") == {"margin_mm": 0.5, "force_cap_n": 2.0}
    room.kept({"margin_mm": 0.4, "force_cap_n": 2.0})
    assert room.accepted("one") == {"margin_mm": 0.5}, "changed again while it was being kept"


def test_a_process_that_does_not_read_is_sent_one_change_of_the_settings(room: SharedDrive) -> None:
    """A pipe that nobody empties never fills, however long the slider is moved."""
    room.lease.take("one")
    for n in range(1000):
        room.change_settings("one", {"margin_mm": 0.3 + 1e-3 * n})
    assert len(_sent(room)) == 1


def test_a_change_that_could_not_be_sent_is_not_waited_for(room: SharedDrive, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(process: _Process, settings: ControlSettings) -> None:
        raise ControlError("the control process does not answer")

    room.lease.take("one")
    monkeypatch.setattr(_Process, "set_settings", refuse, raising=False)
    with pytest.raises(ControlError, match="does not answer"):
        room.change_settings("one", {"margin_mm": 0.5})
    monkeypatch.undo()
    room.change_settings("one", {"force_cap_n": 2.0})
    (sent,) = _sent(room)
    assert (sent.margin_mm, sent.force_cap_n) == (room.settings.margin_mm, 2.0)


def test_a_process_that_hangs_is_told_and_can_be_ended(room: SharedDrive, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-10: the age of its newest snapshot tells it; one that wakes up again is shown again."""
    for silence, state in ((0.1, "ready"), (2.5, "silent"), (7.0, "silent"), (0.0, "ready"), (60.0, "silent")):
        monkeypatch.setattr(_Process, "silence_s", silence)
        room.check()
        assert room.state == state
        assert (f"has not answered for {silence:.0f} s" in room.words) == (state == "silent")
    room.close()
    assert (room.state, _Process.last.alive) == ("absent", False)


def test_a_process_that_ends_with_a_word_passes_it_on(room: SharedDrive, monkeypatch: pytest.MonkeyPatch) -> None:
    _answer(room, monkeypatch, Event("failed", "out of memory"))
    assert (room.state, room.words) == ("failed", "out of memory")


def test_a_hand_is_forgotten_with_the_process_it_held(room: SharedDrive) -> None:
    """HAZ-11: a plan edited in the middle of a drag leaves no hand behind for the next holder or the next process."""
    for end in (room.close, lambda: room.open("plan", _prepared, _Now()), lambda: room.leave("one")):
        room.open("plan", _prepared, _Now())
        room.lease.take("one")
        room.set_grip("one", (1.0, 2.0, 3.0))
        end()
        room.release("one")
        room.lease.let_go("one")
        room.open("plan", _prepared, _Now())
        room.lease.take("two")
        room.drive("two", 1)
        room.heartbeat("two")
        assert _Process.last.told == [("drive", 1), ("heartbeat",)]
        room.lease.let_go("two")


def test_a_hand_that_was_let_go_of_has_to_take_hold_again(room: SharedDrive) -> None:
    """HAZ-11: a drag goes on in a scene that missed the release; its moves are no hand."""
    room.lease.take("one")
    room.set_grip("one", (1.0, 2.0, 3.0))
    room.move_grip("one", (2.0, 2.0, 3.0))
    room.release_grip("one")
    room.move_grip("one", (9.0, 9.0, 9.0))
    room.heartbeat("one")
    assert _Process.last.told == [
        ("set_grip", (1.0, 2.0, 3.0)),
        ("set_grip", (2.0, 2.0, 3.0)),
        ("release",),
        ("heartbeat",),
    ]


def test_a_number_that_is_none_does_not_cost_the_page_its_connection(caplog: pytest.LogCaptureFixture) -> None:
    message = {"type": "state", "sections": {"plan": {"points": [[math.nan, 1.0, -math.inf]], "name": "nan"}}}
    told = json.loads(to_text(message))
    assert told["sections"]["plan"] == {"points": [[None, 1.0, None]], "name": "nan"}
    assert "numbers that are none" in caplog.text


def test_a_page_that_comes_back_finds_the_room_of_its_plan() -> None:
    """A room that was given away meanwhile leaves no orphan: the page and the newcomer share one."""
    rooms = SharedDrives()
    first = rooms.enter("plan", "one")
    assert rooms.enter("plan", "two") is first
    rooms.leave(first, "one")
    rooms.leave(first, "two")
    assert rooms.enter("plan", "one") is rooms.enter("plan", "two") is not first


def test_a_window_that_enters_while_the_last_one_leaves_keeps_its_robot(
    room: SharedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    rooms, close = SharedDrives(), SharedDrive.close
    left, entered = rooms.enter("plan", "one"), list[SharedDrive]()

    def close_late(closing: SharedDrive) -> None:
        if not entered:
            entered.append(rooms.enter("plan", "two"))
            entered[0].open("plan", _prepared, _Now())
        close(closing)

    monkeypatch.setattr(SharedDrive, "close", close_late)
    rooms.leave(left, "one")
    assert entered[0].state == "ready"
    assert rooms.enter("plan", "three") is entered[0]


def test_a_process_that_ends_while_another_is_coming_does_not_end_that_one(
    room: SharedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One window resets while another one hears the process that is being replaced."""
    started: list[Any] = []
    later: Any = SimpleNamespace(submit=lambda work, *values: started.append(lambda: work(*values)))

    def events(process: _Process) -> list[Any]:
        room.open("plan", _prepared, later)
        return [Event("failed", "ended")]

    monkeypatch.setattr(_Process, "events", events)
    room.check()
    assert (room.state, room.is_for("plan")) == ("starting", True)
    started[0]()
    assert (room.state, _Process.last.alive) == ("ready", True)


def test_two_windows_that_listen_at_once_hear_the_reason_of_a_refusal(
    room: SharedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The note is heard by one thread and the answer it belongs to by the next, in this order."""
    room.lease.take("one")
    room.change_settings("one", {"margin_mm": 1.5})
    said = [[Event("note", "the tube is narrow")], [_told(room.settings)]]
    other = Beside(lambda: room.check())

    def events(process: _Process) -> list[Event]:
        heard = said.pop(0) if said else []
        if threading.current_thread() is not other.thread:
            other.begin()
        return heard

    monkeypatch.setattr(room, "_checking", other, raising=False)
    monkeypatch.setattr(_Process, "events", events)
    room.check()
    other.thread.join(20)
    assert room.settings_refusal == "Safety margin stays at 0.3 mm: the tube is narrow"
    assert room.take_words("one") == []


def test_a_page_that_leaves_lets_go(room: SharedDrive) -> None:
    room.lease.take("one")
    room.set_grip("one", (1.0, 2.0, 3.0))
    room.leave("one")
    assert _Process.last.told[-1] == ("release",)
    assert room.lease.take("two")


def test_settings_are_clamped_on_the_server(room: SharedDrive) -> None:
    """HAZ-05: whatever a slider is made to say."""
    room.lease.take("one")
    bounds = ControlSettings.bounds()
    room.change_settings("one", {"margin_mm": -5.0, "force_cap_n": 1e6})
    (settings,) = _sent(room)
    assert (settings.margin_mm, settings.force_cap_n) == (bounds["margin_mm"].low, bounds["force_cap_n"].high)


def test_a_room_says_why_it_could_not_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_drive, "RehearsalProcess", _Process)
    monkeypatch.setattr(_Process, "refuses", True)
    room = SharedDrive()
    room.open("plan", _prepared, _Now())
    assert room.state == "failed"
    assert "does not fit" in room.words
    assert not _Process.last.alive


def test_a_start_that_is_not_wanted_any_more_is_ended_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It does not go on for its two minutes behind the back of the next one."""
    monkeypatch.setattr(shared_drive, "RehearsalProcess", _Process)
    room = SharedDrive()
    ended: list[bool] = []

    def wait_ready(process: _Process) -> None:
        room.close()
        ended.append(not process.alive)
        raise ControlError("the control process ended before it was ready")

    monkeypatch.setattr(_Process, "wait_ready", wait_ready)
    room.open("plan", _prepared, _Now())
    assert (ended, room.state) == ([True], "absent")


def test_slow_work_keeps_no_other_lane_waiting_and_its_own_lane_does_the_newest_next() -> None:
    done: list[str] = []
    slow, other = threading.Event(), threading.Event()

    def first() -> None:
        slow.wait(20)
        done.append("first")

    with ThreadPoolExecutor(4) as executor:
        lanes = Lanes(executor)
        lanes.submit("slow", first)
        lanes.submit("slow", lambda: done.append("older"))
        lanes.submit("slow", lambda: done.append("newest"))
        lanes.submit("other", other.set)
        assert other.wait(10)
        assert done == []
        slow.set()
    assert done == ["first", "newest"]


def test_work_that_fails_is_logged_and_what_waits_behind_it_is_done(caplog: pytest.LogCaptureFixture) -> None:
    done: list[str] = []

    def fail() -> None:
        lanes.submit("lane", lambda: done.append("waited"))
        raise ValueError("spoiled")

    lanes = Lanes(_Now())
    lanes.submit("lane", fail)
    lanes.submit("lane", lambda: done.append("later"))
    assert done == ["waited", "later"]
    assert "spoiled" in caplog.text


def test_a_control_process_that_ends_is_noticed(room: SharedDrive) -> None:
    _Process.last.alive = False
    room.check()
    assert room.state == "failed"
    assert "ended" in room.words


def test_slices_stay_inside_the_volume() -> None:
    volume = Volume(np.zeros((6, 5, 4), dtype=np.int16), np.array([1.0, 2.0, 3.0]), np.ones(3), np.eye(3))
    desk = SliceView(volume, np.array([99.0, 99.0, 99.0]))
    assert desk.cross.tolist() == [4.0, 6.0, 8.0]
    desk.move("axial", -1e4)
    assert desk.cross.tolist() == [4.0, 6.0, 3.0]
    plane = desk.view()["planes"]["coronal"]
    assert (plane["columns"], plane["rows"], plane["position"]) == (4, 6, 6.0)
    assert plane["origin"][1] == 6.0
