"""Cheap changes to examples that are seen again, of whole batches at once, on whatever device.

What a hand, a person's way to shade and a camera do once more to a page that has been drawn over:
it is mirrored, shifted and turned, shaded, its lines thicker or softer. The labels follow.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F  # noqa: N812

from ..preprocess import TYPICAL_INK
from .augment import Names

TURN, STRETCH, SHIFT = 0.07, 0.05, 0.02  # spreads: radians, log of a scale, share of the crop
STEADY = 0.3  # of the examples, those that stay where they are
# How many of the examples are mirrored, shaded, drawn thicker, blurred, given another contrast,
# given grain, have something rubbed out.
MIRRORED, SHADED, THICKER, BLURRED, CONTRAST, GRAINY, RUBBED = 0.5, 0.3, 0.12, 0.2, 0.3, 0.15, 0.15
PICTURES = {"ink", "regions"}
Batch = dict[str, Tensor]


def jittered(batch: Batch, names: Names) -> Batch:
    """Examples as of `common.collate`, their ink (b, 1, size, size) 0..1, each changed by lot."""
    batch = mirrored(batch, names, chosen(batch, MIRRORED))
    batch = moved(batch, *motion(batch))
    ink = batch["ink"]
    ink = torch.where(_wide(chosen(batch, SHADED)), shaded(ink), ink)
    ink = torch.where(_wide(chosen(batch, THICKER)), F.max_pool2d(ink, 3, 1, 1), ink)
    ink = torch.where(_wide(chosen(batch, BLURRED)), F.avg_pool2d(ink, 3, 1, 1), ink)
    power = torch.exp(0.4 * torch.randn_like(ink[:, :, :1, :1]))
    ink = torch.where(_wide(chosen(batch, CONTRAST)), ink.clamp(min=1e-4) ** power, ink)
    grain = 0.05 * torch.rand_like(ink[:, :, :1, :1]) * torch.randn_like(ink)
    ink = torch.where(_wide(chosen(batch, GRAINY)), (ink + grain).clamp(0, 1), ink)
    ink = torch.where(_wide(chosen(batch, RUBBED)), rubbed(ink), ink)
    return batch | {"ink": evened(ink).contiguous(memory_format=torch.channels_last)}


def chosen(batch: Batch, share: float) -> Tensor:
    """(b,) bool, about this share of the examples."""
    return torch.rand(len(batch["ink"]), device=batch["ink"].device) < share


def mirrored(batch: Batch, names: Names, which: Tensor) -> Batch:
    """Left and right exchanged everywhere in the examples that `which` (b,) names."""
    units = torch.as_tensor(names.au_mirror, device=which.device)
    places = torch.as_tensor(names.landmark_mirror, device=which.device)
    flip = batch["angles"].new_tensor
    other = {
        **{name: batch[name].flip(-1) for name in PICTURES if name in batch},
        "active": batch["active"][:, units],
        "intensity": batch["intensity"][:, units],
        "angles": batch["angles"] * flip((-1, 1, -1)),
        "landmarks": batch["landmarks"][:, places] * flip((-1, 1)) + flip((1, 0)),
        "boxes": batch["boxes"] * flip((-1, 1, 1)) + flip((1, 0, 0)),
    }
    return batch | {
        name: torch.where(which.reshape(-1, *[1] * (value.dim() - 1)), value, batch[name])
        for name, value in other.items()
    }


def motion(batch: Batch) -> tuple[Tensor, Tensor, Tensor]:
    """By lot: turn (b,) radians clockwise, scale (b, 2), shift (b, 2) in crop units."""
    still = chosen(batch, STEADY)[:, None]
    noise = torch.randn(len(still), 5, device=still.device).clamp(-2.5, 2.5)
    noise = torch.where(still, torch.zeros_like(noise), noise)
    return TURN * noise[:, 0], torch.exp(STRETCH * noise[:, 1:3]), SHIFT * noise[:, 3:]


def moved(batch: Batch, turn: Tensor, scale: Tensor, shift: Tensor) -> Batch:
    """The pages stretched, turned about their middles and shifted; what comes in is paper."""
    c, s = torch.cos(turn), torch.sin(turn)
    matrix = torch.stack([torch.stack([c, -s], 1), torch.stack([s, c], 1)], 1) * scale[:, None]
    back = torch.linalg.inv(matrix)
    # affine_grid counts from -1 to 1, so that shifts are twice as long there
    place = torch.cat([back, -2 * back @ shift[:, :, None]], dim=2)
    pictures = {}
    for name in PICTURES & batch.keys():
        grid = F.affine_grid(place, list(batch[name].shape), align_corners=False)
        pictures[name] = F.grid_sample(batch[name], grid, padding_mode="zeros", align_corners=False)

    def new(points: Tensor) -> Tensor:
        return (points - 0.5) @ matrix.transpose(1, 2) + 0.5 + shift[:, None]

    sides = batch["boxes"][:, :, 2:] * scale.prod(dim=1).sqrt()[:, None, None]
    return {
        **batch,
        **pictures,
        "angles": turned(batch["angles"], turn),
        "landmarks": new(batch["landmarks"]),
        "boxes": torch.cat([new(batch["boxes"][:, :, :2]), sides], dim=2),
    }


def turned(angles: Tensor, turn: Tensor) -> Tensor:
    """`targets.rotated_in_picture` of many: angles (b, 3), turn (b,), radians."""
    (cy, cp, cr), (sy, sp, sr) = torch.cos(angles).unbind(1), torch.sin(angles).unbind(1)
    first = torch.stack([cy * cr - sy * sp * sr, cy * sr + sy * sp * cr, sy * cp], 1)
    second = torch.stack([-cp * sr, cp * cr, -sp], 1)
    c, s = torch.cos(turn)[:, None], torch.sin(turn)[:, None]
    first, second = c * first + s * second, -s * first + c * second
    yaw = torch.atan2(first[:, 2], cy * cp)
    pitch = torch.asin((-second[:, 2]).clamp(-1, 1))
    return torch.stack([yaw, pitch, torch.atan2(-second[:, 0], second[:, 1])], 1)


def shaded(ink: Tensor) -> Tensor:
    """Fields of tone as of a soft pencil or a shadow on the paper, somewhere, with its grain."""
    cells = int(torch.randint(2, 7, ()))
    field = torch.rand(len(ink), 1, cells, cells, device=ink.device)
    field = F.interpolate(field, size=ink.shape[2:], mode="bicubic", align_corners=False)
    edge, soft, dark, grain = torch.rand(4, len(ink), 1, 1, 1, device=ink.device)
    field = torch.sigmoid((field - 0.3 - 0.5 * edge) * (4 + 26 * soft))
    tone = (0.05 + 0.4 * dark) * field * (1 + 0.5 * grain * torch.randn_like(ink)).clamp(min=0)
    return (ink + tone * (1 - ink)).clamp(0, 1)


def rubbed(ink: Tensor) -> Tensor:
    """A rectangle of each page as paper."""
    size = ink.shape[-1]
    at = torch.arange(size, device=ink.device) / size
    middle = torch.rand(2, len(ink), 1, device=ink.device)
    half = 0.02 + 0.1 * torch.rand(2, len(ink), 1, device=ink.device)
    inside = (at - middle).abs() < half
    return ink * ~(inside[0][:, None, None, :] & inside[1][:, None, :, None])


def evened(ink: Tensor) -> Tensor:
    """`preprocess.even_ink` of many."""
    total = ink.sum(dim=(1, 2, 3), keepdim=True)
    typical = ink.square().sum(dim=(1, 2, 3), keepdim=True) / total.clamp(min=1e-6)
    return (ink * (TYPICAL_INK / typical.clamp(min=0.08))).clamp(max=1)


def _wide(which: Tensor) -> Tensor:
    return which[:, None, None, None]
