"""Tables of poses, as trackers and robots write them, for the calibration of a pointer and of a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from app.kit.text_tables import (
    cell_number,
    check_last_line,
    decode,
    fault_at,
    mm_per_unit,
    table_header,
    table_rows,
)
from app.kit.values import check_position
from app.registration.calibration_records import MAX_POSES
from vfix_engine.arrays import Array
from vfix_engine.errors import FrameError, InputError

PoseKind = Literal["pointer_to_tracker", "marker_to_tracker", "flange_to_base"]

MAX_POSES_BYTES = 4 << 20
_KEYS = ("pose", "unit")
_COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")
_UNIT = 1e-3  # how far a quaternion's length may be from 1: three decimals of each number
_WHAT: dict[PoseKind, str] = {
    "pointer_to_tracker": "poses of the pointer",
    "marker_to_tracker": "poses of the marker on the robot",
    "flange_to_base": "poses of the robot's flange",
}


@dataclass(frozen=True, eq=False)
class PoseTable:
    """Poses (n, 4, 4), rigid, mm, in the order of the rows; numbers: of the rows where the table has them."""

    poses: Array
    numbers: tuple[int, ...] | None


def read_poses(data: bytes, kind: PoseKind) -> PoseTable:
    """A table of poses with the columns x, y, z, qx, qy, qz, qw, and number where rows of two tables are paired by it.

    Comment lines above it say `# unit=mm` (or um, m; of x, y and z) and `# pose=`, from which frame to which: a kind.
    Raises FrameError where one of them is not said or is another, and InputError for anything else.
    """
    text = decode(data, "the table")
    check_last_line(text)
    lines = text.splitlines()
    header = table_header(lines, _KEYS, above=1)
    if "unit" not in header:
        raise FrameError("the table does not name its unit; add a line '# unit=mm'.", ("unit",))
    _check_kind(header.get("pose"), kind)
    scale = mm_per_unit(header["unit"])
    poses, numbers, unseen = [], [], []
    for count, (line, row) in enumerate(table_rows(lines, _COLUMNS), 1):
        if count > MAX_POSES:
            raise InputError(f"the table holds more than {MAX_POSES:,} poses; leave some of them out.")
        with fault_at(f"line {line} of the table"):
            poses.append(_pose(row, scale))
            numbers.append(_number(row))
        if np.array_equal(poses[-1], np.eye(4)):
            unseen.append(line)
    if not poses:
        raise InputError("the table holds no poses.")
    if unseen:
        rows = "row has" if len(unseen) == 1 else "rows have"
        raise InputError(
            f"{len(unseen)} {rows} the identity as pose, first line {unseen[0]}; so trackers write a tool "
            f"that is out of sight. Delete {'it' if len(unseen) == 1 else 'them'}."
        )
    known = [number for number in numbers if number is not None]
    if known and len(set(known)) < len(numbers):
        raise InputError("the column number is different in each row, or left out.")
    return PoseTable(np.array(poses), tuple(known) if known else None)


def paired(robot: PoseTable, tracker: PoseTable) -> tuple[Array, Array]:
    """The poses of both tables at the same moments: of the same numbers where both have them, else of the same rows.

    Raises InputError where they cannot be paired.
    """
    if (robot.numbers is None) != (tracker.numbers is None):
        raise InputError("one table numbers its poses and the other does not; number both, or none.")
    if robot.numbers is None or tracker.numbers is None:
        if len(robot.poses) != len(tracker.poses):
            raise InputError(
                f"{len(robot.poses)} robot poses and {len(tracker.poses)} tracker poses are no pairs; "
                "give one row for each moment in both, or pair the rows by a column 'number'."
            )
        return robot.poses, tracker.poses
    rows = {number: row for row, number in enumerate(tracker.numbers)}
    common = [(row, rows[number]) for row, number in enumerate(robot.numbers) if number in rows]
    if not common:
        raise InputError("no number stands in both tables; rows of the same moment have the same number.")
    of_robot, of_tracker = zip(*common, strict=True)
    return robot.poses[list(of_robot)], tracker.poses[list(of_tracker)]


def _check_kind(named: str | None, kind: PoseKind) -> None:
    if named is None:
        raise FrameError(f"the table does not say which poses it holds; add a line '# pose={kind}'.", ("pose",))
    if named == kind:
        return
    if named not in get_args(PoseKind):
        raise FrameError(f"the poses {named!r:.40} are not known; say {', '.join(get_args(PoseKind))}.")
    raise FrameError(f"the table holds {_WHAT[named]}; {_WHAT[kind]} are needed, '# pose={kind}'.")  # type: ignore[index]


def _pose(row: Mapping[str, str], scale: float) -> Array:
    """One row as a transform (4, 4)."""
    try:
        values = [cell_number(row[name]) for name in _COLUMNS]
    except ValueError:
        raise InputError(f"{', '.join(_COLUMNS)} must be numbers, with a point and not a comma.") from None
    place, (x, y, z, w) = check_position([scale * value for value in values[:3]]), values[3:]
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if length == 0.0:
        raise InputError("qx, qy, qz, qw are all 0; delete the row, as of an unseen tool.")
    if not abs(length - 1.0) <= _UNIT:
        raise InputError(f"qx, qy, qz, qw are a unit quaternion; this one has the length {length:.4g}.")
    x, y, z, w = x / length, y / length, z / length, w / length
    pose = np.eye(4)
    pose[:3, :3] = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    pose[:3, 3] = place
    return pose


def _number(row: Mapping[str, str]) -> int | None:
    text = (row.get("number") or "").strip()
    if "number" not in row:
        return None
    if not text.isascii() or not text.isdigit() or len(text) > 18:
        raise InputError("the column number holds whole numbers from 0 on.")
    return int(text)
