"""What a step of the driven snake came to."""

from __future__ import annotations

from typing import Literal, NamedTuple

from ....arrays import Array

LimitedBy = Literal["bound", "speed", "step", "bends", "bent", "end", "tissue", "insertion", "planning"]


class Outcome(NamedTuple):
    """What a step came to.

    name: 'rest' where nothing is asked for or it is so already, 'moved', 'shrunk' to a part of the wanted step, or
        'held'. 'shrunk' too where a command was carried out but the tissue's motion could not be followed, or where one
        to bend came with insertion. A bend and 'straighten' name a goal and no speed: on the way there is 'moved'.
    words: what shrank or held it.
    limit: what that was, 'bound' of a link, 'speed' of the joints, 'step': the most that one inserts, 'bends': none
        moves the camera so, 'bent': the tip has to be straightened first, 'end' of the path, 'tissue' without a
        pathway, 'insertion' before the camera, 'planning' of what is to come.
    at: (3,) LPS mm, the vertex that would be beyond its link's bound.
    """

    name: Literal["rest", "moved", "shrunk", "held"]
    words: str | None = None
    limit: LimitedBy | None = None
    at: Array | None = None


REST, MOVED = Outcome("rest"), Outcome("moved")


def both(tissue: Outcome, command: Outcome) -> Outcome:
    """Of following the tissue and a command; tissue that could not be followed is not passed over."""
    if tissue.name == "held" and command.name == "moved":
        return tissue._replace(name="shrunk")
    return command
