"""The operator's newest input as it is sent to the control process, and the command that the loop derives from it.

There are seven channels, each with a dead man's switch of its own: the hand on the grip, keys, the axes of a snake, a
drag and a wheel in its picture, a master device and a rate device. What a channel does depends on the control mode:
the hand's motion is a force in hands-on and the motion of a master in teleoperation, a deflection is a force or a rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from ..arrays import Array
from .camera_hand import CameraDrag, DrivenCamera, Way, WheelDepth
from .command import NO_AXES, Command, Master
from .control_mode import FREEHAND, TELEOPERATED, Control
from .system import Grip
from .virtual_coupling import NOBODY, Glide, Hold, VirtualCoupling

INPUT_BYTES = 1024
SIX_ZEROS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STALE_S = 0.25  # after the last deflection heartbeats no longer sustain it: the device was unplugged

_AT_REST = np.zeros(3)  # of a device that nobody deflects
_AT_REST.setflags(write=False)

Place = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class HandInput:
    """Newest state of the operator's input: grip (3) in LPS mm, its count of moves, keys, axes, buttons, their holds.

    axes: camera x, camera y and insertion, from -1 to +1; see ``Command``.
    turns: a hand on the grip turns the tool about its tip, where the mode has that, and does not move it.
    master: (3) in LPS mm, sum of a master's motions so far, clutch: it is coupled, leads: count of its messages; lead:
    its hold.
    rate: a rate device's deflection (translations, then rotations) in the frame of ``Grip.axes``, from -1 to +1;
    rated_at: when it was told last; deflect: its hold.
    dragging: a drag in the picture goes on, the newest one, number ``drags``; drag_from: the way that was told as it
    began, dragged: the way since, in mm to the right and down that the camera is to go; pull: its hold.
    depths: count of the depths that a wheel wanted; depth_mm: the newest one; wheel: its hold.
    """

    grip: Place = (0.0, 0.0, 0.0)
    moves: int = 0
    drive: int = 0
    twist: int = 0
    hand: Hold = NOBODY
    keys: Hold = NOBODY
    axes: Place = NO_AXES
    buttons: int = 0
    stick: Hold = NOBODY
    master: Place = (0.0, 0.0, 0.0)
    clutch: bool = False
    leads: int = 0
    lead: Hold = NOBODY
    rate: Six = SIX_ZEROS
    rated_at: float = 0.0
    deflect: Hold = NOBODY
    turns: bool = False
    dragging: bool = False
    drags: int = 0
    drag_from: Way = (0.0, 0.0)
    dragged: Way = (0.0, 0.0)
    pull: Hold = NOBODY
    depths: int = 0
    depth_mm: float = 0.0
    wheel: Hold = NOBODY

    @property
    def _holds(self) -> tuple[Hold, ...]:
        return self.hand, self.keys, self.stick, self.lead, self.deflect, self.pull, self.wheel

    def active(self, now: float) -> bool:
        """Whether any input has an effect."""
        return any(hold.active(now) for hold in self._holds)

    def lost(self, now: float) -> bool:
        """Whether an input has timed out that was not released and has to be pressed anew.

        A drag and a wheel in the picture are told again while they are held.
        """
        return any(hold.lost(now) for hold in self._holds[:5])

    def beaten(self, now: float) -> HandInput:
        """After a heartbeat; a deflection that was not told again for long is not sustained by it."""
        fresh = now - self.rated_at < STALE_S
        return replace(
            self,
            hand=self.hand.beat(now),
            keys=self.keys.beat(now),
            stick=self.stick.beat(now),
            lead=self.lead.beat(now),
            deflect=self.deflect.beat(now) if fresh else self.deflect,
            pull=self.pull.beat(now),
            wheel=self.wheel.beat(now),
        )

    def released(self, now: float) -> HandInput:
        """With every channel released."""
        hand, keys, stick, lead, deflect = (hold.release(now) for hold in self._holds[:5])
        return replace(
            self, drive=0, twist=0, clutch=False, hand=hand, keys=keys, stick=stick, lead=lead, deflect=deflect,
            dragging=False, pull=NOBODY, wheel=NOBODY,
        )  # fmt: skip

    def led(self, position: Place, clutch: bool, now: float) -> HandInput:
        """After a message of a master; with an open clutch it is released."""
        lead = self.lead.press(now) if clutch else self.lead.release(now)
        return replace(self, master=position, clutch=clutch, leads=self.leads + 1, lead=lead)

    def pulled(self, way: Way, held: bool, now: float) -> HandInput:
        """After a message of a drag in the picture: its way so far, of which the newest one counts, and whether it is
        held. Where nobody holds it, it moves nothing any more, also not what was left of its way.
        """
        if not held:
            return replace(self, dragging=False, pull=NOBODY)
        start = self.drag_from if self.dragging else way
        return replace(
            self, dragging=True, drags=self.drags + (not self.dragging), drag_from=start,
            dragged=(way[0] - start[0], way[1] - start[1]), pull=self.pull.press(now),
        )  # fmt: skip

    def wheeled(self, depth_mm: float, held: bool, now: float) -> HandInput:
        """After a message of a wheel: the depth that it wants, and whether that still counts."""
        if not held:
            return replace(self, wheel=NOBODY)
        other = depth_mm != self.depth_mm or self.wheel == NOBODY
        return replace(self, depths=self.depths + other, depth_mm=depth_mm, wheel=self.wheel.press(now))

    def deflected(self, rate: Six, now: float) -> HandInput:
        """After a message of a rate device; six zeros release it. Clipped to ±1; a non-finite value is 0 (HAZ-05)."""
        x, y, z, turn_x, turn_y, turn_z = (share(value) for value in rate)
        rate = x, y, z, turn_x, turn_y, turn_z
        deflect = self.deflect.press(now) if any(rate) else self.deflect.release(now)
        return replace(self, rate=rate if any(rate) else self.rate, rated_at=now, deflect=deflect)

    def to_bytes(self) -> bytes:
        """Pack for the shared memory; the inverse is ``from_bytes``."""
        return _ENCODER.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> HandInput:
        """Unpack the result of ``to_bytes``; raises msgspec's errors for other data."""
        return _HAND.decode(data)


