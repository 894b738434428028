"""A second opinion: units and landmarks as networks see them that were trained otherwise.

What was trained on strangers forgets some of what it knew before, and networks that err in
different ways err less together: the mean of both is better on both kinds of drawings than weights
between the two (Lakshminarayanan et al. 2017, "Simple and Scalable Predictive Uncertainty
Estimation using Deep Ensembles", NeurIPS).
"""

from __future__ import annotations

from pathlib import Path

import onnx
from onnx import utils

from facs_rig.common.errors import InputError

from ..runtime import ASKED, read_description


def networks_in(folder: Path) -> Path:
    """The file of a folder of weights that gives a second opinion to others."""
    return Path(folder) / read_description(folder)["weights"]


def second_in(folder: Path) -> Path | None:
    """The file of a folder's own second opinion, if it has one."""
    known = Path(folder).is_dir() and read_description(folder).get("second")
    return Path(folder) / known["weights"] if known else None


def write_second(networks: Path, path: Path, like: Path) -> None:
    """Write what of exported networks is needed for a second opinion, alone.

    like : the networks beside which it will stand. Raises InputError if those are of other units,
    landmarks or size.
    """
    whole = onnx.load(str(networks))
    if _shapes(whole) != _shapes(onnx.load(str(like))):
        raise InputError(f"The networks in {networks} are of other units, landmarks or size.")
    part = utils.Extractor(whole).extract_model(["ink"], list(ASKED))
    onnx.checker.check_model(part)
    path.write_bytes(part.SerializeToString())


def _shapes(model: onnx.ModelProto) -> dict[str, tuple[int, ...]]:
    """Of the ink and of what is asked for, but for how many crops there are."""
    entries = (*model.graph.input, *model.graph.output)
    return {
        entry.name: tuple(side.dim_value for side in entry.type.tensor_type.shape.dim[1:])
        for entry in entries
        if entry.name in ("ink", *ASKED)
    }
