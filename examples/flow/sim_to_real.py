#!/usr/bin/env python3
"""Compares sensors for training: the same network, trained on events of each, is tested on real clips of rotations.

    sim_to_real.py CLIPS --out out/sim_to_real [--settings sim_to_real.yaml] [--training windows_full.yaml --device cuda]

CLIPS contains folders as rotation_clips.py describes them. The same command continues after an interruption. Writes into
--out: windows.csv, summary.json, table.md, figure.png, and for each sensor its samples and trainings. See docs/learning.md.
"""

import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import time

import numpy as np
import torch
import torch.utils.data
import yaml

import esim
from bootstrap import LEVEL, compared
from figure import draw_sim_to_real
from flownet import end_point_error
from rotation_clips import read_clips
from settings import like, read, read_settings
from train import Training, time_left, train

HERE = pathlib.Path(__file__).parent
ALL = "all windows"
KEYS = {"training", "seeds", "sensors", "near_px"}


class StoredTraining(Training):
    """A training whose samples, if they are used repeatedly, are simulated once into a folder."""

    def __init__(self, settings, device, folder):
        super().__init__(settings, device)
        self.folder = folder

    def loader(self, dataset, **options):
        if isinstance(dataset, StoredSamples):  # quick enough without other processes
            return torch.utils.data.DataLoader(dataset, **options)
        return super().loader(dataset, **options)

    def stored(self, **options):
        made_by = {**{name: self.settings[name] for name in ("images", "lead", "simulation")}, **options}
        samples = StoredSamples(self.folder / ("validation" if "seed" in options else "training"), made_by)
        first, count = samples.done, options["count"]
        began = time.monotonic()
        for batch in self.simulated(**{**options, "first": first, "count": count - first}) if first < count else ():
            before = samples.done
            samples.add(batch)
            if 10 * before // count < 10 * samples.done // count:
                print(f"{self.folder.name}: {samples.done} of {count} sequences simulated, "
                      f"{time_left(began, samples.done - first, count - first)}", flush=True)
        return samples


class StoredSamples(torch.utils.data.Dataset):
    """Samples of one size in a file, added batch by batch; what is there is found again after an interruption.

    NAME.npy: float32 (count, channels of the tensor, the optical flow and the mask, height, width); NAME.json: the options
    that it was made with (`made_by`, with `count`), and how many samples are complete.
    """

    CHANNELS = 4, 2, 1

    def __init__(self, path, made_by):
        self.values, self.head = path.with_suffix(".npy"), path.with_suffix(".json")
        path.parent.mkdir(parents=True, exist_ok=True)
        made_by = json.loads(json.dumps(made_by))
        if not self.head.exists():
            size = made_by["simulation"]
            np.lib.format.open_memmap(self.values, "w+", np.float32, (made_by["count"], sum(self.CHANNELS), size["height"], size["width"]))
            self.write({"made_by": made_by, "done": 0})
        self.state = json.loads(self.head.read_text())
        if self.state["made_by"] != made_by:
            raise esim.Error(f"{self.head}: the samples were simulated with other settings; use the same settings, or another --out")
        self.array = None

    done = property(lambda self: self.state["done"])

    def write(self, state):
        part = self.head.with_suffix(".part")
        part.write_text(json.dumps(state))
        os.replace(part, self.head)
        self.state = state

    def add(self, batch):
        array = np.load(self.values, mmap_mode="r+")
        done = self.done + len(batch[0])
        array[self.done : done] = np.concatenate([part.numpy() for part in batch], axis=1)
        array.flush()
        self.write({**self.state, "done": done})

    def __len__(self):
        return self.done

    def __getitem__(self, i):
        if self.array is None:
            self.array = np.load(self.values, mmap_mode="r")
        return torch.from_numpy(self.array[i].copy()).split(self.CHANNELS)


def read_experiment(path, training=None):
    """The settings of sim_to_real.yaml, checked; `training` replaces the file that they name."""
    experiment = read(path)
    if set(experiment) != KEYS:
        raise esim.Error(f"{path}: must have the settings {', '.join(sorted(KEYS))}, and no others")
    for name, sensor in experiment["sensors"].items():
        if "fit" in sensor:
            fit_of(sensor, f"{path}: sensors.{name}")
    experiment["training"] = training or pathlib.Path(path).parent / experiment["training"]
    experiment["seeds"] = [like(1, seed, f"{path}: seeds") for seed in experiment["seeds"]]
    return experiment


def fit_of(sensor, where):
    """The clip and the fractions of its duration that a sensor is fitted to: CLIP:FROM:TO."""
    try:
        clip, low, high = sensor["fit"].split(":")
        part = float(low), float(high)
        if not 0 <= part[0] < part[1] <= 1:
            raise ValueError
    except ValueError:
        raise esim.Error(f'{where}.fit must be CLIP:FROM:TO with fractions of its duration, not "{sensor["fit"]}"') from None
    return clip, part


