"""What every kind of training shares: its configuration, its batches, its checkpoints."""

from __future__ import annotations

import logging
import math
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.errors import InputError
from facs_rig.common.files import Outputs

from . import shards
from .augment import NEAR, SHARES, Example, Names, example
from .regions import Outlines
from .targets import Targets

if TYPE_CHECKING:
    from .network import Networks

log = logging.getLogger("classifiers.training")
CHECKPOINT = "checkpoint.pt"


@dataclass(frozen=True)
class Config:
    """Everything that makes a run; it travels with the checkpoint."""

    size: int = 160
    batch: int = 32
    minutes: float = 90.0
    steps: int = 0  # stop after so many steps even if there is time left; 0: never
    rate: float = 2e-3  # AdamW's highest learning rate, for the heads
    trunk_rate: float = 0.6  # of that, for the pretrained trunk
    decay: float = 1e-2
    warm_up: float = 0.03  # share of the budget in which the rate rises
    settle: float = 0.2  # share after which the parts named in `settle` stay as they are (faster)
    settled_blocks: int = 3  # of the trunk, from the page on
    mid_weight: float = 0.3  # how much the units count in crops that are not yet close
    unseen: str = "brush"  # looks that are never trained on, with commas; "" to train on all
    imagenet: bool = True
    seed: int = 1
    threads: int = 2
    workers: int = 1
    checkpoint_minutes: float = 3.0
    device: str = "auto"  # cpu, cuda, or whichever there is
    agree: float = 0.0  # how much it counts that two drawings of one face are read alike
    pool: int = 0  # examples that are kept and seen again, changed a little; 0: each is seen once


class Batches:
    """Batch n of the endless stream of training examples; a map-style data set for a DataLoader."""

    def __init__(
        self, data: shards.DataSet, targets: Targets, rows, names: Names, config: Config,
        shares: Sequence[float] = SHARES,
    ) -> None:  # fmt: skip
        self.data, self.targets, self.names, self.config = data, targets, names, config
        self.shares = shares
        self.rows = np.asarray(rows)
        self._orders: dict[int, np.ndarray] = {}
        twins = data.twins() if config.agree else np.full(len(data), -1)
        self.twins = np.where(np.isin(twins, self.rows), twins, -1)

    def order(self, epoch: int) -> np.ndarray:
        """The drawings in the order of an epoch: every one once."""
        if epoch not in self._orders:
            self._orders = {e: o for e, o in self._orders.items() if e == epoch - 1}
            self._orders[epoch] = np.random.default_rng((self.config.seed, epoch)).permutation(
                self.rows
            )
        return self._orders[epoch]

    def __len__(self) -> int:
        return 1 << 40

    def another(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Some drawing and its landmarks, to stand beside another on a page."""
        row = int(rng.choice(self.rows))
        return self.data.drawings[row], self.targets.landmarks[row]

    def with_twins(
        self, rows: NDArray, flips: NDArray, rng: np.random.Generator
    ) -> tuple[NDArray, NDArray, NDArray]:
        """The rows and as many again, a face's twin or, without one, any other; whether each is
        mirrored, twins alike; and each one's twin in the batch, or -1."""
        others = self.twins[rows]
        alone = others < 0
        others = np.where(alone, rng.choice(self.rows, len(rows)), others)
        here = np.arange(len(rows))
        twin = np.concatenate([here + len(rows), here])
        twin[np.tile(alone, 2)] = -1
        return np.concatenate([rows, others]), np.tile(flips, 2), twin

    def __getitem__(self, step: int) -> dict[str, np.ndarray]:
        seed = self.config.seed
        # With twins, half of a batch are the faces in their order, the others their twins.
        size = self.config.batch // (2 if self.config.agree else 1)
        epoch, place = divmod(step * size, len(self.rows))
        order = self.order(epoch)[place:]
        while len(order) < size:  # a batch may reach into the next epochs
            epoch += 1
            order = np.concatenate([order, self.order(epoch)])
        rng = np.random.default_rng((seed, 0x5E7, step))
        rows = order[:size]
        flips = rng.random(size) < 0.5
        twin = np.full(size, -1)
        if self.config.agree:
            rows, flips, twin = self.with_twins(rows, flips, rng)
        batch = collate(
            [
                example(
                    self.data.drawings[i], self.targets, i, self.names, self.config.size, rng,
                    another=self.another, flip=bool(flip), shares=self.shares,
                    outlines=Outlines.of(self.data.records[i]),
                )
                for i, flip in zip(rows, flips, strict=True)
            ]
        )  # fmt: skip
        batch["twin"] = twin
        if self.config.pool:  # here, where there are many processes, and to send less
            batch["ink"] = np.rint(255 * batch["ink"]).astype(np.uint8)
        return batch


def collate(examples: Sequence) -> dict[str, np.ndarray]:
    """Arrays (b, ...) by the names of an Example's fields."""
    return {f.name: np.stack([getattr(e, f.name) for e in examples]) for f in fields(Example)}


def validation_batch(
    data: shards.DataSet, targets: Targets, rows, names: Names, size: int, limit: int = 400
) -> dict[str, np.ndarray]:
    """Second looks at held-out drawings, drawn over like those of training, always the same."""
    return collate(
        [
            example(
                data.drawings[i], targets, i, names, size, np.random.default_rng((7, int(i))), NEAR
            )
            for i in spaced(rows, limit)
        ]
    )


def spaced(rows: NDArray, limit: int) -> NDArray:
    """At most `limit` of the rows, of all parts of the data alike."""
    some = np.linspace(0, len(rows) - 1, min(limit, len(rows))) if len(rows) else np.empty(0)
    return np.asarray(rows)[some.round().astype(int)]


def usable(data: shards.DataSet, config: Config) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of the drawings to train on, and of those that are held out.

    Raises InputError if there is none to train on.
    """
    held_out = data.held_out()
    unseen = {look for look in config.unseen.split(",") if look}
    strange = np.isin(data.looks, list(unseen))
    rows, kept = np.flatnonzero(~held_out & ~strange), np.flatnonzero(held_out)
    if not len(rows):
        raise InputError("The data set holds no drawing to train on: generate more.")
    return rows, kept


def rate_at(progress: float, config: Config) -> float:
    """Share of the highest learning rate: a short rise, then half a cosine to zero."""
    if progress < config.warm_up:
        return max(progress / config.warm_up, 0.02)
    done = min((progress - config.warm_up) / (1 - config.warm_up), 1.0)
    return 0.5 * (1 + math.cos(math.pi * done)) + 1e-3


def save(path: Path, state: dict[str, Any]) -> None:
    """Write a checkpoint whole or not at all."""
    import torch

    with Outputs() as outputs:
        torch.save(state, outputs.beside(path))


def load_networks(checkpoint: Path) -> tuple[Networks, dict[str, Any]]:
    """The networks of a checkpoint, ready to answer, and its other entries.

    Raises InputError if it is none.
    """
    import torch

    from .network import Networks

    try:
        saved = torch.load(checkpoint, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, pickle.UnpicklingError):
        raise InputError(
            f"{checkpoint} cannot be read: name a checkpoint.pt of a training."
        ) from None
    networks = Networks(saved["aus"], saved["landmarks"], saved["config"]["size"], saved["person"])
    # A checkpoint may be older than a part of the networks.
    lacking, unknown = networks.load_state_dict(saved["networks"], strict=False)
    if unknown or not all(name.startswith(("regions.", "hats.")) for name in lacking):
        raise InputError(f"{checkpoint} is of other networks than these.")
    return networks.eval(), saved
