#!/usr/bin/env python3
"""Trains FlowNet Simple to predict optical flow from events, which are simulated during the training (the ESIM paper's Section 5).

    train.py small.yaml --out out/flow [--resume] [--set network.width=0.5] [--device cuda]

Writes into the folder: last.pt (a checkpoint), log.csv, figure.png, curve.png, and a log for TensorBoard where it is installed.
"""

import argparse
import csv
import itertools
import os
import pathlib
import sys
import time

import torch
from torch.utils.data import DataLoader

import esim
import esim.torch
from augment import random_change, turned_and_scaled
from figure import draw, draw_curve
from flownet import FlowNetS, end_point_error, enlarged, load_checkpoint, training_loss
from lead import LeadFlowDataset
from settings import read_settings

COLUMNS = ("iteration", "seconds", "rate", "loss", "train_epe_px", "validation_epe_px", "zero_epe_px")
VALIDATION_SEED = 1 << 32  # added to the training's


class Passes:
    """Indices of the samples of each batch, starting at sample number `first` of all passes: each pass goes through all
    `count` samples in another order."""

    def __init__(self, count, first, size):
        self.count, self.first, self.size = count, first, size

    def numbers(self):
        for turn in itertools.count(self.first // self.count):
            order = torch.randperm(self.count, generator=torch.Generator().manual_seed(turn)).tolist()
            yield from order[self.first % self.count if turn == self.first // self.count else 0 :]

    def __iter__(self):
        numbers = self.numbers()
        while True:
            yield list(itertools.islice(numbers, self.size))


class Training:
    """A network, its optimiser, and the progress of the training."""

    def __init__(self, settings, device="cpu"):
        self.settings, self.device = settings, device
        torch.manual_seed(settings["seed"])
        self.network = FlowNetS(**settings["network"]).to(device)
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=settings["rate"])
        self.iteration = 0
        self.seconds = 0.0
        self.validation_batches = None

    def dataset(self, **options):
        settings = self.settings
        options = {"block": settings["batch"], "seed": settings["seed"], **settings["simulation"], **options}
        if settings["lead"]:
            return LeadFlowDataset(settings["images"], lead_s=settings["lead"], **options)
        return esim.torch.AffineFlowDataset(settings["images"], **options)

    def loader(self, dataset, **options):
        workers = 0 if isinstance(dataset, list) else self.settings["workers"]  # lists are in memory
        return DataLoader(dataset, num_workers=workers, **options)

    def simulated(self, **options):
        """Batches of simulated samples that can be kept: copies, because each tensor from a worker keeps a file of shared
        memory open."""
        loader = self.loader(self.dataset(**options), batch_size=self.settings["batch"])
        return ([part.clone() for part in batch] for batch in loader)

    def stored(self, **options):
        """Simulated samples, to be used repeatedly."""
        return [sample for batch in self.simulated(**options) for sample in zip(*batch)]

    def batches(self):
        """Batches of training samples, starting at the current iteration; the same after resuming."""
        first, size, count = self.iteration * self.settings["batch"], self.settings["batch"], self.settings["sequences"]
        pinned = self.device != "cpu"
        if self.settings["dataset"] is not None:
            stored = esim.torch.EventTensorDataset(self.settings["dataset"])
        elif count:
            stored = self.stored(count=count)
        else:
            return self.loader(self.dataset(first=first), batch_size=size, pin_memory=pinned)
        return self.loader(stored, batch_sampler=Passes(len(stored), first, size), pin_memory=pinned)

    def rate(self):
        """Learning rate of the current iteration."""
        done = self.iteration / self.settings["iterations"]
        start, times = self.settings["halve_from"], self.settings["halve_times"]
        halvings = 0 if done < start else min(times, 1 + int((done - start) / max(1 - start, 1e-9) * times))
        return self.settings["rate"] * 0.5**halvings

    def step(self, batch):
        """One iteration; the loss, and the end-point error on pixels with events, px."""
        tensors, flow, fired = (part.to(self.device, non_blocking=True) for part in batch)
        change = random_change(len(tensors), self.settings["augmentation"]["angle_deg"],
                               self.settings["augmentation"]["scale"], seed=self.iteration)
        tensors, flow, fired, valid = turned_and_scaled(tensors, flow, fired, *(c.to(self.device) for c in change))
        for group in self.optimiser.param_groups:
            group["lr"] = self.rate()
        self.network.train()
        self.optimiser.zero_grad()
        flows = self.network(tensors)
        loss = training_loss(flows, flow, valid)
        if not torch.isfinite(loss):
            raise esim.Error(f"the loss is {loss.item()} in iteration {self.iteration}; lower the rate")
        loss.backward()
        self.optimiser.step()
        self.iteration += 1
        with torch.no_grad():
            return loss.item(), end_point_error(enlarged(flows[0], *flow.shape[-2:]), flow, fired).item()

    def validate(self):
        """End-point errors on pixels with events, px, of the network and of predicting no motion."""
        if self.validation_batches is None:
            seed = self.settings["simulation"].get("seed", self.settings["seed"]) + VALIDATION_SEED
            stored = self.stored(seed=seed, count=self.settings["validation"])
            self.validation_batches = list(DataLoader(stored, batch_size=self.settings["batch"]))
        self.network.eval()
        errors, zeros, pixels = 0.0, 0.0, 0.0
        with torch.no_grad():
            for batch in self.validation_batches:
                tensors, flow, fired = (part.to(self.device) for part in batch)
                count = fired.sum().item()
                errors += end_point_error(self.network.full_flow(tensors), flow, fired).item() * count
                zeros += end_point_error(torch.zeros_like(flow), flow, fired).item() * count
                pixels += count
        return errors / max(pixels, 1), zeros / max(pixels, 1)

    def save(self, path):
        """Replaces the checkpoint atomically."""
        part = path.with_suffix(".part")
        torch.save({"settings": self.settings, "network": self.network.state_dict(), "iteration": self.iteration,
                    "optimiser": self.optimiser.state_dict(), "seconds": self.seconds}, part)
        os.replace(part, path)

    def restore(self, path):
        checkpoint = load_checkpoint(path)
        free = {"iterations", "workers", "report_every", "validation"}  # what may change when resuming
        changed = [name for name, value in self.settings.items()
                   if name not in free and checkpoint["settings"].get(name) != value]
        if changed:
            raise esim.Error(f"{path} was trained with other settings: {', '.join(changed)}; use the same settings, or another --out")
        self.network.load_state_dict(checkpoint["network"])
        self.optimiser.load_state_dict(checkpoint["optimiser"])
        self.iteration, self.seconds = checkpoint["iteration"], checkpoint["seconds"]


def time_left(began, done, count):
    """How much longer a work takes of which `done` of `count` parts are done, as text, since `began` (of time.monotonic)."""
    seconds = round((time.monotonic() - began) / done * (count - done))
    return f"{seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02} left"


class Log:
    """Writes log.csv, and TensorBoard logs if it is installed."""

    def __init__(self, folder, until):
        self.path = folder / "log.csv"
        rows = []
        if self.path.exists():
            with open(self.path, newline="") as file:
                rows = [row for row in csv.DictReader(file) if int(row["iteration"]) <= until]
        with open(self.path, "w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        try:
            from torch.utils.tensorboard import SummaryWriter

            self.board = SummaryWriter(folder / "tensorboard", purge_step=until)
        except ImportError:
            self.board = None

    def add(self, row, note=""):
        with open(self.path, "a", newline="") as file:
            csv.DictWriter(file, COLUMNS).writerow({name: f"{value:.6g}" for name, value in row.items()})
        print("  ".join([*(f"{name} {value:.4g}" for name, value in row.items()), note]).rstrip(), flush=True)
        for name, value in row.items() if self.board else ():
            self.board.add_scalar(name, value, row["iteration"])


def train(training, folder):
    """Trains until the last iteration; yields a row of the log for each report."""
    settings = training.settings
    log = Log(folder, training.iteration)

    first = training.iteration

    def report(losses, errors):
        epe, zero = training.validate()
        mean = lambda values: sum(values) / len(values) if values else float("nan")
        row = (training.iteration, training.seconds, training.rate(), mean(losses), mean(errors), epe, zero)
        done = training.iteration - first
        log.add(dict(zip(COLUMNS, row)), time_left(started, done, settings["iterations"] - first) if done else "")

    if training.iteration == 0:
        report([], [])
    losses, errors, began = [], [], time.monotonic()
    if training.iteration >= settings["iterations"]:
        return
    batches = training.batches()  # may simulate first
    started = time.monotonic()
    for batch in batches:
        loss, error = training.step(batch)
        losses.append(loss)
        errors.append(error)
        last = training.iteration >= settings["iterations"]
        if last or training.iteration % settings["report_every"] == 0:
            training.seconds += time.monotonic() - began
            training.save(folder / "last.pt")
            report(losses, errors)
            losses, errors, began = [], [], time.monotonic()
        if last:
            return


def draw_validation(training, path, count=4):
    """Draws the first validation sequences, the prediction and the truth, as in the paper's Fig. 7."""
    tensors, flow, _ = training.validation_batches[0]
    with torch.no_grad():
        predicted = training.network.full_flow(tensors.to(training.device)).cpu()
    draw([(tensors[i].numpy(), predicted[i].numpy(), flow[i].numpy()) for i in range(min(count, len(flow)))], path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("settings", type=pathlib.Path, help="small.yaml, full.yaml, or your own")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="change a setting")
    parser.add_argument("--resume", action="store_true", help="continue from the checkpoint in the folder")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="number of PyTorch's processor threads")
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
    training = Training(read_settings(options.settings, options.set), options.device)
    checkpoint = options.out / "last.pt"
    if options.resume:
        training.restore(checkpoint)
    elif checkpoint.exists():
        raise esim.Error(f"{options.out} already has a training; continue it with --resume")
    options.out.mkdir(parents=True, exist_ok=True)
    train(training, options.out)
    if training.validation_batches is None:
        training.validate()
    draw_validation(training, options.out / "figure.png")
    draw_curve(options.out / "log.csv", options.out / "curve.png")


if __name__ == "__main__":
    try:
        main()
    except esim.Error as problem:
        sys.exit(f"train.py: {problem}")
