"""The operator's newest input as it crosses to the control process, and the command that a loop makes of it."""

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
    """The newest state of the hand: grip (3) in LPS mm, its moves so far, keys, axes and buttons, and the hold on each.

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
        """Somebody drives."""
        return self.hand.active(now) or self.keys.active(now) or self.stick.active(now)

    def lost(self, now: float) -> bool:
        """Something that nobody let go of was not heard of for so long that it no longer counts."""
        return self.hand.lost(now) or self.keys.lost(now) or self.stick.lost(now)

    def to_bytes(self) -> bytes:
        """Packed for the shared memory, as ``from_bytes`` reads it."""
        return _ENCODER.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> HandInput:
        """What ``to_bytes`` packed; msgspec's errors where it is something else."""
        return _HAND.decode(data)


class Hand:
    """The hand as the loop hears of it: the dead man's switch and the virtual coupling give the command of a step."""

    def __init__(self) -> None:
        self.input = HandInput()
        self._coupling = VirtualCoupling()

    def hear(self, news: HandInput, now: float) -> None:
        """A newer state of the hand."""
        before, self.input = self.input, news
        if news.moves != before.moves:
            self._coupling.move(np.array(news.grip), now, onwards=before.hand.active(now))

    def command(self, grip: Grip | None, now: float) -> Command:
        """The command of this moment, decayed (HAZ-11)."""
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
