"""A rigid tool's scene as plain values and arrays, for the control process and a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...control import ControlSettings
from ...control.qp import DUAL
from ...control.tasks.printed_path import PrintedWeights
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections
from ...proximity.proximity import ProximityTree
from ...robots import RobotModel, Tool
from ...robots.joints import MOST_JOINTS
from ...robots.tool import MAX_PARTS
from ...runtime.system import Worker
from ...virtual_fixtures import Fixture, Zone
from .scene import Scene
from .scene_parts import (
    fixtures_from,
    fixtures_parts,
    robot_from,
    robot_parts,
    shaft_from,
    shaft_parts,
    tool_from,
    tool_parts,
    zones_from,
    zones_parts,
)
from .snapshot import RigidSnapshot
from .system import RigidSystem


@dataclass(frozen=True, eq=False)
class SceneSpec:
    """A scene that can be sent to another process; see ``Scene`` for the meaning.

    robot, tool: a shipped name or file, or the object, such as one from your own URDF.
    zones, fixtures: objects of this library, or of user-defined classes that can be pickled.

    Raises:
        InputError: bent_inspection is neither True nor False.
    """

    vertices: Array
    faces: NDArray[np.int32]
    robot: str | RobotModel
    tool: str | Tool
    base: Array
    q_start: Array
    path_points: Array | None = None
    targets: Array = field(default_factory=lambda: np.zeros((0, 3)))
    target_names: tuple[str, ...] = ()
    zones: tuple[Zone, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    solver: str = DUAL
    structure_names: Mapping[str, str] = field(default_factory=dict)
    shaft: ShaftDirections | None = None
    printed: PrintedWeights | None = None
    bent_inspection: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.bent_inspection, bool):
            raise InputError(f"bent_inspection of a scene is true or false, not {self.bent_inspection!r:.20}")

    @classmethod
    def of(cls, scene: Scene, solver: str = DUAL) -> Self:
        """The spec of a scene."""
        mesh, path = scene.tree.mesh, None if scene.path is None else scene.path.points
        return cls(
            np.asarray(mesh.vertices), np.asarray(mesh.faces), scene.robot, scene.tool, scene.base, scene.q_start,
            path, scene.targets, scene.target_names, scene.zones, scene.fixtures, solver,
            scene.structure_names, scene.shaft, scene.printed, scene.bent_inspection,
        )  # fmt: skip

    def robot_model(self) -> RobotModel:
        """The robot itself. Raises RobotError."""
        return self.robot if isinstance(self.robot, RobotModel) else RobotModel.load(self.robot)

    def tool_itself(self) -> Tool:
        """The tool itself. Raises RobotError."""
        return self.tool if isinstance(self.tool, Tool) else Tool.load(self.tool)

    def build(self) -> Scene:
        """The scene itself; the proximity tree is built here."""
        path = None if self.path_points is None else SplinePath(self.path_points)
        tree = ProximityTree(TriangleMesh(self.vertices, self.faces))
        robot, tool = self.robot_model(), self.tool_itself()
        return Scene(
            tree, robot, tool, self.base, self.q_start, path, self.targets, self.target_names, self.zones,
            self.fixtures, self.structure_names, self.shaft, self.printed, self.bent_inspection,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class RigidSpec:
    """The rigid tool as ``runtime.SystemSpec``: a scene and the settings that it starts with."""

    scene: SceneSpec
    control: ControlSettings

    world = "rigid"
    snapshot_type = RigidSnapshot
    snapshot_numbers = MOST_JOINTS + 7 * MAX_PARTS  # for any robot and tool
    has_worker = False

    def build(self) -> RigidSystem:
        """The system itself.

        Raises:
            VfixError: robot, tool, path or surface cannot be used, or no such solver is installed.
        """
        return RigidSystem(self.scene.build(), self.control, self.scene.solver)

    def worker(self) -> Worker:
        raise InputError("a rigid tool has no background work")

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process as its parts; user-defined fixtures are pickled."""
        values, arrays = self._parts()
        return _from_process, (values, arrays, self.scene.fixtures)

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """See ``runtime.SystemSpec``. Raises InputError: a standing fixture is of a user-defined class."""
        fixtures, more = fixtures_parts(self.scene.fixtures)
        values, arrays = self._parts()
        return values | {"fixtures": fixtures}, arrays | more

    def _parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """All but the fixtures."""
        scene = self.scene
        zones, arrays = zones_parts(scene.zones)
        arrays |= {"vertices": scene.vertices, "faces": scene.faces, "base": scene.base, "q_start": scene.q_start}
        arrays["targets"] = scene.targets
        if scene.path_points is not None:
            arrays["path_points"] = scene.path_points
        arrays |= shaft_parts(scene.shaft)
        values = {
            "robot": robot_parts(scene.robot_model()),
            "tool": tool_parts(scene.tool_itself()),
            "zones": zones,
            "target_names": list(scene.target_names),
            "solver": scene.solver,
            "structure_names": dict(scene.structure_names),
            "settings": self.control.to_dict(),
            "bent_inspection": scene.bent_inspection,
        }
        if scene.printed is not None:
            values["printed"] = asdict(scene.printed)
        return values, {name: np.asarray(array) for name, array in arrays.items()}

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The inverse. Raises InputError."""
        try:
            scene = SceneSpec(
                arrays["vertices"],
                arrays["faces"],
                robot_from(values["robot"]),
                tool_from(values["tool"]),
                arrays["base"],
                arrays["q_start"],
                arrays.get("path_points"),
                arrays["targets"],
                tuple(values["target_names"]),
                zones_from(values["zones"], arrays),
                fixtures_from(values.get("fixtures", []), arrays),
                values["solver"],
                dict(values.get("structure_names", {})),
                shaft_from(arrays),
                PrintedWeights(**values["printed"]) if "printed" in values else None,
                values.get("bent_inspection", False),  # runs of before have none
            )
            return cls(scene, ControlSettings.from_dict(values["settings"]))
        except (KeyError, TypeError) as error:
            raise InputError(f"the run's scene cannot be read: {error!r:.80}") from error


def _from_process(values: dict[str, Any], arrays: dict[str, NDArray[Any]], fixtures: tuple[Fixture, ...]) -> RigidSpec:
    spec = RigidSpec.from_parts(values, arrays)
    return replace(spec, scene=replace(spec.scene, fixtures=fixtures))
