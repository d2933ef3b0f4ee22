"""Generated anatomy for the attack: shapes that are difficult for control, around a tool whose tip is at the origin.

The tool enters along +y from y < 0; every mesh leaves a passage for its shaft. Lengths are in mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh

Random = np.random.Generator


def sheet(points: Array) -> TriangleMesh:
    """A mesh over a lattice of points (n, m, 3)."""
    rows, columns = points.shape[:2]
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    faces = np.concatenate(
        [
            np.column_stack([a, a + 1, a + columns]),
            np.column_stack([a + 1, a + columns + 1, a + columns]),
        ]
    )
    return TriangleMesh(points.reshape(-1, 3), faces)


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    """Several meshes as one, nothing merged."""
    offset = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return TriangleMesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + o for m, o in zip(meshes, offset[:-1], strict=True)]),
    )


def plane(origin: Array, one: Array, two: Array, parts: int = 24) -> TriangleMesh:
    """The parallelogram origin + [−1, 1]·one + [−1, 1]·two."""
    u = np.linspace(-1.0, 1.0, parts + 1)
    return sheet(origin + u[:, None, None] * one + u[None, :, None] * two)


def wall(y: float, size: float = 40.0, parts: int = 40) -> TriangleMesh:
    """A wall across the path of the tool."""
    return plane(np.array([0.0, y, 0.0]), np.array([size, 0, 0]), np.array([0, 0, size]), parts)


def tube(radius: float, bend_radius: float, length: float = 60.0, taper: float = 0.0) -> tuple[TriangleMesh, Array]:
    """A tube along an arc from the origin, first along +y, narrowed by ``taper`` at its end, and its centreline."""
    angle = np.linspace(0.0, length / bend_radius, 48)[:, None]
    around = np.linspace(0.0, 2 * np.pi, 33)[None, :]
    wide = radius - taper * angle / angle.max()
    out = wide * np.sin(around)
    y = bend_radius * np.sin(angle) - out * np.sin(angle)
    z = bend_radius * (1 - np.cos(angle)) + out * np.cos(angle)
    centre = np.column_stack([np.zeros(48), bend_radius * np.sin(angle[:, 0]), bend_radius * (1 - np.cos(angle[:, 0]))])
    x = wide * np.cos(around) + 0.0 * angle
    return sheet(np.stack([x, y, z], axis=-1)), centre[1:46:8]


def wedge(opening: float) -> TriangleMesh:
    """Two planes that meet in an edge 9 mm ahead, ``opening`` rad between each and the axis."""
    edge, along = np.array([0.0, 9.0, 0.0]), np.array([0.0, 0.0, 30.0])
    sides = [np.array([sign * np.sin(opening), -np.cos(opening), 0.0]) * 15.0 for sign in (-1.0, 1.0)]
    return joined(*(plane(edge + side, side, along) for side in sides))


def corner() -> TriangleMesh:
    """Three planes that meet in a point ahead and beside."""
    at = np.array([3.0, 6.0, 4.0])
    axes = np.eye(3) * 30.0
    return joined(
        plane(at - [30, 0, 30] * np.ones(3), axes[0], axes[2]),
        plane(at - [0, 30, 30] * np.ones(3), axes[1], axes[2]),
        plane(at - [30, 30, 0] * np.ones(3), axes[0], axes[1]),
    )


def plates(gap: float = 3.2) -> TriangleMesh:
    """Plates 0.02 mm thick, which the tip fits between."""
    found = []
    for k in (-2, -1, 1, 2):
        x = gap * (k - 0.5 * np.sign(k))
        for side in (0.0, 0.02):
            origin = np.array([x + side, 12.0, 0.0])
            found.append(plane(origin, np.array([0, 11.0, 0]), np.array([0, 0, 12.0]), 8))
    return joined(*found)


def spikes(random: Random, count: int = 90) -> TriangleMesh:
    """Needles on a wall, their points at many depths and a few beside the shaft."""
    vertices: list[Array] = []
    faces: list[list[int]] = []
    for _ in range(count):
        foot = np.array([random.uniform(-14, 14), 14.0, random.uniform(-14, 14)])
        tip = foot * [1, 0, 1] + [0, random.uniform(1.6, 9.0), 0] + random.normal(size=3) * [1, 0, 1]
        around = np.linspace(0, 2 * np.pi, 4)[:3]
        ring = foot + 0.4 * np.column_stack([np.cos(around), np.zeros(3), np.sin(around)])
        start = len(vertices)
        vertices += [tip, *ring]
        faces += [[start, start + 1 + k, start + 1 + (k + 1) % 3] for k in range(3)]
    return joined(TriangleMesh(np.array(vertices), np.array(faces)), wall(14.0, 16.0, 12))


def lattice(hole: float = 3.4, bar: float = 0.7) -> TriangleMesh:
    """Two grids of flat bars, one behind the other; the tip fits through their holes, the shaft barely."""
    found = []
    for y, shift in ((3.0, 0.5), (9.0, 0.2)):
        for k in range(-5, 6):
            at = (k + shift) * (hole + bar)
            found.append(plane(np.array([at, y, 0.0]), np.array([bar / 2, 0, 0]), np.array([0, 0, 20.0]), 6))
            found.append(plane(np.array([0.0, y, at]), np.array([20.0, 0, 0]), np.array([0, 0, bar / 2]), 6))
    return joined(*found)


def soup(random: Random, count: int = 700) -> TriangleMesh:
    """Triangles of any size and direction, from splinters to boards, none of them where the tool enters."""
    centre = random.uniform([-16, -60, -16], [16, 26, 16], size=(6 * count, 3))
    size = 10.0 ** random.uniform(-2, 1.0, size=(6 * count, 1, 1))
    corners = centre[:, None, :] + size * random.normal(size=(6 * count, 3, 3))
    return _of_corners(corners[_clear_of_the_way(corners, 1.4)][:count])


def needles(random: Random, count: int = 400) -> TriangleMesh:
    """Triangles 30 mm long and about 0.001 mm wide, crossing the space ahead."""
    centre = random.uniform([-14, -40, -14], [14, 24, 14], size=(6 * count, 3))
    along = random.normal(size=(6 * count, 3))
    along *= 15.0 / np.linalg.norm(along, axis=1, keepdims=True)
    thin = 1e-3 * random.normal(size=(6 * count, 3))
    corners = np.stack([centre - along, centre + along, centre + along + thin], axis=1)
    return _of_corners(corners[_clear_of_the_way(corners, 1.4)][:count])


def cavern(random: Random, radius: float = 11.0, bumps: float = 1.2) -> TriangleMesh:
    """A noisy sphere from inside, open where the shaft enters."""
    azimuth = np.linspace(0.0, 2 * np.pi, 73)[None, :]
    polar = np.linspace(0.02, np.pi - 0.75, 40)[:, None]
    noise = bumps * random.uniform(-1, 1, size=(40, 73))
    noise[:, -1] = noise[:, 0]
    wide = radius + noise
    x, y = wide * np.sin(polar) * np.cos(azimuth), wide * np.cos(polar) + 0.0 * azimuth
    return sheet(np.stack([x, y - 2.0, wide * np.sin(polar) * np.sin(azimuth)], axis=-1))


def slit(half: float) -> TriangleMesh:
    """Two walls on either side of a tool that is bent in their plane; ``half``: half the distance between them."""
    side = np.array([0, 90.0, 0]), np.array([0, 0, 30.0])
    return joined(*(plane(np.array([x, -60.0, 0.0]), *side, 30) for x in (-half, half)))


def broken_wall(random: Random, y: float = 4.0) -> TriangleMesh:
    """A wall with duplicated triangles, and others without area: points, edges, three collinear corners."""
    whole = wall(y, 14.0, 14)
    vertices = np.asarray(whole.vertices)
    ends = random.integers(len(vertices), size=(60, 2))
    points = np.column_stack([ends[:, 0]] * 3)
    edges = np.column_stack([ends[:, 0], ends[:, 1], ends[:, 0]])
    middle = 0.5 * (vertices[ends[:, 0]] + vertices[ends[:, 1]])
    line = np.column_stack([ends[:, 0], ends[:, 1], len(vertices) + np.arange(60)])
    faces = np.concatenate([whole.faces, whole.faces[:200, [1, 2, 0]], points, edges, line])
    return TriangleMesh(np.concatenate([vertices, middle]), faces)


def no_area(random: Random) -> TriangleMesh:
    """Only points and line segments ahead and around: every triangle has no area."""
    start = random.uniform([-10, -30, -10], [10, 20, 10], size=(1500, 3))
    end = np.where(random.random((1500, 1)) < 0.5, start, start + random.normal(size=(1500, 3)) * 4)
    corners = np.stack([start, end, start], axis=1)
    return _of_corners(corners[_clear_of_the_way(corners, 1.4)])


def open_edges() -> TriangleMesh:
    """Half plates with free edges in the way, at the tip and beside the shaft."""
    return joined(
        plane(np.array([0.0, 4.0, 11.0]), np.array([20.0, 0, 0]), np.array([0, 0, 10.0])),
        plane(np.array([12.6, -30.0, 0.0]), np.array([10.0, 0, 0]), np.array([0, 0, 20.0])),
        plane(np.array([-8.0, 5.0, -11.0]), np.array([6.0, 4.0, 0]), np.array([0, 0, 8.0])),
    )


def teeth(height: float = 1.5, parts: int = 40) -> TriangleMesh:
    """A wall of saw teeth as fine as the margin, and another one beside the shaft."""
    u = np.linspace(-14.0, 14.0, parts + 1)
    saw = height * (np.arange(parts + 1) % 2)
    x, z = np.meshgrid(u, u, indexing="ij")
    ahead = np.stack([x, 5.0 - saw[:, None] - 0.5 * saw[None, :], z], axis=-1)
    y = np.linspace(-80.0, 2.0, parts + 1)
    y, z = np.meshgrid(y, u, indexing="ij")
    beside = np.stack([5.0 - saw[:, None] - 0.5 * saw[None, :], y, z], axis=-1)
    return joined(sheet(ahead), sheet(beside))


def rings() -> TriangleMesh:
    """Sharp-edged rings around the shaft, far from the tip: small rotations move the shaft into them."""
    found = []
    around = np.linspace(0.0, 2 * np.pi, 41)
    for y, wide in ((-140.0, 9.6), (-90.0, 9.8), (-40.0, 10.4)):
        ring = [[r * np.cos(around), np.full(41, y + h), r * np.sin(around) - 4.0] for r, h in ((wide, 0), (15, 1))]
        found.append(sheet(np.moveaxis(np.array(ring), 1, 2)))
    return joined(*found, wall(30.0, 30.0, 4))


def room() -> TriangleMesh:
    """A box of boards of two triangles each, 200 mm long, open at the back."""
    half = 9.0
    boards = [wall(12.0, half, 1)]
    for k in (0, 2):
        for sign in (-1.0, 1.0):
            side = np.zeros(3)
            side[k], other = sign * half, np.zeros(3)
            other[2 - k] = half
            boards.append(plane(side - [0, 88, 0], np.array([0, 100.0, 0]), other, 1))
    return joined(*boards)


def grains(random: Random) -> TriangleMesh:
    """A thousand triangles of 0.01 mm scattered ahead, the nearest just outside of the margin."""
    centre = random.uniform([-6, 0.5, -6], [6, 7, 6], size=(4000, 3))
    corners = centre[:, None, :] + 0.01 * random.normal(size=(4000, 3, 3))
    return _of_corners(corners[_clear_of_the_way(corners, 1.4)][:1000])


def _of_corners(corners: Array) -> TriangleMesh:
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def _clear_of_the_way(corners: Array, keep: float) -> NDArray[np.bool_]:
    """Return which triangles are at least ``keep`` mm from the start poses of the tools: 15 mm of tip, bent 30°, shaft.

    The check is coarse, between points of the axis and of the triangle; the controller refuses a start that is still
    too near, and another one is used.
    """
    weights = np.array([[i, j, 8 - i - j] for i in range(9) for j in range(9 - i)]) / 8.0
    points = np.einsum("wk,nkx->nwx", weights, corners)
    elbow = -15.0 * np.array([0.0, np.cos(np.pi / 6), np.sin(np.pi / 6)])
    clear = np.ones(len(corners), bool)
    for start, end, radius in ((elbow, np.zeros(3), 1.0), (elbow - [0, 150.0, 0], elbow, 1.5)):
        along = end - start
        t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        away = np.linalg.norm(points - start - t[..., None] * along, axis=-1).min(axis=1)
        clear &= away > radius + keep
    return clear
