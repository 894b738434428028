"""Examples that are kept, to be seen again: for devices that learn faster than cores can draw."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from .augment import Names
from .jitter import jittered

FIRST = 8  # batches to wait for before anything is learnt
WAITING = 16  # batches at most between the workers and the device


class Pool:
    """Batches by lot of all examples that were made so far, at most `room`, each changed a little.

    Batches come as of `common.Batches` with a pool, their ink as bytes, and are kept on the
    device. A thread takes what the workers have made, so that learning never waits for drawing.
    """

    def __init__(
        self, batches: Iterator[dict[str, np.ndarray]], names: Names, room: int, size: int,
        device: torch.device,
    ) -> None:  # fmt: skip
        self.names, self.room, self.size, self.device = names, room, size, device
        self.made = 0
        self._kept: dict[str, Tensor] = {}
        self._queue: queue.Queue = queue.Queue(WAITING)
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._fetch, args=(batches,), daemon=True)
        self._thread.start()

    def _fetch(self, batches: Iterator[dict[str, np.ndarray]]) -> None:
        try:
            for batch in batches:
                while not self._closed.is_set():
                    try:
                        self._queue.put(batch, timeout=0.5)
                        break
                    except queue.Full:
                        continue
                if self._closed.is_set():
                    return
        except Exception as error:  # told where the batches are used
            self._queue.put(error)

    def close(self) -> None:
        self._closed.set()
        self._thread.join(timeout=10)

    def __iter__(self) -> Pool:
        return self

    def __next__(self) -> dict[str, Tensor]:
        # At most one at a time: as many may come as can be drawn, and learning is to go on.
        while self.made < FIRST * self.size:
            self._add(self._queue.get())
        if not self._queue.empty():
            self._add(self._queue.get())
        rows = torch.randint(min(self.made, self.room), (self.size,), device=self.device)
        batch = {name: values[rows] for name, values in self._kept.items()}
        batch["ink"] = batch["ink"][:, None].float() / 255
        return jittered(batch, self.names)

    def _add(self, batch: dict[str, np.ndarray] | Exception) -> None:
        if isinstance(batch, Exception):
            raise batch
        count = len(batch["ink"])
        if not self._kept:
            self._kept = {
                name: torch.empty(
                    (self.room, *values.shape[1:]), device=self.device,
                    dtype=torch.as_tensor(values).dtype,
                )
                for name, values in batch.items()
            }  # fmt: skip
        first = self.made % self.room
        fits = min(count, self.room - first)
        for name, values in batch.items():
            new = torch.as_tensor(values)
            self._kept[name][first : first + fits] = new[:fits].to(self.device)
            self._kept[name][: count - fits] = new[fits:].to(self.device)
        self.made += count
