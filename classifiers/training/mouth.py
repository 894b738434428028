"""Train the network that looks at mouths (classifiers.mouth): drawn, learnt, written.

    python -m classifiers.training.mouth --out classifiers/weights [--pages 5300] [--minutes 20]

Drawings of both engines, of people of all kinds, whose mouths do what mouths do when they open:
laugh, bare their teeth, speak, shout; the rest are shut. A page is drawn over as for the detector
(augment.artistic_page) and looked at several times, as far off as the detector may be.
"""

from __future__ import annotations

import argparse
import logging
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from dataset_gen.generate import make_sample
from dataset_gen.sampling import sample_actions
from facs_rig import LANDMARKS
from facs_rig.common.images import area_resample

from ..mouth import MIRROR, MOUTH, NAME, OPEN, RIMS, SIDE, SIZE, mouth_box, opening
from ..preprocess import even_ink
from . import closer
from .augment import AS_DRAWN, Names, artistic_page
from .closer import amiss, soiled
from .paper import spoiled

log = logging.getLogger(__name__)

SEED = 5_000_000
LOOKS = 4  # at each page
WIDTH = 128  # of the layer that sees all of a crop
BATCH, RATE = 128, 2e-3
HELD_OUT = 15  # one look in so many
PAGES = (224, 416)  # px, the sides of pages
CONTOURS = 0.4  # of the pages, those drawn by contours
SPREADS = 0.07, 0.05, 0.05, 0.07  # see `amiss`
# What mouths do, how often: each control with how often it joins in, its least and its most.
MOUTHS: tuple[tuple[float, tuple[tuple[str, float, float, float], ...]], ...] = (
    (0.34, ()),
    (0.24, (("smile", 1, 1.5, 6), ("lower_lip_depress", 0.5, 0.5, 5), ("sneer", 0.4, 0.5, 4),
            ("jaw_open", 0.4, 0.3, 3))),
    (0.14, (("jaw_open", 1, 0.5, 6), ("smile", 0.4, 1, 6), ("grimace", 0.15, 1, 5))),
    (0.10, (("grimace", 1, 1.5, 6), ("sneer", 0.5, 1, 5), ("lower_lip_depress", 0.6, 1, 5),
            ("jaw_open", 0.3, 0.5, 5))),
    (0.08, (("smile", 1, 1, 6),)),
    (0.05, (("lip_loosen", 1, 0.5, 5), ("jaw_open", 0.3, 0.5, 4))),
    (0.05, (("lower_lip_depress", 1, 0.5, 5), ("frown", 0.4, 1, 5))),
)  # fmt: skip


def page_of(seed: int, index: int, names: Names) -> tuple[NDArray, NDArray, NDArray]:
    """LOOKS crops (l, SIZE, SIZE) uint8 of a page, their mouths' landmarks (l, m, 2) in crop units,
    and the mean distance of their rims (l,), as a share of the face's height."""
    rng = np.random.default_rng([seed, index, 7])
    aus = sample_actions(rng)
    lot = rng.choice(len(MOUTHS), p=[odds for odds, _ in MOUTHS])
    for name, share, least, most in MOUTHS[lot][1]:
        if rng.random() < share:
            aus[name] = float(rng.uniform(least, most))
    engine = "contours" if rng.random() < CONTOURS else "conventions"
    scheme = "people" if rng.random() < 0.5 else "sparse"
    size = int(rng.integers(*PAGES))
    drawing, record = make_sample(seed, index, size, scheme, engine, aus=aus)
    told = record.get("drawn_landmarks", record["landmarks"])
    points = np.array([told[name] for name in LANDMARKS])
    man = float(record["identity"].get("gender", 0.5))
    bald = engine == "contours"
    ink, points, turn = artistic_page(
        drawing, points, aus.get("smile", 0) > 1.5, man, names, rng, bald
    )
    crops, places, opened = [], [], []
    for _ in range(LOOKS):
        marks = dict(zip(LANDMARKS, points, strict=True))
        own = mouth_box(marks, turn)
        noise = np.clip(rng.normal(size=6), -2.5, 2.5)
        crop = amiss(own, noise, SPREADS)
        small = area_resample(ink, crop, SIZE) / np.float32(255)
        if rng.random() > AS_DRAWN:
            small = spoiled(small, rng)
        mouth = np.array([marks[name] for name in MOUTH])
        crops.append(np.rint(255 * even_ink(small)).astype(np.uint8))
        places.append(crop.to_units(mouth).astype(np.float32))
        opened.append(float(opening(mouth)) * SIDE / own.width)
    return np.stack(crops), np.stack(places), np.array(opened, np.float32)


