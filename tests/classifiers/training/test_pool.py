"""Examples that are kept to be seen again."""

from __future__ import annotations

import threading

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from classifiers.training.augment import MOST_FACES, Names  # noqa: E402
from classifiers.training.pool import FIRST, Pool  # noqa: E402
from facs_rig import LANDMARKS, TWELVE  # noqa: E402

NAMES = Names.of(TWELVE, LANDMARKS)
SIZE = 4


def batch(number: int) -> dict[str, np.ndarray]:
    units, places = len(TWELVE), len(LANDMARKS)
    return {
        "ink": np.full((SIZE, 32, 32), 120, np.uint8),
        "kind": np.full(SIZE, number),
        "active": np.zeros((SIZE, units), np.float32),
        "intensity": np.zeros((SIZE, units), np.float32),
        "angles": np.zeros((SIZE, 3), np.float32),
        "landmarks": np.full((SIZE, places, 2), 0.5, np.float32),
        "boxes": np.full((SIZE, MOST_FACES, 3), np.nan, np.float32),
    }


def pool_of(batches, room=1000):
    return Pool(iter(batches), NAMES, room, SIZE, torch.device("cpu"))


def seen(pool, times):
    return {int(kind) for _ in range(times) for kind in next(pool)["kind"]}


def test_all_that_was_made_is_seen_and_seen_again():
    pool = pool_of(batch(k) for k in range(FIRST + 3))
    assert seen(pool, 400) == set(range(FIRST + 3))
    assert pool.made == SIZE * (FIRST + 3)
    pool.close()
    assert not pool._thread.is_alive()


def test_the_oldest_make_room():
    room = SIZE * 5 + 2  # batches do not fit evenly
    pool = pool_of((batch(k) for k in range(FIRST + 4)), room)
    seen(pool, 50)
    assert pool.made == SIZE * (FIRST + 4)
    assert seen(pool, 300) == set(range(FIRST - 2, FIRST + 4))
    pool.close()


def test_learning_goes_on_while_nothing_new_comes():
    go_on = threading.Event()

    def slow():
        yield from (batch(k) for k in range(FIRST))
        go_on.wait(20)

    pool = pool_of(slow())
    assert seen(pool, 60) <= set(range(FIRST))
    go_on.set()
    pool.close()


def test_what_went_wrong_in_a_worker_is_told():
    def broken():
        yield batch(0)
        raise OSError("the disk is gone")

    pool = pool_of(broken())
    with pytest.raises(OSError, match="the disk is gone"):
        next(pool)
    pool.close()
