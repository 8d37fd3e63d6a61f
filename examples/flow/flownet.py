"""FlowNet Simple (Dosovitskiy et al., "FlowNet: Learning Optical Flow with Convolutional Networks", ICCV 2015), for event tensors.

A contracting part of convolutions with stride 2 up to 1/64 of the resolution, and a refinement that from there on, four
times, up-convolves features, concatenates those of the contracting part and the up-sampled coarser flow, and predicts flow
at twice the resolution, up to 1/4; bilinear interpolation makes flow of the full size of that (the paper's Figs. 2 and 3).
"""

import math

import torch
from torch import nn
from torch.nn import functional as F

import esim

# Layers of the paper: kernel and channels; "+": with a second convolution, 3 x 3 with stride 1.
LAYERS = ((7, 64, ""), (5, 128, ""), (5, 256, "+"), (3, 512, "+"), (3, 512, "+"), (3, 1024, ""))
CHANNELS = 4  # of an event tensor
SLOPE = 0.1  # of the leaky ReLU

# Weights of end-point errors, from 1/4 of the resolution to coarser ones. The authors weight errors summed over pixels
# by 0.005, 0.01, 0.02, 0.08, 0.32; for means over pixels, as here, these are the ratios.
LEVEL_WEIGHTS = (1.0, 0.5, 0.25, 0.25, 0.25)


def convolution(inputs, outputs, kernel, stride, normalise):
    layers = [nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=not normalise)]
    layers += [nn.BatchNorm2d(outputs)] if normalise else []
    return nn.Sequential(*layers, nn.LeakyReLU(SLOPE))


def up_convolution(inputs, outputs):
    return nn.Sequential(nn.ConvTranspose2d(inputs, outputs, 4, 2, 1), nn.LeakyReLU(SLOPE))


class FlowNetS(nn.Module):
    """Optical flow of every pixel, px, from event tensors.

    Parameters
    ----------
    width : float
        Channels are the paper's times this.
    levels : int
        Convolutions with stride 2, 3 to 6; the paper's 6 see 1/64 of the resolution.
    normalise : bool
        Batch normalisation after the convolutions of the contracting part; the paper has none.
    unit_px : float
        What the network takes for 1; of the size of typical optical flow.
    """

    def __init__(self, width=1.0, levels=6, normalise=False, unit_px=20.0):
        super().__init__()
        if not 3 <= levels <= len(LAYERS) or width <= 0 or unit_px <= 0:
            raise esim.Error("levels of the network must be 3 to 6, and its width and unit_px above 0")
        self.levels, self.unit_px = levels, unit_px
        channels = [max(1, round(outputs * width)) for _, outputs, _ in LAYERS[:levels]]
        self.contracting = nn.ModuleList()
        inputs = CHANNELS
        for (kernel, _, more), outputs in zip(LAYERS, channels):
            block = [convolution(inputs, outputs, kernel, 2, normalise)]
            block += [convolution(outputs, outputs, 3, 1, normalise)] if more else []
            self.contracting.append(nn.Sequential(*block))
            inputs = outputs
        self.predict, self.raise_flow, self.raise_features = nn.ModuleList(), nn.ModuleList(), nn.ModuleList()
        for level in range(levels - 1, 0, -1):  # 1 is at a quarter of the resolution
            self.predict.append(nn.Conv2d(inputs, 2, 3, 1, 1))
            if level > 1:
                raised = max(1, channels[level - 1] // (1 if level == 5 else 2))
                self.raise_flow.append(nn.ConvTranspose2d(2, 2, 4, 2, 1))
                self.raise_features.append(up_convolution(inputs, raised))
                inputs = channels[level - 1] + raised + 2
        for module in self.modules():
            if isinstance(module, (nn.Conv2d, nn.ConvTranspose2d)):
                nn.init.kaiming_normal_(module.weight, SLOPE)
                if module.bias is not None:
                    nn.init.zeros_(module.bias)
        for module in self.predict:  # initially, it predicts little motion
            nn.init.normal_(module.weight, std=1e-2 / math.sqrt(module.in_channels))

    def forward(self, tensors):
        """Flows of a batch (N, 4, height, width) at 1/4 of the resolution, 1/8, ...: lists of (N, 2, ...), px of the full
        resolution. Any size; borders are added to the right and below where it is no multiple of 2^levels."""
        multiple = 2**self.levels
        height, width = tensors.shape[-2:]
        x = F.pad(tensors, (0, -width % multiple, 0, -height % multiple))
        features = []
        for block in self.contracting:
            x = block(x)
            features.append(x)
        flows = []
        for step, predict in enumerate(self.predict):
            flows.insert(0, predict(x))
            if step < len(self.raise_flow):
                skip = features[self.levels - 2 - step]
                x = torch.cat([skip, self.raise_features[step](x), self.raise_flow[step](flows[0])], dim=1)
        return [flow * self.unit_px for flow in flows]

    def full_flow(self, tensors):
        """Flow in full resolution, (N, 2, height, width), px."""
        return enlarged(self(tensors)[0], *tensors.shape[-2:])


def enlarged(flow, height, width):
    """Upsamples flow from a quarter of the resolution, without the borders that forward() added."""
    return F.interpolate(flow, scale_factor=4, mode="bilinear", align_corners=False)[..., :height, :width]


def end_point_error(flow, truth, mask):
    """Mean of |flow - truth| over the pixels where mask is 1: (N, 2, h, w), (N, 2, h, w), (N, 1, h, w)."""
    error = (flow - truth).norm(dim=1, keepdim=True)
    return (error * mask).sum() / mask.sum().clamp(min=1)


def training_loss(flows, truth, valid):
    """End-point errors at all levels, weighted: each flow against the mean of the truth over its cells.

    truth (N, 2, height, width), px; valid (N, 1, height, width): 1 where the truth is known.
    """
    loss = 0
    for flow, weight in zip(flows, LEVEL_WEIGHTS):
        height, width = flow.shape[-2:]
        cell = 4 * flows[0].shape[-1] // width
        bottom, right = height * cell - truth.shape[-2], width * cell - truth.shape[-1]
        fraction = F.avg_pool2d(F.pad(valid, (0, right, 0, bottom)), cell)
        mean = F.avg_pool2d(F.pad(truth * valid, (0, right, 0, bottom)), cell) / fraction.clamp(min=1e-6)
        loss = loss + weight * end_point_error(flow, mean, (fraction > 0).to(fraction))
    return loss


def load_checkpoint(path):
    """Loads a checkpoint of train.py. Raises esim.Error for other files."""
    try:
        checkpoint = torch.load(path, map_location="cpu")
    except FileNotFoundError:
        raise esim.Error(f"the checkpoint {path} does not exist") from None
    except Exception as problem:  # zip, pickle and PyTorch raise many types
        reason = (str(problem).splitlines() or [type(problem).__name__])[0]
        raise esim.Error(f"{path} is not a checkpoint of train.py, or is damaged: {reason}") from None
    if not isinstance(checkpoint, dict) or not {"settings", "network"} <= set(checkpoint):
        raise esim.Error(f"{path} is not a checkpoint of train.py")
    return checkpoint


def load_predictor(path):
    """A function from an event tensor (4, height, width) to optical flow (2, height, width) in px, both NumPy arrays,
    and the settings of the training (a dict)."""
    checkpoint = load_checkpoint(path)
    network = FlowNetS(**checkpoint["settings"]["network"])
    network.load_state_dict(checkpoint["network"])
    network.eval()

    def predict(tensor):
        with torch.no_grad():
            return network.full_flow(torch.from_numpy(tensor)[None])[0].numpy()

    return predict, checkpoint["settings"]
