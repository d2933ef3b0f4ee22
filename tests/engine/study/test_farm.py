"""Trials on all cores: the same results whoever runs them, and after a worker was killed."""

import functools
import os
import signal
from pathlib import Path

import pytest

from vfix_engine.errors import ControlError, InputError
from vfix_engine.study import kept_trials
from vfix_engine.study.farm import run_all
from vfix_engine.study.kept_trials import KeptTrials


def squared(key: int) -> int:
    return key * key


def refuses(key: int) -> int:
    raise InputError(f"no trial {key}")


def logged(key: tuple[str, int], step: int) -> int:
    Path(key[0]).touch()
    return step * key[1]


def killed_once(key: tuple[str, int]) -> int:
    """The worker that comes to number 3 first is killed, as by the system that is out of memory."""
    mark, number = Path(key[0]), key[1]
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def killed(key: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return key


@pytest.mark.parametrize("workers", [1, 2])
def test_results_are_in_the_order_of_their_keys(workers: int) -> None:
    came: list[int] = []
    found = run_all(squared, [3, 1, 2], workers, lambda key, value: came.append(key))
    assert list(found.items()) == [(3, 9), (1, 1), (2, 4)]
    assert sorted(came) == [1, 2, 3]


def test_what_a_killed_worker_had_not_finished_runs_again(tmp_path: Path) -> None:
    keys = [(str(tmp_path / "killed"), number) for number in range(8)]
    found = run_all(killed_once, keys, 2)
    assert (tmp_path / "killed").exists()
    assert [found[key] for key in keys] == [number * number for number in range(8)]


def test_a_trial_that_always_kills_its_worker_ends_with_its_name() -> None:
    with pytest.raises(ControlError, match="1 trials lost their worker 3 times, the first of them 7"):
        run_all(killed, [7], 2)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_study_that_was_interrupted_goes_on_with_what_was_kept(tmp_path: Path, workers: int) -> None:
    """Also with a partial function, a result that was cut, and one of another function with the same key."""
    study = {"study": "squares", "seed": 3}
    interrupted = [(str(tmp_path / str(number)), number) for number in range(6)]
    told: list[int] = []

    def stop(key: tuple[str, int], value: int) -> None:
        told.append(key[1])
        if len(told) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_all(
            functools.partial(logged, step=2), interrupted, workers, stop, kept=KeptTrials(tmp_path / "kept", study)
        )
    ran = {key for key in interrupted if Path(key[0]).exists()}
    kept = sorted((tmp_path / "kept").glob("*.trial"))
    assert 4 <= len(kept) <= len(ran)
    kept[0].write_bytes(b"\x80\x04K" if workers == 1 else b"cno_such_module\nname\n.")
    for key in interrupted:
        Path(key[0]).unlink(missing_ok=True)

    folder = KeptTrials(tmp_path / "kept", study)
    told.clear()
    found = run_all(
        functools.partial(logged, step=2), interrupted, workers, lambda key, value: told.append(key[1]), kept=folder
    )
    assert found == {key: 2 * key[1] for key in interrupted}
    assert sorted(told) == [0, 1, 2, 3, 4, 5], "progress counts what was kept"
    assert sum(Path(key[0]).exists() for key in interrupted) == 7 - len(kept), "the others, and the one that was cut"
    assert folder.get(squared, interrupted[0]) is None


@pytest.mark.parametrize("other", ["study", "engine", "assets", "something else"])
def test_a_folder_of_another_study_is_refused(tmp_path: Path, other: str, monkeypatch: pytest.MonkeyPatch) -> None:
    KeptTrials(tmp_path, {"seed": 1}).add(squared, 3, 9)
    assert KeptTrials(tmp_path, {"seed": 1}).get(squared, 3) == 9
    if other == "engine":
        monkeypatch.setattr(kept_trials, "hash_of_sources", lambda package: b"another")
    elif other == "assets":
        (tmp_path / "assets").mkdir()
        monkeypatch.setattr(kept_trials, "assets_dir", lambda: tmp_path / "assets")
    elif other == "something else":
        (tmp_path / "study.json").unlink()
    with pytest.raises(InputError, match="name another folder"):
        KeptTrials(tmp_path, {"seed": 2 if other == "study" else 1})


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_trial_raises_is_raised(workers: int) -> None:
    with pytest.raises(InputError, match="no trial 4"):
        run_all(refuses, [4], workers)


def test_a_user_who_cancels_ends_it() -> None:
    def cancel(key: int, value: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_all(squared, list(range(50)), 2, cancel)


class Added:
    """A function with data of its own, which is sent to each process once."""

    def __init__(self, mark: Path) -> None:
        self.mark, self.times = mark, 0

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        with self.mark.open("a") as file:
            file.write("x")

    def __call__(self, key: int) -> int:
        return key + 10


def test_the_data_of_all_trials_are_sent_to_each_process_once(tmp_path: Path) -> None:
    found = run_all(Added(tmp_path / "sent"), list(range(20)), 2)
    assert found == {key: key + 10 for key in range(20)}
    assert len((tmp_path / "sent").read_text()) <= 2
