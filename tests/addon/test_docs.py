"""The documentation tells the truth: tables from the catalogue, links and pictures that exist."""

from __future__ import annotations

import argparse
import importlib.util
import re
from pathlib import Path

import pytest

from addon.commands import generate_arguments
from dataset_gen.freestyle import DRAWN
from dataset_gen.generate import generate, make_sample
from dataset_gen.lines import WAYS
from dataset_gen.sampling import WAY_ODDS
from facs_rig import LANDMARKS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), ROOT / "README.md"])
LARGEST = 1_000_000  # bytes of a picture


def tables():
    spec = importlib.util.spec_from_file_location("tables", DOCS / "tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def data_page() -> str:
    return (DOCS / "dataset.md").read_text(encoding="utf-8")


def test_the_tables_of_the_face_are_those_of_the_catalogue():
    page = (DOCS / "face.md").read_text(encoding="utf-8")
    assert tables().renewed("face.md", page) == page, "run: python docs/tables.py"
    table = page.partition("## The 47 controls")[2].partition("## Creases")[0]
    assert len(re.findall(r"^\| `\w+` \|", table, re.MULTILINE)) == 47


def test_the_table_of_conventions_is_that_of_the_code():
    page = (DOCS / "artist.md").read_text(encoding="utf-8")
    assert tables().renewed("artist.md", page) == page, "run: python docs/tables.py"


def test_the_figures_of_the_data_set_are_those_of_the_sampler():
    assert tables().renewed("dataset.md", data_page()) == data_page(), "run: python docs/tables.py"


def test_a_page_without_a_place_for_a_table_is_refused():
    with pytest.raises(ValueError, match="face.md needs the lines"):
        tables().renewed("face.md", "# The face\n")


def test_every_key_of_a_sample_is_described_and_no_other():
    table = data_page().partition("| key | |")[2].partition("\n\n")[0]
    told = [key for cell in re.findall(r"^\| ([^|]+) \|", table, re.MULTILINE)
            for key in re.findall(r"`(\w+)`", cell)]  # fmt: skip
    _, sample = make_sample(0, 0, strokes=True)
    assert sorted(told) == sorted(sample)
    assert f"not; {len(LANDMARKS)} of them" in table


def test_the_options_of_the_data_page_are_those_of_the_command():
    parser = argparse.ArgumentParser()
    generate_arguments(parser)
    known = {option for action in parser._actions for option in action.option_strings}
    of_dask = {"--nworkers", "--nthreads"}
    assert set(re.findall(r"--[a-z]+", data_page())) - of_dask <= known


def test_the_ways_to_draw_have_the_odds_that_are_told():
    told = dict(re.findall(r"^\| `(\w+)` \| (0\.\d) \|", data_page(), re.MULTILINE))
    assert {way: float(odds) for way, odds in told.items()} == WAY_ODDS
    drawable = {way for way in WAYS if {*sum(WAYS[way], ())} <= {*DRAWN}}
    assert drawable == {"suggestive"}  # as the page says


def test_the_example_of_reading_a_data_set_runs(tmp_path, monkeypatch, capsys):
    code = re.search(r"```python\n(.*?)```", data_page(), re.DOTALL).group(1)
    generate(2, tmp_path / "data", meshes=True)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.startswith("(256, 256) [") for line in lines] == [True, True, False, False]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_what_a_page_links_to_is_there(page):
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = [link for link in links
               if "://" not in link and not (page.parent / link).exists()]  # fmt: skip
    assert not missing


def test_pictures_are_light_enough_to_load():
    heavy = [p.name for p in DOCS.rglob("*.png") if p.stat().st_size > LARGEST]
    assert not heavy


def test_every_picture_is_shown_somewhere():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert not [p.name for p in (DOCS / "images").glob("*.png") if p.name not in text]
