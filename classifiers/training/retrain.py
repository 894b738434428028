"""One action unit's network trained anew, all else as it is: `sketch2face train --only smile`.

The trunk, the other units and the geometry come from a checkpoint and stay as they are, to the bit:
the unit's convolution, pooling and softmax learn on features that do not change.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch

from facs_rig.common.errors import InputError

from . import shards
from .augment import MID, NEAR, Names
from .common import CHECKPOINT, Batches, Config, load_networks, log, rate_at, save, usable
from .losses import unit_losses
from .network import DROPOUT, side_by_side
from .targets import encode_all


def retrain(
    data: shards.DataSet,
    start: Path,
    only: Sequence[str],
    out: Path,
    config: Config,
) -> Path:
    """Train the heads named in `only` for `config.minutes` on their own loss; -> out's checkpoint.

    Raises InputError if `start` is no checkpoint or lacks one of the units, or if `out` holds a
    checkpoint already.
    """
    path = out / CHECKPOINT
    if path.exists():
        raise InputError(f"{path} would be overwritten: choose another --out.")
    networks, saved = load_networks(start)
    if missing := [name for name in only if name not in saved["aus"]]:
        raise InputError(f"{start} knows no {', '.join(missing)}: train all units first.")
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    networks = networks.to(memory_format=torch.channels_last).requires_grad_(False)
    heads = [networks.heads[name].requires_grad_(True) for name in only]
    columns = [saved["aus"].index(name) for name in only]

    config = replace(config, size=networks.size)
    rows, _ = usable(data, config)
    names = Names.of(saved["aus"], saved["landmarks"])
    targets = encode_all(data, saved["aus"], saved["landmarks"])
    batches = Batches(data, targets, rows, names, config)
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
        batch = {name: torch.as_tensor(values) for name, values in batches[step].items()}
        weight = (batch["kind"] == NEAR).float() + config.mid_weight * (batch["kind"] == MID)
        ink = batch["ink"][:, None].contiguous(memory_format=torch.channels_last)
        with torch.no_grad():
            features = networks.trunk(ink)
        units = side_by_side(heads, features, DROPOUT)
        active, intensity = batch["active"][:, columns], batch["intensity"][:, columns]
        loss = torch.stack([*unit_losses(units, active, intensity, weight).values()]).sum()
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
    save(path, saved | {"networks": networks.state_dict(), "retrained": [*earlier, again]})
    return path
