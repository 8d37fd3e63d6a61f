"""Windows within a motion: as in a recording, the pixels have seen the motion before the window of the network begins.

`esim.dataset.AffineSequences` start at rest: no pixel has seen a change, and no refractory period is running. In windows of
8 ms, these first moments are a large part. Here, the image has moved for some time before the window.
"""

import numpy as np
from torch.utils.data import get_worker_info

import esim
from esim.dataset import AffineSequences
from esim.torch import AffineFlowDataset, to_sample


class LeadFlowDataset(AffineFlowDataset):
    """`esim.torch.AffineFlowDataset` of the last `duration` s of sequences that are `lead_s` longer. The magnitudes of the
    optical flow are those of the last `duration` s, if the motion were of constant speed (it varies by up to a third)."""

    def __init__(self, images=None, *, lead_s, duration=0.04, flow_scale=1.0, **options):
        if lead_s <= 0:
            raise esim.Error(f"lead_s must be above 0 s, not {lead_s}")
        complete_s = lead_s + duration
        super().__init__(images, duration=complete_s, flow_scale=flow_scale * complete_s / duration, **options)
        self.lead_s = lead_s

    def __iter__(self):
        sequences = AffineSequences(**self.options)
        worker = get_worker_info()
        for i in self.indices(worker.id, worker.num_workers) if worker else self.indices():
            yield to_sample(*window_of(sequences[i], self.lead_s))


def window_of(sequence, lead_s):
    """The event tensor (4, height, width) and the optical flow (2, height, width), px, of a sequence after `lead_s`."""
    t0, t1 = round(lead_s * 1e9), sequence.duration
    height, width = sequence.motion_field.shape[1:]
    events = sequence.events[sequence.events["t"] >= t0]
    tensor = esim.event_tensor(events, width, height, t0=esim.ns(t0), t1=esim.ns(t1))
    return tensor, flow_between(sequence.info["poses"], t0 * 1e-9, t1 * 1e-9, width, height)


def flow_between(poses, t0_s, t1_s, width, height):
    """Optical flow of each pixel from t0_s to t1_s, px, of a sprite in pixels with three poses (docs/sprites.md)."""
    (position0, A0), (position1, A1) = placement(poses, t0_s), placement(poses, t1_s)
    v, u = np.mgrid[:height, :width]
    pixels = np.stack([u - (width - 1) / 2, v - (height - 1) / 2])
    moved = np.tensordot(A1 @ np.linalg.inv(A0), pixels - position0[:, None, None], 1) + position1[:, None, None]
    return moved - pixels


def placement(poses, t_s):
    """Where the pivot is from the centre of the sensor, px (2,), and the image's axes, px per texel (2, 2), at t_s."""
    values = np.array([[*pose["position"], np.radians(pose["rotation_deg"]), *pose["scale"], pose["shear"]] for pose in poses])
    x, y, angle, scale_x, scale_y, shear = spline([pose["t_s"] for pose in poses], values, t_s)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([x, y]), np.array([[c, -s], [s, c]]) @ np.array([[scale_x, shear * scale_y], [0, scale_y]])


def spline(t, values, now):
    """The natural cubic spline through three points: (N,) from values (3, N)."""
    h0, h1 = np.diff(t)
    bend = 3 * ((values[2] - values[1]) / h1 - (values[1] - values[0]) / h0) / (h0 + h1)  # second derivative in the middle
    i, h = (0, h0) if now < t[1] else (1, h1)
    q = (now - t[i]) / h
    p = 1 - q
    curve = p**3 - p if i == 1 else q**3 - q
    return p * values[i] + q * values[i + 1] + h * h / 6 * curve * bend
