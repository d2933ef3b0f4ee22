"""The worlds that are driven, by name: where the spec of each is, and how its kernels are compiled ahead.

The one place that knows all of them. A world is loaded when it is asked for, its kernels' table is not.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from ..errors import InputError
from ..kernels.preparation import Preparation
from ..runtime.run import Run
from ..runtime.system import SystemSpec
from .rigid.preparation import RIGID


class World(NamedTuple):
    """Module and name of a world's spec.

    certified: whether every motion in it is certified.
    preparation: of the kernels that it needs.
    """

    module: str
    spec: str
    certified: bool
    preparation: Preparation

    def load(self) -> type[SystemSpec]:
        """The class of its specs."""
        found: Any = getattr(import_module(self.module), self.spec)
        return found  # type: ignore[no-any-return]


__all__ = ["RIGID", "SNAKE", "WORLDS", "World", "preparation_of", "prepare", "spec_of"]

# One process, which yields to others: the page waits for the rigid tool's kernels only.
SNAKE = Preparation("vfix_engine.worlds.snake.preparation", (("drive",),), "prepared-snake", 219, spare=True)

WORLDS = {
    "rigid": World("vfix_engine.worlds.rigid.spec", "RigidSpec", certified=True, preparation=RIGID),
    "freehand": World("vfix_engine.worlds.freehand.spec", "FreehandSpec", certified=False, preparation=RIGID),
    "snake": World("vfix_engine.worlds.snake", "SnakeSystemSpec", certified=True, preparation=SNAKE),
    "snake drive": World("vfix_engine.worlds.snake", "DriveSpec", certified=True, preparation=SNAKE),
}


def prepare() -> None:
    """Compile the kernels of every world; as ``Preparation.prepare``."""
    for preparation in dict.fromkeys(world.preparation for world in WORLDS.values()):
        preparation.prepare()


def preparation_of(run: Run) -> Preparation:
    """The kernels that a replay of a run needs. Raises InputError for a world that is not known here."""
    return _world_of(run).preparation


def spec_of(run: Run) -> SystemSpec:
    """The spec that a run was driven with, made of its manifest.

    Raises:
        InputError: a world that is not known here, or a spec that could not be written or does not fit.
    """
    world = _world_of(run)
    if run.manifest["spec_not_written"]:
        raise InputError(f"the run does not hold its spec: {run.manifest['spec_not_written']}")
    return world.load().from_parts(run.manifest["spec"], run.arrays)


def _world_of(run: Run) -> World:
    name = run.manifest["world"]
    if name not in WORLDS:
        raise InputError(f"the run is of the world '{name}'; known here are {', '.join(WORLDS)}")
    return WORLDS[name]
