"""Write assets/studies/cavity.json, for study II of Kwok 2013; a change of it is a new version of the study."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from vfix_engine.study.diathermy.bend_map import BendMap
from vfix_engine.study.diathermy.placing import placed_labels
from vfix_engine.study.experiment.cavity import FILE, SCHEMA
from vfix_engine.study.experiment.colon import hash_of
from vfix_engine.worlds.snake.cavity import cavity_case

SEED = 1  # of the labels


def main() -> None:
    """Draw six labels whose lines can be traced, and write them."""
    case = cavity_case()
    placed = placed_labels(case, BendMap(case.script().build()), SEED)
    content = {
        "schema": SCHEMA,
        "version": 1,
        "frame": "LPS",
        "unit": "mm",
        "surface_sha256": hash_of(case.mesh),
        "labels": [label.to_dict() for label in placed.labels],
    }
    FILE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
