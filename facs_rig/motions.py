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

from .identity import CAGE_TARGETS, STYLES, target_weights
from .moves import compressed, dense, entries, shared, sparse
from .variants import variant_weights


@dataclass(frozen=True)
class Motions:
    """Rows of displacements in metres, flat; those of the cage before those of the skin.

    targets : (t, 3M) and details : (d, 3u) sparse, the identity's on cage and skin;
    cage_keys : (k, 3M);  skin_keys : (c, 3u) sparse;  skin_at : (u,) fine vertices of the skin;
    cage_variants : (v, 3M) and skin_variants : (w, 3u), sparse;  parents : (v + w,) their keys;
    growth : (styles, 3M) and skin_growth : (styles, 3u), how much more keys move for each style
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
        return _sum(who.targets[:, :CAGE_TARGETS], self.targets), skin

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
        if (styles := who.targets[:, STYLES]).any():
            cage *= 1 + styles @ self.growth
            if skin is not None:
                skin *= 1 + styles @ self.skin_growth
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
        if (styles := who.targets[0, STYLES]).any():
            cage = cage * (1 + styles @ self.growth)
            skin = skin.multiply(1 + styles @ self.skin_growth).tocsr()
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
        return not (self.variants.any() or self.targets[:, STYLES].any())

    def same_keys(self, other: Who) -> bool:
        """Whether these people and others have the same keys."""
        return np.array_equal(self.variants, other.variants) and np.array_equal(
            self.targets[:, STYLES], other.targets[:, STYLES]
        )


def read_motions(arrays: Mapping[str, NDArray], cage: int, matrix: sp.csr_matrix) -> Motions:
    """From the asset's arrays. cage : M, vertices and joints;  matrix : (n, m) refinement."""
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
    return np.ascontiguousarray((rows[used].T @ weights[:, used].T).T, dtype=np.float32)
