"""The paper's parameterised control and the quadratic program, on the same commands in the same pathway."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....arrays import Array
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel
from ..settings import CONTROLS, Control, DriveSettings
from ..stepping.command import SnakeCommand
from .drive_report import DeviationTally
from .operators import Order, Stop, adversarial, scripted
from .snake_drive import SnakeDrive

_TIP_S = 200.0  # [mm] of the comparison
_LINKS = 7
_BEND_MM, _RADIUS_MM = 130.0, 14.0  # of the pathway that it is made in
_SPACING_MM = 1.0  # [mm] between places of the camera's path that its curvature is taken of


def compare_controls(
    pathway: Pathway | None = None,
    tip_s: float = _TIP_S,
    attack_steps: int = 2000,
    seed: int = 0,
    settings: DriveSettings | None = None,
) -> dict[str, Any]:
    """Both controls under the commands of a scripted look-round and of an adversary.

    The look-round's commands are recorded while the paper's control carries them out with the hand looking; both
    controls are then given that record, blind.

    Args:
        pathway: None: a bend of 130 mm radius in a lumen of 28 mm.
        tip_s: mm, where the tip is; attack_steps, seed: of the adversary; settings: but for the control.

    Returns:
        JSON's types: operator → control → deviation_mm {mean, max}, beyond_mm (most beyond a bound, negative: within),
        jerk_rad_s3 (RMS of all joints), curvature_1_mm (RMS of the camera's path), missed (share of the commanded
        motion of the camera that was not carried out), held (share of steps), step_us (median).
    """
    lane = pathway if pathway is not None else _bend()
    common = settings or DriveSettings()
    watched = _drive(lane, tip_s, common, "parameterised")
    look: list[Order] = []
    operator = scripted([Stop("here", tip_s)], tip_s, with_plan=False)
    while (act := operator(watched.system, watched.state)) is not None:
        look.append(act.note)
        watched.act(act)
    still = _drive(lane, tip_s, common, "parameterised")
    attacker = adversarial(attack_steps, seed)
    attack = [_only_camera(act.note) for act in iter(lambda: attacker(still.system, still.state), None)]
    return {
        name: {control: _measured(_drive(lane, tip_s, common, control), orders) for control in CONTROLS}
        for name, orders in (("scripted", look), ("adversarial", attack))
    }


def _bend() -> Pathway:
    angle = np.linspace(0.0, 2.2, 34)
    centre = np.column_stack([1.0 - np.cos(angle), np.zeros(34), np.sin(angle)]) * _BEND_MM
    return Pathway(centre, np.full(34, _RADIUS_MM), 67)


def _drive(pathway: Pathway, tip_s: float, settings: DriveSettings, control: Control) -> SnakeDrive:
    return SnakeDrive(SnakeModel(_LINKS), pathway, replace(settings, control=control), tip_s=tip_s)


def _only_camera(order: Order) -> Order:
    """Both controls stay at the same place of the pathway."""
    return order._replace(command=replace(order.command, insert_mm_per_s=0.0))


def _measured(drive: SnakeDrive, orders: list[Order]) -> dict[str, Any]:
    tally = DeviationTally(drive.snake.q_max, drive.state.bounds.most)
    joints, cameras, wanted, done = [drive.q[-drive.distal.dof :].copy()], [_camera(drive)], 0.0, 0.0
    even = orders[0].dt
    jerks: list[float] = []
    steps: list[float] = []
    for order in orders:
        before = drive.q.copy()
        state = drive.step(order.command, order.dt)
        tally.add(before, state, order.dt, drive.step_s)
        joints.append(state.q[-drive.distal.dof :])
        cameras.append(_camera(drive))
        command = (order.command if order.command.finite else SnakeCommand()).camera * order.dt
        size = float(np.linalg.norm(command))
        if size > 0.0:
            moved = cameras[-2][:3, :2].T @ (cameras[-1][:3, 3] - cameras[-2][:3, 3])
            wanted, done = wanted + size, done + float(moved @ command) / size
        steps.append(order.dt)
        if steps[-3:] == [even, even, even]:  # the steps between the four poses of a third difference
            jerks.append(float(((joints[-1] - 3.0 * joints[-2] + 3.0 * joints[-3] - joints[-4]) ** 2).mean()) / even**6)
    return {
        "deviation_mm": {"mean": float(tally.mean), "max": float(tally.deepest)},
        "beyond_mm": float(tally.most_beyond),
        "jerk_rad_s3": float(np.sqrt(np.mean(jerks))) if jerks else 0.0,
        "curvature_1_mm": _curvature(np.array([camera[:3, 3] for camera in cameras])),
        "missed": 1.0 - done / wanted if wanted > 0.0 else 0.0,
        "held": tally.outcomes["held"] / len(orders),
        "step_us": float(np.median(tally.step_us["looking"])) if tally.step_us["looking"] else None,
    }


def _camera(drive: SnakeDrive) -> Array:
    return drive.snake.camera(drive.q, drive.state.base)


def _curvature(path: Array) -> float:
    """RMS curvature in 1/mm of a path (n, 3), taken every millimetre of its length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    if along[-1] < 4.0 * _SPACING_MM:
        return 0.0
    places = np.arange(0.0, along[-1], _SPACING_MM)
    even = np.column_stack([np.interp(places, along, path[:, axis]) for axis in range(3)])
    direction = np.diff(even, axis=0)
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", direction[:-1], direction[1:]), -1.0, 1.0))
    return float(np.sqrt(np.mean((turn / _SPACING_MM) ** 2)))
