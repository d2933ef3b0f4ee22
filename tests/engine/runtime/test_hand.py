"""Channels of the hand in every control mode: what a channel does, and that it lets go by itself (HAZ-05, HAZ-11)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from vfix_engine.runtime import Command, Control, Grip
from vfix_engine.runtime.hand import INPUT_BYTES, STALE_S, Hand, HandInput, Six
from vfix_engine.runtime.loop import ControlLoop
from vfix_engine.runtime.virtual_coupling import GONE_S

AXES = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # of a device: its x is the patient's y, and so on
GRIP = Grip(np.zeros(3), 0.25, 5.0, AXES)
RIGHT: Six = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
TURN: Six = (0.0, 0.0, 0.0, 0.2, 0.4, 0.6)

Change = Callable[[HandInput, float], HandInput]


class Device:
    """A hand in the loop that hears a change at 60 Hz and the heartbeat."""

    def __init__(self, control: Control) -> None:
        self.hand, self.now = Hand(control), 10.0

    def hear(self, change: Change) -> None:
        self.hand.hear(change(self.hand.input, self.now), self.now)

    def run(self, seconds: float, beat: bool = True, change: Change | None = None) -> list[Command]:
        """Commands at 500 Hz; ``change``: heard at 60 Hz."""
        found = []
        for tick in range(round(seconds / 0.002)):
            self.now += 0.002
            if beat and tick % 15 == 0:
                self.hear(HandInput.beaten)
            if change is not None and tick % 8 == 0:
                self.hear(change)
            found.append(self.hand.command(GRIP, self.now))
        return found


def rated(six: Six) -> Change:
    return lambda hand, now: hand.deflected(six, now)


def led(device: Device, way: np.ndarray, seconds: float) -> list[Command]:
    """A master that moves evenly by ``way``, with its clutch closed."""
    begin, start = device.now, np.array(device.hand.input.master)

    def onwards(hand: HandInput, now: float) -> HandInput:
        x, y, z = (start + way * (now - begin) / seconds).tolist()
        return hand.led((x, y, z), True, now)

    return device.run(seconds, change=onwards)


def total(commands: list[Command]) -> np.ndarray:
    """The way (3,) that a master has led."""
    return np.sum([one.master.increment for one in commands if one.master is not None], axis=0)


def test_a_master_leads_by_what_it_moves_and_stops_where_it_stops() -> None:
    device = Device(Control("teleoperated"))
    commands = led(device, np.array([3.0, -2.0, 1.0]), 0.5) + device.run(0.2)
    np.testing.assert_allclose(total(commands), [3.0, -2.0, 1.0], atol=0.1)
    assert not total(device.run(0.3)).any()
    assert max(np.abs(one.master.increment).max() for one in commands if one.master) < 0.05, (
        "it glides between messages"
    )


def test_a_master_moves_nothing_while_its_clutch_is_open_or_nothing_is_heard_of_it() -> None:
    device = Device(Control("teleoperated"))
    led(device, np.array([3.0, 0.0, 0.0]), 0.5)
    device.hear(lambda hand, now: hand.led((3.0, 0.0, 0.0), False, now))
    device.hear(lambda hand, now: hand.led((40.0, 0.0, 0.0), False, now))
    commands = device.run(0.3)
    assert not total(commands).any()
    assert all(one.master is not None and not one.master.clutch for one in commands)
    led(device, np.array([1.0, 0.0, 0.0]), 0.2)
    gone = device.run(0.4, beat=False)
    assert all(one.master is not None and not one.master.clutch for one in gone[round(GONE_S / 0.002) + 1 :])
    assert device.hand.input.lost(device.now)


def test_the_handle_is_a_master_in_teleoperation_and_a_spring_in_hands_on() -> None:
    def dragged(place: float) -> Change:
        return lambda hand, now: HandInput((place, 0.0, 0.0), hand.moves + 1, hand=hand.hand.press(now))

    for control, led_by, force in ((Control("teleoperated"), 8.0, 0.0), (Control("hands-on"), 0.0, 2.5)):
        device = Device(control)
        device.hear(dragged(2.0))
        commands = device.run(0.1)
        device.hear(dragged(10.0))
        commands += device.run(0.2)
        np.testing.assert_allclose(total(commands) + np.zeros(3), [led_by, 0.0, 0.0], atol=1e-9)
        np.testing.assert_allclose(commands[-1].force, [force, 0.0, 0.0])


def test_a_rate_device_pushes_in_its_own_axes_and_only_in_teleoperation_as_a_rate() -> None:
    for control, rate in ((Control("teleoperated", "rate"), True), (Control("hands-on"), False)):
        device = Device(control)
        last = device.run(0.3, change=rated(RIGHT))[-1]
        np.testing.assert_allclose(last.force, 0.5 * GRIP.cap * AXES[:, 0])
        assert (last.rate, last.master) == (rate, None)
    device = Device(Control("teleoperated", "rate"))
    np.testing.assert_allclose(device.run(0.3, change=rated(TURN))[-1].axes, AXES @ [0.2, 0.4, 0.6])
    device = Device(Control("freehand"))
    turned = device.run(0.3, change=rated(TURN))[-1]
    np.testing.assert_allclose((*turned.axes, turned.twist), (0.4, -0.2, 0.0, 0.6), atol=1e-12)


def test_a_handle_that_is_held_aside_is_a_rate() -> None:
    """As a joystick: by how far it was dragged from where it was pressed, wherever the tool has gone since."""
    device = Device(Control("teleoperated", "rate"))
    for place in (100.0, 108.0):
        device.hear(lambda hand, now, at=place: HandInput((at, 0.0, 0.0), hand.moves + 1, hand=hand.hand.press(now)))  # type: ignore[misc]
        commands = device.run(0.3)
    np.testing.assert_allclose(commands[-1].force, [2.0, 0.0, 0.0])
    assert commands[-1].rate


@pytest.mark.parametrize("control", [Control("teleoperated", "rate"), Control("hands-on"), Control("freehand")])
def test_an_unplugged_device_lets_go_though_a_button_is_held(control: Control) -> None:
    """Heartbeats of another input do not sustain a deflection that nobody tells any more."""
    device = Device(control)
    device.run(0.3, change=rated(RIGHT))
    late = device.run(STALE_S + GONE_S + 0.05)
    assert np.linalg.norm(late[0].force) > 2.0
    assert not late[-1].force.any()
    device = Device(control)
    device.run(0.3, change=rated(RIGHT))
    gone = device.run(GONE_S + 0.01, beat=False)
    assert not gone[-1].force.any()
    device = Device(control)
    device.run(0.3, change=rated(RIGHT))
    assert not device.run(0.15, change=rated((0.0,) * 6))[-1].force.any(), "six zeros release it"  # type: ignore[arg-type]


def test_a_change_of_mode_makes_no_jump() -> None:
    device = Device(Control("hands-on"))
    led(device, np.array([30.0, 0.0, 0.0]), 0.3)
    device.hear(
        lambda hand, now: HandInput((25.0, 0, 0), 7, hand=hand.hand.press(now), master=hand.master, leads=hand.leads)
    )
    device.run(0.1)
    device.hand.choose(Control("teleoperated"), device.now)
    assert not total(device.run(0.1)).any()
    device.hand.choose(Control("teleoperated", "rate"), device.now)
    assert not device.run(0.1)[-1].force.any(), "the handle's rest is where it was at the change"
    device.hand.choose(Control("hands-on"), device.now)
    np.testing.assert_allclose(device.run(0.1)[-1].force, [5.0, 0.0, 0.0])


@pytest.mark.parametrize("channel", ["master", "grip"])
def test_a_hold_that_ended_and_began_again_between_two_reads_leads_nothing(channel: str) -> None:
    """The mailbox has the newest state alone: an open clutch, or a grip let go, is told by the number of the hold."""

    def press(hand: HandInput, y: float, now: float) -> HandInput:
        return hand.led((0.0, y, 0.0), True, now) if channel == "master" else _pressed(hand, y, now)

    device = Device(Control("teleoperated"))
    device.hear(lambda hand, now: press(hand, 0.0, now))
    device.run(0.2)
    device.hear(lambda hand, now: press(hand.released(now), 40.0, now + 0.001))
    assert np.abs(total(device.run(0.2))).max() == 0.0
    device.hear(lambda hand, now: press(hand, 41.0, now))
    assert total(device.run(0.2))[1] == pytest.approx(1.0), "the same hold leads"


def test_what_a_master_moved_during_a_pause_leads_nothing() -> None:
    """While it is paused the loop asks for no command; it goes on from where the master is then."""
    device = Device(Control("teleoperated"))
    led(device, np.array([0.0, 1.0, 0.0]), 0.3)
    for _ in range(20):  # a pause: heard, but nothing asked for
        device.now += 0.016
        device.hear(lambda hand, now: hand.led((0.0, 1.0 + 1.5 * (now - 10.3), 0.0), True, now))
    device.now += 0.06
    device.hear(HandInput.beaten)
    device.hand.go_on(device.now)
    assert np.abs(total(device.run(0.1))).max() == 0.0
    assert total(led(device, np.array([0.0, 2.0, 0.0]), 0.3) + device.run(0.1))[1] == pytest.approx(2.0, abs=0.1)


def test_the_loop_goes_on_from_where_the_hand_is() -> None:
    went: list[float] = []
    loop = object.__new__(ControlLoop)
    loop._running = False
    loop._hand = SimpleNamespace(go_on=went.append)  # type: ignore[assignment]
    loop._publish = lambda force: None  # type: ignore[assignment, method-assign, misc]
    for message, count in (("run", 1), ("run", 1), ("pause", 1), ("run", 2)):
        loop._do(message)
        assert len(went) == count, message


def _pressed(hand: HandInput, y: float, now: float) -> HandInput:
    return replace(hand, grip=(0.0, y, 0.0), moves=hand.moves + 1, hand=hand.hand.press(now))


def test_keys_drive_in_every_mode() -> None:
    for control in (Control("hands-on"), Control("teleoperated"), Control("teleoperated", "rate"), Control("freehand")):
        device = Device(control)
        device.hear(lambda hand, now: HandInput(drive=1, twist=-1, keys=hand.keys.press(now)))
        last = device.run(0.1)[-1]
        assert (last.drive, last.twist, last.rate) == (1.0, -1.0, control.mode == "teleoperated")


def test_all_channels_at_once_fit_into_the_mailbox() -> None:
    hand = HandInput((1e5 / 3,) * 3, 2**53, -1, 1, axes=(0.1,) * 3, master=(1e5 / 7,) * 3, rate=(0.1,) * 6, leads=2**53)
    hand = hand.led((1.0, 2.0, 3.0), True, 1e6 / 3).deflected((-0.3,) * 6, 1e6 / 7)
    assert HandInput.from_bytes(hand.to_bytes()) == hand
    assert len(hand.to_bytes()) < INPUT_BYTES - 100
