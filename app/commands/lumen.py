"""`vfix lumen`: drive a snake robot through a hollow organ without the page; prints the measurements."""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app.commands.lumen_options import lumen_surface, lumen_tissue, open_words, place, read_landmarks
from app.commands.lumen_task import add_task, run_task
from app.commands.lumen_viewable import add_viewable, run_viewable
from app.commands.run_recording import RunRecording
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.files.frame_report import FRAMES, MM_PER_UNIT
from vfix_engine.files.mesh_files import write_ply
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway_surface import pathway_surface
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.drive_lumen import OPERATORS, DriveReport, DriveSettings, Shot, drive_lumen
from vfix_engine.worlds.snake.picture.picture import LumenPictures
from vfix_engine.worlds.snake.plans.look_plan import view_of
from vfix_engine.worlds.snake.presets import PRESETS
from vfix_engine.worlds.snake.settings import ARMS, CONTROLS
from vfix_engine.worlds.snake.stepping.state import SnakeState


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("lumen", help="drive a snake robot through a lumen", description=__doc__)
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    add_viewable(actions)
    drive = actions.add_parser("drive", help="insert it, and look round at each landmark")
    # A place to the patient's right begins with a minus, which is no option.
    drive._negative_number_matcher = re.compile(r"^-[\d.]")
    drive.add_argument("surface", metavar="SURFACE", type=Path, help="the lumen's closed surface (.stl, .ply, .obj)")
    drive.add_argument("--frame", choices=FRAMES, help="of the surface, where its file does not say")
    drive.add_argument("--unit", choices=tuple(MM_PER_UNIT), help="of the surface, where its file does not say")
    drive.add_argument("--start", type=place, required=True, metavar="X,Y,Z", help="where it goes in, LPS mm")
    drive.add_argument("--end", type=place, required=True, metavar="X,Y,Z", help="where the way ends, LPS mm")
    drive.add_argument("--preset", choices=tuple(PRESETS), help="a paper's robot and printed parameters")
    drive.add_argument(
        "--links", type=links, default=argparse.SUPPRESS, metavar="N",
        help="links of 28 mm; auto: as many as it takes to the end",
    )  # fmt: skip
    drive.add_argument("--landmarks", metavar="FILE", help="JSON with places to look round at; none: only at the end")
    drive.add_argument("--operator", choices=OPERATORS, default="scripted", help="whose hand it is")
    drive.add_argument("--arm", choices=ARMS, help="what holds the links: the hand, forces on it, or the certificate")
    drive.add_argument("--control", choices=CONTROLS, help="what bends the last links")
    drive.add_argument("--contours", type=int, help="that are fitted to the surface")
    drive.add_argument("--interpolated", type=int, help="contours made of them")
    drive.add_argument("--angles", type=int, help="radii of a contour; 1: circles")
    drive.add_argument("--quantile", type=float, metavar="Q", help="of the radii measured")
    drive.add_argument("--radius", type=float, metavar="MM", help="of the robot")
    drive.add_argument("--bound", type=float, metavar="MM", help="how far a link may leave the pathway, everywhere")
    drive.add_argument("--tip-bound", type=float, metavar="MM", help="how far the last link may")
    drive.add_argument("--anyway", action="store_true", help="go on where the lumen is narrower than the robot")
    drive.add_argument("--back", action="store_true", help="draw it out again at the end")
    drive.add_argument("--waypoint", type=float, metavar="MM", help="of insertion between two conforming shapes")
    drive.add_argument("--breathing", type=float, metavar="MM", help="the pathway moves to and fro by so much")
    drive.add_argument("--peristalsis", type=float, metavar="SHARE", help="waves narrow the pathway by that share")
    drive.add_argument("--pictures", type=Path, metavar="FOLDER", help="a picture for each landmark")
    drive.add_argument("--pathway", type=Path, metavar="FILE.ply", help="keep the surface that the links are held to")
    drive.add_argument("--seed", type=natural, default=0, help="of the adversarial hand")
    drive.add_argument("--json", action="store_true", help="one JSON object on stdout")
    add_task(actions)
    return parser


def links(text: str) -> int | None:
    """An integer of at least 1, or None for 'auto'."""
    if text == "auto":
        return None
    if not text.isascii() or not text.isdigit() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text!r:.20} is no number of links: write 1 or more, or auto")
    return int(text)


