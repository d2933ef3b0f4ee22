"""A snake's vertices in compact patches of 16 under a tree of balls, in the layout of the compiled query."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...errors import InputError

if TYPE_CHECKING:  # the query does not depend on the robots' libraries at run time
    from ...robots.snake_surface import LinkVertices


LANES = 16
BLOCK = 52  # numbers in a block: x of its 16 points, y, z; centre and radius of a ball about them
# Numbers in a node: x of its 16 children's balls, y, z, radius and child index; then a ball around all of them.
NODE = 84
RADIUS, CHILD, WHOLE = 48, 64, 80

MOST = LANES**6  # vertices of a link; the query's scratch memory has five levels of nodes
_GROWN = 1e-10  # [mm] enlargement of every ball, more than all rounding errors of the tests with it


class VertexBlocks(NamedTuple):
    """Blocks of 16 vertices of one link each, in the frame of that link, mm; all read-only."""

    lanes: Array
    """(B, 52): x of the 16, y, z, then a ball around them. An incomplete block repeats some of them."""
    ball: Array
    """(N, 84): nodes of 16 balls; the first L are the links' roots. A child ≥ 0 is a node, any other the block
    -1 - child. Lanes without a child are balls of radius -inf, which are never entered."""
    start: IntArray
    """(L + 1,): link l has the blocks start[l] … start[l + 1] - 1."""
    index: IntArray  # type: ignore[assignment]  # tuple has a method of that name, which nobody calls here
    """(B, 16): the points' rows in ``LinkVertices.points``; the first of a link is its first vertex."""


class _Tree(NamedTuple):
    """Patches and nodes of one link."""

    rows: IntArray
    """(b, 16) of the patches' points."""
    balls: Array
    """(b, 4)."""
    nodes: Array
    """(n, NODE), the root first; child indices are local to this tree."""


def vertex_blocks(vertices: LinkVertices) -> VertexBlocks:
    """Sort the vertices into blocks by recursive bisection of each link across its longest extent.

    Raises:
        InputError: points are not finite, or a link has none or more than ``MOST``.
    """
    points = np.array(vertices.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError("vertices of a snake are finite points (V, 3) in mm")
    trees: dict[bytes, _Tree] = {}  # links are usually identical
    of_link: list[_Tree] = []
    for link, (first, last) in enumerate(zip(vertices.start[:-1], vertices.start[1:], strict=True)):
        if not 0 <= first < last <= len(points):
            raise InputError(f"link {link} has no vertices: rows {first} to {last} of {len(points)}")
        if last - first > MOST:
            raise InputError(f"link {link} has {last - first:,} vertices, more than {MOST:,}")
        own = points[first:last]
        key = own.tobytes()
        trees[key] = trees[key] if key in trees else _tree(own)
        of_link.append(trees[key])
    start = np.concatenate([[0], np.cumsum([len(tree.rows) for tree in of_link])]).astype(np.int64)
    index = np.concatenate([tree.rows + first for tree, first in zip(of_link, vertices.start, strict=False)])
    balls = np.concatenate([tree.balls for tree in of_link])
    lanes = np.concatenate([points[index].transpose(0, 2, 1).reshape(-1, 3 * LANES), balls], axis=1)
    blocks = VertexBlocks(lanes, _nodes(of_link, start), start, index.astype(np.int64))
    for array in blocks:
        array.setflags(write=False)
    return blocks


def _nodes(trees: list[_Tree], start: IntArray) -> Array:
    """Nodes of all links, roots first, with global child indices."""
    later = len(trees)
    roots, others = [], []
    for tree, first in zip(trees, start[:-1], strict=True):
        nodes = tree.nodes.copy()
        child = nodes[:, CHILD:WHOLE]
        child[child > 0] += later - 1
        child[child < 0] -= first
        later += len(nodes) - 1
        roots.append(nodes[:1])
        others.append(nodes[1:])
    return np.concatenate(roots + others)


def _tree(points: Array) -> _Tree:
    """Build patches and nodes over one link's points."""
    patches: list[IntArray] = []
    balls: list[Array] = []
    nodes: list[Array] = []

    def add(index: IntArray) -> int:
        """Index of the node over these rows."""
        node, number = np.zeros(NODE), len(nodes)
        nodes.append(node)
        node[WHOLE:] = _ball(points[index])
        node[RADIUS:CHILD] = -np.inf
        for lane, part in enumerate(_sixteen(points, index)):
            ball = _ball(points[part])
            node[lane:CHILD:LANES] = ball
            if len(part) <= LANES:
                patches.append(part)
                balls.append(ball)
                node[CHILD + lane] = -len(patches)
            else:
                node[CHILD + lane] = add(part)
        return number

    add(np.arange(len(points)))
    # The link's first vertex must be the first of its first block: it is reported if there is no deviation.
    one = next(k for k, patch in enumerate(patches) if 0 in patch)
    patches[0], patches[one] = np.sort(patches[one]), patches[0]
    balls[0], balls[one] = balls[one], balls[0]
    for node in nodes:
        child = node[CHILD:WHOLE]
        at, other = child == -1.0, child == -1.0 - one
        child[at], child[other] = -1.0 - one, -1.0
    rows = np.array([np.resize(patch, LANES) for patch in patches])
    return _Tree(rows, np.array(balls), np.array(nodes))


def _sixteen(points: Array, index: IntArray) -> list[IntArray]:
    """Divide rows into at most 16 compact parts; 16 rows or fewer are not divided."""
    parts = [index]
    for _ in range(4):
        parts = [half for part in parts for half in _halves(points, part)]
    return parts


def _halves(points: Array, index: IntArray) -> list[IntArray]:
    if len(index) <= LANES:
        return [index]
    longest = int(np.ptp(points[index], axis=0).argmax())
    half = LANES * (-(-len(index) // LANES) // 2)
    ordered = index[np.argpartition(points[index, longest], half)]
    return [ordered[:half], ordered[half:]]


def _ball(points: Array) -> Array:
    """Centre and radius (4,) of a ball around points: iterates from their box's centre towards the farthest point."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    best, least = centre, np.inf
    for k in range(1, 25):  # Bădoiu & Clarkson 2003, "Smaller core-sets for balls", SODA
        away = points - centre
        squared = np.einsum("ij,ij->i", away, away)
        farthest = int(squared.argmax())
        if squared[farthest] < least:
            best, least = centre, float(squared[farthest])
        centre = centre + away[farthest] / (k + 1)
    return np.append(best, np.sqrt(least) + _GROWN)
