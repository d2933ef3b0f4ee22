"""Study II of Kwok 2013: what planning of a line, the base's pose and the rest shape are worth.

`python -m benchmarks.lumen_cavity [--places N]`: the share of unselected places on the wall whose line can be traced,
for bases and rest shapes, and the lines that a hand without a plan traces on labels that can be traced.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np

from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.runtime.command import BUTTON_CUT, no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.operator import Act
from vfix_engine.study.diathermy.bend_map import BendMap
from vfix_engine.study.diathermy.labels import HALF_MM, Label, marker_on
from vfix_engine.study.diathermy.placing import LABELS, PlacedLabels, drawn_label, placed_labels
from vfix_engine.study.diathermy.task import DiathermySample, first_state, stepped
from vfix_engine.study.diathermy.tracing import Tracer
from vfix_engine.worlds.snake.cavity import CavityCase, cavity_case

_LONGEST_S, _SPEED_MM_PER_S = 30.0, 40.0  # of a hand without a plan, for one label


def turned_base(case: CavityCase, roll_deg: float, incline_deg: float) -> CavityCase:
    """The case with its base turned about z and then about x."""
    roll, lean = math.radians(roll_deg), math.radians(incline_deg)
    about_z, about_x = np.eye(4), np.eye(4)
    about_z[:2, :2] = [[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]]
    about_x[1:3, 1:3] = [[math.cos(lean), -math.sin(lean)], [math.sin(lean), math.cos(lean)]]
    base = case.base.copy()
    base[:3, :3] = (about_x @ about_z)[:3, :3]
    return replace(case, base=base)


def rests() -> dict[str, Array]:
    """Rest shapes by name: an arch, and an S in two directions."""
    arch, ess, both = np.zeros(10), np.zeros(10), np.zeros(10)
    arch[1::2] = math.radians(12.0)
    ess[1::2] = np.radians([25.0, 10.0, -10.0, -25.0, -25.0])
    both[0::2], both[1::2] = np.radians([15.0, 0, -15.0, -15.0, 0]), np.radians([15.0, 5.0, -5.0, -15.0, -15.0])
    return {"arch of 60°": arch, "S of 35° and back": ess, "S about both axes": both}


def traceable(case: CavityCase, q_nominal: Array | None, places: list[Label]) -> str:
    """Of places, how many lines can be traced."""
    try:
        bends = BendMap(replace(case.script(), q_nominal=q_nominal).build())
    except InputError as error:
        return f"not possible: {error}"
    tracer = Tracer(bends, Wall(case.mesh))
    found = sum(tracer.trace(label) is not None for label in places)
    return f"{found} of {len(places)} places, {int(bends.free.sum())} free bends"


def pulled_straight(case: CavityCase, placed: PlacedLabels) -> int:
    """Lines that a hand traces which pulls the camera straight towards what it aims at, certified."""
    driver, task = Driver(case.script("certified").build()), first_state(placed.labels)
    sight = Wall(case.mesh).free
    for number, label in enumerate(placed.labels):
        aim, until = -HALF_MM, driver.state.t + _LONGEST_S
        while driver.state.t < until and task.labels[number].done_s is None:
            camera = case.snake.camera(driver.state.q, case.base)
            marker = marker_on(label, camera)
            if marker is not None and math.hypot(marker.along - aim, marker.across) < 0.5:
                aim = min(aim + 0.04, HALF_MM + 0.5)
            x, y, z = camera[:3, :3].T @ (label.at(aim) - camera[:3, 3])
            size = max(math.hypot(x, y), 1e-9)
            speed = _SPEED_MM_PER_S if z <= 0.0 else min(4.0 * size + 0.5, _SPEED_MM_PER_S)
            axes = (float(x / size * speed), float(y / size * speed), 0.0)
            state = driver.act(Act(replace(no_command(), axes=axes, buttons=BUTTON_CUT)))
            camera = case.snake.camera(state.q, case.base)
            task = stepped(placed.labels, task, DiathermySample(state.t, camera, True), sight)
    return task.traced


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=120)
    parser.add_argument("--seeds", type=int, default=5)
    args = parser.parse_args()
    case, random = cavity_case(), np.random.default_rng(0)
    wall, places = Wall(case.mesh), list[Label]()
    while len(places) < args.places:
        label = drawn_label(case, wall, random, len(places) % LABELS)
        if label is not None:
            places.append(label)
    for roll, lean in ((0.0, 0.0), (22.5, 0.0), (45.0, 0.0), (0.0, -12.0), (0.0, -25.0), (45.0, -25.0)):
        print(
            f"base rolled {roll:g}°, inclined {lean:g}°: {traceable(turned_base(case, roll, lean), None, places)}",
            flush=True,
        )
    for name, q in rests().items():
        print(f"rest an {name}: {traceable(case, q, places)}", flush=True)
    bends = BendMap(case.script().build())
    for seed in range(1, args.seeds + 1):
        print(
            f"seed {seed}, pulled straight: {pulled_straight(case, placed_labels(case, bends, seed))} of {LABELS}",
            flush=True,
        )


if __name__ == "__main__":
    main()
