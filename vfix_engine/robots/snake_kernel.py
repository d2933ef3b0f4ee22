"""Forward kinematics and Jacobian of a snake of universal joints, compiled.

Kwok 2013, section III.A.1: T of link i in link i − 1 from the pair of angles of its universal joint. Here
T = Rot_x(q[2i]) · Rot_y(q[2i + 1]) · Trans_z(length), links counted from 0; a link's frame is at its far end.
A pose is written as three rows [R | p], mm in the patient frame.
"""

from __future__ import annotations

import math

from ..arrays import Array
from ..kernels.compiled import compiled, no_refcount


@no_refcount
def snake_frames(q: Array, base: Array, length: float, out: Array) -> None:
    """Poses of all links, written into ``out``.

    Args:
        q: (2L,) rad; base: (3, 4) or (4, 4) the frame before the first joint; length: of a link, mm.
        out: (L, 3, 4) the poses of the links' frames.
    """
    for row in range(3):
        for column in range(4):
            out[0, row, column] = base[row, column]
    for link in range(len(out)):
        before = link - 1 if link > 0 else 0  # out[0] holds the base until it is overwritten
        ca, sa = math.cos(q[2 * link]), math.sin(q[2 * link])
        cb, sb = math.cos(q[2 * link + 1]), math.sin(q[2 * link + 1])
        for row in range(3):
            x, y, z = out[before, row, 0], out[before, row, 1], out[before, row, 2]
            y, z = y * ca + z * sa, z * ca - y * sa  # Rot_x
            x, z = x * cb - z * sb, x * sb + z * cb  # Rot_y
            out[link, row, 3] = out[before, row, 3] + length * z
            out[link, row, 0], out[link, row, 1], out[link, row, 2] = x, y, z


@no_refcount
def snake_jacobian(frames: Array, base: Array, q: Array, link: int, x: float, y: float, z: float, out: Array) -> None:
    """Write the Jacobian (3, 2L) of a point fixed to a link.

    A universal joint rotates about the x axis of the previous frame, then about the y axis of its own link. Both axes
    pass through the origin of the previous frame.

    Args:
        frames: (L, 3, 4) of ``snake_frames`` at q (2L,); base: as there; link: 0 … L − 1; x, y, z: the point in the
            patient frame, mm.
        out: (3, 2L) mm/rad; columns of joints beyond the link are 0.
    """
    for joint in range(len(q)):
        owner = joint // 2
        if owner > link:
            out[0, joint], out[1, joint], out[2, joint] = 0.0, 0.0, 0.0
            continue
        if owner == 0:
            px, py, pz = base[0, 3], base[1, 3], base[2, 3]
            ax, ay, az = base[0, 0], base[1, 0], base[2, 0]
        else:
            px, py, pz = frames[owner - 1, 0, 3], frames[owner - 1, 1, 3], frames[owner - 1, 2, 3]
            ax, ay, az = frames[owner - 1, 0, 0], frames[owner - 1, 1, 0], frames[owner - 1, 2, 0]
        if joint % 2 == 1:
            ax, ay, az = frames[owner, 0, 1], frames[owner, 1, 1], frames[owner, 2, 1]
        rx, ry, rz = x - px, y - py, z - pz
        out[0, joint], out[1, joint], out[2, joint] = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx


@compiled
def aim(dx: float, dy: float, dz: float) -> tuple[float, float]:
    """The angles (odd, even) in rad that turn a link's z axis to the unit vector (dx, dy, dz) of the frame before it.

    Rot_x(a) Rot_y(b) e_z = (sin b, −sin a cos b, cos a cos b); of the two solutions the one with b within ± 90° is
    returned. Along ± x the odd angle is arbitrary, and 0 is returned.
    """
    across = math.sqrt(dy * dy + dz * dz)
    even = math.atan2(dx, across)
    if across < 1e-12:
        return 0.0, even
    return math.atan2(-dy, dz), even
