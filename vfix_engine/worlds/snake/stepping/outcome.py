"""The outcome of a step of the driven snake."""

from __future__ import annotations

from typing import Literal, NamedTuple

from ....arrays import Array

LimitedBy = Literal["bound", "speed", "step", "bends", "bent", "range", "end", "tissue", "insertion", "planning"]


class Outcome(NamedTuple):
    """The outcome of a step.

    name: 'rest' without a command or where its goal is reached, 'moved', 'shrunk' to a part of the commanded step, or
        'held'. Also 'shrunk' where a command was executed but the tissue's motion could not be followed, or where one
        to bend was combined with insertion. A bend and 'straighten' state a goal and no speed: on the way to it is
        'moved'.
    words: the reason why it was scaled or held.
    limit: the limiting constraint, 'bound' of a link, 'speed' of the joints, 'step': the largest insertion, 'bends':
        none moves the camera so, 'bent': the tip has to be straightened first, 'range' of a joint, 'end' of the path,
        'tissue' without a pathway, 'insertion' before the camera, 'planning' of the next part.
    at: (3,) LPS mm, the vertex that would be beyond its link's bound.
    """

    name: Literal["rest", "moved", "shrunk", "held"]
    words: str | None = None
    limit: LimitedBy | None = None
    at: Array | None = None


REST, MOVED = Outcome("rest"), Outcome("moved")


def both(tissue: Outcome, command: Outcome) -> Outcome:
    """Outcome of following the tissue and a command; a failure to follow the tissue is included."""
    if tissue.name == "held" and command.name == "moved":
        return tissue._replace(name="shrunk")
    return command
