"""Trials on all cores: the same results whoever runs them, and after a worker was killed."""

import os
import signal
from pathlib import Path

import pytest

from vfix_engine.errors import ControlError, InputError
from vfix_engine.study.farm import run_all


def squared(key: int) -> int:
    return key * key


def refuses(key: int) -> int:
    raise InputError(f"no trial {key}")


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