def fitted(clips, sensor, folder, program):
    """Fits a sensor by `esim evaluate realism`, unless it has been done: options of esim.dataset.AffineSequences."""
    path = folder / "base_fitted.yaml"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "base.yaml").write_text(yaml.safe_dump({"event_camera": sensor["base"]}))
        print(f"fitting a sensor to {sensor['fit']}", flush=True)
        done = subprocess.run([*program, "evaluate", "realism", clips, "--sensor", folder / "base.yaml", "--fit-to",
                               sensor["fit"], "--save-fitted", folder, "--quiet"], stdout=subprocess.PIPE, text=True)
        if done.returncode:
            raise esim.Error(f"esim evaluate realism could not fit a sensor to {sensor['fit']}; its message is above")
        (folder / "fit.txt").write_text(done.stdout)
    return sequence_options(yaml.safe_load(path.read_text())["event_camera"])


def sequence_options(event_camera):
    """Options of esim.dataset.AffineSequences for a sensor with one threshold of each polarity: these would replace both."""
    sensor = dict(event_camera)
    on = sensor.pop("contrast_threshold_on", None)
    off = sensor.pop("contrast_threshold_off", None)
    given = sensor.pop("contrast_threshold", on)
    on = on or given
    if off is not None:
        sensor["threshold_ratio"] = off / on
    return {"contrast_threshold": on, "event_camera": sensor}


def trained(name, sensor, seed, experiment, out, device):
    """The training of a sensor with a seed, continued until it is complete."""
    settings = read_settings(experiment["training"])
    settings["seed"] = seed
    settings["simulation"].update(sensor)
    training = StoredTraining(settings, device, out / name)
    folder = out / name / f"seed-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / "last.pt").exists():
        training.restore(folder / "last.pt")
    if training.iteration < settings["iterations"]:
        print(f"training on {name}, seed {seed}", flush=True)
    train(training, folder)
    return training


def validation(training, near_px):
    """End-point errors, px, on the training's own validation sequences: of all pixels with events, and of those whose optical
    flow is within near_px, each for the network and for no motion."""
    training.validate()
    training.network.eval()
    sums = np.zeros((2, 3))
    for tensors, flow, fired in training.validation_batches:
        with torch.no_grad():
            predicted = training.network.full_flow(tensors.to(training.device)).cpu()
        length = flow.norm(dim=1, keepdim=True)
        near = fired * ((length >= near_px[0]) & (length < near_px[1]))
        for row, mask in zip(sums, (fired, near)):
            count = mask.sum().item()
            row += [end_point_error(predicted, flow, mask).item() * count, (length * mask).sum().item(), count]
    every, near = (row[:2] / max(row[2], 1) for row in sums)
    return {"epe_px": every[0], "zero_epe_px": every[1], "near_epe_px": near[0], "near_zero_epe_px": near[1]}


def predictor(training):
    training.network.eval()

    def predict(tensor):
        with torch.no_grad():
            return training.network.full_flow(torch.from_numpy(tensor)[None].to(training.device))[0].cpu().numpy()

    return predict


def tested(clips, parts, sensor, seed, training):
    """A row for each window of each clip and truth; `fitted`: whether a sensor was fitted to a part of the window."""
    window_s = training.settings["simulation"]["duration"]
    rows = []
    for clip in clips:
        for truth in clip.truths:
            for row in clip.rows(truth, predictor(training), window_s)[0]:
                seen = any(clip.within(row["t0_s"], window_s, part) for name, part in parts if name == clip.name)
                rows.append({"clip": clip.name, "truth": truth, "sensor": sensor, "seed": seed, "fitted": int(seen), **row})
    return rows


def errors_of(rows, truth, clip):
    """Errors by sensor, (trainings, windows), and of no motion, in the windows that no sensor was fitted to; empty without
    such windows."""
    chosen = [row for row in rows if row["truth"] == truth and not row["fitted"] and clip in (row["clip"], ALL)]
    errors = {}
    for row in chosen:
        errors.setdefault(row["sensor"], {}).setdefault(row["seed"], []).append(row["epe_px"])
    if not chosen:
        return {}
    errors = {sensor: list(by_seed.values()) for sensor, by_seed in errors.items()}
    sensor, seed = chosen[0]["sensor"], chosen[0]["seed"]
    zero = [row["zero_epe_px"] for row in chosen if (row["sensor"], row["seed"]) == (sensor, seed)]
    return {"no motion": [zero], **errors}


def summary_of(rows, validations, clips, near_px):
    """What table.md says, as numbers."""
    summary = {"level": LEVEL, "near_px": near_px, "validation": validations, "rates_rad_per_s": {
        clip.name: {name: truth.rate[0].round(4).tolist() for name, truth in clip.truths.items()} for clip in clips}, "clips": []}
    for truth in clips[0].truths:
        for clip in [*(clip.name for clip in clips), ALL]:
            errors = errors_of(rows, truth, clip)
            if not errors:
                continue
            means, pairs = compared(errors)
            summary["clips"].append({
                "truth": truth, "clip": clip, "windows": len(errors["no motion"][0]),
                "epe_px": {name: {"mean": mean, "interval": limits} for name, (mean, limits) in means.items()},
                "pairs": [dict(zip(("first", "second", "difference_px", "interval", "verdict"), pair)) for pair in pairs]})
    return summary


