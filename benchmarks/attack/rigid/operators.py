"""Adversarial operators of the rigid tool: each returns a command for its state that might break a limit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.attack import campaign
from benchmarks.attack.campaign import NONSENSE, Random
from vfix_engine.arrays import Array
from vfix_engine.runtime.command import Command, Master
from vfix_engine.runtime.control_mode import DEVICES, HANDS_ON, TELEOPERATED, Control
from vfix_engine.runtime.hand import Hand, HandInput
from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.requests import SetControl
from vfix_engine.worlds.rigid.operators import to_nearest_bone
from vfix_engine.worlds.rigid.state import RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

LOOK_AGAIN = 8  # steps after which the nearest bone is searched again


@dataclass
class Memory(campaign.Memory):
    """What an operator remembers; held: whether the last step was, also after a change of the mode.

    hand, now: what the loop has heard of its devices, and the time.
    """

    held: bool = False
    direction: Array | None = None
    until: int = 0
    hand: Hand = field(default_factory=Hand)
    now: float = 0.0


Attack = campaign.Attack[Memory, RigidSystem, RehearsalState]


def _direction(random: Random) -> Array:
    vector = random.normal(size=3)
    return vector / float(np.linalg.norm(vector))


def _kept(memory: Memory, longest: int) -> Array:
    """Return a random direction that stays for a random number of steps."""
    if memory.direction is None or memory.count >= memory.until:
        memory.direction = _direction(memory.random)
        memory.until = memory.count + int(memory.random.integers(1, longest))
    return memory.direction


def _to_bone(memory: Memory, system: RigidSystem, state: RehearsalState) -> Array:
    """Return the direction to the nearest bone, searched every few steps."""
    if memory.direction is None or memory.count >= memory.until:
        memory.direction = to_nearest_bone(system, state)
        memory.until = memory.count + LOOK_AGAIN
    return memory.direction


def at_random(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Another force each step."""
    force = memory.random.normal(size=3) * 4.0
    return Act(Command(force, int(memory.random.integers(-1, 2)), int(memory.random.integers(-1, 2))))


def jumping(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """A constant force that jumps now and then."""
    return Act(Command(_kept(memory, 60) * 30.0, twist=int(memory.count // 40 % 3) - 1))


def saturated(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """A million newtons in one direction."""
    return Act(Command(_kept(memory, 150) * 1e6, drive=1))


def nonsense(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """NaN, infinite and huge values, and valid ones in between."""
    force = memory.random.choice(NONSENSE, size=3)
    return Act(Command(np.asarray(force, dtype=float), int(memory.random.choice((-1, 0, 1))), 1))


def towards_bone(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Full force into the nearest bone."""
    return Act(Command(_to_bone(memory, system, state) * 50.0))


def alternating(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Into bone and back out, every step."""
    sign = -1.0 if memory.count % 2 else 1.0
    return Act(Command(sign * _to_bone(memory, system, state) * 50.0, drive=int(sign), twist=int(-sign)))


def resonant(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Moves sideways as soon as it is stopped, and pushes in as soon as it is not."""
    inward = _to_bone(memory, system, state)
    if not memory.held:
        return Act(Command(inward * 20.0))
    aside = np.cross(inward, _direction(memory.random))
    return Act(Command(inward * 8.0 + aside * 12.0, twist=int(memory.random.integers(-1, 2))))


def into_corners(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Along the nearest bone and a little into it, until something else stops it."""
    inward = _to_bone(memory, system, state)
    aside = np.cross(inward, np.roll(inward, 1 + memory.count // 200 % 2) + 0.1)
    size = float(np.linalg.norm(aside))
    return Act(Command(inward * 3.0 + (aside / size if size > 1e-9 else aside) * 20.0))


def twisting(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Turns about the shaft, this way and that, leaning into bone."""
    return Act(Command(_to_bone(memory, system, state) * 2.0, twist=1 if memory.count // 25 % 2 else -1))


def flooding(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Everything at once, everything different each step."""
    size = 10.0 ** memory.random.uniform(-9, 9)
    drive, twist = (int(v) for v in memory.random.integers(-1, 2, size=2))
    return Act(Command(_direction(memory.random) * size, drive, twist))


def driving(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Along the path with full force and sideways at the same time, sometimes back."""
    return Act(Command(_kept(memory, 200) * 4.0, drive=-1 if memory.count // 120 % 4 == 3 else 1))


def master(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """A remote master that runs ahead, jumps, lets go and sends invalid values."""
    random, kind = memory.random, int(memory.random.integers(8))
    increment = _kept(memory, 40) * random.uniform(0, 0.3)
    if kind == 0:
        increment = _to_bone(memory, system, state) * random.uniform(0, 5)
    elif kind == 1:
        increment = _direction(random) * 10.0 ** random.uniform(-9, 9)
    elif kind == 2:
        increment = np.asarray(random.choice(NONSENSE, size=3), dtype=float)
    twist, clutch = int(random.integers(-1, 2)), bool(random.random() > 0.03)
    return Act(Command(np.zeros(3), twist=twist, master=Master(increment, clutch)))


def every_channel(memory: Memory, system: RigidSystem, state: RehearsalState) -> Act:
    """Grip, keys, master and rate device at once, each unplugged and back, the mode changed within a step."""
    random, hand, grip = memory.random, memory.hand, system.grip(state)
    memory.now += 0.3 if random.random() < 0.02 else float(random.choice((state.settings.dt_s, 0.016)))
    now = memory.now
    kind = int(random.integers(10))
    news: HandInput = hand.input.beaten(now) if random.random() < 0.7 else hand.input
    if kind <= 1:
        x, y, z = (grip.position + _to_bone(memory, system, state) * 10.0 ** random.uniform(0, 2)).tolist()
        news = replace(news, grip=(x, y, z), moves=news.moves + 1, hand=news.hand.press(now))
    elif kind <= 3:
        way = _kept(memory, 40) * 10.0 ** random.uniform(-3, 3)
        x, y, z = (np.array(news.master) + way).tolist()
        news = news.led((x, y, z), bool(random.random() < 0.9), now)
    elif kind <= 5:
        six = random.choice((*NONSENSE, -1.0, 1.0), size=6) if random.random() < 0.2 else random.uniform(-1, 1, 6)
        if random.random() < 0.7:
            six[:3] = grip.axes.T @ _to_bone(memory, system, state)
        a, b, c, d, e, f = six.tolist()
        news = news.deflected((a, b, c, d, e, f), now)
    elif kind == 6:
        drive, twist = (int(value) for value in random.integers(-1, 2, size=2))
        news = replace(news, drive=drive, twist=twist, keys=news.keys.press(now))
    elif kind == 7 and random.random() < 0.2:
        news = news.released(now)
    hand.hear(news, now)
    command = hand.command(grip, now)
    if random.random() < 0.1:
        mode, device = (HANDS_ON, TELEOPERATED)[int(random.integers(2))], DEVICES[int(random.integers(2))]
        control = Control(mode, device)
        hand.choose(control, now)
        return Act(command, (SetControl(control),))
    return Act(command)


ATTACKS: dict[str, Attack] = {
    "random": at_random,
    "jumps": jumping,
    "saturated": saturated,
    "nonsense": nonsense,
    "to the nearest bone": towards_bone,
    "alternating": alternating,
    "resonant": resonant,
    "into corners": into_corners,
    "twists": twisting,
    "flood": flooding,
    "along the path": driving,
    "master": master,
    "every channel": every_channel,
}
