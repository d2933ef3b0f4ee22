"""Values of `Volume.sample` in a file, which the page's tests compare their own cut of a volume with."""

import json
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.files.volume import Volume

SAMPLES = Path(__file__).resolve().parents[2] / "web" / "volume-samples.json"


def _made() -> dict[str, object]:
    """A small tilted, left-handed volume with anisotropic voxels, and its values at places in, on and outside it."""
    random = np.random.default_rng(20)
    shape = (5, 6, 7)
    hu = random.integers(-1024, 3072, shape).astype(np.int16)
    direction = np.linalg.qr(random.normal(size=(3, 3)))[0]
    direction[:, 2] *= -np.sign(np.linalg.det(direction))
    volume = Volume(hu, np.array([-3.5, 12.0, 40.25]), np.array([0.4, 0.7, 1.3]), direction)
    last = np.array(shape[::-1]) - 1.0
    inner = random.uniform(0.0, last, (200, 3))
    rim = inner[:60].copy()
    rim[np.arange(60), np.arange(60) % 3] = np.where(np.arange(60) < 30, 0.0, last[np.arange(60) % 3])
    corners = np.array(np.meshgrid(*([0.0, end] for end in last))).T.reshape(-1, 3)
    beyond = inner[:40].copy()
    beyond[np.arange(40), np.arange(40) % 3] = np.where(np.arange(40) < 20, -0.01, last[np.arange(40) % 3] + 0.01)
    places = volume.index_to_lps(np.concatenate([inner, rim, corners, beyond]))
    values = volume.sample(places, outside=np.nan)
    return {
        "shape": list(shape[::-1]),
        "transform_index_to_lps": volume.transform_index_to_lps.tolist(),
        "hu": hu.ravel().tolist(),
        "places": places.tolist(),
        "values": [None if np.isnan(value) else value for value in values.tolist()],
    }


def test_the_page_is_compared_with_what_the_engine_samples_now() -> None:
    kept, made = json.loads(SAMPLES.read_text(encoding="utf-8")), _made()
    assert kept["hu"] == made["hu"]
    for name in ("transform_index_to_lps", "places"):
        assert np.array(kept[name]) == pytest.approx(np.array(made[name]), abs=1e-9)
    assert [value is None for value in kept["values"]] == [value is None for value in made["values"]]  # type: ignore[attr-defined]
    known = [(one, other) for one, other in zip(kept["values"], made["values"], strict=True) if one is not None]  # type: ignore[call-overload]
    assert np.array(known)[:, 0] == pytest.approx(np.array(known)[:, 1], abs=1e-6)


if __name__ == "__main__":  # after a change of the sampling: python tests/engine/files/test_volume_samples.py
    SAMPLES.write_text(json.dumps(_made()) + "\n", encoding="utf-8")
