"""The documentation tells the truth: tables from the catalogue, links and pictures that exist."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), ROOT / "README.md"])
LARGEST = 1_000_000  # bytes of a picture


def tables():
    spec = importlib.util.spec_from_file_location("tables", DOCS / "tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tables_of_the_face_are_those_of_the_catalogue():
    page = (DOCS / "face.md").read_text(encoding="utf-8")
    assert tables().renewed(page) == page, "run: python docs/tables.py"
    table = page.partition("## The 47 controls")[2].partition("## Creases")[0]
    assert len(re.findall(r"^\| `\w+` \|", table, re.MULTILINE)) == 47


def test_a_page_without_a_place_for_a_table_is_refused():
    with pytest.raises(ValueError, match="needs the lines"):
        tables().renewed("# The face\n")


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
