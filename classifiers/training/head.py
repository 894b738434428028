"""Train the network that looks at heads (classifiers.head): drawn, learnt, written.

    python -m classifiers.training.head --out classifiers/weights [--pages 12000] [--minutes 60]

Drawings of both engines that tell what lies where: heads of hair in every finish, beards, hats, and
bald ones. A page is drawn over as for the detector (augment.artistic_page) and looked at several
times, as far off as the detector may be. The trunk goes on from the detector's.
"""

from __future__ import annotations

import argparse
import logging
import math
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from dataset_gen.generate import make_sample
from facs_rig import LANDMARKS
from facs_rig.common.images import area_resample

from ..head import CELLS, NAME, SIZE, WHO, head_box
from ..labels import REGIONS
from ..preprocess import even_ink
from ..runtime import WEIGHTS
from . import closer
from .augment import AS_DRAWN, Names, artistic_page
from .closer import amiss, soiled
from .clothes import dressed
from .exported import opened
from .network import STAGES, Trunk
from .paper import spoiled
from .regions import Outlines

log = logging.getLogger(__name__)

SEED = 6_000_000
LOOKS = 2  # at each page
CHUNK = 100  # pages to a file of looks
BATCH, RATE, DECAY = 48, 1e-3, 1e-2
TRUNK_RATE = 0.3  # of the rate, for what has been learnt before
KEPT = 2  # blocks of the trunk that stay as they are, which saves two fifths of the time
HELD_OUT = 512  # looks, the first ones
PAGES = (256, 448)  # px, the sides of pages
CONTOURS, HAIRED = 0.5, 0.85  # of the pages, those drawn by contours, and those with hair of these
WORN = 0.3, 4.0  # of the pages, those on which beards and hats are commoner, and how much
CLOTHED = 0.4  # of the pages, those with clothes that are inked as hair is
SPREADS = 0.08, 0.05, 0.025, 0.07  # see `amiss`
OVERLAP = 0.5  # weight of how little a region overlaps
TOLD = 0.2  # weight of who is drawn
WEIGHTED = {"hat": 2.0, "beard": 2.0}
# Looks at these, and at heads with little hair for their face (bald ones, rims, shorn hair), are
# taken so many times as often as others.
RARE, LITTLE, AGAIN = ("beard", "hat"), 0.4, 2
BITS = np.array([bin(byte).count("1") for byte in range(256)])


def page_of(seed: int, index: int, names: Names) -> tuple[NDArray, ...]:
    """LOOKS crops (l, SIZE, SIZE) uint8 of a page, what lies where in each (l, r, CELLS, CELLS)
    bool, (l, r) whether that is told of a region at all, and who is drawn (l, p)."""
    rng = np.random.default_rng([seed, index, 11])
    engine = "contours" if rng.random() < CONTOURS else "conventions"
    scheme = "people" if engine == "contours" or rng.random() < 0.6 else "sparse"
    size = int(rng.integers(*PAGES))
    worn = WORN[1] if np.random.default_rng([seed, index, 13]).random() < WORN[0] else 1.0
    drawing, record = make_sample(seed, index, size, scheme, engine, hair=HAIRED, worn=worn)
    places = record.get("drawn_landmarks", record["landmarks"])
    outlines = Outlines.of(record)
    count = len(LANDMARKS)
    around = np.zeros((0, 2)) if outlines is None else outlines.points
    points = np.concatenate([np.array([places[name] for name in LANDMARKS]), around])
    man = float(record["identity"].get("gender", 0.5))
    folds = record["aus"].get("smile", 0) > 1.5
    ink, points, turn = artistic_page(drawing, points, folds, man, names, rng, bald=False)
    if outlines is not None and rng.random() < CLOTHED:
        over = Image.new("1", (ink.shape[1], ink.shape[0]))
        for a, b in zip(outlines.starts[:-1], outlines.starts[1:], strict=True):
            if b - a > 2:
                outline = points[count + a : count + b].ravel().tolist()
                ImageDraw.Draw(over).polygon(outline, fill=1)
        ink = dressed(ink, points[:count], np.asarray(over), rng)
    marks = dict(zip(LANDMARKS, points[:count], strict=True))
    own = head_box(marks, turn)
    crops, regions = [], []
    for _ in range(LOOKS):
        noise = np.clip(rng.normal(size=5), -2.5, 2.5)
        crop = amiss(own, noise, SPREADS)
        small = area_resample(ink, crop, SIZE) / np.float32(255)
        if rng.random() > AS_DRAWN:
            small = spoiled(small, rng)
        crops.append(np.rint(255 * even_ink(small)).astype(np.uint8))
        regions.append(
            np.full((len(REGIONS), CELLS, CELLS), np.nan)
            if outlines is None
            else outlines.mask(points[count:], crop, CELLS)
        )
    found = np.stack(regions)
    who = np.array([record["identity"].get(name, 0.5) for name in WHO], np.float32)
    told = ~np.isnan(found).any(axis=(2, 3))
    return np.stack(crops), found > 0.5, told, np.tile(who, (LOOKS, 1))


