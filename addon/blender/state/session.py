"""What the add-on keeps while it is switched on, and nothing of it afterwards."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..background.tasks import InSlices, Steps, Tick
    from ..viewport.overlay import FaceLines


@dataclass
class Session:
    """Everything that outlives a call and is not in Blender's file.

    running, doing : the button that was pressed, and what it is at; None while nothing runs
    refit, refit_waits_for : the fit of a live face that goes on, and the thread that it waits for
    refused : name of a live face -> state of its sketch that could not be fitted, and why not
    troubles : name of a live face -> why its sketch cannot be read, for the panel
    face_lines : name of a face -> its lines, for the overlay
    show_points : whether the points of the face are shown, too, while the artist places pins
    held_point : the point that the mouse is on
    evidence : state of a sketch -> action -> picture (s, s, 4); of the newest alone
    evidence_icons, thumbnails : Blender's preview collections
    draw_handler : Blender's handle of the overlay
    """

    running: InSlices | None = None
    doing: Tick | None = None
    refit: Steps | None = None
    refit_waits_for: threading.Event | None = None
    refused: dict[str, tuple[str, str]] = field(default_factory=dict)
    troubles: dict[str, str] = field(default_factory=dict)
    face_lines: dict[str, FaceLines] = field(default_factory=dict)
    show_points: bool = False
    held_point: str | None = None
    evidence: dict[str, dict] = field(default_factory=dict)
    evidence_icons: Any = None
    thumbnails: Any = None
    draw_handler: Any = None

    def clear(self) -> None:
        """As it was before the add-on was switched on; who holds on to the object keeps it."""
        fresh = Session()
        for each in fields(self):
            setattr(self, each.name, getattr(fresh, each.name))


session = Session()
