"""Train the networks on shards of generated drawings: `sketch2face train --data DIR`.

The schedule follows the clock, not a number of steps: the learning rate reaches zero when the
budget of `--minutes` is used up, however slow the machine or busy its cores. A run that is
interrupted goes on from its last checkpoint when started again with the same `--out`; the drawings
of step n depend on the seed and n alone.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from facs_rig import TWELVE
from facs_rig.common.errors import InputError

from ..labels import REGIONS
from . import losses, shards
from .augment import Names
from .common import (
    CHECKPOINT,
    Batches,
    Config,
    log,
    rate_at,
    save,
    usable,
    validation_batch,
)
from .metrics import auc
from .network import Networks, imagenet_weights
from .pool import Pool
from .targets import encode_all

REPORT = 20.0  # seconds of training between two lines of the log
STEEPEST = 5.0  # norm that a gradient is cut down to


def train(
    data: shards.DataSet,
    aus: Sequence[str],
    out: Path,
    config: Config,
    start: Path | None = None,
) -> Path:
    """Train until the budget is used up; returns the checkpoint. Goes on with an unfinished run.

    start : a folder of exported networks to go on from, instead of ImageNet's weights

    Raises InputError if there is no drawing to train on, or `out` holds a run of other controls.
    """
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    out.mkdir(parents=True, exist_ok=True)
    landmarks = tuple(data.records[0]["landmarks"])
    names, targets = Names.of(aus, landmarks), encode_all(data, aus, landmarks)
    rows, kept = usable(data, config)

    run = Run.begun(aus, landmarks, out / CHECKPOINT, config, start)
    held_out = validation_batch(data, targets, kept, names, config.size) if len(kept) else None
    log.info(
        "%d drawings to train on, %d held out, %d parameters, %d threads, %d workers, on %s",
        len(rows), len(kept), sum(p.numel() for p in run.networks.parameters()), config.threads,
        config.workers, run.device,
    )  # fmt: skip

    made = stream(Batches(data, targets, rows, names, config), run.step)
    pool = Pool(made, names, config.pool, config.batch, run.device) if config.pool else None
    batches = pool or map(run.tensors, made)
    pace = Pace(run)
    saved_at = run.seconds
    # Starting the stream drew random numbers; a run that goes on draws what it would have drawn.
    torch.set_rng_state(run.random)
    try:
        while not run.finished:
            begun = time.monotonic()
            batch = next(batches)
            pace.waited += time.monotonic() - begun
            pace.add(run.learn(batch))
            run.seconds += time.monotonic() - begun
            pace.tell_now_and_then(run)
            if run.seconds - saved_at > config.checkpoint_minutes * 60:
                run.save(len(rows))
                tell(run, held_out)  # looking at what is held out costs no training time
                saved_at = run.seconds
    finally:
        run.save(len(rows))
        if pool:
            pool.close()
            log.info("%d examples were made", pool.made)
        del batches, made
    tell(run, held_out)
    log.info(
        "done: %d steps, %d images, %.1f minutes",
        run.step, run.step * config.batch, run.seconds / 60,
    )  # fmt: skip
    return run.path


@dataclass
class Run:
    """A training as it stands: what a checkpoint holds.

    seconds : of training so far;  random : torch's state after the last whole step
    """

    networks: Networks
    optimiser: torch.optim.Optimizer
    path: Path
    config: Config
    device: torch.device
    step: int = 0
    seconds: float = 0.0
    random: Tensor = field(default_factory=torch.get_rng_state)

    @classmethod
    def begun(
        cls, aus: Sequence[str], landmarks: Sequence[str], path: Path, config: Config,
        start: Path | None = None,
    ) -> Run:  # fmt: skip
        """The run whose checkpoint lies at `path`, or a new one."""
        device = device_of(config.device)
        torch.backends.cudnn.benchmark = True  # all batches are of one size
        torch.set_float32_matmul_precision("high")
        networks = Networks(aus, landmarks, config.size)
        saved = torch.load(path, map_location="cpu", weights_only=True) if path.exists() else None
        if saved:
            if saved["aus"] != list(aus) or saved["landmarks"] != list(landmarks):
                raise InputError(f"{path} is of a run with other controls: choose another --out.")
            networks.load_state_dict(saved["networks"])
        elif start:
            from .exported import load_exported

            load_exported(networks, start)
        elif config.imagenet:
            networks.trunk.load_imagenet(imagenet_weights())
        networks = networks.to(device, memory_format=torch.channels_last)
        run = cls(networks, optimiser_of(networks, config), path, config, device)
        if saved:
            run.optimiser.load_state_dict(saved["optimiser"])
            run.step, run.seconds, run.random = saved["step"], saved["seconds"], saved["random"]
            log.info("going on from step %d after %.1f minutes", run.step, run.seconds / 60)
        return run

    def save(self, drawings: int) -> None:
        """Write the checkpoint; `drawings` : how many are trained on."""
        state = {
            "networks": self.networks.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
            "random": self.random,
            "config": asdict(self.config),
            "aus": list(self.networks.aus),
            "landmarks": list(self.networks.landmark_names),
            "person": list(self.networks.person_names),
            "regions": list(REGIONS),
            "drawings": drawings,
        }
        save(self.path, state)

    @property
    def progress(self) -> float:
        """The share of the budget that is used up."""
        by_clock = self.seconds / (self.config.minutes * 60)
        return max(by_clock, self.step / self.config.steps if self.config.steps else 0.0)

    @property
    def finished(self) -> bool:
        return self.progress >= 1

    def tensors(self, batch: dict[str, np.ndarray]) -> dict[str, Tensor]:
        """A batch on the device, its ink (b, 1, size, size)."""
        tensors = {name: torch.as_tensor(values) for name, values in batch.items()}
        tensors["ink"] = tensors["ink"][:, None].contiguous(memory_format=torch.channels_last)
        return {name: tensor.to(self.device) for name, tensor in tensors.items()}

    def learn(self, batch: dict[str, Tensor]) -> dict[str, float]:
        """One step; returns the terms of the loss."""
        self.networks.train()
        if self.progress >= self.config.settle:
            settle(self.networks, self.config.settled_blocks)
        for group in self.optimiser.param_groups:
            group["lr"] = self.config.rate * group["share"] * rate_at(self.progress, self.config)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.device.type == "cuda"):
            features = self.networks.trunk(batch["ink"])
        answers = self.networks.answers(features.float())  # landmarks need more digits
        parts = losses.loss_parts(answers, batch, self.config.mid_weight, self.config.agree)
        self.optimiser.zero_grad(set_to_none=True)
        total = torch.stack(list(parts.values()))
        total.sum().backward()
        torch.nn.utils.clip_grad_norm_(self.networks.parameters(), STEEPEST)
        self.optimiser.step()
        self.step += 1
        self.random = torch.get_rng_state()
        values = total.tolist()  # waits for the device once
        return dict(zip(parts, values, strict=True))


def device_of(name: str) -> torch.device:
    """InputError for a device that is not here."""
    there = torch.cuda.is_available()
    if name not in ("auto", "cpu", "cuda") or (name == "cuda" and not there):
        raise InputError(f"--device {name} is not here: choose cpu{' or cuda' if there else ''}.")
    return torch.device("cuda" if there and name != "cpu" else "cpu")


def optimiser_of(networks: Networks, config: Config) -> torch.optim.Optimizer:
    trunk = list(networks.trunk.parameters())
    heads = [p for name, p in networks.named_parameters() if not name.startswith("trunk.")]
    return torch.optim.AdamW(
        [{"params": trunk, "share": config.trunk_rate}, {"params": heads, "share": 1.0}],
        lr=config.rate,
        weight_decay=config.decay,
        fused=True,
    )


def settle(networks: Networks, blocks: int) -> None:
    """Fix the statistics of batch normalisation, the stem and the trunk's first blocks.

    Those blocks work at the highest resolution and take half of the time; strokes and their ends
    have long been learnt when the rest still improves.
    """
    for module in networks.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.eval()
    networks.trunk.stem.requires_grad_(False)
    networks.trunk.blocks[:blocks].requires_grad_(False)


def stream(batches: Batches, first: int) -> Iterator[dict[str, np.ndarray]]:
    """The batches from number `first` on, made by `workers` processes."""
    workers = batches.config.workers
    loader = torch.utils.data.DataLoader(
        batches,
        batch_size=None,
        sampler=range(first, 1 << 40),
        num_workers=workers,
        prefetch_factor=6 if workers else None,
        collate_fn=_as_it_is,
        worker_init_fn=_one_thread,
    )
    return iter(loader)


def _as_it_is(batch: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return batch


def _one_thread(_worker: int) -> None:
    torch.set_num_threads(1)


class Pace:
    """What the log says every `REPORT` seconds: losses, speed, the wait for drawings."""

    def __init__(self, run: Run) -> None:
        self._begin(run)

    def _begin(self, run: Run) -> None:
        self.seconds, self.step, self.waited = run.seconds, run.step, 0.0
        self.sums: dict[str, float] = {}

    def add(self, parts: dict[str, float]) -> None:
        for name, value in parts.items():
            self.sums[name] = self.sums.get(name, 0.0) + value

    def tell_now_and_then(self, run: Run) -> None:
        steps, seconds = run.step - self.step, run.seconds - self.seconds
        if seconds <= REPORT:
            return
        log.info(
            "step %d  %.1f min  %s  %.1f images/s  waiting for data %.0f%%  rate %.2g",
            run.step, run.seconds / 60,
            " ".join(f"{name} {value / steps:.3f}" for name, value in self.sums.items()),
            steps * run.config.batch / seconds, 100 * self.waited / seconds,
            run.optimiser.param_groups[1]["lr"],
        )  # fmt: skip
        self._begin(run)


def tell(run: Run, held_out: dict[str, np.ndarray] | None) -> None:
    """Log how well the held-out drawings are read."""
    if held_out is not None:
        figures = validate(run.networks, run.tensors(held_out))
        said = " ".join(f"{name} {value:.4f}" for name, value in figures.items())
        log.info("step %d  held out: %s", run.step, said)


def validate(networks: Networks, batch: dict[str, Tensor]) -> dict[str, float]:
    """Mean AUC of the units, mean yaw error (degrees), mean landmark error (of the crop)."""
    networks.eval()
    with torch.no_grad():
        parts = [networks(ink) for ink in batch["ink"].split(64)]
    units, points, angles = (
        torch.cat(tensors).float().cpu().numpy() for tensors in list(zip(*parts, strict=True))[:3]
    )
    truth, places, turned = (
        batch[name].cpu().numpy() for name in ("active", "landmarks", "angles")
    )
    scores = [auc(truth[:, k], units[:, k, 1] - units[:, k, 0]) for k in range(truth.shape[1])]
    offset = points[..., :2] - places
    twelve = [score for name, score in zip(networks.aus, scores, strict=True) if name in TWELVE]
    known = not np.all(np.isnan(scores))
    return {
        "auc": float(np.nanmean(scores)) if known else float("nan"),
        "worst_auc": float(np.nanmin(scores)) if known else float("nan"),
        "auc_of_the_twelve": float(np.nanmean(twelve)) if known else float("nan"),
        "yaw": float(np.degrees(np.abs(angles - turned)[:, 0]).mean()),
        "landmarks": float(np.hypot(offset[..., 0], offset[..., 1]).mean()),
    }


def speed(aus: Sequence[str], landmarks: Sequence[str], config: Config) -> None:
    """Print how many images a second train with one and with two threads on this machine."""
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
