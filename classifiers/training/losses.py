"""What training minimises: how far the networks' answers are from the labels. Needs torch."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F  # noqa: N812

from ..finding import BELL
from ..labels import FULL
from .augment import MID, NEAR, NO_FACE, WIDE

YES = 2.5  # how much a yes counts: most actions are rare, and calibration follows anyway
WHO = 0.5  # how much the person counts
# The first parameters of a person, sex, age and weight, change the whole face: how many, how much
# each of them counts.
MACROS, MACRO = 3, 8.0
UNITS = 4.0  # how much the units count among the rest; they are the hardest to learn


def loss_parts(
    outputs, batch: dict[str, Tensor], mid_weight: float, agree: float = 0.0
) -> dict[str, Tensor]:
    """The terms whose sum is minimised.

    A landmark's spread is that of a Laplace distribution around it (Kendall & Gal 2017), and does
    not bend the landmark itself.
    """
    units, places, angles, face, found, person, regions = outputs
    kind = batch["kind"]
    weight = (kind == NEAR).float() + mid_weight * (kind == MID).float()
    close = ((kind == NEAR) | (kind == MID)).float()
    many = close.sum().clamp(min=1)

    turn = F.smooth_l1_loss(angles, batch["angles"], beta=0.1, reduction="none").mean(dim=1)
    points, spread = places[:, :, :2], places[:, :, 2]
    spot = F.smooth_l1_loss(points, batch["landmarks"], beta=0.02, reduction="none").mean(
        dim=(1, 2)
    )
    off = torch.linalg.vector_norm(points.detach() - batch["landmarks"], dim=2)
    doubt = (off * torch.exp(-spread) + spread).mean(dim=1)
    parts = {
        **unit_losses(units, batch["active"], batch["intensity"], weight),
        "angles": 2 * (turn * close).sum() / many,
        "landmarks": 5 * (spot * close).sum() / many,
        "spread": 0.02 * (doubt * close).sum() / many,
        "face": 0.5 * F.binary_cross_entropy_with_logits(face, (kind != NO_FACE).float()),
        "found": 0.3 * finder_loss(found, batch["boxes"]),
        "person": WHO * person_loss(person, batch["person"], tells_who(kind)),
        "regions": region_loss(regions, batch["regions"]),
    }
    if agree:
        told = agreement_loss(units, batch["active"], batch["twin"], close.bool())
        parts["agree"] = agree * told
    return parts


def tells_who(kind: Tensor) -> Tensor:
    """(b,) 1 for the looks that the person is read from, else 0."""
    return ((kind == NEAR) | (kind == WIDE)).float()


def unit_losses(
    units: Tensor, truth: Tensor, intensity: Tensor, weight: Tensor
) -> dict[str, Tensor]:
    """Those of the action units: (b, k, 3) against active and intensity (b, k), weight (b,).

    Yes/no is the mean cross-entropy of each unit's softmax (thesis, "Training"), over the drawings
    where it is one or the other. How strong is only asked where it is active, so that the answer
    does not shrink with the doubt whether it is.
    """
    known = ~torch.isnan(truth) * weight[:, None]
    entropy = F.cross_entropy(
        units[:, :, :2].permute(0, 2, 1), torch.nan_to_num(truth).long(), reduction="none"
    )
    entropy = entropy * (1 + (YES - 1) * torch.nan_to_num(truth))
    strong = torch.nan_to_num(truth) * weight[:, None]
    fifths = F.smooth_l1_loss(units[:, :, 2], intensity / FULL, beta=0.1, reduction="none")
    return {
        "units": UNITS * (entropy * known).sum() / known.sum().clamp(min=1e-6),
        "intensity": (fifths * strong).sum() / strong.sum().clamp(min=1),
    }


def person_loss(person: Tensor, truth: Tensor, weight: Tensor) -> Tensor:
    """Of a Gaussian for each parameter, (b, p, 2) mean and log of its spread, against truth (b, p).

    Each sample counts by its own spread, so that what is hard to see does not stop being learnt
    (Seitzer et al. 2022, "On the Pitfalls of Heteroscedastic Uncertainty Estimation", beta 0.5).
    What is not known (nan) does not count; what changes the whole face counts `MACRO` times.
    """
    known = ~torch.isnan(truth) * weight[:, None]
    much = torch.ones_like(truth[0])
    much[:MACROS] = MACRO
    spread = person[:, :, 1].clamp(-4, 2)
    off = person[:, :, 0] - torch.nan_to_num(truth)
    likelihood = 0.5 * (off * torch.exp(-spread)) ** 2 + spread
    likelihood = likelihood * torch.exp(spread).detach()
    return (likelihood * known * much).sum() / known.sum().clamp(min=1)


def region_loss(regions: Tensor, truth: Tensor) -> Tensor:
    """Mean cross-entropy of each region's share of each half cell, (b, r, c, c); nan is unknown."""
    known = ~torch.isnan(truth)
    entropy = F.binary_cross_entropy_with_logits(regions, torch.nan_to_num(truth), reduction="none")
    return (entropy * known).sum() / known.sum().clamp(min=1)


