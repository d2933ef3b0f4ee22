"""Write assets/studies/colon.json, on which study I of Kwok 2013 runs; a change of it is a new version of the study."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np

from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.study.experiment.colon import ARRAYS, FILE, SCHEMA, hash_of
from vfix_engine.study.polyps.world import polyp_world
from vfix_engine.worlds.snake.presets import PRESETS
from vfix_engine.worlds.snake.spec import LumenContours

SEED = 0  # of the polyps
DIGITS = 4  # of a millimetre


def main() -> None:
    """Prepare the synthetic colon for the paper's robot, place ten polyps, and write what the study needs of both."""
    case, preset = colon_case(), PRESETS["kwok2013"]
    world = polyp_world(
        case.mesh, case.start, case.end, case.course.landmarks, preset.robot(), preset.links,
        preset.settings(arm="certified"), seed=SEED,
    )  # fmt: skip
    contours = LumenContours.of(world.lumen)
    lumen = {name: np.round(getattr(contours, name), DIGITS).tolist() for name in ARRAYS}
    lumen |= {"count": contours.count, "curve_step_mm": contours.curve_step_mm}
    content = {
        "schema": SCHEMA,
        "version": 1,
        "frame": "LPS",
        "unit": "mm",
        "surface_sha256": hash_of(case.mesh),
        "task": world.polyps.task.to_dict(),
        "lumen": lumen,
    }
    lines = [f" {json.dumps(name)}: {json.dumps(value, separators=(',', ':'))}" for name, value in content.items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
