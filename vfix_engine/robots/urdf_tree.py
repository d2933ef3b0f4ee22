"""Check that links and joints form a tree, and find the chain from the base link to the tool link."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import RobotError

Edge = tuple[str, str, str]  # joint, parent link, child link


def check_tree(links: Sequence[str], edges: Sequence[Edge]) -> str:
    """Return the root link of the tree.

    Raises:
        RobotError: two joints have the same name, a link is unknown or has two parents, a cycle, or several roots.
    """
    known, seen = set(links), set()
    parent_of: dict[str, str] = {}
    for joint, parent, child in edges:
        if joint in seen:
            raise RobotError(f"two joints are called '{joint}'")
        seen.add(joint)
        for link in (parent, child):
            if link not in known:
                raise RobotError(f"joint '{joint}' joins the link '{link[:60]}', which is not there")
        if parent == child:
            raise RobotError(f"joint '{joint}' joins the link '{child}' to itself")
        if child in parent_of:
            raise RobotError(f"the link '{child}' has two parents, '{parent_of[child]}' and '{parent}'")
        parent_of[child] = parent
    roots = [link for link in links if link not in parent_of]
    if not roots:
        raise RobotError("the joints go round in a circle: no link is the root")
    if len(roots) > 1:
        raise RobotError(f"the links are not connected: '{roots[0]}' and '{roots[1]}' both have no parent")
    # With one root and one parent each, links that cannot be reached from the root form a cycle.
    children: dict[str, list[str]] = {}
    for child, parent in parent_of.items():
        children.setdefault(parent, []).append(child)
    reached, waiting = {roots[0]}, [roots[0]]
    while waiting:
        below = children.get(waiting.pop(), [])
        reached.update(below)
        waiting.extend(below)
    for link in links:
        if link not in reached:
            raise RobotError(f"the joints go round in a circle at the link '{link}'")
    return roots[0]


def joint_chain(edges: Sequence[Edge], base: str, tool: str) -> list[int]:
    """Indices of the joints from the base link outwards to the tool link.

    Raises:
        RobotError: the tool link is not a descendant of the base link.
    """
    above = {child: (index, parent) for index, (_, parent, child) in enumerate(edges)}
    found: list[int] = []
    link = tool
    while link != base:
        if link not in above:
            raise RobotError(f"the tool frame '{tool}' is not below the base frame '{base}'")
        index, link = above[link]
        found.append(index)
    return found[::-1]