def natural(text: str) -> int:
    """An integer of at least 0."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is negative")
    return number


def run(args: argparse.Namespace) -> int:
    """Exit status 0 when the tip reached its target and no link left its bound, 1 otherwise; or that of its action."""
    other = {"task": run_task, "viewable": run_viewable}.get(args.action)
    if other is not None:
        return other(args)
    if args.pathway is not None and args.pathway.suffix.lower() != ".ply":
        raise InputError(f"the pathway is written as .ply, not to {args.pathway.name}")
    mesh, assumed = lumen_surface(args.surface, args.frame, args.unit)
    warned = [words for words in (assumed, open_words(mesh)) if words]
    for words in warned:
        print(f"vfix: warning: {words}", file=sys.stderr, flush=True)
    file, landmarks = _landmarks(args.landmarks, args.surface)
    preset = None if args.preset is None else PRESETS[args.preset]
    settings = _settings(args)
    snake = SnakeModel(1) if preset is None else preset.snake
    snake = snake if args.radius is None else replace(snake, radius_mm=args.radius)
    count = getattr(args, "links", None if preset is None else preset.links)
    album = None if args.pictures is None else Album(args.pictures, mesh, landmarks, settings)
    recording = RunRecording(args.seed if args.operator == "adversarial" else None)
    try:
        report = drive_lumen(
            mesh, args.start, args.end, count, landmarks, args.operator, settings, album, snake=snake,
            tissue=lumen_tissue(args.breathing, args.peristalsis), seed=args.seed,
            anyway=args.anyway, back=args.back, record=recording.begin,
            progress=lambda words: print(f"vfix: {words}", file=sys.stderr, flush=True),
        )  # fmt: skip
    except BaseException:
        recording.drop()
        raise
    result = {"surface": args.surface.name, "landmarks_from": file} | report.to_dict()
    result |= {"arm": settings.arm, "certified": settings.arm == "certified"}
    result |= {"preset": None} if preset is None else preset.report()
    result["run"] = recording.keep()
    result["surface_assumed"] = assumed
    result["pictures"] = [] if album is None else album.files
    result["pathway"] = _written(args.pathway, report)
    result["warnings"] = [*warned, *result["warnings"]]
    if args.json:
        print(json.dumps(result, allow_nan=False))
    else:
        _print_for_people(result)
    return 0 if report.reached and report.within_bounds else 1


def _settings(args: argparse.Namespace) -> DriveSettings:
    """The preset's settings, or the usual ones, with those that are named."""
    named = {"bound": "bound_mm", "tip_bound": "tip_bound_mm", "waypoint": "waypoint_mm"}
    same = ("arm", "control", "contours", "interpolated", "angles", "quantile")
    asked = {**{name: name for name in same}, **named}
    changed = {field: getattr(args, name) for name, field in asked.items() if getattr(args, name) is not None}
    return DriveSettings(**changed) if args.preset is None else PRESETS[args.preset].settings(**changed)


def _written(file: Path | None, report: DriveReport) -> str | None:
    """Write the pathway at rest as a surface."""
    if file is None:
        return None
    try:
        write_ply(file, pathway_surface(report.pathway.moved(None)))
    except OSError as error:
        raise InputError(f"the pathway {file} cannot be written: {error.strerror}") from error
    return str(file)


class Album:
    """Draws a picture for every landmark and writes it as a PNG."""

    def __init__(
        self, folder: Path, mesh: TriangleMesh, landmarks: Mapping[str, Array], settings: DriveSettings
    ) -> None:
        self.files: list[str] = []
        self._folder, self._settings = folder, settings
        self._pictures = LumenPictures(mesh, landmarks)
        self._names: list[str] = []
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"the folder {folder} cannot be made: {error.strerror}") from error

    def __call__(self, shot: Shot) -> None:
        """Draw and write one picture."""
        if shot.name not in self._names:
            self._names.append(shot.name)
        picture = self._pictures.draw(
            shot.name, shot.snake, shot.state.q, shot.state.base, shot.state.packed,
            self._settings.manipulated, self._words(shot),
        )  # fmt: skip
        looking = "_looking" if shot.event == "bent" else ""
        name = f"{len(self._names):02d}_{re.sub(r'[^A-Za-z0-9]+', '_', shot.name)}{looking}.png"
        encoded = cv2.imencode(".png", picture[..., ::-1])[1]
        try:
            (self._folder / name).write_bytes(encoded.tobytes())
        except OSError as error:
            raise InputError(f"the picture {name} cannot be written: {error.strerror}") from error
        self.files.append(str(self._folder / name))

    def _words(self, shot: Shot) -> list[str]:
        state = shot.state
        inside = state.deviation.depth[state.measured]
        at_limit = int((np.abs(state.q) >= shot.snake.q_max - 1e-9).sum())
        doing = f"looking {_turned(shot)} degrees aside" if shot.event == "bent" else "just arrived"
        deepest = f"{inside.max():.1f} mm" if len(inside) else "not measured, no link is inside yet"
        return [
            f"{shot.snake.links} links, the tip {state.tip_s:.0f} mm in, {doing}",
            f"farthest out of the pathway: {deepest}",
            _allowed(shot.state),
            f"{at_limit} of {shot.snake.dof} joints at their limit",
        ]


def _allowed(state: SnakeState) -> str:
    """The bounds of the links that are inside, where they are."""
    bound = state.bound[state.measured]
    if not len(bound):
        return "allowed: as far as the pathway's radius has it"
    body = f"{bound[:-1].min():.1f} to {bound[:-1].max():.1f} mm, " if len(bound) > 1 else ""
    return f"allowed here: {body}the last link {bound[-1]:.1f} mm"


def _turned(shot: Shot) -> int:
    """Angle between the view and the straight view, in whole degrees."""
    straight = shot.snake.camera(shot.state.q_nominal, shot.state.base)
    return round(math.degrees(view_of(straight, shot.camera[:3, 2]).turned))


def _landmarks(given: str | None, surface: Path) -> tuple[str | None, dict[str, Array]]:
    """The file of the landmarks, by default one beside the surface, and their positions (3,) by name."""
    if given == "none":
        return None, {}
    if given is not None:
        return given, read_landmarks(Path(given))
    beside = [*surface.parent.glob("*_info.json"), *surface.parent.glob("landmarks.json")]
    if len(beside) > 1:
        names = ", ".join(sorted(file.name for file in beside))
        raise InputError(f"landmarks may be in {names}: say which with --landmarks FILE, or --landmarks none")
    return (beside[0].name, read_landmarks(beside[0])) if beside else (None, {})


def _print_for_people(result: Mapping[str, Any]) -> None:
    for name, value in result.items():
        for line in value if name == "landmarks" else [value]:
            print(f"{name:>24}  {json.dumps(line) if isinstance(line, (dict, list)) else line}")