def pages(seed: int, indices: range) -> tuple[NDArray, NDArray, NDArray]:
    """The looks at some pages, one behind another."""
    names = Names.of((), LANDMARKS)
    made = [page_of(seed, i, names) for i in indices]
    ink, places, opened = (np.concatenate(part) for part in zip(*made, strict=True))
    return ink, places, opened


class MouthNetwork(nn.Module):
    """ink (b, 1, SIZE, SIZE) -> landmarks (b, m, 3): u, v in crop units and the log of their
    expected error; and the logit (b,) that the mouth is open."""

    def __init__(self) -> None:
        super().__init__()

        def block(inside: int, out: int, kernel: int, stride: int) -> list[nn.Module]:
            pad = kernel // 2
            conv = nn.Conv2d(inside, out, kernel, stride, pad, bias=False)
            return [conv, nn.BatchNorm2d(out), nn.ReLU(inplace=True)]

        self.trunk = nn.Sequential(
            *block(1, 16, 5, 2), *block(16, 32, 3, 2), *block(32, 64, 3, 2), *block(64, 64, 3, 1),
            *block(64, 32, 1, 1), nn.Flatten(),
            nn.Linear(32 * (SIZE // 8) ** 2, WIDTH), nn.ReLU(inplace=True), nn.Dropout(0.1),
        )  # fmt: skip
        self.places = nn.Linear(WIDTH, 3 * len(MOUTH))
        self.opened = nn.Linear(WIDTH, 1)

    def forward(self, ink: Tensor) -> tuple[Tensor, Tensor]:
        found = self.trunk(ink)
        places = self.places(found).reshape(-1, len(MOUTH), 3)
        shift = torch.tensor([0.5, 0.5, -3.0], device=ink.device)
        return places * 0.2 + shift, self.opened(found)[:, 0]


def loss_of(network: MouthNetwork, ink: Tensor, places: Tensor, opened: Tensor) -> Tensor:
    """Distances of landmarks and of the rims from each other, the doubt about them, and whether the
    mouth is open."""
    found, logit = network(ink)
    off = found[:, :, :2] - places
    far = torch.sqrt((off**2).sum(dim=2) + 1e-6)
    upper, lower = ([MOUTH.index(pair[k]) for pair in RIMS] for k in (0, 1))
    gap = (off[:, lower] - off[:, upper]).abs().sum(dim=2)
    doubt = far.detach() / torch.exp(found[:, :, 2]) + found[:, :, 2]
    said = F.binary_cross_entropy_with_logits(logit, opened)
    return 20 * far.mean() + 20 * gap.mean() + 0.2 * doubt.mean() + 0.5 * said


def changed(ink: Tensor, places: Tensor) -> tuple[Tensor, Tensor]:
    """Crops (b, 1, s, s) mirrored, shaded, rubbed out, of other contrast, by lot."""
    flip = torch.rand(len(ink)) < 0.5
    mirrored = places[:, torch.as_tensor(MIRROR)] * torch.tensor([-1.0, 1]) + torch.tensor([1.0, 0])
    places = torch.where(flip[:, None, None], mirrored, places)
    wide = flip[:, None, None, None]
    ink = torch.where(wide, ink.flip(-1), ink)
    return soiled(ink), places


def figures(network: MouthNetwork, ink: Tensor, places: Tensor, opened: Tensor) -> dict[str, float]:
    """Of held-out looks: landmarks' and the opening's mean error where it is open, crop units; AUC
    of open; and by what the spreads must be multiplied to be true."""
    network.eval()
    with torch.no_grad():
        parts = [network(part) for part in ink.split(256)]
    found, logit = (torch.cat(part).numpy() for part in zip(*parts, strict=True))
    yes = opened.numpy() > 0.5
    far = np.linalg.norm(found[:, :, :2] - places.numpy(), axis=2)[yes]
    gap = (opening(found[:, :, :2]) - opening(places.numpy()))[yes]
    order = np.argsort(np.argsort(logit)) + 1
    auc = (order[yes].sum() - yes.sum() * (yes.sum() + 1) / 2) / (yes.sum() * (~yes).sum())
    return {
        "landmarks": round(float(far.mean()), 5),
        "opening": round(float(np.abs(gap).mean()), 5),
        "opening_bias": round(float(gap.mean()), 5),
        "open_auc": round(float(auc), 4),
        "open_right": round(float(((logit > 0) == yes).mean()), 4),
        "spread": round(float((far / np.exp(found[yes, :, 2])).mean()), 4),
    }


def learn(
    data: tuple[NDArray, ...], minutes: float, threads: int, seed: int
) -> tuple[MouthNetwork, dict]:
    """The network after so many minutes on the looks, of which the last fifteenth is held out."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    ink, places = torch.from_numpy(data[0]), torch.from_numpy(data[1])
    opened = torch.from_numpy((data[2] > OPEN).astype(np.float32))
    kept = len(ink) // 15
    held = ink[-kept:, None].float() / 255, places[-kept:], opened[-kept:]
    network = MouthNetwork().to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-2)
    begun, step, told = time.monotonic(), 0, 0.0
    while (share := (time.monotonic() - begun) / (60 * minutes)) < 1:
        rate = 2e-3 * min(1.0, (step + 1) / 200) * 0.5 * (1 + np.cos(np.pi * share))
        for group in optimiser.param_groups:
            group["lr"] = rate
        rows = torch.randint(len(ink) - kept, (128,))
        crops, marks = changed(ink[rows][:, None].float() / 255, places[rows])
        network.train()
        loss = loss_of(
            network, crops.contiguous(memory_format=torch.channels_last), marks, opened[rows]
        )
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        step += 1
        if time.monotonic() - told > 60:
            told = time.monotonic()
            log.info("%4.1f min, step %d, loss %.3f, %s", share * minutes, step, loss.item(),
                     figures(network, *held))  # fmt: skip
    return network, {"steps": step, **figures(network, *held)}


class Calibrated(nn.Module):
    """The network with spreads that are true of held-out drawings."""

    def __init__(self, network: MouthNetwork, spread: float) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("shift", torch.tensor([0.0, 0.0, float(np.log(spread))]))

    def forward(self, ink: Tensor) -> tuple[Tensor, Tensor]:
        places, opened = self.network(ink)
        return places + self.shift, opened


def write(network: MouthNetwork, about: dict, out: Path) -> None:
    """mouth.onnx and mouth.json of the network."""
    model = Calibrated(network.eval().cpu(), about["held_out"]["spread"])
    about = {"landmarks": list(MOUTH), **about}
    closer.write(model, NAME, SIZE, ("places", "opened"), about, out)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the weights")
    parser.add_argument("--pages", type=int, default=5_300)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--looks", type=Path, help="keep the looks here (.npz), or go on with them")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    if options.looks and options.looks.exists():
        with np.load(options.looks) as stored:
            data = tuple(stored[name] for name in ("ink", "places", "opened"))
    else:
        chunks = [range(a, min(a + 100, options.pages)) for a in range(0, options.pages, 100)]
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            parts = list(pool.map(partial(pages, options.seed), chunks))
        data = tuple(np.concatenate(part) for part in zip(*parts, strict=True))
        if options.looks:
            np.savez(options.looks, ink=data[0], places=data[1], opened=data[2])
    network, held_out = learn(data, options.minutes, options.jobs, options.seed)
    log.info("%s", held_out)
    about = {"pages": len(data[0]) // LOOKS, "seed": options.seed, "held_out": held_out}
    write(network, about, options.out)


if __name__ == "__main__":
    main()
