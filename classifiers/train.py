"""Train the networks on shards of generated drawings: `sketch2face train --data DIR`.

One flat script. The schedule follows the clock, not a number of steps: the learning rate reaches
zero when the budget of `--minutes` is used up, however slow the machine or busy its cores. A run
that is interrupted goes on from its last checkpoint when started again with the same `--out`; the
drawings of step n depend on the seed and n alone.
"""

from __future__ import annotations

import argparse
import json
import logging
import math
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from facs_rig import CONTROL_NAMES, DETECTED
from facs_rig.common.files import Outputs

from . import shards
from .augment import NEAR, Names, example
from .labels import Targets, encode
from .metrics import auc

if TYPE_CHECKING:
    import torch

    from .network import Networks

log = logging.getLogger("classifiers.train")
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


class Batches:
    """Batch n of the endless stream of training examples; a map-style data set for a DataLoader."""

    def __init__(self, data: shards.DataSet, targets: Targets, rows, names: Names, config: Config):
        self.data, self.targets, self.names, self.config = data, targets, names, config
        self.rows = np.asarray(rows)
        self._orders: dict[int, np.ndarray] = {}

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

    def __getitem__(self, step: int) -> dict[str, np.ndarray]:
        size, seed = self.config.batch, self.config.seed
        epoch, place = divmod(step * size, len(self.rows))
        order = self.order(epoch)[place:]
        while len(order) < size:  # a batch may reach into the next epochs
            epoch += 1
            order = np.concatenate([order, self.order(epoch)])
        rng = np.random.default_rng((seed, 0x5E7, step))
        return collate(
            [
                example(
                    self.data.drawings[i], self.targets, i, self.names, self.config.size, rng,
                    another=self.another,
                )
                for i in order[:size]
            ]
        )  # fmt: skip


def collate(examples: Sequence) -> dict[str, np.ndarray]:
    """Arrays (b, ...) by the names of an Example's fields."""
    names = ("ink", "kind", "active", "intensity", "angles", "landmarks", "boxes")
    return {name: np.stack([getattr(e, name) for e in examples]) for name in names}


def validation_batch(
    data: shards.DataSet, targets: Targets, rows, names: Names, size: int, limit: int = 400
) -> dict[str, np.ndarray]:
    """Second looks at held-out drawings, drawn over like those of training, always the same."""
    return collate(
        [
            example(
                data.drawings[i], targets, i, names, size, np.random.default_rng((7, int(i))), NEAR
            )
            for i in rows[:limit]
        ]
    )


def validate(networks: Networks, batch: dict[str, torch.Tensor]) -> dict[str, float]:
    """Mean AUC of the units, mean yaw error (degrees), mean landmark error (of the crop)."""
    import torch

    networks.eval()
    with torch.no_grad():
        parts = [networks(ink) for ink in batch["ink"].split(64)]
    units, points, angles = (
        torch.cat(tensors).numpy() for tensors in list(zip(*parts, strict=True))[:3]
    )
    truth = batch["active"].numpy()
    scores = [auc(truth[:, k], units[:, k, 1] - units[:, k, 0]) for k in range(truth.shape[1])]
    offset = points[..., :2] - batch["landmarks"].numpy()
    twelve = [score for name, score in zip(networks.aus, scores, strict=True) if name in DETECTED]
    known = not np.all(np.isnan(scores))
    return {
        "auc": float(np.nanmean(scores)) if known else float("nan"),
        "worst_auc": float(np.nanmin(scores)) if known else float("nan"),
        "auc_of_the_twelve": float(np.nanmean(twelve)) if known else float("nan"),
        "yaw": float(np.degrees(np.abs(angles - batch["angles"].numpy())[:, 0]).mean()),
        "landmarks": float(np.hypot(offset[..., 0], offset[..., 1]).mean()),
    }


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


