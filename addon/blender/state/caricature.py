"""The slider from a plain face over the drawn one to its caricature."""

import numpy as np

from facs_rig import CONTROL_NAMES, FaceParameters, load_rig
from facs_rig.blender.pose import identity_of, refresh
from facs_rig.blender.reshape import reshape
from facs_rig.controls import MAX_INTENSITY
from facs_rig.exaggeration import exaggerated
from facs_rig.fitted_keys import FITTED
from facs_rig.identity import BY_NAME

# Custom properties of the object: how much is shown, and who was drawn.
MUCH, PERSON = "caricature", "sketch_person"
MOST = 2.0  # as far as the key "Fitted" goes
DIGITS = 6  # what Blender's 32 bits hold
NO_SKIN = np.zeros((0, 3), np.float32)


def begin(face, identity: dict[str, float]) -> None:
    """A face that was just fitted: it is as drawn, and this is who that is."""
    face[MUCH], face[PERSON] = 1.0, dict(identity)


def shown(face) -> float:
    """How much of the drawn face it shows: 1 as drawn."""
    return float(face.get(MUCH, 1.0))


def show(face, much: float) -> None:
    """Take features, expression and skin to `much` times what was drawn.

    What the artist has changed since is kept beside it. Raises InputError, with nothing changed,
    for a face that cannot be reshaped.
    """
    kept, drawn = face.get(PERSON), face.sketch_to_face.expression
    if kept is None or not len(drawn):
        return
    aus = {item.name: item.value for item in drawn if item.name in CONTROL_NAMES}
    as_drawn = FaceParameters(aus, dict(kept))
    was, becomes = (exaggerated(as_drawn, NO_SKIN, m)[0] for m in (shown(face), much))
    identity = dict(identity_of(face))
    for name, value in becomes.identity.items():
        if value != was.identity[name]:
            feature = BY_NAME[name]
            changed = identity.get(name, feature.default) + value - was.identity[name]
            identity[name] = float(np.clip(changed, *feature.span))
    reshape(face, load_rig(), identity)
    for name, value in becomes.aus.items():
        changed = round(face[name] + value - was.aus[name], DIGITS)
        face[name] = float(np.clip(changed, 0, MAX_INTENSITY))
    key = face.data.shape_keys.key_blocks.get(FITTED)
    if key is not None and FITTED in drawn:
        key.value = float(np.clip(key.value + drawn[FITTED].value * (much - shown(face)), 0, MOST))
    face[MUCH] = float(much)
    refresh(face)