def text_of(value, limits):
    return f"{value:.2f}" + (f" [{limits[0]:.2f}, {limits[1]:.2f}]" if limits else "")


def table_of(summary):
    """The summary as Markdown."""
    low, high = summary["near_px"]
    lines = ["End-point errors on simulated validation sequences, px (mean of the trainings; no motion in brackets)", "",
             f"| sensor | all pixels | pixels that move by {low:g} to {high:g} px |", "|---|---|---|"]
    for sensor, values in summary["validation"].items():
        mean = {key: np.mean([value[key] for value in values]) for key in values[0]}
        lines.append(f"| {sensor} | {mean['epe_px']:.2f} ({mean['zero_epe_px']:.2f}) "
                     f"| {mean['near_epe_px']:.2f} ({mean['near_zero_epe_px']:.2f}) |")
    sensors = list(summary["clips"][0]["epe_px"])
    lines += ["", f"End-point errors on real clips, px, with {100 * summary['level']:g} % intervals", "",
              f"| truth | clip | windows | {' | '.join(sensors)} |", "|---" * (3 + len(sensors)) + "|"]
    for entry in summary["clips"]:
        cells = [text_of(entry["epe_px"][name]["mean"], entry["epe_px"][name]["interval"]) for name in sensors]
        lines.append(f"| {entry['truth']} | {entry['clip']} | {entry['windows']} | {' | '.join(cells)} |")
    lines += ["", "Differences of errors, px: first minus second", "", "| truth | clip | first | second | difference | verdict |",
              "|---|---|---|---|---|---|"]
    for entry in summary["clips"]:
        for pair in entry["pairs"]:
            lines.append(f"| {entry['truth']} | {entry['clip']} | {pair['first']} | {pair['second']} "
                         f"| {text_of(pair['difference_px'], pair['interval'])} | {pair['verdict']} |")
    return "\n".join(lines) + "\n"


def write(out, rows, summary, samples):
    with open(out / "windows.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    (out / "table.md").write_text(table_of(summary))
    draw_sim_to_real(summary, samples, out / "figure.png")


def samples_of(clips, trainings):
    """One window of each clip, the one in its middle: the event tensor, the truth, and the prediction of each sensor."""
    samples = {}
    for clip in clips:
        for sensor, training in trainings.items():
            window_s = training.settings["simulation"]["duration"]
            _, kept = clip.rows("sharpest", predictor(training), window_s, keep=10**6)
            tensor, predicted, truth = kept[len(kept) // 2]
            sample = samples.setdefault(clip.name, {"tensor": tensor, "truth": truth, "predicted": {}})
            sample["predicted"][sensor] = predicted
    return samples


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", type=pathlib.Path, help="folder of clips")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write, or to continue")
    parser.add_argument("--settings", type=pathlib.Path, default=HERE / "sim_to_real.yaml", help="sensors and seeds")
    parser.add_argument("--training", type=pathlib.Path, help="settings of train.py, instead of those that --settings names")
    parser.add_argument("--esim", help="the program esim (default: that of the Python package), for sensors that are fitted")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="number of PyTorch's processor threads")
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
    program = [options.esim] if options.esim else [sys.executable, "-m", "esim"]
    experiment = read_experiment(options.settings, options.training)
    clips = read_clips(options.clips)
    sensors, parts = {}, []
    for name, sensor in experiment["sensors"].items():
        if "fit" in sensor:
            parts.append(fit_of(sensor, name))
            sensor = fitted(options.clips, sensor, options.out / name, program)
        sensors[name] = sensor
    for clip, _ in parts:
        if clip not in [one.name for one in clips]:
            raise esim.Error(f"{options.settings}: a sensor is fitted to {clip}, which is not one of the clips in {options.clips}")
    rows, validations, first = [], {name: [] for name in sensors}, {}
    for seed in experiment["seeds"]:
        for name, sensor in sensors.items():
            training = trained(name, sensor, seed, experiment, options.out, options.device)
            validations[name].append(validation(training, experiment["near_px"]))
            rows += tested(clips, parts, name, seed, training)
            first.setdefault(name, training)
        write(options.out, rows, summary_of(rows, validations, clips, experiment["near_px"]), samples_of(clips, first))
        print(f"seed {seed} is complete: {options.out / 'table.md'}", flush=True)
    print((options.out / "table.md").read_text())


if __name__ == "__main__":
    try:
        main()
    except esim.Error as problem:
        sys.exit(f"sim_to_real.py: {problem}")
