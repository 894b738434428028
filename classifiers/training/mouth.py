"""Train the network that looks at mouths (classifiers.mouth): drawn, learnt, written.

    python -m classifiers.training.mouth --out classifiers/weights [--pages 5300] [--minutes 20]
        [--start classifiers/weights]

Drawings of both engines, of people of all kinds, whose mouths do what mouths do when they open:
laugh, bare their teeth, speak, shout; the rest are shut. Many are drawn as comics do, by one bold
shape (dataset_gen.conventions.grins). A page is drawn over as for the detector
(augment.artistic_page) and looked at several times, as far off as the detector may be.
"""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import numpy_helper
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from dataset_gen.generate import make_sample
from dataset_gen.samples import clenched
from dataset_gen.sampling import sample_actions
from facs_rig import LANDMARKS
from facs_rig.common.images import area_resample

from ..mouth import MIRROR, MOUTH, NAME, OPEN, RIMS, SIDE, SIZE, mouth_box, opening
from ..preprocess import even_ink
from . import closer
from .augment import AS_DRAWN, Names, artistic_page
from .closer import amiss, soiled
from .metrics import auc
from .paper import spoiled

log = logging.getLogger(__name__)

SEED = 5_000_000
LOOKS = 6  # at each page
WIDTH = 128  # of the layer that sees all of a crop
BATCH, RATE = 128, 2e-3
HELD_OUT = 15  # one look in so many
PARTS = ("ink", "places", "opened", "meets")  # of what `page_of` makes
PAGES = (224, 416)  # px, the sides of pages
CONTOURS = 0.3  # of the pages, those drawn by contours
GRINS = 0.45  # of the others, those whose open mouths are one bold shape
SPREADS = 0.1, 0.05, 0.07, 0.07  # see `amiss`
PARTED = 0.3, 1.0  # intensities of `jaw_open` up to which teeth meet, and from which on they do not
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


def page_of(seed: int, index: int, names: Names) -> tuple[NDArray, ...]:
    """LOOKS crops (l, SIZE, SIZE) uint8 of a page, their mouths' landmarks (l, m, 2) in crop units,
    the mean distance of their rims (l,), as a share of the face's height, and whether teeth meet
    (l,), see `meeting`."""
    rng = np.random.default_rng([seed, index, 7])
    aus = sample_actions(rng)
    lot = rng.choice(len(MOUTHS), p=[odds for odds, _ in MOUTHS])
    for name, share, least, most in MOUTHS[lot][1]:
        if rng.random() < share:
            aus[name] = float(rng.uniform(least, most))
    engine = "contours" if rng.random() < CONTOURS else "conventions"
    scheme = "people" if rng.random() < 0.5 else "sparse"
    size = int(rng.integers(*PAGES))
    drawing, record = make_sample(seed, index, size, scheme, engine, aus=aus, grins=GRINS)
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
    meets = np.full(LOOKS, meeting(record), np.float32)
    return np.stack(crops), np.stack(places), np.array(opened, np.float32), meets


def meeting(record: Mapping[str, Any]) -> float:
    """Whether the teeth of a mouth that is drawn open meet: 1 if the jaw is shut, else 0; nan if
    the mouth is drawn shut, or as if the jaw were neither."""
    jaw = float(record["aus"].get("jaw_open", 0.0))
    if jaw > PARTED[1]:
        return 0.0
    if record["engine"] != "conventions":
        return 1.0 if jaw < PARTED[0] else np.nan
    return 1.0 if clenched(record) else np.nan


def pages(seed: int, indices: range) -> tuple[NDArray, ...]:
    """The looks at some pages, one behind another."""
    names = Names.of((), LANDMARKS)
    made = [page_of(seed, i, names) for i in indices]
    return tuple(np.concatenate(part) for part in zip(*made, strict=True))


