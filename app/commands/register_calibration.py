"""The actions of `vfix register` for calibrations: of the pointer, and of the robot beside the tracker."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.exchange.resolve import read_bytes
from app.link import TrackerClient
from app.operations import verbs
from app.registration.calibrating import Calibrating
from app.registration.calibration import PIVOT_S
from app.registration.calibration_operations import (
    ClearPointer,
    ClearRobot,
    SimulatePointer,
    SimulateRobot,
    TrackPointer,
)
from app.registration.calibration_records import pointer_cautions, robot_cautions
from app.registration.document import StoredRegistration
from app.registration.operations import SPEC
from app.registration.pose_tables import MAX_POSES_BYTES
from app.services import Services
from app.settings import tracker_address
from vfix_engine.errors import InputError

ACTIONS = {
    "pivot": "find the tip of a tracked pointer that was swung about it",
    "robot": "find where the tracker stands beside the robot",
}
_CONNECT_S = 10.0


def add_arguments(every: Mapping[str, argparse.ArgumentParser]) -> None:
    """The options of these actions."""
    every["pivot"].add_argument("--csv", type=Path, metavar="FILE", help="poses of the pointer")
    every["pivot"].add_argument("--tracker", metavar="HOST:PORT/NAME", help="a tracking server, whose pointer is swung")
    every["pivot"].add_argument(
        "--seconds", type=float, default=PIVOT_S, metavar="S", help="that it is swung; %(default)g"
    )
    every["robot"].add_argument("--robot-csv", type=Path, metavar="FILE", help="poses of the robot's flange")
    every["robot"].add_argument("--tracker-csv", type=Path, metavar="FILE", help="poses of the marker at those moments")
    for action in ("pivot", "robot"):
        every[action].add_argument("--simulated", type=float, metavar="MM", help="simulate it with this rms noise")
        every[action].add_argument(
            "--seed", type=int, metavar="N", help="of the simulated noise; else another each time"
        )
        every[action].add_argument("--clear", action="store_true", help="forget it")


def run(services: Services, registration_id: str, args: argparse.Namespace) -> tuple[StoredRegistration, list[str]]:
    """Do one of these actions; returns the registration after it, and lines for people. Raises VfixError."""
    if args.action == "pivot":
        done = _pivot(services, registration_id, args)
        return done, _pointer_lines(done)
    done = _robot(services, registration_id, args)
    return done, _robot_lines(done)


def tools_of(document: StoredRegistration) -> dict[str, Any]:
    """The JSON of what a registration was measured with."""
    pointer, robot = document.content.pointer, document.content.robot
    return {
        "pointer": None if pointer is None else {**asdict(pointer), "cautions": pointer_cautions(pointer)},
        "robot": None if robot is None else {**asdict(robot), "cautions": robot_cautions(robot)},
    }


def _pivot(services: Services, key: str, args: argparse.Namespace) -> StoredRegistration:
    _one_of(args, {"--csv": args.csv, "--tracker": args.tracker, "--simulated": args.simulated, "--clear": args.clear})
    if args.csv is not None:
        return services.registering.calibrating.read_pointer(key, _table(args.csv))
    if args.simulated is not None:
        wanted = verbs.asked(SimulatePointer, noise_mm=args.simulated, seed=args.seed)
        return wanted.run(SPEC.context(services), key)
    if args.clear:
        return ClearPointer().run(SPEC.context(services), key)
    seconds = verbs.asked(TrackPointer, seconds=args.seconds).seconds
    with _connected(args) as tracker:
        print(f"Swing the pointer about its tip now, for {seconds:g} s.", file=sys.stderr, flush=True)
        return Calibrating(services.registrations, tracker).track_pointer(key, seconds)


def _robot(services: Services, key: str, args: argparse.Namespace) -> StoredRegistration:
    files = args.robot_csv or args.tracker_csv
    _one_of(args, {"--robot-csv and --tracker-csv": files, "--simulated": args.simulated, "--clear": args.clear})
    if args.simulated is not None:
        wanted = verbs.asked(SimulateRobot, noise_mm=args.simulated, seed=args.seed)
        return wanted.run(SPEC.context(services), key)
    if args.clear:
        return ClearRobot().run(SPEC.context(services), key)
    if args.robot_csv is None or args.tracker_csv is None:
        raise InputError("give both tables: --robot-csv of the flange's poses, --tracker-csv of the marker's.")
    return services.registering.calibrating.read_robot(key, _table(args.robot_csv), _table(args.tracker_csv))


def _one_of(args: argparse.Namespace, given: Mapping[str, Any]) -> None:
    said = [name for name, value in given.items() if value is not None and value is not False]
    if len(said) != 1:
        raise InputError(f"`vfix register {args.action}` needs one of {', '.join(given)}.")


def _table(path: Path) -> bytes:
    data = read_bytes(path)
    if len(data) > MAX_POSES_BYTES:
        raise InputError(f"{path.name} has {len(data):,} bytes; {MAX_POSES_BYTES:,} are allowed for a table of poses.")
    return data


@contextmanager
def _connected(args: argparse.Namespace) -> Iterator[TrackerClient]:
    """A client that sees the pointer. Raises InputError where it does not within some seconds."""
    address = tracker_address(args.tracker)
    tracker = TrackerClient(address.host, address.port, address.name)
    tracker.start()
    try:
        end = time.monotonic() + _CONNECT_S
        while tracker.state != "fresh":
            if time.monotonic() > end:
                raise InputError(f"{tracker.words}.")
            time.sleep(0.02)
        yield tracker
    finally:
        tracker.close()


def _pointer_lines(document: StoredRegistration) -> list[str]:
    pointer = document.content.pointer
    if pointer is None:
        return ["The pointer's tip is forgotten: the tracker tells where it is."]
    x, y, z = pointer.tip
    simulated = ", simulated" if pointer.measured_from == "simulated" else ""
    return [
        f"Tip {x:.2f} {y:.2f} {z:.2f} mm, known to {pointer.tip_error_mm:.2f} mm rms{simulated}",
        f"residual {pointer.residual_mm:.2f} mm rms of {pointer.poses} poses, swung by {pointer.swing_deg:.0f}°",
        *pointer_cautions(pointer),
    ]


def _robot_lines(document: StoredRegistration) -> list[str]:
    robot = document.content.robot
    if robot is None:
        return ["The robot's calibration is forgotten."]
    simulated = ", simulated" if robot.measured_from == "simulated" else ""
    return [
        f"Residuals {robot.translation_residual_mm:.2f} mm and {robot.rotation_residual_deg:.2f}° rms "
        f"of {robot.poses} poses{simulated}",
        *robot_cautions(robot),
    ]
