"""A drive that clients share: who moves it, what the process says, how it ends."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from session_doubles import Later, Now

from app.drives import drive_process, shared_drive
from app.drives.drive_process import Tell
from app.drives.live_comments import LiveComments
from app.drives.shared_drive import SharedDrive
from app.drives.shared_drives import DriveKey, SharedDrives
from app.messages.client import Client
from app.scene.plan import PlanItem
from app.tabs.rehearse.preparation import PreparedRehearsal
from app.tabs.rehearse.view import rehearsal_section
from tests.locks import Beside
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, InputError, PlanError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.events import Event
from vfix_engine.runtime.requests import Request, SetSettings, SetTask
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

Drive = SharedDrive[PreparedRehearsal, RigidSnapshot]
PLAN = DriveKey("case", "plan")
FREE = SetTask("free")
ONE, TWO, THREE = (Client(name, "holds") for name in ("one", "two", "three"))


class Process:
    """Stands for the control process and notes what it is told."""

    refuses = False
    silence_s = 0.0
    hand_lost = False

    def __init__(self, *_: Any, **__: Any) -> None:
        self.told: list[Any] = []
        self.alive = True
        Process.last = self

    last: Process

    def start(self) -> None:
        pass

    def wait_ready(self, **_: Any) -> None:
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


def _prepared(tell: Tell | None = None) -> PreparedRehearsal:
    nothing: Any = None
    targets = [PlanItem(name, "target", name, (0.0, 0.0, 0.0)) for name in ("t-1", "t-2")]
    items = (PlanItem("p-1", "point", "P1", (0.0, 0.0, 0.0)), *targets)
    return PreparedRehearsal(spec=nothing, settings=ControlSettings(), robot=nothing, items=items)


@pytest.fixture
def drive(monkeypatch: pytest.MonkeyPatch) -> Drive:
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    monkeypatch.setattr(Process, "refuses", False)
    made: Drive = SharedDrive()
    made.open("plan", _prepared, Now())
    return made


@pytest.mark.parametrize("driven", ["plan", "plan behind another registration"])
def test_a_robot_stands_for_what_it_was_placed_for(monkeypatch: pytest.MonkeyPatch, driven: str) -> None:
    """The registration may have been changed after the start was asked for, and changed back since."""
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    drive: Drive = SharedDrive()
    drive.open("plan", lambda tell: replace(_prepared(), made_of=driven), Now())
    assert drive.is_for(driven)
    assert drive.is_for("plan") is (driven == "plan")


def test_a_start_that_another_one_replaced_is_told_so_and_shows_no_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    drive: Drive = SharedDrive()
    later, tells = Later(), list[Tell]()

    def prepared(tell: Tell) -> PreparedRehearsal:
        tells.append(tell)
        tell(f"start {len(tells)}")
        return _prepared()

    drive.open("plan", prepared, later)
    drive.open("another plan", prepared, later)
    first, second = later.work
    first()  # it says how far it is while the second one is starting
    assert (drive.state, drive.read(ONE).words) == ("starting", "Starting …")
    second()
    assert drive.is_for("another plan")
    with pytest.raises(ControlError, match="not wanted any more"):
        tells[0]("half way")


def test_only_the_holder_moves_the_robot(drive: Drive) -> None:
    """HAZ-12: everything that another tab sends is ignored."""
    assert drive.lease.take(ONE)
    for tab in (TWO, ONE):
        drive.set_grip(tab, (1.0, 2.0, 3.0))
        drive.drive(tab, 1)
        drive.twist(tab, -1)
        drive.run(tab)
        drive.pause(tab)
        drive.reset(tab)
        drive.axes(tab, 0.5, 0.0, 0.0)
        drive.drag(tab, 1.0, 2.0, True)
        drive.master(tab, (1.0, 2.0, 3.0), True)
        drive.rate(tab, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
        drive.change_control(tab, Control("teleoperated"))
        drive.apply(tab, FREE)
        drive.change_settings(tab, {"margin_mm": 1.0})
        if tab == TWO:
            assert Process.last.told == []
    names = [name for name, *_ in Process.last.told]
    hand = ["set_grip", "drive", "twist", "run", "pause", "reset", "axes", "drag", "master", "rate"]
    assert names == [*hand, "control", "apply", "apply"]


def test_each_sign_of_the_holders_hand_makes_those_who_hear_it_prompt(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11: nobody else's does, nor what a click asks for."""
    heard: list[str] = []
    monkeypatch.setattr(shared_drive, "PROMPT_THREADS", SimpleNamespace(hear=lambda: heard.append("sign")))
    drive.lease.take(ONE)
    for tab in (TWO, ONE):
        drive.run(tab)
        assert heard == []
        drive.set_grip(tab, (1.0, 2.0, 3.0))
        drive.heartbeat(tab)
        drive.drive(tab, 1)
        drive.twist(tab, -1)
        drive.drag(tab, 1.0, 2.0, True)
        drive.master(tab, (1.0, 2.0, 3.0), True)
        drive.rate(tab, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
        assert len(heard) == (7 if tab == ONE else 0)
        drive.release(tab)
    assert len(heard) == 7


def test_a_target_is_named_by_its_id_and_must_be_one_that_is_driven() -> None:
    """The process has the targets of the plan that it was started for, in their order."""
    assert _prepared().target_index("t-2") == 1
    with pytest.raises(PlanError, match="not part of this rehearsal"):
        _prepared().target_index("p-1")


def test_everybody_reads_what_was_requested_last_of_the_robot_that_is_there(drive: Drive) -> None:
    drive.lease.take(ONE)
    drive.apply(ONE, FREE)
    drive.change_settings(ONE, {"margin_mm": 1.0})
    drive.apply(TWO, SetTask("path"))
    assert drive.read(TWO).requested is FREE
    drive.open("plan", _prepared, Now())
    assert drive.read(TWO).requested is None


def test_a_heartbeat_never_takes_hold(drive: Drive) -> None:
    """HAZ-11: only a press or a moved pointer does, whatever heartbeats come before, between and after."""
    drive.lease.take(ONE)
    drive.heartbeat(ONE)
    drive.set_grip(ONE, (1.0, 2.0, 3.0))
    drive.heartbeat(ONE)
    drive.release(ONE)
    drive.heartbeat(ONE)
    beat, grip = ("heartbeat",), ("set_grip", (1.0, 2.0, 3.0), False)
    assert Process.last.told == [beat, grip, beat, ("release",), beat]


def test_a_click_beside_the_grip_leaves_the_keys_alone(drive: Drive) -> None:
    drive.lease.take(ONE)
    drive.drive(ONE, 1)
    drive.release_grip(ONE)
    assert Process.last.told == [("drive", 1)]
    drive.set_grip(ONE, (1.0, 2.0, 3.0))
    drive.release_grip(ONE)
    assert Process.last.told[-1] == ("release",)


def _answer(drive: Drive, monkeypatch: pytest.MonkeyPatch, *events: Event) -> None:
    monkeypatch.setattr(Process, "events", lambda self: list(events))
    drive.check()
    monkeypatch.setattr(Process, "events", lambda self: [])


def _sent(drive: Drive) -> list[ControlSettings]:
    asked = [told[1] for told in Process.last.told if told[0] == "apply"]
    return [one.settings for one in asked if isinstance(one, SetSettings)]


def _in_force(drive: Drive) -> ControlSettings:
    settings = drive.read(ONE).settings
    assert isinstance(settings, ControlSettings)
    return settings


def _told(settings: ControlSettings) -> Event:
    return Event("settings", json.dumps(settings.to_dict()))


def test_a_setting_that_is_refused_is_not_shown_as_in_force(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said once, beside the slider, without a word of a start; what was wished meanwhile does not carry it."""
    drive.lease.take(ONE)
    old = _in_force(drive)
    drive.change_settings(ONE, {"margin_mm": 1.5})
    drive.change_settings(ONE, {"force_cap_n": 2.0})
    assert (drive.read(ONE).settings, len(_sent(drive))) == (old, 1)
    monkeypatch.setattr(Process, "snapshot", lambda self: SimpleNamespace(clearance_mm=0.35, certified=True))
    _answer(drive, monkeypatch, Event("note", "no such target"), Event("note", "would start too near"), _told(old))
    assert (drive.read(ONE).settings, drive.read(ONE).answered) == (old, 1)
    assert (
        drive.read(ONE).refusal
        == "Safety margin stays at 0.3 mm: the tool is 0.35 mm from bone here. Draw it back first."
    )
    assert (_sent(drive)[-1].margin_mm, _sent(drive)[-1].force_cap_n) == (old.margin_mm, 2.0)
    _answer(drive, monkeypatch, _told(_sent(drive)[-1]))
    assert (drive.read(ONE).refusal, _in_force(drive).force_cap_n) == ("", 2.0)
    assert drive.read(TWO, take_words=True).words_for_holder == ()
    assert drive.read(ONE, take_words=True).words_for_holder == ("no such target",)
    assert drive.read(ONE).accepted == {"force_cap_n": 2.0}
    with pytest.raises(InputError, match="no setting is called 'self'"):
        drive.change_settings(ONE, {"self": 1.0})


def test_settings_count_once_the_process_has_confirmed_them(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two changes in a row both hold, and each is handed to the plan until that has kept it."""
    drive.lease.take(ONE)
    drive.change_settings(ONE, {"margin_mm": 0.5})
    drive.change_settings(ONE, {"force_cap_n": 2.0})
    for number in (1, 2):
        assert len(_sent(drive)) == number
        _answer(drive, monkeypatch, _told(_sent(drive)[-1]))
    now = drive.read(ONE)
    assert (_in_force(drive).margin_mm, _in_force(drive).force_cap_n, now.answered) == (0.5, 2.0, 2)
    assert drive.read(TWO).accepted == {}
    assert drive.read(ONE).accepted == {"margin_mm": 0.5, "force_cap_n": 2.0}
    drive.kept({"margin_mm": 0.4, "force_cap_n": 2.0})
    assert drive.read(ONE).accepted == {"margin_mm": 0.5}, "changed again while it was being kept"


def test_a_process_that_does_not_read_is_sent_one_change_of_the_settings(drive: Drive) -> None:
    """A pipe that nobody empties never fills, however long the slider is moved."""
    drive.lease.take(ONE)
    for n in range(1000):
        drive.change_settings(ONE, {"margin_mm": 0.3 + 1e-3 * n})
    assert len(_sent(drive)) == 1


def test_a_change_that_could_not_be_sent_is_not_waited_for(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(process: Process, request: Request) -> None:
        raise ControlError("the control process does not answer")

    drive.lease.take(ONE)
    monkeypatch.setattr(Process, "apply", refuse, raising=False)
    with pytest.raises(ControlError, match="does not answer"):
        drive.change_settings(ONE, {"margin_mm": 0.5})
    monkeypatch.undo()
    drive.change_settings(ONE, {"force_cap_n": 2.0})
    (sent,) = _sent(drive)
    assert (sent.margin_mm, sent.force_cap_n) == (_in_force(drive).margin_mm, 2.0)


def test_a_process_that_hangs_is_told_and_can_be_ended(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-10: the age of its newest snapshot tells it; one that wakes up again is shown again."""
    for silence, state in ((0.1, "ready"), (2.5, "silent"), (7.0, "silent"), (0.0, "ready"), (60.0, "silent")):
        monkeypatch.setattr(Process, "silence_s", silence)
        drive.check()
        assert drive.state == state
        assert (f"has not answered for {silence:.0f} s" in drive.read(ONE).words) == (state == "silent")
    drive.close()
    assert (drive.state, Process.last.alive) == ("absent", False)


def test_a_process_that_ends_with_a_word_passes_it_on(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    _answer(drive, monkeypatch, Event("failed", "out of memory"))
    assert (drive.state, drive.read(ONE).words) == ("failed", "out of memory")


def test_a_hand_is_forgotten_with_the_process_it_held(drive: Drive) -> None:
    """HAZ-11: a plan edited in the middle of a drag leaves no hand behind for the next holder or the next process."""
    for end in (drive.close, lambda: drive.open("plan", _prepared, Now()), lambda: drive.leave(ONE)):
        drive.open("plan", _prepared, Now())
        drive.lease.take(ONE)
        drive.set_grip(ONE, (1.0, 2.0, 3.0))
        end()
        drive.release(ONE)
        drive.lease.let_go(ONE)
        drive.open("plan", _prepared, Now())
        drive.lease.take(TWO)
        drive.drive(TWO, 1)
        drive.heartbeat(TWO)
        assert Process.last.told == [("drive", 1), ("heartbeat",)]
        drive.lease.let_go(TWO)


def test_a_hand_that_was_let_go_of_has_to_take_hold_again(drive: Drive) -> None:
    """HAZ-11: a drag goes on in a scene that missed the release; its moves are no hand."""
    drive.lease.take(ONE)
    drive.set_grip(ONE, (1.0, 2.0, 3.0))
    drive.set_grip(ONE, (2.0, 2.0, 3.0), takes_hold=False)
    drive.release_grip(ONE)
    drive.set_grip(ONE, (9.0, 9.0, 9.0), takes_hold=False)
    drive.heartbeat(ONE)
    assert Process.last.told == [
        ("set_grip", (1.0, 2.0, 3.0), False),
        ("set_grip", (2.0, 2.0, 3.0), False),
        ("release",),
        ("heartbeat",),
    ]


def test_a_page_that_comes_back_finds_the_drive_of_its_plan() -> None:
    """A drive that was given away meanwhile leaves no orphan: the page and the newcomer share one."""
    drives: SharedDrives[PreparedRehearsal, RigidSnapshot] = SharedDrives()
    first = drives.enter(PLAN, ONE)
    assert drives.enter(PLAN, TWO) is first
    drives.leave(first, ONE)
    drives.leave(first, TWO)
    assert drives.enter(PLAN, ONE) is drives.enter(PLAN, TWO) is not first


def test_a_window_that_enters_while_the_last_one_leaves_keeps_its_robot(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    drives: SharedDrives[PreparedRehearsal, RigidSnapshot] = SharedDrives()
    close = SharedDrive.close
    left, entered = drives.enter(PLAN, ONE), list[Drive]()

    def close_late(closing: Drive) -> None:
        if not entered:
            entered.append(drives.enter(PLAN, TWO))
            entered[0].open("plan", _prepared, Now())
        close(closing)

    monkeypatch.setattr(SharedDrive, "close", close_late)
    drives.leave(left, ONE)
    assert entered[0].state == "ready"
    assert drives.enter(PLAN, THREE) is entered[0]


def test_the_holder_is_told_that_a_drive_is_not_recorded_any_more(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-26: it is no answer to a setting that is on its way, and the drive goes on."""
    drive.lease.take(ONE)
    drive.change_settings(ONE, {"margin_mm": 1.5})
    _answer(drive, monkeypatch, Event("unrecorded", "the run cannot be written: No space left on device"))
    (words,) = drive.read(ONE, take_words=True).words_for_holder
    assert "not recorded any more" in words
    assert "No space left" in words
    assert (drive.state, drive.read(ONE).refusal) == ("ready", "")
    shown = [rehearsal_section(drive.read(client))["unrecorded"] for client in (ONE, TWO)]
    assert shown == ["the run cannot be written: No space left on device"] * 2, "also to those who watch, and it stays"


def test_a_run_that_cannot_be_finished_is_told_when_the_drive_has_ended(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rest of it is written, and it gets its name, once its process has ended."""
    drive.lease.take(ONE)
    process = drive._live()
    late = [Event("unrecorded", "the run cannot be written: No space left on device")]
    monkeypatch.setattr(process, "events", lambda: [] if process.alive else late, raising=False)
    drive.close()
    (words,) = drive.read(ONE, take_words=True).words_for_holder
    assert words.startswith("This drive is not recorded any more: the run cannot be written: No space left on device.")
    assert rehearsal_section(drive.read(ONE))["unrecorded"] is None, "there is no drive"


def test_a_process_that_ends_while_another_is_coming_does_not_end_that_one(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One window resets while another one hears the process that is being replaced."""
    started: list[Any] = []
    later: Any = SimpleNamespace(submit=lambda work, *values: started.append(lambda: work(*values)))

    def events(process: Process) -> list[Any]:
        if not process.alive:  # the rest of its run is written
            return []
        drive.open("plan", _prepared, later)
        return [Event("failed", "ended")]

    monkeypatch.setattr(Process, "events", events)
    drive.check()
    assert (drive.state, drive.is_for("plan")) == ("starting", True)
    started[0]()
    assert (drive.state, Process.last.alive) == ("ready", True)


def test_two_windows_that_listen_at_once_hear_the_reason_of_a_refusal(
    drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The note is heard by one thread and the answer it belongs to by the next, in this order."""
    drive.lease.take(ONE)
    drive.change_settings(ONE, {"margin_mm": 1.5})
    said = [[Event("note", "the tube is narrow")], [_told(_in_force(drive))]]
    other = Beside(lambda: drive.check())

    def events(process: Process) -> list[Event]:
        heard = said.pop(0) if said else []
        if threading.current_thread() is not other.thread:
            other.begin()
        return heard

    monkeypatch.setattr(drive, "_checking", other, raising=False)
    monkeypatch.setattr(Process, "events", events)
    drive.check()
    other.thread.join(20)
    assert drive.read(ONE).refusal == "Safety margin stays at 0.3 mm: the tube is narrow"
    assert drive.read(ONE, take_words=True).words_for_holder == ()


def test_a_page_that_leaves_lets_go(drive: Drive) -> None:
    drive.lease.take(ONE)
    drive.set_grip(ONE, (1.0, 2.0, 3.0))
    drive.leave(ONE)
    assert Process.last.told[-1] == ("release",)
    assert drive.lease.take(TWO)


def test_settings_out_of_their_range_are_refused(drive: Drive) -> None:
    """HAZ-05: whatever a slider is made to say; nothing of it reaches the process, not even clamped."""
    drive.lease.take(ONE)
    with pytest.raises(InputError, match=r"Safety margin \(margin_mm\) is -5; allowed is 0.05 … 3 mm"):
        drive.change_settings(ONE, {"force_cap_n": 2.0, "margin_mm": -5.0})
    with pytest.raises(InputError, match="force_cap_n"):
        drive.change_settings(ONE, {"force_cap_n": 1e6})
    assert _sent(drive) == []
    low = ControlSettings.bounds()["margin_mm"].low
    drive.change_settings(ONE, {"margin_mm": low * (1.0 - 1e-12)})  # as a browser rounds
    (settings,) = _sent(drive)
    assert settings.margin_mm == low


def test_a_drive_says_why_it_could_not_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    monkeypatch.setattr(Process, "refuses", True)
    drive: Drive = SharedDrive()
    drive.open("plan", _prepared, Now())
    assert drive.state == "failed"
    assert "does not fit" in drive.read(ONE).words
    assert not Process.last.alive


def test_a_start_that_compiles_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    drive: Drive = SharedDrive()
    said: list[str] = []

    def wait_ready(process: Process, heard: Callable[[int], None]) -> None:
        for count in (3, 40):
            heard(count)
            said.append(drive.read(ONE).words)

    monkeypatch.setattr(Process, "wait_ready", wait_ready)
    drive.open("plan", _prepared, Now())
    assert said == ["First start: compiling, 3 parts done.", "First start: compiling, 40 parts done."]
    assert (drive.state, drive.read(ONE).words) == ("ready", "")


def test_a_start_that_is_not_wanted_any_more_is_ended_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It does not go on for its two minutes behind the back of the next one."""
    monkeypatch.setattr(drive_process, "ControlProcess", Process)
    drive: Drive = SharedDrive()
    ended: list[bool] = []

    def wait_ready(process: Process, **_: Any) -> None:
        drive.close()
        ended.append(not process.alive)
        raise ControlError("the control process ended before it was ready")

    monkeypatch.setattr(Process, "wait_ready", wait_ready)
    drive.open("plan", _prepared, Now())
    assert (ended, drive.state) == ([True], "absent")


def test_a_control_process_that_ends_is_noticed(drive: Drive) -> None:
    Process.last.alive = False
    drive.check()
    assert drive.state == "failed"
    assert "ended" in drive.read(ONE).words


def test_a_role_says_what_a_client_may_do(drive: Drive) -> None:
    """Who instructs changes mode and settings of a robot that another drives; who watches changes nothing."""
    teacher, watcher = Client("teacher", "instructs"), Client("watcher", "watches")
    drive.lease.take(ONE)
    for client in (watcher, teacher):
        assert not drive.lease.take(client)
        drive.set_grip(client, (1.0, 2.0, 3.0))
        drive.drive(client, 1)
        drive.run(client)
        drive.reset(client)
        drive.apply(client, FREE)
        drive.change_settings(client, {"margin_mm": 1.0})
        told = [name for name, *_ in Process.last.told]
        assert told == ([] if client is watcher else ["apply", "apply"])
    assert drive.lease.holder == ONE


def test_whoever_watches_comments_on_a_drive_that_is_recorded(
    drive: Drive, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """At the time and the step that the process is at; every client reads it."""
    with pytest.raises(ControlError, match="recorded"):
        drive.comment("nothing is driven")
    recorded: Any = SimpleNamespace(comments=LiveComments(tmp_path / "run"))
    monkeypatch.setattr(Process, "snapshot", lambda process: SimpleNamespace(t=1.25))
    monkeypatch.setattr(Process, "recorded", 625, raising=False)
    monkeypatch.setattr(drive_process, "RecordedProcess", Process)
    drive.open("plan", lambda tell: replace(_prepared(), recording=recorded), Now())
    drive.comment("  Slower  ")
    for client in (ONE, Client("watcher", "watches")):
        (one,) = drive.read(client).comments
        assert (one.text, one.t_s, one.step) == ("Slower", 1.25, 625)
    with pytest.raises(InputError, match="control character"):
        drive.comment("a\nb")
    drive.close()
    assert drive.read(ONE).comments == ()


def test_a_comment_at_the_moment_of_closing_is_refused(
    drive: Drive, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A closed process has no steps any more: the comment would stand before the first one."""
    comments = LiveComments(tmp_path / "run")
    recorded: Any = SimpleNamespace(comments=comments)

    def closing(process: Process) -> int:
        drive.close()
        return 0

    monkeypatch.setattr(Process, "snapshot", lambda process: SimpleNamespace(t=1.25))
    monkeypatch.setattr(Process, "recorded", property(closing), raising=False)
    monkeypatch.setattr(drive_process, "RecordedProcess", Process)
    drive.open("plan", lambda tell: replace(_prepared(), recording=recorded), Now())
    with pytest.raises(ControlError, match="in Review"):
        drive.comment("just now")
    assert comments.all == ()
