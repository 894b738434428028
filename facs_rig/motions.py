"""What moves a face: its identity's targets, its expression's keys, and how people differ in keys.

A cage of M vertices is moved, and a part of the fine skin, u vertices, by itself. The keys are
those of the default person. Another's have *variants* added to them, each a difference that belongs
to one key and counts as much as the person has of it; and where a person is stylised, eyes of twice
the size say, all that keys move there grows with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .identity import CAGE_TARGETS, STYLED, STYLES, target_weights
from .moves import compressed, dense, entries, shared, sparse
from .variants import variant_weights

# Where fields squeeze space, movements shrink, but none is turned around.
LEAST_GROWN = 0.2
_HEAD_AND_EYES = (-5, -3, -2)  # rows of these joints behind the cage's vertices
MIDDLE = 0.0155  # metres from the middle, within which a vertex belongs to both eyes
TURNED = 2048  # rows of a tall array that are turned into columns at once
_OF_EYES = np.array([f.name.startswith("eye_") for f in STYLED])
_DEFAULT = target_weights({})[:CAGE_TARGETS].astype(np.float32)


@dataclass(frozen=True)
class Motions:
    """Rows of displacements in metres, flat; those of the cage before those of the skin.

    targets : (t, 3M) and details : (d, 3u) sparse, the identity's on cage and skin;
    cage_keys : (k, 3M);  skin_keys : (c, 3u) sparse;  skin_at : (u,) fine vertices of the skin;
    cage_variants : (v, 3M) and skin_variants : (w, 3u), sparse;  parents : (v + w,) their keys;
    growth : (styles, 3M) and skin_growth : (styles, 3u), how much more keys move for each style;
    left : (M,) how far a vertex is on the face's left, 0 to 1
    """

    targets: NDArray[np.float32]
    details: sp.csr_matrix
    cage_keys: NDArray[np.float32]
    skin_keys: sp.csr_matrix
    skin_at: NDArray[np.intp]
    cage_variants: sp.csr_matrix
    skin_variants: sp.csr_matrix
    parents: NDArray[np.intp]
    variant_names: tuple[str, ...]
    growth: NDArray[np.float32]
    skin_growth: NDArray[np.float32]
    left: NDArray[np.float32]

    @property
    def split(self) -> int:
        """How many keys move the cage."""
        return len(self.cage_keys)

    def at_skin(self, kept: NDArray[np.bool_], numbers: NDArray[np.intp]) -> Motions:
        """The same for a part of the skin: kept : (u,) which;  numbers : theirs, new, in order."""
        columns = np.flatnonzero(np.repeat(kept, 3))
        return replace(
            self,
            details=self.details[:, columns],
            skin_keys=self.skin_keys[:, columns],
            skin_variants=self.skin_variants[:, columns],
            skin_growth=self.skin_growth[:, columns],
            skin_at=numbers,
        )

    def who(self, identities: Sequence[Mapping[str, float]]) -> Who:
        """What these people are made of; InputError for what no person can be."""
        weights = np.stack([target_weights(identity) for identity in identities])
        kinds = [variant_weights(identity, self.variant_names) for identity in identities]
        return Who(weights.astype(np.float32), np.stack(kinds).astype(np.float32))

    def person(self, who: Who) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """(b, 3M) what the identity moves the cage by and (b, 3u) the skin, None for nothing."""
        on_skin = who.targets[:, CAGE_TARGETS:]
        skin = _sparse_sum(on_skin, self.details) if on_skin.any() else None
        cage = _sum(who.targets[:, :CAGE_TARGETS], self.targets)
        some = np.flatnonzero(who.targets[:, STYLES].any(axis=1))
        if len(some):
            cage[some] += self.stretched(who.targets[some])
            if skin is not None:
                skin[some] *= self._grown(who.targets[some], self.skin_growth)
        return cage, skin

    def stretched(self, targets: NDArray[np.float32]) -> NDArray[np.float32]:
        """(b, 3M) how much more a stylised person's own features move the cage than another's.

        Around an eye they are what the ball's place leaves: lids open as far as the eye is large,
        but an eye of twice the size does not stand twice as far out. targets : (b, targets)
        """
        own = targets[:, :CAGE_TARGETS] - _DEFAULT
        own[:, STYLES] *= ~self.growth.any(axis=1)
        features = _sum(own, self.targets).reshape(len(own), -1, 3)
        head, *eyes = (features[:, [k]] for k in _HEAD_AND_EYES)
        moved = (self._grown(targets, self.growth) - 1).reshape(features.shape)
        of_eyes = (targets[:, STYLES][:, _OF_EYES] @ self.growth[_OF_EYES]).reshape(features.shape)
        left = self.left[:, None]
        centre = left * eyes[0] + (1 - left) * eyes[1]
        return (moved * (features - head) - of_eyes * (centre - head)).reshape(len(own), -1)

    def details_of(self, targets: NDArray[np.float32]) -> sp.csr_matrix:
        """(d, 3u) the details of one person, of targets (1, t)."""
        if not targets[:, STYLES].any():
            return self.details
        return self.details.multiply(self._grown(targets, self.skin_growth)).tocsr()

    def grown(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        """(1, 3M) times as far that what moves the cage moves it in this person."""
        return self._grown(target_weights(identity).astype(np.float32)[None], self.growth)

    @staticmethod
    def _grown(targets: NDArray, growth: NDArray) -> NDArray[np.float32]:
        """(b, k) times as far that what moves a person of these targets moves."""
        return np.maximum(1 + targets[:, STYLES] @ growth, LEAST_GROWN)

    def expression(
        self, who: Who, values: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """(b, 3M) what keys of values (b, keys) move the cage by and (b, 3u) the skin, or None."""
        cage = _sum(values[:, : self.split], self.cage_keys)
        on_skin = values[:, self.split :]
        skin = _sparse_sum(on_skin, self.skin_keys) if on_skin.any() else None
        if who.variants.any():
            amounts = values[:, self.parents] * who.variants
            count = self.cage_variants.shape[0]
            cage += _sparse_sum(amounts[:, :count], self.cage_variants)
            if skin is not None:
                skin += _sparse_sum(amounts[:, count:], self.skin_variants)
        if who.stylised:
            cage *= self._grown(who.targets, self.growth)
            if skin is not None:
                skin *= self._grown(who.targets, self.skin_growth)
        return cage, skin

    def keys_of(self, who: Who) -> tuple[NDArray[np.float32], sp.csr_matrix]:
        """The keys of one person: (k, 3M) of the cage and (c, 3u), sparse, of the skin."""
        cage, skin = self.cage_keys, self.skin_keys
        if who.variants.any():
            share = sp.csr_matrix(
                (who.variants[0], (self.parents, np.arange(len(self.parents)))),
                shape=(cage.shape[0] + skin.shape[0], len(self.parents)),
            )
            count = self.cage_variants.shape[0]
            cage = cage + (share[: self.split, :count] @ self.cage_variants).toarray()
            skin = (skin + share[self.split :, count:] @ self.skin_variants).tocsr()
        if who.stylised:
            cage = cage * self._grown(who.targets[:1], self.growth)
            skin = skin.multiply(self._grown(who.targets[:1], self.skin_growth)).tocsr()
        return cage, skin


@dataclass(frozen=True)
class Who:
    """b people. targets : (b, targets) weights, see `identity.target_weights`;
    variants : (b, variants) how much of each they have, 0 for the default person"""

    targets: NDArray[np.float32]
    variants: NDArray[np.float32]

    @property
    def default_keys(self) -> bool:
        """Whether the keys of all of them are those of the default person."""
        return not (self.variants.any() or self.stylised)

    @property
    def stylised(self) -> bool:
        """Whether any of them is."""
        return bool(self.targets[:, STYLES].any())

    def same_keys(self, other: Who) -> bool:
        """Whether these people and others have the same keys."""
        return np.array_equal(self.variants, other.variants) and np.array_equal(
            self.targets[:, STYLES], other.targets[:, STYLES]
        )


def read_motions(arrays: Mapping[str, NDArray], matrix: sp.csr_matrix) -> Motions:
    """From the asset's arrays. matrix : (n, m) refinement."""
    cage = len(arrays["base"])  # M, vertices and joints
    skin_at, (details, skin_keys, skin_variants) = compressed(
        [
            entries(arrays, "details"),
            entries(arrays, "creases"),
            shared(arrays, "skin_variants", arrays["mirror"]),
        ]
    )
    growth = dense(arrays, "growth", cage)
    of_cage = growth.reshape(len(growth), cage, 3)[:, : matrix.shape[1]]
    on_skin = [matrix[skin_at] @ style for style in of_cage]
    return Motions(
        targets=dense(arrays, "identity", cage),
        details=details,
        cage_keys=dense(arrays, "cage_keys", cage),
        skin_keys=skin_keys,
        skin_at=skin_at,
        cage_variants=sparse(arrays, "cage_variants", cage),
        skin_variants=skin_variants,
        parents=arrays["variant_parents"].astype(np.intp),
        variant_names=tuple(map(str, arrays["variant_names"])),
        growth=growth,
        left=np.clip((arrays["base"][:, 0] / MIDDLE + 1) / 2, 0, 1).astype(np.float32),
        skin_growth=np.array(on_skin, np.float32).reshape(len(growth), 3 * len(skin_at)),
    )


def _sum(weights: NDArray, rows: NDArray) -> NDArray[np.float32]:
    """weights (b, r) times rows (r, k); rows without weight are not read."""
    used = np.flatnonzero(weights.any(axis=0))
    if 2 * len(used) < len(rows):
        weights, rows = weights[:, used], rows[used]
    return weights @ rows


def _sparse_sum(weights: NDArray, rows: sp.csr_matrix) -> NDArray[np.float32]:
    """weights (b, r) times sparse rows (r, k)."""
    used = np.flatnonzero(weights.any(axis=0))
    found = rows[used].T @ weights[:, used].T
    out = np.empty(found.shape[::-1], dtype=np.float32)
    for start in range(0, len(found), TURNED):  # all at once it would read across the cache
        out[:, start : start + TURNED] = found[start : start + TURNED].T
    return out
