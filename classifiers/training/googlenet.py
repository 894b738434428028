"""The thesis' own detector, to compare with: a GoogLeNet for each action unit. In torch.

Chapter 2, "Training": a GoogLeNet (Szegedy et al. 2015, "Going Deeper with Convolutions", CVPR)
with three layers on top, convolution, max pooling and softmax over yes and no; cross-entropy,
stochastic gradient descent with a learning rate of 0.01. It sees the drawing once, whole, and says
nothing but yes or no.

Batch normalisation (Ioffe & Szegedy 2015, ICML) follows each convolution, in place of the auxiliary
classifiers and of the local response normalisation. The thesis starts from pretrained weights; here
the networks start from nothing, since no package carries any.
"""

from __future__ import annotations

import pickle
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from facs_rig import CONTROL_NAMES
from facs_rig.common.errors import InputError
from facs_rig.common.images import area_resample

from ..preprocess import Floats, even_ink, ink_square
from . import metrics, shards
from .calibration import LIKELIHOOD_RATIO
from .common import Config, log, save, usable
from .readings import Row, pages_of
from .targets import encode

RATE = 0.01
MOMENTUM = 0.9  # GoogLeNet's own; the thesis names none
CALIBRATED_ON = 1000  # held-out drawings
FORMAT = "googlenet-1"
SILENT = ("chin",)  # a landmark that targets are made of; nothing is said about it

# Inception modules: 1x1; 1x1 and 3x3; 1x1 and 5x5; 1x1 after the pooling. Table 1 of the paper;
# None is a max pooling with stride 2.
INCEPTIONS = (
    (64, 96, 128, 16, 32, 32), (128, 128, 192, 32, 96, 64), None,
    (192, 96, 208, 16, 48, 64), (160, 112, 224, 24, 64, 64), (128, 128, 256, 24, 64, 64),
    (112, 144, 288, 32, 64, 64), (256, 160, 320, 32, 128, 128), None,
    (256, 160, 320, 32, 128, 128), (384, 192, 384, 48, 128, 128),
)  # fmt: skip
TOP_CHANNELS = 64
STRIDE = 64  # pixels to a cell of the last pooling


