"""The manual that the add-on brings: the pages of docs/manual as web pages, with their pictures."""

from __future__ import annotations

import html
import re
from pathlib import Path

FOLDER = Path("docs") / "manual"
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font: 17px/1.55 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem;
       color: #222; background: #fdfdfc; }}
img {{ max-width: 100%; border: 1px solid #ddd; border-radius: 4px; }}
table {{ border-collapse: collapse; }}
td, th {{ border-bottom: 1px solid #ddd; padding: .35rem .8rem .35rem 0; text-align: left;
         vertical-align: top; }}
code, pre {{ background: #f0efec; border-radius: 3px; padding: .1rem .25rem; }}
a {{ color: #1a5fa8; }}
nav {{ border-bottom: 1px solid #ddd; padding-bottom: .6rem; }}
nav a, nav strong {{ margin-right: 1rem; white-space: nowrap; }}
@media (prefers-color-scheme: dark) {{
  body {{ color: #ddd; background: #222; }}
  code, pre {{ background: #333; }}
  a {{ color: #7fb8f0; }}
}}
</style>
</head>
<body>
<nav>
{ways}
</nav>
{body}
</body>
</html>
"""
_PAGE = re.compile(r"\]\((\w+)\.md\)")
_LINK = re.compile(r'(?P<what>href|src)="(?P<target>[^"]+)"')


def manual(root: Path) -> dict[str, bytes]:
    """Name in the zip's folder `manual` -> bytes: a web page for each page, and what they show.

    Links between pages work without a network, every page has the way to each other one, in the
    index's order, and a picture opens in full by a click. Links to other documents of the project,
    which the zip does not bring, become plain text.
    """
    from markdown import markdown

    pages = {path.stem: path for path in sorted((root / FOLDER).glob("*.md"))}
    texts = {name: path.read_text(encoding="utf-8") for name, path in pages.items()}
    order = list(dict.fromkeys(["index", *_PAGE.findall(texts["index"]), *pages]))
    titles = {name: html.escape(texts[name].splitlines()[0].lstrip("# ")) for name in order}
    content: dict[str, bytes] = {}
    for name, path in pages.items():
        text = texts[name]
        body = markdown(text, extensions=["tables", "toc", "fenced_code"])
        for match in _LINK.finditer(body):
            picture = path.parent / match["target"]
            if match["what"] == "src":
                content[f"images/{picture.name}"] = picture.read_bytes()
        body = _LINK.sub(_inside(pages), body)
        body = re.sub(r'<a href="">(.*?)</a>', r"\1", body, flags=re.S)
        body = re.sub(r'(<img [^>]*?src="([^"]+)"[^>]*>)', r'<a href="\2">\1</a>', body)
        ways = "\n".join(
            f"<strong>{_short(titles[other])}</strong>"
            if other == name
            else f'<a href="{other}.html">{_short(titles[other])}</a>'
            for other in order
        )
        content[f"{name}.html"] = PAGE.format(title=titles[name], ways=ways, body=body).encode()
    return content


def _short(title: str) -> str:
    """What stands before the colon: the way to a page has no room for more."""
    return title.partition(":")[0]


def _inside(pages):
    """A function that rewrites a link to what the zip has; to nothing where it has nothing."""

    def rewrite(match: re.Match) -> str:
        what, target = match["what"], match["target"]
        if what == "src":
            return f'src="images/{Path(target).name}"'
        file, mark, anchor = target.partition("#")
        if not file or file.startswith(("http:", "https:")):
            return match[0]
        if file.removesuffix(".md") in pages:
            return f'href="{file.removesuffix(".md")}.html{mark}{anchor}"'
        return 'href=""'

    return rewrite
