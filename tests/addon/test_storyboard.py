"""The order of a folder of sketches, and what is read of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from addon import pipeline
from addon.drawing import FORMATS
from addon.storyboard import SUFFIXES, sketches_in
from facs_rig.common.errors import InputError

SKETCHES = Path(__file__).resolve().parents[2] / "addon" / "sketches"


def test_sketches_come_in_the_order_that_people_count_in(tmp_path):
    wanted = ["1 wake.png", "2.PNG", "02.png", "10.jpg", "Shot 9.tif", "shot 10.tiff", "shot.gif"]
    for name in (*wanted, "notes.txt", ".hidden.png", "3.psd"):
        (tmp_path / name).touch()
    (tmp_path / "4.png").mkdir()
    names = [path.name for path in sketches_in(tmp_path)]
    assert sorted(names) == sorted(wanted)
    assert names[0] == "1 wake.png" and names[3:] == wanted[3:]


def test_every_format_that_drawings_are_read_from_counts():
    from PIL import Image

    known = Image.registered_extensions()
    assert {known[suffix] for suffix in SUFFIXES} == set(FORMATS)


@pytest.mark.parametrize("make", [lambda p: p / "nowhere", lambda p: SKETCHES / "render.py"])
def test_a_folder_that_is_none_is_one_sentence(tmp_path, make):
    with pytest.raises(InputError, match=r"^The folder '.*' cannot be read: .*\.$"):
        sketches_in(make(tmp_path))


def test_a_folder_without_pictures_says_what_belongs_there(tmp_path):
    with pytest.raises(InputError, match=r"no picture in .*\.png, \.jpg"):
        sketches_in(tmp_path)


def test_an_expression_is_read_as_a_fit_would_begin():
    path = SKETCHES / "smiling_woman.png"
    read, fitted = pipeline.read_expression(path), pipeline.fit(path)
    assert read.aus == fitted.detection.expression() and read.aus["smile"] > 0
    assert read.head == fitted.detection.head


def test_a_drawing_without_a_face_is_refused():
    page = np.ones((200, 200))
    page[90:110, 20:180] = 0
    with pytest.raises(InputError, match="No face was found in the drawing"):
        pipeline.read_expression(page)