class MouthNetwork(nn.Module):
    """ink (b, 1, SIZE, SIZE) -> landmarks (b, m, 3): u, v in crop units and the log of their
    expected error; the logit (b,) that the mouth is open; and (b,) that teeth meet if it is."""

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
        self.meets = nn.Linear(WIDTH, 1)

    def forward(self, ink: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        found = self.trunk(ink)
        places = self.places(found).reshape(-1, len(MOUTH), 3)
        shift = torch.tensor([0.5, 0.5, -3.0], device=ink.device)
        return places * 0.2 + shift, self.opened(found)[:, 0], self.meets(found)[:, 0]


def started(folder: Path) -> MouthNetwork:
    """The network of an exported folder, to go on from; whether teeth meet begins anew where the
    folder's does not tell."""
    network = MouthNetwork()
    graph = onnx.load(str(folder / f"{NAME}.onnx")).graph
    stored = {entry.name.removesuffix("_half"): torch.tensor(numpy_helper.to_array(entry)).float()
              for entry in graph.initializer}  # fmt: skip
    convolutions = [node for node in graph.node if node.op_type == "Conv"]
    layers = list(network.trunk)
    with torch.no_grad():
        blocks = [k for k, layer in enumerate(layers) if isinstance(layer, nn.Conv2d)]
        for k, node in zip(blocks, convolutions, strict=True):  # with their normalisation folded in
            layers[k].weight.copy_(stored[node.input[1]])
            layers[k + 1].bias.copy_(stored[node.input[2]])
            layers[k + 1].running_var.fill_(1 - layers[k + 1].eps)
    rest = {name.removeprefix("network."): value for name, value in stored.items()}
    known = network.state_dict()
    network.load_state_dict({n: v for n, v in rest.items() if n in known}, strict=False)
    return network


def loss_of(
    network: MouthNetwork, ink: Tensor, places: Tensor, opened: Tensor, meets: Tensor
) -> Tensor:
    """Distances of landmarks and of the rims from each other, the doubt about them, whether the
    mouth is open, and of open ones whether teeth meet, where that is known (else nan)."""
    found, logit, meeting = network(ink)
    off = found[:, :, :2] - places
    far = torch.sqrt((off**2).sum(dim=2) + 1e-6)
    upper, lower = ([MOUTH.index(pair[k]) for pair in RIMS] for k in (0, 1))
    gap = (off[:, lower] - off[:, upper]).abs().sum(dim=2)
    doubt = far.detach() / torch.exp(found[:, :, 2]) + found[:, :, 2]
    said = F.binary_cross_entropy_with_logits(logit, opened)
    known = (opened > 0.5) & ~meets.isnan()
    told = F.binary_cross_entropy_with_logits(meeting[known], meets[known], reduction="sum")
    said = said + told / len(ink)
    return 20 * far.mean() + 20 * gap.mean() + 0.2 * doubt.mean() + 0.5 * said


@dataclass(frozen=True)
class Looks:
    """Looks at mouths: of what `page_of` makes, whether they are open instead of how far."""

    ink: Tensor
    places: Tensor
    opened: Tensor
    meets: Tensor

    @classmethod
    def parted(cls, sets: Sequence[Sequence[NDArray]]) -> tuple[Looks, Looks]:
        """Those to learn from, and the last of each set, which are held out."""
        kept = [len(ink) // HELD_OUT for ink, *_ in sets]
        both = (
            [[part[:-k] for part in parts] for k, parts in zip(kept, sets, strict=True)],
            [[part[-k:] for part in parts] for k, parts in zip(kept, sets, strict=True)],
        )
        learnt, held = (cls._of(*map(np.concatenate, zip(*some, strict=True))) for some in both)
        return learnt, held

    @classmethod
    def _of(cls, ink: NDArray, places: NDArray, opened: NDArray, meets: NDArray) -> Looks:
        wide = (opened > OPEN).astype(np.float32)
        return cls(*map(torch.from_numpy, (ink, places, wide, meets)))


def changed(ink: Tensor, places: Tensor) -> tuple[Tensor, Tensor]:
    """Crops (b, 1, s, s) mirrored, shaded, rubbed out, of other contrast, by lot."""
    flip = torch.rand(len(ink)) < 0.5
    mirrored = places[:, torch.as_tensor(MIRROR)] * torch.tensor([-1.0, 1]) + torch.tensor([1.0, 0])
    places = torch.where(flip[:, None, None], mirrored, places)
    wide = flip[:, None, None, None]
    ink = torch.where(wide, ink.flip(-1), ink)
    return soiled(ink), places


def figures(network: MouthNetwork, looks: Looks) -> dict[str, float]:
    """Of held-out looks: landmarks' and the opening's mean error where it is open, crop units; AUC
    of open, and of teeth that meet; and by what the spreads must be multiplied to be true."""
    network.eval()
    with torch.no_grad():
        parts = [network(part[:, None].float() / 255) for part in looks.ink.split(256)]
    found, logit, meeting = (torch.cat(part).numpy() for part in zip(*parts, strict=True))
    yes, meets, places = looks.opened.numpy() > 0.5, looks.meets.numpy(), looks.places.numpy()
    far = np.linalg.norm(found[:, :, :2] - places, axis=2)[yes]
    gap = (opening(found[:, :, :2]) - opening(places))[yes]
    return {
        "landmarks": round(float(far.mean()), 5),
        "opening": round(float(np.abs(gap).mean()), 5),
        "opening_bias": round(float(gap.mean()), 5),
        "open_auc": round(auc(yes.astype(float), logit), 4),
        "open_right": round(float(((logit > 0) == yes).mean()), 4),
        "meet_auc": round(auc(np.where(yes, meets, np.nan), meeting), 4),
        "spread": round(float((far / np.exp(found[yes, :, 2])).mean()), 4),
    }


def learn(
    looks: Looks, held: Looks, minutes: float, threads: int, seed: int, network: MouthNetwork
) -> dict:
    """Train the network for so many minutes on the looks; its figures on those held out."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    network.to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-2)
    begun, step, told = time.monotonic(), 0, 0.0
    while (share := (time.monotonic() - begun) / (60 * minutes)) < 1:
        rate = RATE * min(1.0, (step + 1) / 200) * 0.5 * (1 + np.cos(np.pi * share))
        for group in optimiser.param_groups:
            group["lr"] = rate
        rows = torch.randint(len(looks.ink), (BATCH,))
        crops, marks = changed(looks.ink[rows][:, None].float() / 255, looks.places[rows])
        network.train()
        loss = loss_of(
            network, crops.contiguous(memory_format=torch.channels_last), marks,
            looks.opened[rows], looks.meets[rows],
        )  # fmt: skip
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        step += 1
        if time.monotonic() - told > 60:
            told = time.monotonic()
            log.info("%4.1f min, step %d, loss %.3f, %s", share * minutes, step, loss.item(),
                     figures(network, held))  # fmt: skip
    return {"steps": step, **figures(network, held)}


class Calibrated(nn.Module):
    """The network with spreads that are true of held-out drawings."""

    def __init__(self, network: MouthNetwork, spread: float) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("shift", torch.tensor([0.0, 0.0, float(np.log(spread))]))

    def forward(self, ink: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        places, opened, meets = self.network(ink)
        return places + self.shift, opened, meets


def write(network: MouthNetwork, about: dict, out: Path) -> None:
    """mouth.onnx and mouth.json of the network."""
    model = Calibrated(network.eval().cpu(), about["held_out"]["spread"])
    about = {"landmarks": list(MOUTH), **about}
    closer.write(model, NAME, SIZE, ("places", "opened", "meets"), about, out)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the weights")
    parser.add_argument("--pages", type=int, default=5_300)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--start", type=Path, help="folder of weights to go on from")
    there = "keep the looks here (.npz), or learn from those that are there"
    parser.add_argument("--looks", type=Path, nargs="*", default=[], help=there)
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    stored = [path for path in options.looks if path.exists()]
    if not stored:
        chunks = [range(a, min(a + 100, options.pages)) for a in range(0, options.pages, 100)]
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            made = list(pool.map(partial(pages, options.seed), chunks))
        sets = [[np.concatenate(part) for part in zip(*made, strict=True)]]
        if options.looks:
            np.savez(options.looks[0], **dict(zip(PARTS, sets[0], strict=True)))
    else:
        sets = [[np.load(path)[name] for name in PARTS] for path in stored]
    looks, held = Looks.parted(sets)
    network = started(options.start) if options.start else MouthNetwork()
    held_out = learn(looks, held, options.minutes, options.jobs, options.seed, network)
    log.info("%s", held_out)
    about = {"looks": len(looks.ink) + len(held.ink), "seed": options.seed, "held_out": held_out}
    write(network, about, options.out)


if __name__ == "__main__":
    main()
