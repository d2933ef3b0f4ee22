"""A snake's vertices in compact patches of 16 under a tree of balls, as the compiled query reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

if TYPE_CHECKING:  # the query is to be had without the robots' libraries
    from ..robots.snake_surface import LinkVertices

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LANES = 16
BLOCK = 52  # numbers in a block: x of its 16 points, y, z; centre and radius of a ball about them
NODE = 84  # numbers in a node: x of its 16 children's balls, y, z, radius, which they are; a ball about them all

_GROWN = 1e-10  # [mm] of every ball: more than all roundings of what is concluded from it


class VertexBlocks(NamedTuple):
    """Blocks of 16 vertices of one link each, in the frame of that link, mm; all read-only."""

    lanes: Array
    """(B, 52): x of the 16, y, z, then a ball about them. A block that has fewer repeats some of them."""
    ball: Array
    """(N, 84): nodes of 16 balls; the first L are the links' roots. A child ≥ 0 is a node, any other the block
    -1 - child. Lanes without a child have the radius -inf."""
    start: Index
    """(L + 1,): link l has the blocks start[l] … start[l + 1] - 1."""
    index: Index  # type: ignore[assignment]  # tuple has a method of that name, which nobody calls here
    """(B, 16): the points' rows in ``LinkVertices.points``; the first of a link is its first vertex."""


class _Tree(NamedTuple):
    """One link's vertices: rows of the patches (b, 16), children (n, 16) of the nodes and their balls (n, 4)."""

    rows: Index
    children: Index
    balls: Array


def vertex_blocks(vertices: LinkVertices) -> VertexBlocks:
    """The vertices sorted into blocks, each link's halved again and again across its longest extent.

    Raises:
        InputError: points that are not finite, or a link that has none.
    """
    points = np.array(vertices.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError("vertices of a snake are finite points (V, 3) in mm")
    trees: dict[bytes, _Tree] = {}  # links are alike as a rule
    of_link: list[_Tree] = []
    for link, (first, last) in enumerate(zip(vertices.start[:-1], vertices.start[1:], strict=True)):
        if not 0 <= first < last <= len(points):
            raise InputError(f"link {link} has no vertices: rows {first} to {last} of {len(points)}")
        own = points[first:last]
        key = own.tobytes()
        trees[key] = trees[key] if key in trees else _tree(own)
        of_link.append(trees[key])
    start = np.concatenate([[0], np.cumsum([len(tree.rows) for tree in of_link])]).astype(np.int64)
    index = np.concatenate([tree.rows + first for tree, first in zip(of_link, vertices.start, strict=False)])
    around = points[index]
    lanes = np.concatenate([around.transpose(0, 2, 1).reshape(-1, 3 * LANES), _balls(around)], axis=1)
    blocks = VertexBlocks(lanes, _nodes(of_link, lanes[:, 48:], start), start, index.astype(np.int64))
    for array in blocks:
        array.setflags(write=False)
    return blocks


def _nodes(trees: list[_Tree], balls: Array, start: Index) -> Array:
    """Nodes of all links (N, 84), roots first; ``balls`` (B, 4) of the blocks."""
    links = len(trees)
    node_start = links + np.concatenate([[0], np.cumsum([len(tree.children) - 1 for tree in trees])])
    nodes = np.zeros((int(node_start[-1]), NODE))
    for link, tree in enumerate(trees):
        place = np.concatenate([[link], np.arange(node_start[link], node_start[link + 1])])
        for node, children in zip(place, tree.children, strict=True):
            for lane, child in enumerate(children):
                if child == 0:  # the root is nobody's child
                    nodes[node, [lane, 16 + lane, 32 + lane]] = nodes[node, [0, 16, 32]]
                    nodes[node, 48 + lane] = -np.inf
                    continue
                ball = tree.balls[child] if child > 0 else balls[start[link] - 1 - child]
                nodes[node, [lane, 16 + lane, 32 + lane, 48 + lane]] = ball
                nodes[node, 64 + lane] = place[child] if child > 0 else -1 - (start[link] - 1 - child)
        nodes[place, 80:] = tree.balls
    return nodes


def _tree(points: Array) -> _Tree:
    """Patches and nodes over one link's points."""
    patches: list[Index] = []
    children: list[list[int]] = []
    balls: list[Array] = []

    def add(index: Index) -> int:
        """Number of the node over these rows, or -1 - number of the patch that they are."""
        number = len(children)
        children.append([])
        balls.append(_balls(points[index][None])[0])
        for part in _sixteen(points, index):
            if len(part) <= LANES:
                patches.append(part)
                children[number].append(-len(patches))
            else:
                children[number].append(add(part))
        return number

    add(np.arange(len(points)))
    one = next(k for k, patch in enumerate(patches) if 0 in patch)
    patches[0], patches[one] = patches[one], patches[0]
    patches[0] = np.sort(patches[0])
    swapped = {-1: -1 - one, -1 - one: -1}
    full = np.zeros((len(children), LANES), dtype=np.int64)
    for row, own in zip(full, children, strict=True):
        row[: len(own)] = [swapped.get(child, child) for child in own]
    return _Tree(np.array([np.resize(patch, LANES) for patch in patches]), full, np.array(balls))


def _sixteen(points: Array, index: Index) -> list[Index]:
    """Rows in at most 16 compact parts; parts of 16 rows or fewer are not divided."""
    parts = [index]
    for _ in range(4):
        parts = [half for part in parts for half in _halves(points, part)]
    return parts


def _halves(points: Array, index: Index) -> list[Index]:
    if len(index) <= LANES:
        return [index]
    longest = int(np.ptp(points[index], axis=0).argmax())
    half = LANES * (-(-len(index) // LANES) // 2)
    ordered = index[np.argpartition(points[index, longest], half)]
    return [ordered[:half], ordered[half:]]


def _balls(points: Array) -> Array:
    """Balls (n, 4) about sets of points (n, m, 3): from the middle of their box towards the farthest, ever less."""
    centre = 0.5 * (points.min(axis=1) + points.max(axis=1))
    best, least = centre, np.full(len(points), np.inf)
    rows = np.arange(len(points))
    for k in range(1, 40):  # Bădoiu & Clarkson 2003, "Smaller core-sets for balls", SODA
        away = np.linalg.norm(points - centre[:, None], axis=2)
        farthest = away.argmax(axis=1)
        radius = away[rows, farthest]
        best = np.where((radius < least)[:, None], centre, best)
        least = np.minimum(least, radius)
        centre = centre + (points[rows, farthest] - centre) / (k + 1)
    return np.concatenate([best, (least + _GROWN)[:, None]], axis=1)
