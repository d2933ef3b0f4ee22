"""Compiling every kernel that a page and a rehearsal need, once for each installation, in processes beside the planner.

A kernel is compiled where it is first called, and most of that time the interpreter waits; in processes of their own
two halves are compiled at once and the planner answers meanwhile. They leave what they compiled in the folder of
geometry/kernel_cache.py, from where every later process reads it.
`python -m vfix_engine.simulation.preparation PART ...` is one of these processes.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..control import ControlSettings, compile_ahead
from ..geometry.fit import nearest_place
from ..geometry.kernel_cache import KernelCache, cache_folder
from ..geometry.mesh import TriangleMesh
from ..geometry.path import SplinePath
from ..geometry.proximity import ProximityTree
from ..imaging.sampling import sample_plane, sample_points
from ..robots import PlacedRobot, RobotModel, Tool
from .dry_run import dry_run
from .rigid import RigidSystem
from .scene import Scene
from .warm_up import warm_up

# Of two processes; the second parts put kernels of both first ones into theirs.
HALVES = (("surface", "distances"), ("parts", "control"))
HALF_SECONDS = 600.0  # a process that takes longer hangs
_LOOK_S = 0.1
_DONE = "prepared"
_GO = b"."
_idle = threading.Event()
_idle.set()
_NOT_KEPT = 3  # exit status of a process whose kernels could not all be written
KEPT_KERNELS = 117  # that are in the folder at the end, for the progress


def is_prepared() -> bool:
    """Whether nothing is to be done: all is compiled already, or what is compiled cannot be kept in our folder."""
    folder = cache_folder()
    if os.environ.get("NUMBA_CACHE_DIR") or folder is None:
        return True
    return (folder / _DONE).exists() or not os.access(folder, os.W_OK)


def progress() -> float:
    """Share of the kernels that are compiled and kept already, below 1 as long as it goes on."""
    folder = cache_folder()
    return 0.99 if folder is None else min(_count(folder) / KEPT_KERNELS, 0.99)


def prepare() -> None:
    """Compile everything, two halves at once; returns when it is done.

    Raises subprocess.SubprocessError when a half fails, OSError when it cannot even begin; the kernels are then
    compiled where they are first called.
    """
    folder = cache_folder()
    if is_prepared() or folder is None:
        return
    _idle.clear()
    try:
        if _run_halves():  # else the disk is full: the next start tries again
            with suppress(OSError):
                (folder / _DONE).touch()
    finally:
        _idle.set()


def _count(folder: Path) -> int:
    return sum(1 for _ in folder.glob("*.nbi"))


def wait(go_on: Callable[[], object] = bool) -> None:
    """Return once no preparation runs in this process: compiling the same a second time would slow both down.

    go_on: called now and then; what it raises ends the waiting.
    """
    while not _idle.wait(_LOOK_S):
        go_on()


def _run_halves() -> bool:
    """Both at once, in threads that keep no planner from ending: its end is theirs. Whether all kernels were kept."""
    meeting, failures, kept = threading.Barrier(len(HALVES)), list[Exception](), list[bool]()

    def run(parts: Sequence[str]) -> None:
        try:
            kept.append(_run_half(parts, meeting))
        except Exception as failure:  # whatever it is, the other half does not wait for this one
            failures.append(failure)
            meeting.abort()

    threads = [threading.Thread(target=run, args=(half,), daemon=True) for half in HALVES]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]
    return all(kept)


def _run_half(parts: Sequence[str], meeting: threading.Barrier) -> bool:
    """One process with its parts; after each but the last it waits until the other half is as far.

    Returns whether all of its kernels were kept.
    """
    root = str(Path(__file__).resolve().parents[2])
    paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "vfix_engine.simulation.preparation", *parts]
    environment = {**os.environ, "PYTHONPATH": paths}
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        late = threading.Timer(HALF_SECONDS, process.kill)
        late.daemon = True
        late.start()
        try:
            while process.stdout.readline():
                meeting.wait()
                process.stdin.write(_GO)
                process.stdin.flush()
        except threading.BrokenBarrierError:
            process.kill()
        finally:
            status = process.wait()
            late.cancel()
    if status not in (0, _NOT_KEPT):
        meeting.abort()
        raise subprocess.CalledProcessError(status, command)
    return status == 0


def _compile(parts: Sequence[str]) -> None:
    """What one of these processes does."""
    go = threading.Event()
    threading.Thread(target=_listen, args=(go,), daemon=True).start()
    gc.disable()  # compilers make many objects and little garbage; looking for it took a tenth of the time
    for place, compile_part in enumerate([_PARTS[part] for part in parts]):
        if place > 0:
            print(flush=True)
            go.wait()
            go.clear()
        compile_part()
    os._exit(
        0 if KernelCache.all_kept else _NOT_KEPT
    )  # nothing is left to be done, and taking all of it apart takes a second


def _listen(go: threading.Event) -> None:
    """The planner holds the other end of stdin; when it ends, so does this process."""
    while os.read(0, 1):
        go.set()
    os._exit(1)


def _tube() -> TriangleMesh:
    """A small stand-in for anatomy: a tube along y from the origin, which bounds the tip; the shaft is outside."""
    around = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    along = np.linspace(0.0, 60.0, 40)
    y, angle = np.meshgrid(along, around, indexing="ij")
    vertices = np.column_stack([4.0 * np.cos(angle).ravel(), y.ravel(), 4.0 * np.sin(angle).ravel()])
    i, j = np.meshgrid(np.arange(39), np.arange(24), indexing="ij")
    a, b = (i * 24 + j).ravel(), (i * 24 + (j + 1) % 24).ravel()
    return TriangleMesh(
        vertices, np.concatenate([np.column_stack([a, b, a + 24]), np.column_stack([b, b + 24, a + 24])])
    )


def _surface() -> None:
    tree, (robot, tool) = ProximityTree(_tube()), _robot()
    # When the tree stands, what this needs is there from the other process, which will put it into the certificate.
    compile_ahead.call_motion(robot, tool, ControlSettings())
    tree.candidates(tool.segments(np.eye(3), np.zeros(3)), 3.0)
    compile_ahead.call_solver(robot, tool, ControlSettings())


def _parts() -> None:
    compile_ahead.call_parts(*_robot(), ControlSettings())
    path = SplinePath(np.array([[0.0, 0, 0], [0, 10, 0.5], [0, 20, 0]]))
    path.position(np.linspace(0.0, path.length, 5))
    path.closest(np.array([0.1, 5.0, 0.2]))


def _robot() -> tuple[PlacedRobot, Tool]:
    """A robot with its tip at the origin."""
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    return robot.placed(_base(tool), tool), tool


def _base(tool: Tool) -> NDArray[np.float64]:
    base = np.eye(4)
    base[:3, 3] = -tool.tip_in_flange
    return base


def _distances() -> None:
    """What a page asks a tree; what it never asks is compiled by who does."""
    tree, segments = ProximityTree(_tube()), Tool.load("bent_30").segments(np.eye(3), np.zeros(3))
    tree.clearance(segments, 3.0)
    nearest_place(tree, np.array([2.5, 5.0, 0.0]), 1.8, inside_bone=None)
    _slices()


def _slices() -> None:
    grey = np.zeros((4, 5, 6), dtype=np.int16)
    sample_points(grey, np.ones((2, 3)), -1024.0)
    axis = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.5, 0.0])
    sample_plane(grey, np.ones(3), *axis, (4, 4), -1024.0)


def _control() -> None:
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    scene = Scene(ProximityTree(_tube()), robot, tool, _base(tool), np.zeros(len(robot.joints)))
    settings = ControlSettings()
    warm_up(RigidSystem(scene, settings))  # first what this half alone compiles, then what the other one has done
    path = SplinePath(np.array([[0.0, 0, 0], [0, 10, 0], [0, 20, 0]]))
    scene = replace(scene, path=path, targets=np.array([[0.0, 18.0, 1.0]]), target_names=("ahead",))
    warm_up(RigidSystem(scene, settings))
    dry_run(scene, settings)


_PARTS: dict[str, Callable[[], None]] = {
    "surface": _surface, "parts": _parts, "distances": _distances, "control": _control,
}  # fmt: skip

if __name__ == "__main__":
    _compile(sys.argv[1:])
