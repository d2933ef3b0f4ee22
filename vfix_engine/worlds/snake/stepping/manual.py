"""The manual arm: the hand turns one of the last two universal joints, and the others follow the centreline.

Kwok 2013, section IV.C.1, the control experiment: left and right, up and down are mapped to the two angles of the
chosen joint, whatever the view is turned to.
"""

from __future__ import annotations

import math

from ....arrays import Array
from ....robots.snake import SnakeModel

JOINTS = 2  # that a hand may choose from; on a fixed base all, as no other moves them


def hand_target(distal: SnakeModel, q: Array, camera_mm: Array, joint: int) -> Array:
    """Joints (2L',) after a motion of the hand (2,) mm that turns universal joint ``joint``, 1: the last.

    The angles are those that move the camera of straight links by so much: to the right about the joint's y, down about
    its x. Each stops at its range.
    """
    link = distal.links - min(joint, distal.links)
    lever = (distal.links - link) * distal.length_mm + distal.camera_offset_mm
    target = q.copy()
    target[2 * link] -= camera_mm[1] / lever
    target[2 * link + 1] += camera_mm[0] / lever
    return distal.clamp(target)


def hand_moved(distal: SnakeModel, before: Array, after: Array, joint: int) -> tuple[float, float]:
    """The motion of the hand in mm that turned universal joint ``joint`` from joints (2L',) to others: the inverse of
    ``hand_target``.
    """
    link = distal.links - min(joint, distal.links)
    lever = (distal.links - link) * distal.length_mm + distal.camera_offset_mm
    down, right = lever * (after - before)[2 * link : 2 * link + 2]
    return float(right), -float(down)


def at_range(snake: SnakeModel, joint: int) -> str:
    """In words, that the chosen joint goes no farther."""
    return f"joint {snake.links - joint + 1} is at the end of its range, ± {math.degrees(snake.q_max):g}°"
