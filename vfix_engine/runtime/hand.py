"""The operator's newest input as it is sent to the control process, and the command that the loop derives from it."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from .command import NO_AXES, Command
from .system import Grip
from .virtual_coupling import NOBODY, Hold, VirtualCoupling

INPUT_BYTES = 512


@dataclass(frozen=True)
class HandInput:
    """Newest state of the operator's input: grip (3) in LPS mm, its count of moves, keys, axes, buttons, their holds.

    axes: camera x, camera y and insertion, from -1 to +1; see ``Command``.
    """

    grip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moves: int = 0
    drive: int = 0
    twist: int = 0
    hand: Hold = NOBODY
    keys: Hold = NOBODY
    axes: tuple[float, float, float] = NO_AXES
    buttons: int = 0
    stick: Hold = NOBODY

    def active(self, now: float) -> bool:
        """Whether any input has an effect."""
        return self.hand.active(now) or self.keys.active(now) or self.stick.active(now)

    def lost(self, now: float) -> bool:
        """Whether an input that was not released has timed out."""
        return self.hand.lost(now) or self.keys.lost(now) or self.stick.lost(now)

    def to_bytes(self) -> bytes:
        """Pack for the shared memory; the inverse is ``from_bytes``."""
        return _ENCODER.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> HandInput:
        """Unpack the result of ``to_bytes``; raises msgspec's errors for other data."""
        return _HAND.decode(data)


class Hand:
    """Input state in the loop: dead man's switch and virtual coupling give the command of a step."""

    def __init__(self) -> None:
        self.input = HandInput()
        self._coupling = VirtualCoupling()

    def hear(self, news: HandInput, now: float) -> None:
        """Receive a newer input state."""
        before, self.input = self.input, news
        if news.moves != before.moves:
            self._coupling.move(np.array(news.grip), now, onwards=before.hand.active(now))

    def command(self, grip: Grip | None, now: float) -> Command:
        """Return the present command, attenuated by the dead man's switch (HAZ-11)."""
        hand = self.input
        if grip is None:
            force = np.zeros(3)
        else:
            force = hand.hand.share(now) * self._coupling.force(grip.position, grip.stiffness, grip.cap, now)
        keys = hand.keys.share(now)
        if hand.stick.share(now) == 0.0:
            return Command(force, keys * hand.drive, keys * hand.twist)
        stick = hand.stick.share(now)
        x, y, insert = hand.axes
        axes = (stick * x, stick * y, stick * insert)
        return Command(force, keys * hand.drive, keys * hand.twist, None, axes, hand.buttons)


_ENCODER = msgspec.msgpack.Encoder()
_HAND = msgspec.msgpack.Decoder(HandInput)