def agreement_loss(units: Tensor, truth: Tensor, twin: Tensor, close: Tensor) -> Tensor:
    """How differently the units of one face are read in two drawings: (b, k, 3), mean over them.

    truth : (b, k), nan where a drawing cannot show a unit;  twin : (b,) the row of the same face's
    other drawing, or -1;  close : (b,) whether the face is seen from near

    Jeffreys' divergence of the two answers, which does not know which of them is right.
    """
    rows = torch.nonzero((twin >= 0) & close & close[twin.clamp(min=0)])[:, 0]
    answers = F.log_softmax(units[:, :, :2], dim=2)
    one, other = answers[rows], answers[twin[rows]]
    apart = ((one.exp() - other.exp()) * (one - other)).sum(dim=2)
    known = ~torch.isnan(truth[rows]) & ~torch.isnan(truth[twin[rows]])
    return (apart * known).sum() / known.sum().clamp(min=1)


def finder_loss(found: Tensor, boxes: Tensor) -> Tensor:
    """Mean over the pages of what the Finder got wrong.

    found : (b, cells, cells, 4);  boxes : (b, f, 3) as in Example, the most important first

    Near a face's middle cells are nearly right: the target falls off as a bell (Zhou et al. 2019),
    and what is easy counts little (Li et al. 2020, "Generalized Focal Loss").
    """
    cells = found.shape[1]
    inside = ((boxes[:, :, :2] >= 0) & (boxes[:, :, :2] < 1)).all(dim=2)  # false where nan
    middle = torch.nan_to_num(boxes[:, :, :2]).clamp(0, 1) * cells
    centre = torch.arange(cells, device=found.device) + 0.5
    away = (middle[:, :, None, None, 0] - centre) ** 2 + (
        middle[:, :, None, None, 1] - centre[:, None]
    ) ** 2
    bell = torch.exp(-away / (2 * BELL**2)) * inside[:, :, None, None]
    target = bell.amax(dim=1)
    logit = found[..., 0]
    entropy = F.binary_cross_entropy_with_logits(logit, target, reduction="none")
    loss = (entropy * (torch.sigmoid(logit) - target).abs().detach() ** 2).sum(dim=(1, 2))

    page, face = torch.nonzero(inside, as_tuple=True)
    cell = middle[page, face].long().clamp(max=cells - 1)
    told = found[page, cell[:, 1], cell[:, 0], 1:]
    place = middle[page, face] - cell - 0.5
    side = torch.log(boxes[page, face, 2:].clamp(min=1e-3))
    box = F.smooth_l1_loss(told, torch.cat([place, side], dim=1), beta=0.1, reduction="sum")
    return loss.mean() + box / max(len(page), 1)
