"""The sections of the Drive tab, made of a snapshot."""

from __future__ import annotations

import math

import numpy as np

from app.drives.drive_record import DriveRecord
from app.drives.view import FREE, place
from app.lumen.document import StoredRoute
from app.lumen.paths import RoutePath
from app.lumen.robot_wall import RobotWall
from app.tabs.drive.preparation import PreparedSnake
from app.tabs.drive.sections import BehindWallView, DeepestLinkView, LinkView, SnakeView
from app.workspace.sections import ScopePoseView, ScopeSection
from vfix_engine.worlds.snake.settings import DriveSettings, SnakeSettings
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

NEAR_SHARE = 0.98  # of a bound: a motion outwards is cut short from there on
NEAR_END_MM = 0.5  # of the way

SnakeRecord = DriveRecord[PreparedSnake, SnakeSnapshot]


def snake_section(now: SnakeRecord, shown: bool = False) -> SnakeView | None:
    """The figures of the newest snapshot; None without a robot. shown: the client sees the control bends."""
    snapshot, prepared = now.snapshot, now.prepared
    if snapshot is None or prepared is None:
        return None
    settings, drive = snake_settings(now) or prepared.settings, prepared.drive
    return {
        "depth_mm": round(float(snapshot.progress_mm), 1),
        "length_mm": round(float(snapshot.length_mm), 1),
        "passed": passed(prepared, float(snapshot.progress_mm)),
        "links": prepared.path.snake.links,
        "links_inside": snapshot.links_inside,
        "nearest": _nearest(snapshot),
        "bend": round(float(snapshot.bend), 3),
        "straight": snapshot.straight,
        "can_look": snapshot.can_look,
        "doing": snapshot.doing,
        "insertion_mm_per_s": settings.insertion_mm_per_s,
        "camera_mm_per_s": settings.camera_mm_per_s,
        "breathing_mm": prepared.route.breathing_mm,
        "arm": drive.arm,
        "certified": snapshot.certified,
        "joint": snapshot.hand_joint,
        "yield_mm_per_s_per_n": drive.yield_mm_per_s_per_n if drive.arm == "guided" else 0.0,
        "behind": behind_wall(prepared.path, drive),
        "deepest": None if prepared.wall is None else deepest_link(prepared.wall, snapshot),
        "steered": drive.control == "parameterised",
        "shown": shown,
        "lens_mm": None if prepared.wall is None else round(prepared.wall.lens_mm(snapshot.camera), 1),
        "fixed": prepared.path.base is not None,
    }


def snake_settings(now: SnakeRecord) -> SnakeSettings | None:
    """The settings in force, or those that the robot was prepared with; None without a robot."""
    if isinstance(now.settings, SnakeSettings):
        return now.settings
    return None if now.prepared is None else now.prepared.settings


def passed(prepared: PreparedSnake, depth_mm: float) -> str:
    """The last landmark behind the tip, '' for none."""
    return next((name for s, name in reversed(prepared.landmarks) if s <= depth_mm), "")


def behind_wall(path: RoutePath, drive: DriveSettings) -> BehindWallView | None:
    """How much of a pathway is behind the wall, and how far a link of a drive may leave it."""
    found = path.reach.behind_wall
    if found is None:
        return None
    return {
        "share": round(found.outside, 4),
        "depth_mm": round(found.depth_mm[-1], 2),
        "bound_mm": round(path.bound_mm(drive), 2),
        "between_mm": math.ceil(100.0 * path.between_vertices_mm) / 100.0,
    }


def deepest_link(wall: RobotWall, snapshot: SnakeSnapshot) -> DeepestLinkView:
    """The link that is deepest behind the wall, at most a moment ago, with its bound now."""
    found = wall.deepest(snapshot)
    bound = float(snapshot.bounds[found.link - 1]) if found.link else math.inf
    known = math.isfinite(bound)  # a link that is out again since it was measured has none
    return {"depth_mm": round(found.mm, 1), "link": found.link, "bound_mm": round(bound, 2) if known else None}


def _nearest(snapshot: SnakeSnapshot) -> LinkView | None:
    """The link that has used most of its bound; the bounds of links outside are infinite."""
    inside = np.isfinite(snapshot.bounds)
    if not inside.any():
        return None
    link = int(np.where(inside, snapshot.deviations / snapshot.bounds, -1.0).argmax())
    return {
        "link": link + 1,
        "deviation_mm": round(float(snapshot.deviations[link]), 2),
        "bound_mm": round(float(snapshot.bounds[link]), 2),
    }


def free_words(snapshot: SnakeSnapshot) -> str:
    """What to say of a robot that nothing holds now: the end of its way, or a link that is near or beyond its bound."""
    nearest = _nearest(snapshot)
    if nearest is not None:
        used = nearest["deviation_mm"] / nearest["bound_mm"]
        if used > 1.0:
            return f"Nothing, but link {nearest['link']} is beyond its bound"
        if used >= NEAR_SHARE:
            return f"Link {nearest['link']} is at its bound"
    if snapshot.progress_mm >= snapshot.length_mm - NEAR_END_MM:
        return "The end of the way"
    return FREE


def _entry_pose(path: RoutePath) -> ScopePoseView:
    """Where the camera is before the robot is inserted: at the start of the centreline, along it."""
    curve = path.lumen.centreline.curve
    tip, ahead = curve.position(0.0), curve.tangent(0.0)
    up = np.eye(3)[np.abs(ahead).argmin()]
    side = up - (up @ ahead) * ahead
    return {"tip": place(tip), "shaft": place(ahead), "side": place(side / np.linalg.norm(side))}


def scope_section(
    case_id: str | None, key: str, route: StoredRoute | None, path: RoutePath | None, live: bool
) -> ScopeSection:
    """The wall of the open case, and the poses of the route's drive while there is one."""
    words = "No lumen is open." if case_id is None else "" if route is not None else "No route yet. Make one in Route."
    return {
        "surface": "" if case_id is None else f"/api/v1/cases/{case_id}/endoscope",
        "key": key,
        "poses": "" if route is None or not live else f"/api/v1/steps/drive/poses?case={case_id}&plan={route.id}",
        "look": "colon" if path is None or path.base is None else "cavity",
        "hand": True,
        "own": True,
        "pose": None if path is None else _entry_pose(path),
        "words": words,
    }
