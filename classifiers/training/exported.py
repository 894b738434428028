"""Going on from networks that were exported: from detector.onnx back to what can be trained."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import onnx
import torch
from onnx import numpy_helper
from torch import Tensor

from facs_rig.common.errors import InputError

from ..runtime import read_description
from .network import Convolution, Networks

# Parts that stand in an export by their own names; those of an older one may lack the last three.
PARTS = ("geometry.", "finder.", "person.", "regions.", "hats.")


def opened(folder: Path) -> tuple[Networks, dict[str, Any]]:
    """The networks of an exported folder, and what a checkpoint would tell of their training."""
    model = read_description(folder)
    networks = Networks(model["aus"], model["landmarks"], model["size"])
    load_exported(networks, folder)
    past = model.get("training", {})
    saved = {
        "aus": model["aus"],
        "landmarks": model["landmarks"],
        "person": list(networks.person_names),
        "regions": model.get("regions", []),
        "config": past.get("config", {}),
        "step": past.get("steps", 0),
        "seconds": 60 * past.get("minutes", 0.0),
        "retrained": past.get("retrained", []),
        "blend": past.get("blend", 1.0),
    }
    return networks.eval(), saved


def load_exported(networks: Networks, folder: Path) -> None:
    """Give networks the weights of a folder that `export` wrote; they answer as those do.

    Exported convolutions hold their normalisation. Taken apart again, each filter is of length 1
    and its length stands in the normalisation, so that steps of one size suit all of them.

    Raises InputError if the folder's networks are of other units or landmarks, or of another size.
    """
    model = read_description(folder)
    theirs = tuple(model["aus"]), tuple(model["landmarks"]), model["size"]
    if theirs != (networks.aus, networks.landmark_names, networks.size):
        raise InputError(f"The networks in {folder} are of other units, landmarks or size.")
    graph = onnx.load(str(Path(folder) / model["weights"])).graph
    stored = {entry.name: torch.tensor(numpy_helper.to_array(entry)) for entry in graph.initializer}
    nodes = [node for node in graph.node if node.op_type == "Conv"]
    convolutions = [m for m in networks.trunk.modules() if isinstance(m, Convolution)]
    with torch.no_grad():
        for layer, node in zip(convolutions, nodes, strict=False):  # in the order of use
            _take_apart(layer, stored[node.input[1]], stored[node.input[2]])
        heads = nodes[len(convolutions)]
        weights = [stored[name].chunk(len(networks.aus)) for name in heads.input[1:3]]
        full, bias = (
            next(stored[name] for node in graph.node if node.op_type == kind for name in node.input
                 if name in stored and len(stored[name]) == len(networks.aus))
            for kind in ("Einsum", "Add")
        )  # fmt: skip
        for k, name in enumerate(networks.aus):
            head = networks.heads[name]
            head.conv.weight.copy_(weights[0][k])
            head.conv.bias.copy_(weights[1][k])
            head.fc.weight.copy_(full[k])
            head.fc.bias.copy_(bias[k])
        rest = {n: v for n, v in stored.items() if n.startswith(PARTS)}
        networks.load_state_dict(rest, strict=False)


def blend(networks: Networks, folder: Path, share: float) -> None:
    """Put networks that were trained on from those of a folder between the two, in place.

    share : of what was learnt, 1 all of it and 0 the networks of the folder. Weights between a
    network and what it became on other data keep more of the first than a shorter training does,
    and lose little of the second (Wortsman et al. 2022, "Robust fine-tuning of zero-shot models",
    CVPR). What the folder's networks do not have stays as it was learnt.
    """
    before = Networks(
        networks.aus, networks.landmark_names, networks.size, networks.person_names
    )  # fmt: skip
    load_exported(before, folder)
    earlier, new = before.state_dict(), networks.state_dict()
    lacking = untold(folder)
    for name, value in new.items():
        if value.is_floating_point() and not name.startswith(lacking):
            value.mul_(share).add_(earlier[name], alpha=1 - share)


def untold(folder: Path) -> tuple[str, ...]:
    """The parts of the networks that those of a folder do not have."""
    model = read_description(folder)
    hats = () if "hat" in model.get("regions", ()) else ("hats.",)
    return (*(f"{part}." for part in ("person", "regions") if part not in model), *hats)


def _take_apart(layer: Convolution, weight: Tensor, bias: Tensor) -> None:
    """A convolution with its normalisation folded in, as the two."""
    length = weight.flatten(1).norm(dim=1).clamp(min=1e-6)
    layer.conv.weight.copy_(weight / length[:, None, None, None])
    norm = layer.norm
    norm.weight.copy_(length)
    norm.bias.copy_(bias)
    norm.running_mean.zero_()
    norm.running_var.fill_(1 - norm.eps)
