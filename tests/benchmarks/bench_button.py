"""From the button to the face in Blender, and how long Blender hears nothing meanwhile.

Measured in Blender as a module, without a window: what drawing the window takes comes on top (the
tests under tests/blender/window print that for an installed Blender). Budget: a face in under 1 s
after the first use, no slice of work on Blender's own thread above 0.2 s.
"""

from __future__ import annotations

import statistics
import time
import warnings
from pathlib import Path

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import bpy

from addon.blender.background import sketching, tasks

ROOT = Path(__file__).resolve().parents[2]
ROUNDS = 9


def timed(steps) -> tuple[float, float, object]:
    """Seconds from begin to end, the longest slice in between, and what the steps return."""
    begin, longest = time.perf_counter(), 0.0
    while True:
        start = time.perf_counter()
        try:
            tick = next(steps)
        except StopIteration as end:
            now = time.perf_counter()
            return now - begin, max(longest, now - start), end.value
        longest = max(longest, time.perf_counter() - start)
        if tick.waits_for is not None:
            tick.waits_for.wait(tasks.EVERY)


def main() -> None:
    """Print the first press, then the median of many; the same for fitting again."""
    import addon.blender as shell

    bpy.ops.wm.read_factory_settings(use_empty=True)
    shell.register()
    print(f"Blender {bpy.app.version_string}")
    for path in sorted((ROOT / "addon" / "sketches").glob("*.png")):
        settings = bpy.context.scene.sketch_to_face
        settings.sketch = str(path)
        rounds = []
        for _ in range(ROUNDS):
            seconds, longest, (face, _) = timed(sketching.new_face(bpy.context, settings))
            rounds.append((seconds, longest))
            if len(rounds) < ROUNDS:
                sketching.remove(face)
        (first, _), *warm = rounds
        seconds, longest = (statistics.median(column) for column in zip(*warm, strict=True))
        worst = max(slice_ for _, slice_ in rounds)
        print(f"{path.stem:18} first {first:5.2f} s   then {seconds:5.2f} s   "
              f"longest slice {1000 * longest:4.0f} ms, {1000 * worst:4.0f} at worst")  # fmt: skip
        again = [timed(sketching.again(bpy.context, face))[:2] for _ in range(ROUNDS)]
        seconds, longest = (statistics.median(column) for column in zip(*again, strict=True))
        print(f"{'  fitted again':18}                then {seconds:5.2f} s   "
              f"longest slice {1000 * longest:4.0f} ms")  # fmt: skip
        sketching.remove(face)
    shell.unregister()


if __name__ == "__main__":
    main()
