"""The documentation tells the truth: tables from the catalogue, links and pictures that exist."""

from __future__ import annotations

import argparse
import ast
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pytest

from addon.commands import generate_arguments
from dataset_gen.freestyle import DRAWN
from dataset_gen.generate import generate, make_sample
from dataset_gen.linework.lines import WAYS
from dataset_gen.sampling import WAY_ODDS
from facs_rig import LANDMARKS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
MANUAL = DOCS / "manual"
PAGES = sorted([*DOCS.rglob("*.md"), ROOT / "README.md"])
LARGEST = 1_000_000  # bytes of a picture
MANUAL_AT_MOST = 4_000_000  # bytes that the manual may take in the zip


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


@pytest.mark.parametrize("name", ["any_rig", "fit"])
def test_the_tables_of_the_manual_are_those_of_the_code(name):
    page = (MANUAL / f"{name}.md").read_text(encoding="utf-8")
    assert tables().renewed(f"manual/{name}.md", page) == page, "run: python docs/tables.py"


def test_the_figures_of_the_data_set_are_those_of_the_sampler():
    assert tables().renewed("dataset.md", data_page()) == data_page(), "run: python docs/tables.py"


def test_a_page_without_a_place_for_a_table_is_refused():
    with pytest.raises(ValueError, match="face.md needs the lines"):
        tables().renewed("face.md", "# The face\n")


def test_every_key_of_a_sample_is_described_and_no_other():
    table = data_page().partition("| key | |")[2].partition("\n\n")[0]
    told = [key for cell in re.findall(r"^\| ([^|]+) \|", table, re.MULTILINE)
            for key in re.findall(r"`(\w+)`", cell)]  # fmt: skip
    keys = [{*make_sample(0, 0, strokes=True, engine=e)[1]} for e in ("contours", "conventions")]
    assert sorted(told) == sorted(keys[0] | keys[1])
    assert {*told} - keys[0] == {"artist", "hidden", "drawn_landmarks"}
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


# --- links ----------------------------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    """What a page's headings are called in links, as GitHub and Python's markdown make them."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_what_a_page_links_to_is_there(page):
    missing = []
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        file, _, anchor = link.partition("#")
        target = page.parent / file if file else page
        if not target.exists() or anchor and anchor not in anchors(target):
            missing.append(link)
    assert not missing


def test_pictures_are_light_enough_to_load():
    heavy = [p.name for p in DOCS.rglob("*.png") if p.stat().st_size > LARGEST]
    assert not heavy


def test_every_picture_is_shown_somewhere():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    images = DOCS / "images"
    pictures = [p.relative_to(images).as_posix() for p in images.rglob("*.png")]
    assert not [name for name in pictures if f"images/{name}" not in text]


# --- the manual -----------------------------------------------------------------------------------


def test_the_manual_has_the_pages_that_the_panels_open_and_no_other():
    source = (ROOT / "addon/blender/operators/help.py").read_text(encoding="utf-8")
    told = next(node.value for node in ast.parse(source).body
                if isinstance(node, ast.Assign) and node.targets[0].id == "PAGES")  # fmt: skip
    assert sorted(ast.literal_eval(told)) == sorted(p.stem for p in MANUAL.glob("*.md"))


def test_every_page_of_the_manual_is_in_its_index():
    linked = re.findall(r"\]\((\w+)\.md\)", (MANUAL / "index.md").read_text(encoding="utf-8"))
    assert {*linked, "index"} == {p.stem for p in MANUAL.glob("*.md")}


def texts(tree: ast.AST) -> Iterator[str]:
    """Every text of a program; where something is filled in, a text on each side of it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.split(r"\{\w*\}", node.value)


@cache
def sayings() -> str:
    """All that the add-on and what it is made of can say."""
    folders = ("addon", "classifiers", "facs_rig", "snakes")
    files = [path for name in folders for path in sorted((ROOT / name).rglob("*.py"))]
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in files)
    return "\n".join(said for tree in trees for said in texts(tree)).casefold()


@pytest.mark.parametrize("page", sorted(MANUAL.glob("*.md")), ids=lambda p: p.stem)
def test_a_message_that_the_manual_quotes_is_one_that_is_said(page):
    rows = re.findall(r"^\| ([^|]*) \|", page.read_text(encoding="utf-8"), re.MULTILINE)
    quoted = [q for row in rows for q in re.findall(r'"([^"]+)"', row)]
    parts = [part.strip(" '0123456789") for q in quoted for part in re.split("…|'jawOpen'", q)]
    assert not [part for part in parts if part.casefold() not in sayings()]


class Web(HTMLParser):
    """What a web page links to and shows, what can be linked to, and its text."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.links: list[str] = []
        self.pictures: list[str] = []
        self.anchors: set[str] = set()
        self.text = ""
        self.feed(page.decode("utf-8"))

    def handle_starttag(self, tag, attrs):
        of = dict(attrs)
        self.links += [of["href"]] if tag == "a" else []
        self.pictures += [of["src"]] if tag == "img" else []
        self.anchors |= {of["id"]} if "id" in of else set()

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def zipped() -> dict[str, bytes]:
    pytest.importorskip("markdown", reason="the manual's web pages need: pip install markdown")
    from addon.packaging.manual import manual

    return manual(ROOT)


def test_the_zip_brings_every_page_and_each_picture_once(zipped):
    pages = {name for name in zipped if name.endswith(".html")}
    assert pages == {f"{p.stem}.html" for p in MANUAL.glob("*.md")}
    shown = {src for name in pages for src in Web(zipped[name]).pictures}
    assert shown == set(zipped) - pages
    for name in shown:
        (original,) = (DOCS / "images").rglob(Path(name).name)
        assert zipped[name] == original.read_bytes()
    assert sum(map(len, zipped.values())) < MANUAL_AT_MOST


def test_links_in_the_zip_lead_to_its_own_pages(zipped):
    webs = {name: Web(data) for name, data in zipped.items() if name.endswith(".html")}
    for name, web in webs.items():
        assert {*web.links} >= {*webs} - {name}  # from every page to every other
        assert {*web.links} >= {*web.pictures}  # and to its pictures in full
        for link in web.links:
            file, _, anchor = link.partition("#")
            assert not file or file in zipped, f"{name} links to {link}"
            assert not anchor or anchor in webs[file or name].anchors, f"{name} links to {link}"


def test_what_the_zip_does_not_bring_is_named_without_a_link(zipped):
    page = Web(zipped["expression.html"])
    assert "[docs/face.md](../face.md)" in (MANUAL / "expression.md").read_text(encoding="utf-8")
    assert "docs/face.md" in page.text and "face.md" not in "".join(page.links)


def test_the_web_pages_have_titles_tables_and_no_code_of_the_writing_left(zipped):
    for name in (name for name in zipped if name.endswith(".html")):
        page = zipped[name].decode("utf-8")
        heading = (MANUAL / name).with_suffix(".md").read_text(encoding="utf-8").splitlines()[0]
        assert f"<title>{heading.lstrip('# ')}</title>" in page
        assert not re.search(r"\|---|\*\*|\]\(", Web(zipped[name]).text)


def test_the_web_pages_are_the_same_bytes_every_time(zipped):
    from addon.packaging.manual import manual

    assert manual(ROOT) == zipped
