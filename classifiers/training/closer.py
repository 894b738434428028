"""What the trainings of the networks that look closer have in common: mouths and heads."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import helper, numpy_helper
from torch import Tensor, nn

from facs_rig.common.box import Box

from .jitter import rubbed, shaded

LARGE = 256  # values, from which on weights are stored in half precision


def amiss(own: Box, noise: NDArray, spreads: Sequence[float]) -> Box:
    """A crop as far off as the detector may be.

    own : the true one      noise : (5,) about 1: of size, shape, place across and down, and turn
    spreads : of size (log), shape (log), place (of the crop), turn (radians)
    """
    scale, stretch, shift, turn = spreads
    side = own.width * np.exp(scale * noise[0])
    wide, tall = side * np.exp(stretch * noise[1]), side / np.exp(stretch * noise[1])
    u, v = np.array(own.middle) + shift * own.width * noise[2:4]
    return Box.at(u - wide / 2, v - tall / 2, wide, tall, own.turn + turn * noise[4])


def soiled(ink: Tensor) -> Tensor:
    """Crops (b, 1, s, s) shaded, rubbed out, of other contrast, with grain, by lot."""
    for share, change in ((0.2, shaded), (0.1, rubbed)):
        some = (torch.rand(len(ink)) < share)[:, None, None, None]
        ink = torch.where(some, change(ink), ink)
    power = torch.exp(0.3 * torch.randn(len(ink), 1, 1, 1))
    some = (torch.rand(len(ink)) < 0.3)[:, None, None, None]
    ink = torch.where(some, ink.clamp(min=1e-4) ** power, ink)
    grain = 0.06 * torch.rand(len(ink), 1, 1, 1) * torch.randn_like(ink)
    some = (torch.rand(len(ink)) < 0.2)[:, None, None, None]
    return torch.where(some, (ink + grain).clamp(0, 1), ink)


def write(
    network: nn.Module, name: str, size: int, outputs: Sequence[str], about: dict, out: Path
) -> None:
    """NAME.onnx and NAME.json of a network that looks at crops of ink (b, 1, size, size)."""
    path = out / f"{name}.onnx"
    with warnings.catch_warnings():
        # As in `export`: the older exporter needs no further package.
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(
            network.eval().cpu(), (torch.zeros(2, 1, size, size),), str(path), dynamo=False,
            opset_version=17, input_names=["ink"], output_names=list(outputs),
            dynamic_axes={each: {0: "batch"} for each in ("ink", *outputs)},
        )  # fmt: skip
    halved(path)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    told = json.dumps({"size": size, "sha256": digest, **about}, indent=1)
    (out / f"{name}.json").write_text(told + "\n", encoding="utf-8")


def halved(path: Path) -> None:
    """Store the weights of an ONNX file in half precision, as it is loaded it has them in single
    precision again: what ships is half as large, and answers differ by less than a thousandth."""
    model = onnx.load(str(path))
    graph = model.graph
    casts = []
    for entry in [*graph.initializer]:
        values = numpy_helper.to_array(entry)
        if values.dtype == np.float32 and values.size > LARGE:
            graph.initializer.remove(entry)
            half = numpy_helper.from_array(values.astype(np.float16), f"{entry.name}_half")
            graph.initializer.append(half)
            casts.append(
                helper.make_node("Cast", [half.name], [entry.name], to=onnx.TensorProto.FLOAT)
            )
    for k, node in enumerate(casts):
        graph.node.insert(k, node)
    onnx.save(model, str(path))
