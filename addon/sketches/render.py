"""Render the drawings of this folder: NAME.svg becomes NAME.png, 768×768 px, 8-bit grey.

Each path of an SVG is one pen stroke as a tablet records it, an outline whose width follows the
pressure. ``python -m addon.sketches.render`` writes the PNGs anew; it needs resvg-py, one small
wheel that renders the same pixels on every system.
"""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

FOLDER = Path(__file__).parent
SIZE = 768


def render(svg: Path) -> Image.Image:
    """The drawing as an 8-bit grey picture on white paper, `SIZE` px square."""
    try:
        import resvg_py
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError("Rendering the sketches needs: pip install resvg-py") from error
    data = resvg_py.svg_to_bytes(
        svg_string=svg.read_text(encoding="utf-8"),
        background="#ffffff",
        width=SIZE,
        height=SIZE,
        skip_system_fonts=True,
    )
    return Image.open(io.BytesIO(bytes(data))).convert("L")


def main() -> int:
    for svg in sorted(FOLDER.glob("*.svg")):
        png = svg.with_suffix(".png")
        render(svg).save(png, optimize=True)
        print(png)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
