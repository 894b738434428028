"""A data set to try things on: cartoon faces of a few lines, in the format of the real shards."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

from facs_rig import CONTROL_NAMES, LANDMARKS, TWELVE
from facs_rig.anatomy import LANDMARK_POINTS

SIZE = 256


def place(name: str) -> tuple[float, float]:
    """Of a landmark, in centimetres from the eyes' middle, u to the image's right, v down."""
    x, y = LANDMARK_POINTS[name][1][:2]
    return x, -y


def cartoon(rng: np.random.Generator) -> tuple[np.ndarray, dict]:
    """One drawing (256, 256) uint8 and its record. Every detected unit is a mark of its own."""
    unit = rng.uniform(8, 10.5)
    origin = np.array([128, 118]) + rng.normal(0, 6, 2)
    yaw = float(rng.uniform(-0.5, 0.5))
    aus = dict.fromkeys(CONTROL_NAMES, 0.0)
    for name in TWELVE:
        if rng.random() < 0.45:
            aus[name] = float(rng.uniform(1, 5))

    def turned(u, v):
        """A turned head moves its features sideways, more toward its middle."""
        return u * np.cos(yaw) + 9 * np.sin(yaw) * (1 - (np.asarray(u) / 7) ** 2) * 0.4, v

    page = Image.new("L", (SIZE * 2, SIZE * 2), 255)
    draw = ImageDraw.Draw(page)

    def line(*points, width=2):
        u, v = turned(*np.array(points, float).T)
        flat = (origin + unit * np.stack([u, np.broadcast_to(v, u.shape)], 1)) * 2
        draw.line(flat.ravel().tolist(), fill=0, width=width)

    angle = np.linspace(0, 2 * np.pi, 40)
    line(*zip(7 * np.cos(angle), 10.6 * np.sin(angle) - 0.4, strict=True), width=3)
    lift = 0.5 * aus["frontalis"] / 5
    for side in (-1, 1):
        small = 1 - 0.12 * aus["squint"]
        line(*zip(side * (2.9 + 1.2 * np.cos(angle)), 0.5 * small * np.sin(angle), strict=True))
        line((side * 2.7, 0), (side * 3.1, 0), width=6)
        line((side * 1.3, -1.2 - lift), (side * 3.4, -1.8 - lift), (side * 4.9, -1.2 - lift))
        line((side * 0.4, 1), (side * 1.7, 4), (0, 4.6))
        for k in range(2):
            if aus["squint"]:
                line((side * 4.5, 0.5 + k * 0.5), (side * 5.5, 1.2 + k * 0.7))
            if aus["outer_squint"]:
                line((side * 4.5, -0.3 - k * 0.4), (side * 5.6, -1.0 - k * 0.6))
            if aus["wince"]:
                line((side * 0.3, 0.6 + k), (side * 1.3, 1.4 + k))
        if aus["sneer"]:
            line((side * 1.8, 3.5), (side * 2.8, 5.4))
        if aus["brow_furrow"]:
            line((side * 0.6, -0.4), (side * 0.5, -2.2))
        if aus["grimace"] + aus["grimace_left" if side > 0 else "grimace_right"]:
            line((side * 3.3, 5.6), (side * 3.7, 6.8), (side * 3.4, 8.0))
    for k in range(3):
        if aus["frontalis"]:
            line((-4, -3 - k), (0, -3.2 - k), (4, -3 - k))
        if aus["medialis_frontalis"]:
            line((-1.3, -3.5 - k), (0, -2.9 - k), (1.3, -3.5 - k))
    u = np.linspace(-2.3, 2.3, 9) * (0.6 if aus["pucker"] else 1)
    curve = -0.3 * aus["smile"] * (u / 2.3) ** 2
    line(*zip(u, 6.8 + curve, strict=True))
    line(*zip(u, 7.4 + curve * 0.5, strict=True))
    if aus["pucker"]:
        for x in (-0.6, 0, 0.6):
            line((x, 5.4), (x * 0.8, 6.2))

    small = np.array(page.resize((SIZE, SIZE), Image.Resampling.BOX))
    landmarks = {}
    for name in LANDMARKS:
        u, v = turned(*place(name))
        landmarks[name] = [float(origin[0] + unit * u), float(origin[1] + unit * v)]
    head = {"yaw": float(np.degrees(yaw)), "pitch": 0.0, "roll": 0.0}
    return small, {
        "aus": aus,
        "head": head,
        "landmarks": landmarks,
        "engine": "contours",
        "seed": 0,
    }


def write_shards(folder: Path, count: int, seed: int = 0, per_shard: int = 500) -> Path:
    """Cartoons as WebDataset shards."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    for start in range(0, count, per_shard):
        with tarfile.open(folder / f"shard-{start // per_shard:06d}.tar", "w") as shard:
            for i in range(start, min(start + per_shard, count)):
                drawing, record = cartoon(rng)
                png = io.BytesIO()
                Image.fromarray(drawing).save(png, "PNG")
                for extension, data in (
                    ("json", json.dumps(record | {"index": i}).encode()),
                    ("png", png.getvalue()),
                ):
                    info = tarfile.TarInfo(f"{i:08d}.{extension}")
                    info.size = len(data)
                    shard.addfile(info, io.BytesIO(data))
    return folder


@pytest.fixture(scope="session")
def cartoons(tmp_path_factory) -> Path:
    """A folder with 60 cartoons in two shards."""
    return write_shards(tmp_path_factory.mktemp("cartoons"), 60, per_shard=40)


@pytest.fixture(scope="session")
def many_cartoons(tmp_path_factory) -> Path:
    """Enough of them to learn from."""
    return write_shards(tmp_path_factory.mktemp("many"), 600, seed=1)


@pytest.fixture(scope="session")
def fresh_weights(tmp_path_factory, cartoons) -> Path:
    """Networks trained for two steps, exported: everything works, nothing is known yet."""
    pytest.importorskip("torch")
    pytest.importorskip("onnx")
    from classifiers.training import shards
    from classifiers.training.common import Config
    from classifiers.training.export import export
    from classifiers.training.train import train

    folder = tmp_path_factory.mktemp("weights")
    data = shards.load(cartoons)
    config = Config(size=64, batch=8, minutes=5, steps=2, workers=0, threads=1, imagenet=False)
    export(train(data, TWELVE, folder / "run", config), data, folder, say=lambda text: None)
    return folder