def usable(data: shards.DataSet, config: Config) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of the drawings to train on, and of those that are held out.

    Raises ValueError if there is none to train on.
    """
    held_out = data.held_out()
    unseen = {look for look in config.unseen.split(",") if look}
    strange = np.array([r.get("style", {}).get("look") in unseen for r in data.records])
    rows, kept = np.flatnonzero(~held_out & ~strange), np.flatnonzero(held_out)
    if not len(rows):
        raise ValueError("The data set holds no drawing to train on: generate more.")
    return rows, kept


def train(data: shards.DataSet, aus: Sequence[str], out: Path, config: Config) -> Path:
    """Train until the budget is used up; returns the checkpoint. Goes on with an unfinished run."""
    import torch

    from .losses import loss_parts
    from .network import Networks, imagenet_weights

    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    out.mkdir(parents=True, exist_ok=True)
    path = out / CHECKPOINT

    landmarks = tuple(data.records[0]["landmarks"])
    names = Names.of(aus, landmarks)
    targets = encode(data.records, aus, landmarks)
    rows, kept = usable(data, config)

    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    networks = Networks(aus, landmarks, config.size)
    step, used = 0, 0.0
    saved = None
    if path.exists():
        saved = torch.load(path, map_location="cpu", weights_only=True)
        if saved["aus"] != list(aus) or saved["landmarks"] != list(landmarks):
            raise ValueError(f"{path} is of a run with other controls: choose another --out.")
        networks.load_state_dict(saved["networks"])
        step, used = saved["step"], saved["seconds"]
        log.info("going on from step %d after %.1f minutes", step, used / 60)
    elif config.imagenet:
        networks.trunk.load_imagenet(imagenet_weights())
    networks = networks.to(device, memory_format=torch.channels_last)
    trunk = list(networks.trunk.parameters())
    heads = [p for name, p in networks.named_parameters() if not name.startswith("trunk.")]
    optimiser = torch.optim.AdamW(
        [{"params": trunk, "share": config.trunk_rate}, {"params": heads, "share": 1.0}],
        lr=config.rate,
        weight_decay=config.decay,
        fused=True,
    )
    if saved:
        optimiser.load_state_dict(saved["optimiser"])

    def as_tensors(batch: dict[str, np.ndarray]) -> dict[str, torch.Tensor]:
        tensors = {name: torch.as_tensor(values) for name, values in batch.items()}
        tensors["ink"] = tensors["ink"][:, None].contiguous(memory_format=torch.channels_last)
        return {name: tensor.to(device) for name, tensor in tensors.items()}

    def checkpoint() -> None:
        save(
            path,
            {
                "networks": networks.state_dict(),
                "optimiser": optimiser.state_dict(),
                "step": step,
                "seconds": used,
                "random": random,
                "config": asdict(config),
                "aus": list(aus),
                "landmarks": list(landmarks),
                "drawings": len(rows),
            },
        )

    validation = validation_batch(data, targets, kept, names, config.size) if len(kept) else None
    stream = torch.utils.data.DataLoader(
        Batches(data, targets, rows, names, config),
        batch_size=None,
        sampler=range(step, 1 << 40),
        num_workers=config.workers,
        prefetch_factor=6 if config.workers else None,
        collate_fn=lambda batch: batch,
        worker_init_fn=_one_thread,
    )
    log.info(
        "%d drawings to train on, %d held out, %d parameters, %d threads, %d workers, on %s",
        len(rows), len(kept), sum(p.numel() for p in networks.parameters()), config.threads,
        config.workers, device,
    )  # fmt: skip

    budget = config.minutes * 60
    last = time.monotonic()
    saved_at = reported_at = used
    reported_step = step
    waited = 0.0
    means: dict[str, float] = {}
    batches = iter(stream)
    if saved:
        torch.set_rng_state(saved["random"])
    random = torch.get_rng_state()  # as it was after the last whole step
    try:
        while used < budget and not (config.steps and step >= config.steps):
            begun = time.monotonic()
            batch = as_tensors(next(batches))
            waited += time.monotonic() - begun
            progress = max(used / budget, step / config.steps if config.steps else 0.0)
            networks.train()
            if progress >= config.settle:
                settle(networks, config.settled_blocks)
            for group in optimiser.param_groups:
                group["lr"] = config.rate * group["share"] * rate_at(progress, config)
            parts = loss_parts(networks(batch["ink"]), batch, config.mid_weight)
            loss = torch.stack(list(parts.values())).sum()
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(networks.parameters(), 5.0)
            optimiser.step()
            step += 1
            random = torch.get_rng_state()
            for name, value in parts.items():
                means[name] = means.get(name, 0.0) + float(value.detach())
            now = time.monotonic()
            used, last = used + now - last, now

            if used - reported_at > 20:
                steps = step - reported_step
                terms = " ".join(f"{name} {value / steps:.3f}" for name, value in means.items())
                log.info(
                    "step %d  %.1f min  %s  %.1f images/s  waiting for data %.0f%%  rate %.2g",
                    step, used / 60, terms, steps * config.batch / (used - reported_at),
                    100 * waited / (used - reported_at), optimiser.param_groups[1]["lr"],
                )  # fmt: skip
                reported_at, reported_step, waited, means = used, step, 0.0, {}
            if used - saved_at > config.checkpoint_minutes * 60:
                checkpoint()
                saved_at = used
                if validation is not None:
                    report(networks, as_tensors(validation), step)
                last = time.monotonic()  # looking at the validation set costs no training time
    finally:
        checkpoint()
        del batches
    if validation is not None:
        report(networks, as_tensors(validation), step)
    log.info("done: %d steps, %d images, %.1f minutes", step, step * config.batch, used / 60)
    return path


def settle(networks: Networks, blocks: int) -> None:
    """Fix the statistics of batch normalisation, the stem and the trunk's first blocks.

    Those blocks work at the highest resolution and take half of the time; strokes and their ends
    have long been learnt when the rest still improves.
    """
    import torch

    for module in networks.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.eval()
    networks.trunk.stem.requires_grad_(False)
    networks.trunk.blocks[:blocks].requires_grad_(False)


def report(networks: Networks, validation: dict[str, torch.Tensor], step: int) -> None:
    figures = validate(networks.cpu(), {name: t.cpu() for name, t in validation.items()})
    networks.to(validation["ink"].device)
    log.info("step %d  held out: %s", step, " ".join(f"{k} {v:.4f}" for k, v in figures.items()))


def _one_thread(_worker: int) -> None:
    import torch

    torch.set_num_threads(1)


def speed(aus: Sequence[str], landmarks: Sequence[str], config: Config) -> None:
    """Print how many images a second train with one and with two threads on this machine."""
    import torch

    from .network import Networks

    networks = Networks(aus, landmarks, config.size).to(memory_format=torch.channels_last)
    ink = torch.rand(config.batch, 1, config.size, config.size)
    ink = ink.contiguous(memory_format=torch.channels_last)
    for settled in (False, True):
        networks.train()
        if settled:
            settle(networks, config.settled_blocks)
        for threads in (1, 2):
            torch.set_num_threads(threads)
            seconds = []
            for _ in range(5):
                begun = time.monotonic()
                torch.stack([output.square().mean() for output in networks(ink)]).sum().backward()
                seconds.append(time.monotonic() - begun)
            print(
                f"{threads} threads{', settled' if settled else ''}:"
                f" {config.batch / min(seconds):.1f} images/s at best,"
                f" {config.batch / float(np.median(seconds)):.1f} in the middle"
            )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `sketch2face train`: the folders, and one for each field of Config."""
    parser.add_argument("--data", type=Path, required=True, help="folder of .tar shards")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/detector"), help="checkpoint and log"
    )
    parser.add_argument(
        "--weights",
        type=Path,
        help="folder for the exported networks (OUT/weights; classifiers/weights ships them)",
    )
    parser.add_argument("--limit", type=int, help="read at most so many drawings")
    parser.add_argument(
        "--only", metavar="UNITS", help="train the networks of these units alone, with commas"
    )
    parser.add_argument("--start", type=Path, help="the checkpoint that --only takes the rest from")
    parser.add_argument(
        "--baseline",
        metavar="UNITS",
        help="train the thesis' GoogLeNet for each of these units, or for 'twelve', --minutes each",
    )
    parser.add_argument("--no-export", action="store_true", help="stop after the last checkpoint")
    parser.add_argument("--speed", action="store_true", help="only measure images per second")
    for field in fields(Config):
        kind = type(field.default)
        option = f"--{field.name.replace('_', '-')}"
        if kind is bool:
            action = argparse.BooleanOptionalAction
            parser.add_argument(option, action=action, default=field.default)
        else:
            parser.add_argument(option, type=kind, default=field.default, help=f"({field.default})")


