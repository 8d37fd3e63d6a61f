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


def draw_sim_to_real(summary, samples, path):
    """Errors of each sensor on each clip, with intervals; below, a window of each clip.

    Parameters
    ----------
    summary : dict
        Of sim_to_real.py.
    samples : dict of clip to {"tensor", "truth", "predicted": dict of sensor to optical flow}
    """
    sensors = list(next(iter(samples.values()))["predicted"])
    columns = 2 + len(sensors)
    figure = plt.figure(figsize=(2 * columns, 2.8 + 1.6 * len(samples)), layout="constrained")
    grid = figure.add_gridspec(1 + len(samples), columns, height_ratios=[1.8] + [1] * len(samples))
    draw_errors(figure.add_subplot(grid[0, :]), summary)
    for row, (clip, sample) in enumerate(samples.items(), 1):
        longest = np.percentile(np.hypot(*sample["truth"]), 99)
        fired = sample["tensor"][:2].sum(axis=0) > 0
        shown = {"events": event_colours(sample["tensor"]), "truth": flow_colours(sample["truth"], longest)}
        for sensor, predicted in sample["predicted"].items():
            shown[sensor] = np.where(fired[..., None], flow_colours(predicted, longest), 1)
        for column, (title, image) in enumerate(shown.items()):
            axis = figure.add_subplot(grid[row, column])
            axis.imshow(image)
            axis.set_xticks([])
            axis.set_yticks([])
            if row == 1:
                axis.set_title(title, fontsize=9)
            if column == 0:
                axis.set_ylabel(clip.replace("_", "\n"), fontsize=7)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_errors(axis, summary):
    """Mean errors and intervals, in groups: the truths of each clip."""
    names = list(summary["clips"][0]["epe_px"])
    for number, name in enumerate(names):
        for group, entry in enumerate(summary["clips"]):
            value = entry["epe_px"][name]
            low, high = value["interval"] or (value["mean"], value["mean"])
            at = group + 0.15 * (number - (len(names) - 1) / 2)
            axis.errorbar(at, value["mean"], [[value["mean"] - low], [high - value["mean"]]], fmt="o", markersize=4,
                          color=f"C{number}", label=name if group == 0 else None)
    labels = [f"{entry['clip'].replace('_', chr(10))}\n{entry['truth']}" for entry in summary["clips"]]
    axis.set_xticks(range(len(labels)), labels, fontsize=7)
    axis.set_ylabel("end-point error, px")
    axis.set_ylim(bottom=0)
    axis.grid(axis="y", alpha=0.3)
    axis.legend(fontsize=8, ncol=len(names))
