"""A run as MCAP in protobuf, which Foxglove shows without a setting: head, tool and path in 3D, every value to plot.

Needs the extra `mcap`. Foxglove's scenes are in metres, so poses and shapes are; the values of a step keep their units,
which are in their names. The tool is drawn once, in the frame of its tip, which the transforms move.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

from app.exchange.runs.table import RunTable, table_of
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.path import SplinePath
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.recorded_settings import driven_s, settings_of
from vfix_engine.worlds.rigid.spec import SceneSpec

ROOT, TIP = "patient_lps", "tip"  # frames
POSE_PERIOD_S = 0.01  # poses are for the eye; the values of a step are all there
M_PER_MM = 1e-3
_NS = 1_000_000_000
_BONE, _TOOL = Color(r=0.85, g=0.79, b=0.66, a=1.0), Color(r=0.91, g=0.64, b=0.09, a=1.0)
_PATH, _TARGET = Color(r=0.12, g=0.5, b=0.84, a=1.0), Color(r=0.76, g=0.09, b=0.36, a=1.0)
_PATH_STEP_MM = 0.5


def write_mcap(run: Run, told: dict[str, Any], path: Path) -> None:
    """Write all steps, and of a rigid tool its poses and the scene; a snake has no bone and no rigid tool.

    told: what it says of itself, see `about`.

    Raises InputError where the run does not hold its spec.
    """
    table = table_of(run)
    times = driven_ns(run)
    scene: SceneSpec | None = getattr(spec_of(run), "scene", None)
    with path.open("wb") as file:
        writer = _ProtobufWriter(file)
        writer.tell({key: value if isinstance(value, str) else json.dumps(value) for key, value in told.items()})
        if scene is not None:
            for topic, message in _still(scene):
                writer.write(topic, message, 0)
        step = _step_type(table)
        poses = {} if scene is None else _poses(run, times)
        for index, (at, row) in enumerate(zip(times.tolist(), table.rows, strict=True)):
            writer.write("/step", step(*row), at)
            if index in poses:
                for topic, message in _moving(*poses[index], at):
                    writer.write(topic, message, at)
        writer.finish()


class _ProtobufWriter:
    """Messages by topic; a channel has its schema with all that it imports."""

    def __init__(self, file: Any) -> None:
        self._writer: Any = Writer(file)  # a library without types
        self._writer.start(profile="", library="vfix")
        self._channels: dict[str, int] = {}

    def finish(self) -> None:
        self._writer.finish()

    def tell(self, values: dict[str, str]) -> None:
        self._writer.add_metadata("vfix", values)

    def write(self, topic: str, message: Message, at_ns: int) -> None:
        if topic not in self._channels:
            described = message.DESCRIPTOR
            files = FileDescriptorSet(file=_with_imports(described.file))
            schema = self._writer.register_schema(described.full_name, "protobuf", files.SerializeToString())
            self._channels[topic] = self._writer.register_channel(topic, "protobuf", schema)
        self._writer.add_message(self._channels[topic], at_ns, message.SerializeToString(), at_ns)


def _with_imports(file: Any) -> list[FileDescriptorProto]:
    found: dict[str, FileDescriptorProto] = {}

    def add(one: Any) -> None:
        if one.name not in found:
            for other in one.dependencies:
                add(other)
            found[one.name] = FileDescriptorProto.FromString(one.serialized_pb)

    add(file)
    return list(found.values())


def driven_ns(run: Run) -> np.ndarray:
    """(n,) driven time at each step in ns; the clock of a row begins again with every return to the start.

    Raises InputError where the run does not hold its spec.
    """
    control = getattr(spec_of(run), "control", None)
    if isinstance(control, ControlSettings):
        time = driven_s([one.dt_s for one in settings_of(run, control)])
    else:  # a snake's clock is its state's, whatever its period
        t = run.column("t")
        step = np.diff(t, prepend=0.0)
        time = np.cumsum(np.where(step > 0.0, step, t))
    return np.asarray(np.rint(time * _NS), dtype=np.int64)


def _poses(run: Run, times: np.ndarray) -> dict[int, tuple[Array, Array]]:
    """Rotation and place of the tip, in m, at the last step of every period of the poses, by the step."""
    period = times // round(POSE_PERIOD_S * _NS)
    last = np.flatnonzero(np.append(np.diff(period) > 0, True))
    place = np.column_stack([run.column(f"tip_{axis}")[last] for axis in "xyz"]) * M_PER_MM
    rotation = np.column_stack([run.column(f"r{i}{j}")[last] for i in range(3) for j in range(3)]).reshape(-1, 3, 3)
    return dict(zip(last.tolist(), zip(rotation, place, strict=True), strict=True))


def field_name(heading: str) -> str:
    """A heading as the name of a field: 'torque_x [N·mm]' is torque_x_N_mm, 'v0 [mm/s]' v0_mm_per_s."""
    return re.sub(r"\W+", "_", heading.replace("/", "_per_")).rstrip("_")


def _step_type(table: RunTable) -> Any:
    """A function from the values of a row to its message, one double a column."""
    names = [field_name(heading) for heading in table.headings]
    kind = {"type": FieldDescriptorProto.TYPE_DOUBLE, "label": FieldDescriptorProto.LABEL_OPTIONAL}
    fields = [FieldDescriptorProto(name=name, number=number + 1, **kind) for number, name in enumerate(names)]
    file = FileDescriptorProto(
        name="vfix/step.proto",
        package="vfix",
        syntax="proto3",
        message_type=[DescriptorProto(name="Step", field=fields)],
    )
    pool = DescriptorPool()
    pool.Add(file)
    made = GetMessageClass(pool.FindMessageTypeByName("vfix.Step"))
    return lambda *values: made(**dict(zip(names, values, strict=True)))


def _still(scene: SceneSpec) -> Iterator[tuple[str, Message]]:
    """Head, path and targets, and the tool in the frame of its tip."""
    vertices = np.asarray(scene.vertices, dtype=np.float64) * M_PER_MM
    bone = SceneEntity(frame_id=ROOT, id="bone", frame_locked=True)
    surface = bone.triangles.add(color=_BONE, indices=np.asarray(scene.faces).ravel().tolist())
    surface.pose.orientation.w = 1.0
    surface.points.extend(Point3(x=x, y=y, z=z) for x, y, z in vertices.tolist())
    yield "/bone", SceneUpdate(entities=[bone])
    yield "/bone_points", _cloud(vertices)
    plan = SceneEntity(frame_id=ROOT, id="plan", frame_locked=True)
    if scene.path_points is not None:
        path = SplinePath(scene.path_points)
        count = max(int(path.length / _PATH_STEP_MM), 2)
        places = path.position(np.linspace(0.0, path.length, count)) * M_PER_MM
        line = plan.lines.add(type=LinePrimitive.LINE_STRIP, thickness=2.0, scale_invariant=True, color=_PATH)
        line.pose.orientation.w = 1.0
        line.points.extend(Point3(x=x, y=y, z=z) for x, y, z in places.tolist())
    for place in np.asarray(scene.targets, dtype=np.float64) * M_PER_MM:
        ball = plan.spheres.add(color=_TARGET)
        _pose(ball.pose, np.eye(3), place)
        ball.size.x = ball.size.y = ball.size.z = 2.0 * M_PER_MM
    yield "/plan", SceneUpdate(entities=[plan])
    yield "/tool", SceneUpdate(entities=[_tool(scene)])


def _tool(scene: SceneSpec) -> SceneEntity:
    """The tool as cylinders in the frame of its tip."""
    entity = SceneEntity(frame_id=TIP, id="tool", frame_locked=True)
    axes = scene.tool_itself().segments(np.eye(3), np.zeros(3))
    for start, end, radius in zip(axes.start, axes.end, axes.radius, strict=True):
        along = end - start
        part = entity.cylinders.add(color=_TOOL, bottom_scale=1.0, top_scale=1.0)
        part.size.x = part.size.y = 2.0 * float(radius) * M_PER_MM
        part.size.z = float(np.linalg.norm(along)) * M_PER_MM
        turned = Rotation.align_vectors(along[None], np.array([[0.0, 0.0, 1.0]]))[0].as_matrix()
        _pose(part.pose, turned, (start + end) / 2.0 * M_PER_MM)
    return entity


def _cloud(places: Array) -> PointCloud:
    """Places (n, 3) as float32."""
    fields = [
        PackedElementField(name=name, offset=4 * i, type=PackedElementField.FLOAT32) for i, name in enumerate("xyz")
    ]
    cloud = PointCloud(frame_id=ROOT, point_stride=12, fields=fields, data=places.astype("<f4").tobytes())
    cloud.pose.orientation.w = 1.0
    return cloud


def _moving(rotation: Array, place: Array, at_ns: int) -> Iterator[tuple[str, Message]]:
    """A pose of the tip, as a transform and as a pose."""
    when = Timestamp(seconds=at_ns // _NS, nanos=at_ns % _NS)
    transform = FrameTransform(timestamp=when, parent_frame_id=ROOT, child_frame_id=TIP)
    _place(transform.translation, place)
    _turn(transform.rotation, rotation)
    yield "/tf", FrameTransforms(transforms=[transform])
    pose = PoseInFrame(timestamp=when, frame_id=ROOT)
    _pose(pose.pose, rotation, place)
    yield "/tip", pose


def _pose(pose: Any, rotation: Array, place: Array) -> None:
    _place(pose.position, place)
    _turn(pose.orientation, rotation)


def _place(vector: Any, place: Array) -> None:
    vector.x, vector.y, vector.z = place.tolist()


def _turn(quaternion: Any, rotation: Array) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = Rotation.from_matrix(rotation).as_quat().tolist()
