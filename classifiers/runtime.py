"""The shipped networks in ONNX Runtime: checked, opened, run. numpy and nothing else besides."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.errors import InputError

from .labels import FULL
from .preprocess import Floats

WEIGHTS = Path(__file__).parent / "weights"
DESCRIPTION = "model.json"
FORMAT = 1
THREADS = 2
KEYS = {
    "weights", "sha256", "size", "aus", "landmarks", "temperatures", "thresholds",
    "face_temperature", "checksum",
}  # fmt: skip


@dataclass(frozen=True)
class Answers:
    """What the networks say of b crops.

    logits : (b, k) yes minus no      intensities : (b, k) 0..5      angles : (b, 3) radians
    landmarks : (b, m, 2) crop units      spreads : (b, m) log of their expected error, crop units
    face : (b,) logit that there is one      found : (b, c, c, 4) see `finding.faces_on`
    apart : of a mean of two looks, the mean distance of their landmarks, crop units
    person : (b, p, 2) mean and log of the spread of what is told of the person; p may be 0
    regions : (b, r, c, c) logits of how much of a cell is of each of `labels.REGIONS`; r may be 0
    """

    logits: NDArray
    intensities: NDArray
    angles: NDArray
    landmarks: NDArray
    spreads: NDArray
    face: NDArray
    found: NDArray
    apart: float = 0.0
    person: NDArray = field(default_factory=lambda: np.zeros((1, 0, 2)))
    regions: NDArray = field(default_factory=lambda: np.zeros((1, 0, 1, 1)))


def sigmoid(logit: NDArray) -> NDArray[np.float64]:
    """The softmax of two logits depends on their difference alone: 1 / (1 + exp(-difference))."""
    logit = np.clip(np.asarray(logit, float), -60, 60)
    return 1 / (1 + np.exp(-logit))


class Runtime:
    """The networks of a weights folder and its description, `model`."""

    def __init__(self, folder: Path, threads: int = THREADS) -> None:
        self.model = read_description(folder)
        path = Path(folder) / self.model["weights"]
        self._session = open_session(path, self.model["sha256"], threads)
        self._outputs = [output.name for output in self._session.get_outputs()]
        self._check(path)

    def run(self, ink: Floats) -> Answers:
        """The answers for crops (b, size, size) of ink as the networks know it (`even_ink`)."""
        values = self._session.run(None, {"ink": ink[:, None]})
        answers = dict(zip(self._outputs, values, strict=True))
        units, places = answers["units"], answers["landmarks"]
        if "regions" in self.model:  # older networks tell fewer
            answers["regions"] = answers["regions"][:, : len(self.model["regions"])]
        return Answers(
            units[:, :, 1] - units[:, :, 0],
            units[:, :, 2] * FULL,
            answers["angles"],
            places[:, :, :2],
            places[:, :, 2],
            answers["face"],
            answers["found"],
            **{name: answers[name] for name in ("person", "regions") if name in self.model},
        )

    def _check(self, path: Path) -> None:
        """InputError if the networks are not those that the description is of."""
        shapes = {output.name: output.shape for output in self._session.get_outputs()}
        names = {"units": "aus", "landmarks": "landmarks", "person": "person"}
        counts = {name: len(self.model[key]) for name, key in names.items() if key in self.model}
        known = {"angles", "face", "found"} <= set(shapes)
        if not known or any(shapes.get(name, [0, 0])[1] != n for name, n in counts.items()):
            raise InputError(
                f"{path} does not belong to the {DESCRIPTION} beside it: install the package again."
            )


def read_description(folder: Path) -> dict[str, Any]:
    """model.json of a weights folder; InputError names the file if it is missing or damaged."""
    path = Path(folder) / DESCRIPTION
    try:
        model = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path} is missing: install the package again, or train with `sketch2face train`."
        ) from None
    except (ValueError, RecursionError):
        raise InputError(f"{path} is damaged: install the package again.") from None
    except OSError:
        raise InputError(f"{path} cannot be read: install the package again.") from None
    if not isinstance(model, dict) or model.get("checksum", checksum(model)) != checksum(model):
        raise InputError(f"{path} is damaged: install the package again.")
    if model.get("format") != FORMAT:
        raise InputError(
            f"{path} has format {model.get('format')}, this version reads {FORMAT}: weights and"
            " program must come from the same release."
        )
    missing = sorted(KEYS - set(model))
    if missing:
        raise InputError(f"{path} lacks {', '.join(missing)}: install the package again.")
    return model


def checksum(model: Mapping[str, Any]) -> str:
    """Of all that a description says but its own checksum, however it is written down."""
    said = {key: value for key, value in model.items() if key != "checksum"}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def open_beside(folder: Path, name: str, threads: int, **known: Any):
    """ONNX Runtime on a smaller network beside the detector's, NAME.onnx, if its description,
    NAME.json, says of each `known` what this version expects.

    None for a folder whose networks were trained without; InputError for one that is damaged.
    """
    path = folder / f"{name}.json"
    if not path.exists():
        return None
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        alike = all(about[key] == value for key, value in known.items())
        sha256 = str(about["sha256"])
    except (OSError, ValueError, KeyError, TypeError):
        alike = False
    if not alike:
        raise InputError(f"{path} is damaged or of another version: install the package again.")
    return open_session(folder / f"{name}.onnx", sha256, threads)


def open_session(path: Path, sha256: str, threads: int):
    """ONNX Runtime on a weights file; InputError names it if its checksum is not the known one."""
    try:
        weights = path.read_bytes()
    except OSError:
        raise InputError(f"{path} cannot be read: install the package again.") from None
    if hashlib.sha256(weights).hexdigest() != sha256:
        raise InputError(f"{path} is damaged or of another version: install the package again.")
    # It would report its use to its maker, and complain on stderr where HOME cannot be written to.
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Waiting threads sleep: the host (Blender) has better use for the cores.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(weights, options, providers=["CPUExecutionProvider"])