def pages(seed: int, folder: Path, chunk: int) -> Path:
    """The looks at CHUNK pages, one behind another, in a file of the folder."""
    path = folder / f"looks_{seed}_{chunk:05}.npz"
    if not path.exists():
        names = Names.of((), LANDMARKS)
        made = [page_of(seed, i, names) for i in range(CHUNK * chunk, CHUNK * (chunk + 1))]
        ink, found, told, who = (np.concatenate(part) for part in zip(*made, strict=True))
        unfinished = path.with_suffix(".part")
        with unfinished.open("wb") as file:
            np.savez(file, ink=ink, found=np.packbits(found, axis=-1), told=told, who=who)
        unfinished.rename(path)
    return path


class HeadNetwork(nn.Module):
    """ink (b, 1, SIZE, SIZE) -> logits (b, r, CELLS, CELLS) of REGIONS, of each by itself, and
    of who is drawn mean and log of the spread (b, p, 2)."""

    def __init__(self) -> None:
        super().__init__()
        self.trunk = Trunk()
        self.known = [self.trunk.stem, *self.trunk.blocks[:KEPT]]
        for layer in self.known:
            layer.requires_grad_(False)
        # The last block before each halving of the picture, and what it answers.
        ends = np.cumsum([repeats for repeats, *_ in STAGES]) - 1
        self.taps = [int(ends[1]), int(ends[2]), int(ends[4])]
        fine, middle, coarse = STAGES[1][-1], STAGES[2][-1], STAGES[4][-1]

        def block(inside: int, out: int) -> nn.Module:
            conv = nn.Conv2d(inside, out, 3, padding=1, bias=False)
            return nn.Sequential(conv, nn.BatchNorm2d(out), nn.ReLU(inplace=True))

        self.whole = nn.Sequential(nn.AdaptiveAvgPool2d(1), nn.Conv2d(coarse, 64, 1))
        self.who = nn.Sequential(
            nn.Conv2d(coarse, 24, 3, padding=1), nn.ReLU(inplace=True), nn.MaxPool2d(2),
            nn.Flatten(), nn.Linear(24 * (SIZE // 32) ** 2, 64), nn.ReLU(inplace=True),
            nn.Dropout(0.2), nn.Linear(64, 2 * len(WHO)),
        )  # fmt: skip
        # By what its spreads must be multiplied to be true of held-out drawings, as logarithms.
        self.register_buffer("doubt", torch.zeros(len(WHO)))
        self.coarse = block(coarse, 64)
        self.middle = block(64 + middle, 48)
        self.fine = block(48 + fine, 32)
        self.answer = nn.Conv2d(32, 4 * len(REGIONS), 3, padding=1)

    def train(self, mode: bool = True) -> HeadNetwork:
        super().train(mode)
        for layer in self.known:
            layer.eval()
        return self

    def forward(self, ink: Tensor) -> tuple[Tensor, Tensor]:
        x, kept = self.trunk.stem(ink), []
        for k, layer in enumerate(self.trunk.blocks):
            x = layer(x)
            if k in self.taps:
                kept.append(x)
        fine, middle, coarse = kept
        x = F.relu(self.coarse(coarse) + self.whole(coarse))
        x = self.middle(torch.cat([F.interpolate(x, scale_factor=2.0), middle], dim=1))
        x = self.fine(torch.cat([F.interpolate(x, scale_factor=2.0), fine], dim=1))
        mean, spread = self.who(coarse).unflatten(1, (len(WHO), 2)).unbind(dim=2)
        who = torch.stack([mean + 0.5, spread.clamp(-4, 2) - 1 + self.doubt], dim=2)
        return F.pixel_shuffle(self.answer(x), 2), who


def loss_of(
    answer: tuple[Tensor, Tensor], found: Tensor, told: Tensor, who: Tensor
) -> tuple[Tensor, Tensor]:
    """Cross entropy of each cell, and one less how far regions overlap (Milletari et al. 2016,
    "V-Net"), of those that are told of; and how unlikely (log) the person is."""
    logits, (mean, spread) = answer[0], answer[1].unbind(dim=2)
    unlikely = (0.5 * ((mean - who) / spread.exp()) ** 2 + spread).mean()
    weight = torch.tensor([WEIGHTED.get(name, 1.0) for name in REGIONS])
    each = F.binary_cross_entropy_with_logits(logits, found, reduction="none").mean(dim=(2, 3))
    share = logits.sigmoid()
    both = (share * found).sum(dim=(2, 3))
    total = (share + found).sum(dim=(2, 3))
    apart = 1 - (2 * both + 20) / (total + 20)
    told = told * weight
    return ((each + OVERLAP * apart) * told).sum() / told.sum().clamp(min=1), unlikely


def changed(ink: Tensor, found: Tensor) -> tuple[Tensor, Tensor]:
    """Crops (b, 1, s, s) mirrored, shaded, rubbed out, of other contrast, by lot."""
    flip = (torch.rand(len(ink)) < 0.5)[:, None, None, None]
    ink = torch.where(flip, ink.flip(-1), ink)
    found = torch.where(flip, found.flip(-1), found)
    return soiled(ink), found


class Looks:
    """The looks of a folder, read as files come."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.seen = folder, set[Path]()
        self.parts: list[tuple[Tensor, ...]] = []
        self.lots = np.zeros(0, np.intp)

    def refresh(self) -> int:
        """Read what is new; -> how many looks there are."""
        for path in sorted(self.folder.glob("looks_*.npz")):
            if path not in self.seen:
                self.seen.add(path)
                with np.load(path) as stored:
                    names = ("ink", "found", "told", "who")
                    self.parts.append(tuple(torch.from_numpy(stored[name]) for name in names))
        self.starts = np.cumsum([0, *(len(part[0]) for part in self.parts)])
        count = int(self.starts[-1])
        rare, hair = [REGIONS.index(name) for name in RARE], REGIONS.index("hair")
        face = REGIONS.index("face")
        cells = np.concatenate([BITS[part[1].numpy()].sum(axis=(2, 3)) for part in self.parts])
        seldom = cells[:, rare].any(axis=1) | (cells[:, hair] < LITTLE * cells[:, face])
        times = np.where(seldom, AGAIN, 1)
        times[:HELD_OUT] = 0
        self.lots = np.repeat(np.arange(count), times)
        return count

    def some(self, count: int, rng: np.random.Generator) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """So many by lot of those that are not held out, as `at` gives them."""
        return self.at(rng.choice(self.lots, count))

    def at(self, rows: NDArray) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Ink (b, 1, s, s) and regions (b, r, c, c) as floats, which are told of (b, r), and who
        is drawn (b, p)."""
        owner = np.searchsorted(self.starts, rows, side="right") - 1
        picked = [
            [values[row - self.starts[k]] for values in self.parts[k]]
            for k, row in zip(owner, rows, strict=True)
        ]
        ink, found, told, who = (torch.stack(part) for part in zip(*picked, strict=True))
        bits = np.unpackbits(found.numpy(), axis=-1)
        return ink[:, None].float() / 255, torch.from_numpy(bits).float(), told.float(), who


def figures(network: HeadNetwork, looks: Looks) -> dict[str, float]:
    """Of the looks that are held out, of each region: the overlap with the true one, mean over
    those that have it, and how often it is seen where there is none."""
    network.eval()
    both, either, true, seen, told, people = [], [], [], [], [], []
    with torch.no_grad():
        for rows in np.array_split(np.arange(HELD_OUT), -(-HELD_OUT // 32)):
            ink, found, known, who = looks.at(rows)
            answer = network(ink.contiguous(memory_format=torch.channels_last))
            said = answer[0] > 0
            people.append(torch.stack([*answer[1].unbind(dim=2), who]))
            yes = found > 0.5
            both.append((said & yes).sum(dim=(2, 3)))
            either.append((said | yes).sum(dim=(2, 3)))
            true.append(yes.sum(dim=(2, 3)))
            seen.append(said.sum(dim=(2, 3)))
            told.append(known > 0)
    b, e, t, s, k = (torch.cat(part).numpy() for part in (both, either, true, seen, told))
    least = 20  # cells
    out = {}
    for r, name in enumerate(REGIONS):
        has, none = k[:, r] & (t[:, r] >= least), k[:, r] & (t[:, r] == 0)
        if has.any():
            out[name] = round(float((b[has, r] / np.maximum(e[has, r], 1)).mean()), 4)
        if none.any():
            out[f"{name}_false"] = round(float((s[none, r] >= least).mean()), 4)
    read, spread, true = torch.cat(people, dim=1).numpy()
    far = np.sqrt((((read - true) / np.exp(spread)) ** 2).mean(axis=0))
    for k, name in enumerate(WHO):
        out[name] = round(float(np.corrcoef(read[:, k], true[:, k])[0, 1]), 4)
        out[f"{name}_spread"] = round(float(far[k]), 4)
    return out


def learn(
    looks: Looks, minutes: float, threads: int, seed: int, checkpoint: Path
) -> tuple[HeadNetwork, dict]:
    """The network after so many minutes on the looks, of which the first are held out.

    checkpoint : where it is kept once a minute, and from where it goes on
    """
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    rng = np.random.default_rng(seed)
    network = HeadNetwork()
    network.trunk.load_state_dict(opened(WEIGHTS)[0].trunk.state_dict())
    network = network.to(memory_format=torch.channels_last)
    old = [p for p in network.trunk.parameters() if p.requires_grad]
    new = [p for name, p in network.named_parameters() if not name.startswith("trunk.")]
    groups = [{"params": old, "share": TRUNK_RATE}, {"params": new, "share": 1.0}]
    optimiser = torch.optim.AdamW(groups, RATE, weight_decay=DECAY)
    step, spent, told, total = 0, 0.0, 0.0, 0.0
    if checkpoint.exists():
        saved = torch.load(checkpoint, weights_only=True)
        network.load_state_dict(saved["network"])
        optimiser.load_state_dict(saved["optimiser"])
        step, spent = saved["step"], saved["spent"]
    count, begun = looks.refresh(), time.monotonic() - spent
    while (share := (time.monotonic() - begun) / (60 * minutes)) < 1:
        if not step % 200:
            count = looks.refresh()
        rate = RATE * min(1.0, (step + 1) / 200) * 0.5 * (1 + math.cos(math.pi * share))
        for group in optimiser.param_groups:
            group["lr"] = rate * group["share"]
        ink, found, known, who = looks.some(BATCH, rng)
        ink, found = changed(ink, found)
        network.train()
        answer = network(ink.contiguous(memory_format=torch.channels_last))
        loss, unlikely = loss_of(answer, found, known, who)
        loss = loss + TOLD * unlikely
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        step, total = step + 1, 0.98 * total + 0.02 * loss.item()
        if time.monotonic() - told > 180:
            told = time.monotonic()
            log.info("%5.1f min, step %d, of %d looks, loss %.4f, %s", share * minutes, step, count,
                     total / (1 - 0.98**step), figures(network, looks))  # fmt: skip
            state = {"network": network.state_dict(), "optimiser": optimiser.state_dict()}
            spent = time.monotonic() - begun
            torch.save(state | {"step": step, "spent": spent}, checkpoint)
    found = figures(network, looks)
    network.doubt += torch.tensor([math.log(found[f"{name}_spread"]) for name in WHO])
    return network, {"steps": step, "looks": looks.refresh(), **found}


def write(network: HeadNetwork, about: dict, out: Path) -> None:
    """head.onnx and head.json of the network."""
    about = {"regions": list(REGIONS), **about}
    closer.write(network, NAME, SIZE, ("regions", "who"), about, out)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the weights")
    parser.add_argument("--looks", type=Path, required=True, help="folder that keeps the looks")
    parser.add_argument("--pages", type=int, default=12_000)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--only-draw", action="store_true", help="make the looks, learn nothing")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    options.looks.mkdir(parents=True, exist_ok=True)
    chunks = range(-(-options.pages // CHUNK))
    if options.pages:
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            for path in pool.map(partial(pages, options.seed, options.looks), chunks):
                log.debug("%s", path)
    if options.only_draw:
        return
    checkpoint = options.looks / "checkpoint.pt"
    network, held_out = learn(
        Looks(options.looks), options.minutes, options.jobs, options.seed, checkpoint
    )
    log.info("%s", held_out)
    pages_seen = held_out["looks"] // LOOKS
    about = {"pages": pages_seen, "seed": options.seed, "held_out": held_out}
    write(network, about, options.out)


if __name__ == "__main__":
    main()
