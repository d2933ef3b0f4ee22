"""What a run of a snake robot in a lumen is worth, and its series."""

from __future__ import annotations

from pydantic import BaseModel

from app.api.score_parts import HeldPublic, HoldPublic, MeanMaxPublic, Numbers, Triple


class DeviationPublic(BaseModel):
    """Times in which any of the last links was outside the pathway, in one piece each; longest_s: of the longest.

    length_mm: the tip's way while the last link is outside; depth_mm: of the deepest link, its mean over time_s.
    """

    episodes: int
    time_s: float
    longest_s: float
    length_mm: float
    depth_mm: MeanMaxPublic | None


class BehindWallPublic(BaseModel):
    """What a certificate of the pathway does not speak of; see docs/metrics.md.

    share: of the pathway's surface behind the wall, depth_mm: its largest depth there. links_mm: the most that a link
    was behind the wall, null where the tissue moves.
    """

    share: float
    depth_mm: float
    links_mm: float | None


class ScoreRowPublic(BaseModel):
    """A figure of a task as it is shown; value null where it is not defined, worse where it is to stand out."""

    name: str
    value: float | None
    unit: str
    digits: int
    worse: bool


class TaskItemPublic(BaseModel):
    """A polyp or label of a task. name: with its number, as in the pictures; done_s: when, null where it was not.

    share: of a label's arrow that was cut; of a polyp 1 or 0.
    """

    name: str
    done_s: float | None
    share: float


class TaskScorePublic(BaseModel):
    """What a run of a task is worth.

    result: the outcome in words, '' where there are none; lacking: what of it is not known and why, '' for nothing.
    items: by their numbers, none where that is not known.
    """

    title: str
    completed: bool
    rows: list[ScoreRowPublic]
    lacking: str
    result: str = ""
    items: list[TaskItemPublic]


class LumenScorePublic(BaseModel):
    """The score of a run in a lumen, see docs/metrics.md; lengths in mm, times in s, forces in N.

    completed: its task was done, or without one the tip came to the end of its way. depth_mm: its deepest place;
    length_mm, reach_mm: of the robot's way, and how far along it this robot can come; share: of length_mm. insertion_s:
    until the deepest place; withdrawal_s: from then until the tip was out, null where it was not. All from depth_mm on
    are null on a fixed base, from which nothing is inserted. deviation: of the last links, nearest_mm: of the link
    nearest to its bound; both null in a run whose rows do not have them. bound_mm: the largest bound of any link.
    behind_wall: null without the lumen's surface. held_by: the longest first; holds: in the
    order of time. task: what the run's task adds, null without one.
    """

    world: str
    arm: str | None
    certified: bool
    whole: bool
    lost: int
    completed: bool
    samples: int
    time_s: float
    depth_mm: float | None
    length_mm: float | None
    reach_mm: float | None
    share: float | None
    insertion_s: float | None
    withdrawal_s: float | None
    path_length_mm: float
    deviation: DeviationPublic | None
    nearest_mm: MeanMaxPublic | None
    bound_mm: float
    beyond_bound_mm: float
    beyond_bound_s: float
    behind_wall: BehindWallPublic | None
    force_n: MeanMaxPublic
    held_s: float
    held_by: list[HeldPublic]
    task: TaskScorePublic | None
    holds: list[HoldPublic]


class LumenSeriesPublic(BaseModel):
    """The series of a run in a lumen at 20 Hz at most, n samples of a robot of L links; LPS mm.

    t_s (n): driven time. chain_mm (n, L + 1): the joints from the base on, last the tip; radius_mm: of a link. eye,
    shaft, side (n): the camera's place, the way it looks, and up in its picture. depth_mm (n): of the tip along the
    pathway; speed_mm_per_s (n): of the insertion. deviation_mm, bound_mm, link (n): of the link nearest to its bound
    in the interval, null and 0 while none is inside; beyond_mm (n): beyond it, negative within it. distal_mm (n):
    largest depth of the last links outside the pathway. bend (n): r. force_n (n): on the hand, guidance_n: the part
    of it that leads away from the wall; guidance_xy_n, resistance_xy_n (n): that part and the rest at t_s, to the
    right in the picture and down, null in runs of before they were recorded. held (n): 1 where a command was held;
    limit, limit_link (n): what held it, a number of limits, and the link whose bound that is, 0 for none.
    """

    run: str
    world: str
    arm: str | None
    certified: bool
    limits: list[str]
    radius_mm: float
    t_s: list[float]
    chain_mm: list[list[Triple]]
    eye: list[Triple]
    shaft: list[Triple]
    side: list[Triple]
    depth_mm: list[float]
    speed_mm_per_s: list[float]
    deviation_mm: Numbers
    bound_mm: Numbers
    link: list[int]
    beyond_mm: Numbers
    distal_mm: list[float]
    bend: list[float]
    force_n: list[float]
    guidance_n: Numbers
    guidance_xy_n: list[tuple[float | None, float | None]]
    resistance_xy_n: list[tuple[float | None, float | None]]
    held: list[int]
    limit: list[int]
    limit_link: list[int]