class Hand:
    """Input state in the loop: dead man's switches, virtual coupling and control mode give the command of a step."""

    def __init__(self, control: Control | None = None) -> None:
        self.input, self.control = HandInput(), control or Control()
        self._coupling = VirtualCoupling()
        self._master = Glide()
        self._drag, self._wheel = CameraDrag(), WheelDepth()
        self._pressed_at = np.zeros(3)  # of the grip, where its present hold began
        self._led = np.zeros(3), np.zeros(3)  # places of grip and master up to where they have led

    def hear(self, news: HandInput, now: float) -> None:
        """Receive a newer input state at ``now`` in s of the monotonic clock.

        Only the newest one is heard: a hold that ended and began again since the last one is told by its number.
        """
        before, self.input = self.input, news
        if news.moves != before.moves:
            onwards = before.hand.active(now) and news.hand.number == before.hand.number
            self._coupling.move(np.array(news.grip), now, onwards)
            if not onwards:
                self._pressed_at = self._coupling.at(now)
                self._led = self._pressed_at, self._led[1]
        if news.leads != before.leads:
            onwards = before.clutch and before.lead.active(now) and news.lead.number == before.lead.number
            self._master.move(np.array(news.master), now, onwards)
            if not onwards:
                self._led = self._led[0], self._master.at(now)

    def choose(self, control: Control, now: float) -> None:
        """Another mode or device at ``now`` in s: what is held goes on from where it is, without a jump."""
        self.control = control
        self.go_on(now)

    def go_on(self, now: float) -> None:
        """After a time in which no command was asked for: what was moved meanwhile leads nothing."""
        self._pressed_at = self._coupling.at(now)
        self._led = self._coupling.at(now), self._master.at(now)
        self._drag.forget(self.input.drags, self.input.dragged)
        self._wheel.forget(self.input.depths)

    def command(self, grip: Grip | None, now: float, camera: DrivenCamera | None = None) -> Command:
        """Return the present command, attenuated by the dead man's switches (HAZ-11).

        camera: that a drag and a wheel in the picture move, where the world has one.
        """
        hand = self.input
        keys = hand.keys.share(now)
        drive, twist = keys * hand.drive, keys * hand.twist
        if grip is not None and self.control.mode == TELEOPERATED:
            if self.control.device == "rate" or keys > 0.0:
                self._led = self._coupling.at(now), self._master.at(now)
                return self._rated(grip, drive, twist, now)
            return Command(np.zeros(3), 0.0, twist, self._master_now(now))
        stick = hand.stick.share(now)
        x, y, insert = (stick * value for value in hand.axes)
        if grip is None:
            if camera is not None:
                x, y = self._drag.axes(camera, (x, y), hand.drags, hand.dragged, hand.pull.share(now))
                insert = self._wheel.axis(camera, insert, hand.depths, hand.depth_mm, hand.wheel.share(now))
            axes = (x, y, insert) if x or y or insert else NO_AXES
            return Command(np.zeros(3), drive, twist, None, axes, hand.buttons if stick else 0)
        pull = hand.hand.share(now) * self._coupling.force(grip.position, grip.stiffness, grip.cap, now)
        push, turns = self._deflection(now)
        if self.control.mode == FREEHAND:
            if hand.turns:
                turns, pull = turns + grip.axes.T @ _turned(grip, pull), np.zeros(3)
            x, y = x + float(turns[1]), y - float(turns[0])
        axes = (x, y, insert) if stick or turns.any() else NO_AXES
        force = pull if push is _AT_REST else pull + grip.cap * (grip.axes @ push)
        return Command(force, drive, twist + float(turns[2]), None, axes, hand.buttons if stick else 0)

    def _master_now(self, now: float) -> Master:
        """How far a master, or the hand on the grip as one, has moved since the last step; open where nobody leads."""
        hand = self.input
        increment, clutch = np.zeros(3), False
        places = self._coupling.at(now), self._master.at(now)
        coupled = hand.hand.share(now) > 0.0, hand.clutch and hand.lead.share(now) > 0.0
        for closed, place, before in zip(coupled, places, self._led, strict=True):
            if closed:
                increment, clutch = increment + place - before, True
        self._led = places
        return Master(increment, clutch)

    def _rated(self, grip: Grip, drive: float, twist: float, now: float) -> Command:
        """The deflection of a rate device as τ; a hand on the grip deflects it by as far as it was dragged."""
        if self.control.device != "rate":
            return Command(np.zeros(3), drive, twist, rate=True)
        push, turns = self._deflection(now)
        tau, turn = grip.cap * (grip.axes @ push), grip.axes @ turns
        dragged = self._coupling.force(self._pressed_at, grip.stiffness, grip.cap, now)
        dragged = self.input.hand.share(now) * dragged
        if self.input.turns:
            turn = turn + _turned(grip, dragged)
        else:
            tau = tau + dragged
        x, y, z = turn.tolist()
        return Command(tau, drive, twist, None, (x, y, z), rate=True)

    def _deflection(self, now: float) -> tuple[Array, Array]:
        """Translations (3,) and rotations (3,) of a rate device."""
        share_now = self.input.deflect.share(now)
        if not share_now:
            return _AT_REST, _AT_REST
        six = share_now * np.array(self.input.rate)
        return six[:3], six[3:]


def share(value: float) -> float:
    """Clip to -1 … +1; a non-finite value counts as 0 (HAZ-05)."""
    return min(max(float(value), -1.0), 1.0) if math.isfinite(value) else 0.0


def _turned(grip: Grip, force: Array) -> Array:
    """How a force at the grip turns the tool about its tip: (3,) about the patient's axes, 1 for the full force."""
    lever = float(np.linalg.norm(grip.lever))
    return np.cross(grip.lever, force) / (lever * grip.cap) if lever > 0.0 else np.zeros(3)


_ENCODER = msgspec.msgpack.Encoder()
_HAND = msgspec.msgpack.Decoder(HandInput)