def convolution(inputs: int, outputs: int, kernel: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Inception(nn.Module):
    """Filters of three sizes and a pooling side by side, each behind a 1x1 that narrows it."""

    def __init__(self, inputs: int, one: int, to3: int, three: int, to5: int, five: int, pool: int):
        super().__init__()
        self.one = convolution(inputs, one, 1)
        self.three = nn.Sequential(convolution(inputs, to3, 1), convolution(to3, three, 3))
        self.five = nn.Sequential(convolution(inputs, to5, 1), convolution(to5, five, 5))
        self.pool = convolution(inputs, pool, 1)

    def forward(self, x: Tensor) -> Tensor:
        pooled = F.max_pool2d(x, 3, 1, 1)
        return torch.cat([self.one(x), self.three(x), self.five(x), self.pool(pooled)], dim=1)


class GoogLeNet(nn.Module):
    """Ink (b, 1, size, size), 0 = paper and 1 = black -> logits (b, 2) of no and yes."""

    def __init__(self, size: int = 128) -> None:
        super().__init__()
        self.size = size
        if size < STRIDE or size % STRIDE:
            raise ValueError(f"The input size must be a multiple of {STRIDE}, not {size}.")
        layers: list[nn.Module] = [
            convolution(1, 64, 7, 2),
            nn.MaxPool2d(3, 2, 1),
            convolution(64, 64, 1),
            convolution(64, 192, 3),
            nn.MaxPool2d(3, 2, 1),
        ]
        channels = 192
        for widths in INCEPTIONS:
            if widths is None:
                layers.append(nn.MaxPool2d(3, 2, 1))
            else:
                layers.append(Inception(channels, *widths))
                channels = widths[0] + widths[2] + widths[4] + widths[5]
        self.layers = nn.Sequential(*layers)
        self.conv = nn.Conv2d(channels, TOP_CHANNELS, 3, padding=1)
        self.fc = nn.Linear(TOP_CHANNELS * (size // STRIDE) ** 2, 2)

    def forward(self, ink: Tensor) -> Tensor:
        x = F.relu(self.conv(self.layers(ink)))
        return self.fc(F.max_pool2d(x, 2).flatten(1))


def whole_page(page: Floats, size: int) -> Floats:
    """What the network sees of a page of ink (h, w): the square around all of it, (size, size)."""
    return even_ink(area_resample(page, ink_square(page), size))


def load_baseline(folder: Path) -> Baseline:
    """The networks of a folder; raises ValueError if it holds none or one is damaged."""
    paths = sorted(Path(folder).glob("*.pt"))
    if not paths:
        raise InputError(f"{folder} holds no GoogLeNet: run `sketch2face train --baseline twelve`.")
    saved = []
    for path in paths:
        try:
            entry = torch.load(path, map_location="cpu", weights_only=True)
        except (OSError, RuntimeError, pickle.UnpicklingError):
            raise InputError(f"{path} is damaged: train it again.") from None
        if entry.get("format") != FORMAT:
            raise InputError(f"{path} is no GoogLeNet of this version: train it again.")
        saved.append(entry)
    return Baseline(saved)


class Baseline:
    """A GoogLeNet for each of some units, as `readings.Reader`: all that they say is yes or no."""

    landmarks = SILENT

    def __init__(self, saved: Sequence[dict[str, Any]]) -> None:
        order = {name: k for k, name in enumerate(CONTROL_NAMES)}
        saved = sorted(saved, key=lambda entry: order[entry["unit"]])
        self.aus = tuple(entry["unit"] for entry in saved)
        amounts = ("images", "seconds")
        self.training = {entry["unit"]: {name: entry[name] for name in amounts} for entry in saved}
        self.thresholds = [entry["threshold"] for entry in saved]
        self.calibration = [(entry["temperature"], entry["offset"]) for entry in saved]
        self.networks = []
        for entry in saved:
            network = GoogLeNet(entry["size"])
            network.load_state_dict(entry["network"])
            self.networks.append(network.eval().to(memory_format=torch.channels_last))

    @property
    def about(self) -> dict[str, Any]:
        return {"networks": "googlenet", "training": self.training}

    def row(self, page: Floats) -> Row:
        """The answers to a page of ink (h, w)."""
        probability = []
        for network, (temperature, offset) in zip(self.networks, self.calibration, strict=True):
            logit = logits(network, [whole_page(page, network.size)])
            probability.append(float(metrics.sigmoid(logit / temperature + offset)[0]))
        nan = float("nan")
        nothing = np.full(len(probability), nan)
        active = [p >= t for p, t in zip(probability, self.thresholds, strict=True)]
        return probability, active, nothing, (nan,) * 3, np.full((1, 2), nan), (nan,), nan, ()


def logits(network: GoogLeNet, pictures: Sequence[Floats]) -> NDArray[np.float64]:
    """(n,) of yes minus no, for n pictures (size, size) as of `whole_page`."""
    network.eval()
    with torch.inference_mode():
        both = network(as_batch(pictures)).numpy()
    return (both[:, 1] - both[:, 0]).astype(float)


def as_batch(pictures: Sequence[Floats]) -> Tensor:
    ink = torch.from_numpy(np.stack(pictures))[:, None]
    return ink.contiguous(memory_format=torch.channels_last)


def train_baseline(data: shards.DataSet, unit: str, out: Path, config: Config) -> Path:
    """Train one unit's GoogLeNet for `config.minutes` on drawings as they are; -> out/UNIT.pt.

    As in the thesis nothing is drawn over and all drawings count, yes or no; those with a trace of
    the action, neither, do not. Looks that the detector is not trained on are left out here too.
    Its input is the largest multiple of 64 pixels within `config.size`. Raises ValueError if no
    drawing can be trained on, or there is one kind alone.
    """
    size = config.size // STRIDE * STRIDE
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    rows, kept = usable(data, config)
    truth = encode(data.records, (unit,), SILENT).active[:, 0]
    rows, kept = rows[~np.isnan(truth[rows])], kept[~np.isnan(truth[kept])][:CALIBRATED_ON]
    if len(np.unique(truth[rows])) < 2:
        raise InputError(f"The data set does not show both yes and no of {unit}: generate more.")

    def pictures(some: NDArray) -> list[Floats]:
        drawings = (data.drawings[int(i)] for i in some)
        return [whole_page(page, size) for page in pages_of(drawings)]

    network = GoogLeNet(size).to(memory_format=torch.channels_last)
    optimiser = torch.optim.SGD(network.parameters(), lr=RATE, momentum=MOMENTUM)
    rng = np.random.default_rng((config.seed, 0x600))
    queue = np.empty(0, int)
    step, loss_sum, told = 0, 0.0, 0
    begun = reported = time.monotonic()
    while time.monotonic() - begun < config.minutes * 60 and step != (config.steps or -1):
        while len(queue) < config.batch:  # every drawing once an epoch
            queue = np.concatenate([queue, rng.permutation(rows)])
        some, queue = queue[: config.batch], queue[config.batch :]
        network.train()
        answer = network(as_batch(pictures(some)))
        loss = F.cross_entropy(answer, torch.from_numpy(truth[some]).long())
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        step, loss_sum = step + 1, loss_sum + float(loss.detach())
        if time.monotonic() - reported > 20:
            steps, pace = step - told, (step - told) * config.batch / (time.monotonic() - reported)
            log.info("%s: step %d  loss %.3f  %.1f images/s", unit, step, loss_sum / steps, pace)
            reported, told, loss_sum = time.monotonic(), step, 0.0
    seconds = time.monotonic() - begun

    parts = [
        logits(network, pictures(some))
        for some in np.split(kept, range(config.batch, len(kept), config.batch))
        if len(some)
    ]
    seen = np.concatenate(parts) if parts else np.empty(0)
    temperature, offset = metrics.platt(truth[kept], seen)
    images = step * config.batch
    log.info(
        "%s: %d steps, %d images, %.1f a second; held out: AUC %.3f of %d drawings",
        unit, step, images, images / max(seconds, 1e-9), metrics.auc(truth[kept], seen), len(kept),
    )  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{unit}.pt"
    save(
        path,
        {
            "format": FORMAT,
            "unit": unit,
            "size": size,
            "network": network.state_dict(),
            "temperature": temperature,
            "offset": offset,
            "threshold": metrics.threshold(truth[kept], LIKELIHOOD_RATIO),
            "steps": step,
            "images": images,
            "seconds": seconds,
            "drawings": len(rows),
            "config": asdict(config),
        },
    )
    return path
