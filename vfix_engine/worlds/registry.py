"""The worlds that are driven, by name: where the spec of each is, and how its kernels are compiled ahead.

The one place that knows all of them. A world is loaded when it is asked for, its kernels' table is not.
"""

from __future__ import annotations

from collections.abc import Mapping
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
    columns: names that the rows of every run of it have, and together no run of a world without the certificate.
    preparation: of the kernels that it needs.
    row: module of its rows, whose ``CODES`` have the names of the numbers in a column.
    arms: whether it is driven in one of the arms of a snake's hand, of which one is certified.
    """

    module: str
    spec: str
    certified: bool
    columns: frozenset[str]
    preparation: Preparation
    row: str
    arms: bool = False

    def load(self) -> type[SystemSpec]:
        """The class of its specs."""
        found: Any = getattr(import_module(self.module), self.spec)
        return found  # type: ignore[no-any-return]


__all__ = [
    "RIGID", "SNAKE", "WORLDS", "World", "arm_of", "codes_of", "is_certified", "preparation_of", "prepare", "spec_of",
]  # fmt: skip

# One process, which yields to the others: the page waits for the rigid tool's kernels only.
SNAKE = Preparation("vfix_engine.worlds.snake.preparation", (("drive",),), "prepared-snake", 113, spare=True)

_OF_ROBOT, _OF_HAND = frozenset(("q0", "v0", "share", "emergency")), frozenset(("push_x", "contacts", "depth"))
_OF_SNAKE = frozenset(("q0", "tip_s", "beyond_bound"))
_RIGID_ROW, _SNAKE_ROW = "vfix_engine.worlds.rigid.row", "vfix_engine.worlds.snake.row"
WORLDS = {
    "rigid": World("vfix_engine.worlds.rigid.spec", "RigidSpec", True, _OF_ROBOT, RIGID, _RIGID_ROW),
    "freehand": World("vfix_engine.worlds.freehand.spec", "FreehandSpec", False, _OF_HAND, RIGID, _RIGID_ROW),
    "snake": World("vfix_engine.worlds.snake", "SnakeSystemSpec", True, _OF_SNAKE, SNAKE, _SNAKE_ROW, True),
    "snake drive": World("vfix_engine.worlds.snake", "DriveSpec", True, _OF_SNAKE, SNAKE, _SNAKE_ROW, True),
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
    try:
        return world.load().from_parts(run.manifest["spec"], run.arrays)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"the run's spec is damaged: {type(error).__name__} {error}") from error


def codes_of(run: Run) -> dict[str, tuple[str, ...]]:
    """Names of the numbers in the columns of a run's rows that are codes, by column: of its world, in their order.

    Raises:
        InputError: as ``spec_of`` for the world.
    """
    codes: Mapping[str, tuple[str, ...]] = import_module(_world_of(run).row).CODES
    columns = {column.name for column in run.columns}
    return {name: names for name, names in codes.items() if name in columns}


def is_certified(manifest: Mapping[str, Any]) -> bool:
    """Whether every motion of a run was certified, by its manifest as it was written: the world it names, whose
    certificate stands in no file, the columns that only rows of that world have, and the arm of a snake's hand."""
    world = WORLDS.get(str(manifest.get("world")))
    if world is None or not world.certified or _missing(world, manifest):
        return False
    return not world.arms or arm_of(manifest) == "certified"


def arm_of(manifest: Mapping[str, Any]) -> str | None:
    """The arm of a snake's hand in which a run was driven, by its manifest; 'certified' of one before there were arms.

    None for a world without arms, and where the manifest does not hold the drive's settings.
    """
    world = WORLDS.get(str(manifest.get("world")))
    spec = manifest.get("spec")
    drive = spec.get("drive") if isinstance(spec, Mapping) else None
    if world is None or not world.arms or not isinstance(drive, Mapping):
        return None
    return str(drive.get("arm", "certified"))


def _missing(world: World, manifest: Mapping[str, Any]) -> list[str]:
    """Columns of a world that a run's manifest does not name, and those of another world that it does."""
    try:
        names = {name for name, _ in manifest["columns"]}
    except (KeyError, TypeError, ValueError):
        return sorted(world.columns)
    foreign = set() if world.columns == _OF_HAND else names & _OF_HAND
    return sorted((world.columns - names) | foreign)


def _world_of(run: Run) -> World:
    name = run.manifest["world"]
    if name not in WORLDS:
        raise InputError(f"the run is of the world '{name}'; known here are {', '.join(WORLDS)}")
    world = WORLDS[name]
    if _missing(world, run.manifest):
        raise InputError(f"the run's columns are not those of the world '{name}', of which it says it is")
    return world
