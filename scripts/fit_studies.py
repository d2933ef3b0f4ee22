"""Fit the people and the error chain of the studies to the five figures, and write assets/studies/fitted.json."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from vfix_engine.study.experiment.fit import FILE, fit


def main() -> None:
    """Fit, which takes about ten minutes, and print what the fit reaches."""
    found = fit()
    FILE.write_text(json.dumps(found.to_file(), indent=1) + "\n", encoding="utf-8")
    for name, values in found.to_dict().items():
        print(f"{name}: {values['value']:.4f} reaches {values['reached']:.3f} for {values['paper']}")


if __name__ == "__main__":
    main()
