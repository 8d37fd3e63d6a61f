"""Figures as in the ESIM paper's Fig. 7: the input of the network, its prediction, and the truth."""

import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def flow_colours(flow, longest):
    """Directions as hues and lengths as saturations, white at rest: (2, height, width) to (height, width, 3), 0 to 1."""
    hue = (np.arctan2(-flow[1], -flow[0]) + np.pi) / (2 * np.pi)
    saturation = np.clip(np.hypot(*flow) / longest, 0, 1)
    return matplotlib.colors.hsv_to_rgb(np.stack([hue % 1, saturation, np.ones_like(hue)], -1))


def event_colours(tensor):
    """Counts of an event tensor on white: orange for mostly ON, blue for mostly OFF."""
    on, off = (np.minimum(count / max(1.0, np.percentile(tensor[:2], 99)), 1) for count in tensor[:2])
    return np.clip(np.stack([1 - off, 1 - 0.5 * on - 0.4 * off, 1 - on], -1), 0, 1)


def draw(samples, path):
    """samples: (tensor (4, h, w), predicted (2, h, w), truth (2, h, w)); flow in px."""
    figure, axes = plt.subplots(len(samples), 4, figsize=(9, 1.95 * len(samples)), squeeze=False)
    for row, (tensor, predicted, truth) in zip(axes, samples):
        longest = max(1e-6, np.nanpercentile(np.hypot(*truth), 99))
        fired = tensor[:2].sum(axis=0) > 0
        error = np.linalg.norm(predicted - truth, axis=0)[fired & np.isfinite(truth).all(axis=0)]
        row[0].imshow(event_colours(tensor))
        row[1].imshow(tensor[2:].max(axis=0), cmap="magma", vmin=0, vmax=1)
        row[2].imshow(np.where(fired[..., None], flow_colours(predicted, longest), 1))
        row[3].imshow(flow_colours(np.nan_to_num(truth), longest))
        row[2].set_xlabel(f"error {error.mean() if len(error) else 0:.2f} px", fontsize=8, labelpad=2)
        row[3].set_xlabel(f"mean {np.nanmean(np.hypot(*truth)):.1f} px", fontsize=8, labelpad=2)
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    for axis, title in zip(axes[0], ("events, counted", "time of the last", "prediction", "truth")):
        axis.set_title(title, fontsize=9)
    figure.tight_layout(pad=0.4, h_pad=0.8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_curve(log, path):
    """End-point errors of a log.csv against the number of iterations."""
    with open(log, newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    figure, axis = plt.subplots(figsize=(6, 3))
    iterations = [row["iteration"] for row in rows]
    for name, label, style in (("train_epe_px", "training, turned and scaled", "-"), ("validation_epe_px", "validation", "o-"),
                               ("zero_epe_px", "validation, predicting no motion", "--")):
        axis.plot(iterations, [row[name] for row in rows], style, label=label, markersize=3)
    axis.set_xlabel("iterations")
    axis.set_ylabel("end-point error, px")
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=110)
    plt.close(figure)