def chosen(names: str) -> tuple[str, ...]:
    """The controls named with commas; 'twelve' are those of the thesis. ValueError for others."""
    if names == "twelve":
        return DETECTED
    wanted = tuple(name for name in names.replace(" ", "").split(",") if name)
    unknown = [name for name in wanted if name not in CONTROL_NAMES]
    if unknown or not wanted:
        raise ValueError(
            f"There is no unit {', '.join(unknown) or 'named'}: `sketch2face rig` lists them."
        )
    return wanted


def run(args: argparse.Namespace) -> int:
    """Train and export; ValueError if the data or the options cannot be used."""
    # Before torch is loaded: threads spinning at a barrier take the core that draws the batches.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    config = Config(**{field.name: getattr(args, field.name) for field in fields(Config)})
    if bool(args.only) != bool(args.start):
        raise ValueError("--only and --start belong together: which units, and to what.")
    for names in (args.only, args.baseline):
        if names is not None:
            chosen(names)  # a slip in a name is told before the drawings are read
    data = shards.load(args.data, args.limit)
    if args.speed:
        speed(CONTROL_NAMES, tuple(data.records[0]["landmarks"]), config)
        return 0
    args.out.mkdir(parents=True, exist_ok=True)
    to_file = logging.FileHandler(args.out / "train.log")
    to_screen = logging.StreamHandler(sys.stdout)
    for handler in (to_file, to_screen):
        handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
        log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.info("config %s", json.dumps(asdict(config)))
    if args.baseline:
        from .googlenet import train_baseline

        for unit in chosen(args.baseline):
            train_baseline(data, unit, args.out, config)
        return 0
    if args.only:
        from .retrain import retrain

        checkpoint = retrain(data, args.start, chosen(args.only), args.out, config)
    else:
        checkpoint = train(data, CONTROL_NAMES, args.out, config)
    if not args.no_export:
        from .export import export

        export(checkpoint, data, args.weights or args.out / "weights", log.info)
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    add_arguments(parser)
    try:
        return run(parser.parse_args(argv))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
