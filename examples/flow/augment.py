"""Rotates and scales samples about the image's centre, including the flow."""

import math

import torch
from torch.nn import functional as F


def turned_and_scaled(tensors, flow, fired, angle, scale):
    """A batch as it would be seen with the image turned and enlarged: with M = scale R(angle), what stood at p from the
    middle stands at M p, and moves by M times its optical flow.

    Parameters
    ----------
    tensors, flow, fired : (N, 4, height, width), (N, 2, height, width), (N, 1, height, width)
        As `esim.torch` gives them.
    angle, scale : (N,)
        rad, from x to y (clockwise on the screen); above 0.

    Returns
    -------
    tensors, flow, fired, valid
        Counts and times are those of the nearest pixel, flow is interpolated; 0 where the image did not reach, where valid
        (N, 1, height, width) is 0.
    """
    n, _, height, width = flow.shape
    cosine, sine, zero = torch.cos(angle), torch.sin(angle), torch.zeros_like(angle)
    # affine_grid's coordinates are +-1 at the outer edges of the image: halves of its sides are the units.
    aspect = height / width
    inverse = torch.stack([cosine, sine * aspect, zero, -sine / aspect, cosine, zero], 1).view(n, 2, 3) / scale.view(n, 1, 1)
    grid = F.affine_grid(inverse, [n, 1, height, width], align_corners=False)
    valid = (grid.abs() <= 1).all(dim=-1).to(flow)[:, None]
    tensors = F.grid_sample(tensors, grid, "nearest", align_corners=False) * valid
    fired = F.grid_sample(fired, grid, "nearest", align_corners=False) * valid
    u, v = F.grid_sample(flow, grid, "bilinear", "border", align_corners=False).unbind(1)
    cosine, sine, scale = (value.view(n, 1, 1) for value in (cosine, sine, scale))
    flow = torch.stack([cosine * u - sine * v, sine * u + cosine * v], 1) * scale[:, None]
    return tensors, flow * valid, fired, valid


def random_change(count, angle_deg, scale, seed):
    """Angles up to +-angle_deg, rad, and scales between the two given, evenly in the logarithm: (count,) each, the same
    for the same seed."""
    generator = torch.Generator().manual_seed(seed)
    angle = math.radians(angle_deg) * (2 * torch.rand(count, generator=generator) - 1)
    low, high = math.log(scale[0]), math.log(scale[1])
    return angle, torch.exp(low + (high - low) * torch.rand(count, generator=generator))
