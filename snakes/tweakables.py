"""The values that an artist can tweak, with the defaults of the thesis.

:class:`Tweakables` is the only place where they stand: the options of the command line and the
properties of the panel are made from its fields and their metadata (see :func:`describe`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from facs_rig.common import settings
from facs_rig.common.settings import check_settings, setting

__all__ = [
    "CURVES", "DEEPEST", "LINES_ALONE", "LINE_TWEAKABLES", "PROFILES", "SNAKE_TYPES", "WIDEST",
    "WORKING_SIZE", "Tweakables", "describe",
]  # fmt: skip

WORKING_SIZE = (91, 200)
"""Width and height in pixels of the images that the snakes work on."""

SNAKE_TYPES = ("free", "fixed", "periodic")
CURVES = ("smooth", "sphere", "root", "inverse_square", "sharp", "linear", "constant")

LINES_ALONE = ("symmetry",)
"""The tweakables that count where lines are fitted, and in the thesis' own way do nothing."""
LINE_TWEAKABLES = ("smoothness", "max_delta", "soft_select_distance", *LINES_ALONE, "mirror")
"""All that count where lines are fitted; the others are of the thesis' own way alone."""

PROFILES = {"crease": 0.15, "scar": 0.5}
"""Height of the rims on both sides of a carved groove, as a share of its depth."""
DEEPEST, WIDEST = 0.005, 0.02
"""Metres, the greatest depth and width of a carved stroke."""


@dataclass(frozen=True)
class Tweakables:
    """How a drawing pulls the face, in the thesis' terms (chapter 3, table of tweakable values).

    Every field is a `facs_rig.common.settings.setting`. Raises InputError with one sentence when a
    value is of the wrong type or outside its range.
    """

    gap_closing: int = setting(
        2,
        "Gap closing",
        "Side of the square that closes gaps in the drawn lines; 1 closes nothing",
        "px",
        1,
        20,
    )
    thinning_iterations: int = setting(
        1,
        "Thinning iterations",
        "How often a layer is peeled off the drawn lines; 0 leaves them as thick as they are",
        "",
        0,
        50,
    )
    snake_type: str = setting(
        "free",
        "Snake type",
        "What the ends of a snake do: move freely, stay where they were drawn, or meet",
        choices=SNAKE_TYPES,
    )
    smoothness: float = setting(
        1.0,
        "Snake smoothness",
        "Higher values give smoother snakes that capture fewer details",
        "",
        0.0,
        1000.0,
    )
    time_stepping: float = setting(
        2.0,
        "Snake time stepping",
        "Inertia of a snake: higher values make it move in smaller steps",
        "",
        0.01,
        1000.0,
    )
    max_step: float = setting(
        1.0,
        "Snake max step",
        "Farthest that a snake moves in one iteration; lower values such as 0.3 can fit better",
        "px",
        0.01,
        10.0,
    )
    max_iterations: int = setting(
        3000,
        "Snake max iterations",
        "A snake that has not come to rest after this many iterations is taken as it is",
        "",
        1,
        100_000,
    )
    convergence: float = setting(
        0.1,
        "Snake convergence",
        "A snake rests once no point moves farther than this; at 1.0 it hardly moves",
        "px",
        0.0001,
        10.0,
    )
    brightness_weight: float = setting(
        -5.0,
        "Snake brightness weight",
        "Negative values push a snake to dark places of the render, positive ones to bright places",
        "",
        -100.0,
        100.0,
    )
    edge_weight: float = setting(
        1.0,
        "Snake edge weight",
        "Positive values push a snake to edges of the render, negative ones away from them",
        "",
        -100.0,
        100.0,
    )
    max_delta: float = setting(
        15.0,
        "Max delta",
        "A snake point that moved farther than this did not find its line and is left out",
        "px",
        0.1,
        200.0,
    )
    low_depth_preference: float = setting(
        0.0,
        "Low depth preference",
        "0 moves the vertex nearest to a pixel, 1 the one nearest to the viewer around it",
        "",
        0.0,
        1.0,
    )
    soft_select_distance: float = setting(
        1.0,
        "Soft select distance",
        "How far the movement of a vertex reaches into the skin around it",
        "cm",
        0.01,
        50.0,
    )
    soft_select_curve: str = setting(
        "linear",
        "Soft select curve",
        "How the movement of a vertex falls off with distance",
        choices=CURVES,
    )
    symmetry: float = setting(
        0.8,
        "Symmetry",
        "How alike both sides of the face are moved: 0 each by its own lines, 1 as mirror images",
        "",
        0.0,
        1.0,
    )
    # Beyond the thesis, therefore off as it comes.
    soft_select_connected: bool = setting(
        False,
        "Soft select connected",
        "Measure distance over the skin, so that a lip does not pull the other lip",
    )
    mirror: bool = setting(
        False,
        "Mirror output",
        "Make the fitted face symmetrical, which removes asymmetries of the drawing",
    )

    def __post_init__(self) -> None:
        check_settings(self)


def describe() -> Iterator[tuple[str, type, Any, dict[str, Any]]]:
    """Yield (name, type, default, metadata) of every tweakable, in the order of the table."""
    return settings.describe(Tweakables)
