"""One network trained anew, all else as it is: `sketch2face train --only smile`, or `hats`.

The trunk, the other networks and the geometry come from a checkpoint or an exported folder and stay
as they are, to the bit: what is trained learns on features that do not change.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facs_rig.common.errors import InputError

from ..labels import REGIONS
from . import shards
from .augment import MID, NEAR, SHARES, Names
from .common import CHECKPOINT, Batches, Config, load_networks, log, rate_at, save, usable
from .exported import opened
from .losses import person_loss, region_loss, tells_who, unit_losses
from .network import DROPOUT, Networks, side_by_side
from .targets import encode_all
from .train import stream

ALONE = ("person", "regions", "hats")  # no units: who is drawn, what lies where, and hats
LOOKS = (0.5, 0.0, 0.0, 0.0, 0.5)  # of its examples: half of them near, half of them wide
HATTED = 0.4  # of the examples that hats are learnt from, those with one
AGAIN = 6  # with a pool, steps on kept batches for each new one: the trunk takes most of the time


def retrain(
    data: shards.DataSet,
    start: Path,
    only: Sequence[str],
    out: Path,
    config: Config,
) -> Path:
    """Train the heads named in `only` for `config.minutes` on their own loss; -> out's checkpoint.

    only : units, or some of ALONE      start : a checkpoint, or a folder of exported networks

    Raises InputError if `start` is neither or lacks one of the units, or if `out` holds a
    checkpoint already.
    """
    path = out / CHECKPOINT
    if path.exists():
        raise InputError(f"{path} would be overwritten: choose another --out.")
    networks, saved = opened(start) if start.is_dir() else load_networks(start)
    wide = set(only) <= set(ALONE)
    if missing := [name for name in only if not wide and name not in saved["aus"]]:
        raise InputError(f"{start} knows no {', '.join(missing)}: train all units first.")
    known = {*saved.get("regions", ()), *(REGIONS[:-1] if "regions" in only else ())}
    if "hats" in only and not known:
        raise InputError(f"{start} tells no regions, of which hats are one: train them first.")
    regions = [name for name in REGIONS if name in known or (name == "hat" and "hats" in only)]
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    networks = networks.to(memory_format=torch.channels_last).requires_grad_(False)
    heads = [getattr(networks, name) if wide else networks.heads[name] for name in only]
    for head in heads:
        head.requires_grad_(True)

    config, kept = replace(config, size=networks.size, pool=0), config.pool // config.batch
    rows, _ = usable(data, config)
    if set(only) == {"hats"}:
        rows = _hats_often(data, rows)
    names = Names.of(saved["aus"], saved["landmarks"])
    targets = encode_all(data, saved["aus"], saved["landmarks"])
    batches = Batches(data, targets, rows, names, config, LOOKS if wide else SHARES)
    made = _with_features(networks, stream(batches, 0), kept, config.seed)
    optimiser = torch.optim.AdamW(
        [parameter for head in heads for parameter in head.parameters()],
        lr=config.rate,
        weight_decay=config.decay,
    )
    step, total, told = 0, 0.0, 0
    begun = reported = time.monotonic()
    while (used := time.monotonic() - begun) < config.minutes * 60 and step != (config.steps or -1):
        progress = max(used / (config.minutes * 60), step / config.steps if config.steps else 0.0)
        for group in optimiser.param_groups:
            group["lr"] = config.rate * rate_at(progress, config)
        features, batch = next(made)
        if wide:
            loss = _wide(networks, only, features, batch)
        else:
            loss = _units(networks, only, features, batch, config.mid_weight)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        step, total = step + 1, total + float(loss.detach())
        if time.monotonic() - reported > 20:
            log.info("step %d  loss %.3f  %.1f min", step, total / (step - told), used / 60)
            reported, total, told = time.monotonic(), 0.0, step
    log.info("%s trained alone: %d steps, %d images", ", ".join(only), step, step * config.batch)
    out.mkdir(parents=True, exist_ok=True)
    again = {"units": list(only), "steps": step, "images": step * config.batch}
    earlier = saved.get("retrained", [])
    state = {"networks": networks.state_dict(), "retrained": [*earlier, again]}
    save(path, saved | {"regions": regions} | state)
    return path


def _hats_often(data: shards.DataSet, rows: NDArray) -> NDArray:
    """The rows, those with a hat so many times that they are HATTED of all."""
    worn = np.concatenate(data.each(_hats))[rows]
    if not worn.any():
        raise InputError("No drawing tells of a hat: generate them by --engine conventions.")
    times = max(round(HATTED / (1 - HATTED) * (~worn).sum() / worn.sum()), 1)
    return np.concatenate([rows, np.repeat(rows[worn], times - 1)])


def _hats(records: Sequence[dict[str, Any]]) -> NDArray[np.bool_]:
    return np.array([bool(record.get("regions", {}).get("hat")) for record in records])


def _with_features(
    networks: Networks, made: Iterator[dict[str, np.ndarray]], kept: int, seed: int
) -> Iterator[tuple[Tensor, dict[str, Tensor]]]:
    """Batches with what the trunk makes of them; of the last `kept` some are given again."""
    rng = np.random.default_rng(seed)
    pool: list[tuple[Tensor, dict[str, Tensor]]] = []
    for step, values in enumerate(made):
        batch = {name: torch.as_tensor(value) for name, value in values.items()}
        ink = batch.pop("ink")[:, None].contiguous(memory_format=torch.channels_last)
        with torch.no_grad():
            features = networks.trunk(ink)
        yield features, batch
        if kept:
            pool[step % kept : step % kept + 1] = [(features, batch)]
            for k in rng.integers(len(pool), size=AGAIN):
                yield pool[k]


def _units(
    networks: Networks, only: Sequence[str], features: Tensor, batch: dict[str, Tensor], mid: float
) -> Tensor:
    columns = [networks.aus.index(name) for name in only]
    weight = (batch["kind"] == NEAR).float() + mid * (batch["kind"] == MID)
    answers = side_by_side([networks.heads[name] for name in only], features, DROPOUT)
    active, intensity = batch["active"][:, columns], batch["intensity"][:, columns]
    return torch.stack([*unit_losses(answers, active, intensity, weight).values()]).sum()


def _wide(
    networks: Networks, only: Sequence[str], features: Tensor, batch: dict[str, Tensor]
) -> Tensor:
    loss = torch.zeros(())
    if "person" in only:
        with torch.no_grad():
            points = networks.geometry(features)[0][:, :, :2]
        person = networks.person(features, points)
        loss = loss + person_loss(person, batch["person"], tells_who(batch["kind"]))
    if "regions" in only:
        loss = loss + region_loss(networks.regions(features), batch["regions"][:, :-1])
    if "hats" in only:
        loss = loss + region_loss(networks.hats(features), batch["regions"][:, -1:])
    return loss
