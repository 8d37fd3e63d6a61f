"""esim.torch and examples/flow: augmentation, network, data sets, and that training learns.

Run as: learning_test.py FOLDER_OF_THE_EXAMPLE, by a Python that has PyTorch and the package esim.
"""

import collections
import contextlib
import csv
import io
import itertools
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tarfile
import tempfile
import unittest

try:
    import h5py
    import matplotlib  # noqa: F401
    import numpy as np
    import torch
    import yaml  # noqa: F401

    import esim
    import esim.torch
except ImportError as missing:
    print(f"skipped: {missing}; scripts/setup --with-learning installs what it needs")
    sys.exit(77)  # skipped, to CTest

EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(EXAMPLE))

from augment import random_change, turned_and_scaled  # noqa: E402
from flownet import FlowNetS, end_point_error, load_checkpoint, load_predictor, training_loss  # noqa: E402
from settings import read_settings  # noqa: E402
from train import Passes, Training, train  # noqa: E402

torch.set_num_threads(1)  # threads that wait for each other lose against other processes
TINY = ["sequences=0", "workers=0", "validation=8", "batch=4"]  # of small.yaml


def pixels(height, width):
    """x and y of pixels from the middle: (height, width) each."""
    y, x = torch.meshgrid(torch.arange(height) - (height - 1) / 2, torch.arange(width) - (width - 1) / 2, indexing="ij")
    return x, y


class Temporary(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="esim_learning_")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)


class Augmentation(unittest.TestCase):
    def change(self, flow, angle, scale, tensors=None, fired=None):
        n, _, height, width = flow.shape
        tensors = torch.zeros(n, 4, height, width) if tensors is None else tensors
        fired = torch.zeros(n, 1, height, width) if fired is None else fired
        return turned_and_scaled(tensors, flow, fired, torch.full((n,), angle), torch.full((n,), scale))

    def test_affine_flow_is_conjugated(self):
        """D(p) = G p + d becomes M G M^-1 p + M d, where the image is."""
        x, y = pixels(30, 40)
        for angle, scale in ((0.3, 1.2), (-2.0, 0.8), (np.pi, 1.0), (0.0, 1.5)):
            random = np.random.default_rng(1)
            G, d = random.normal(size=(2, 2)) * 0.1, random.normal(size=2) * 5
            M = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

            def affine(G, d):
                return torch.stack([G[0, 0] * x + G[0, 1] * y + d[0], G[1, 0] * x + G[1, 1] * y + d[1]])[None].float()

            _, flow, _, valid = self.change(affine(G, d), angle, scale)
            expected = affine(M @ G @ np.linalg.inv(M), M @ d)
            inverse = np.linalg.inv(M)
            inside = ((inverse[0, 0] * x + inverse[0, 1] * y).abs() < 19.4) & ((inverse[1, 0] * x + inverse[1, 1] * y).abs() < 14.4)
            self.assertTrue(torch.allclose((flow - expected)[0][:, inside], torch.zeros(1), atol=1e-4))
            self.assertTrue((valid[0, 0][inside] == 1).all())
            self.assertTrue((flow[0][:, valid[0, 0] == 0] == 0).all())

    def test_flow_still_leads_from_the_first_image_to_the_second(self):
        """Of a texture that moves, turned and scaled with its flow: along that, the second image shows what the first did."""
        x, y = pixels(90, 120)
        G, d = torch.tensor([[0.04, -0.06], [0.05, -0.02]]), torch.tensor([3.0, -2.0])
        flow = torch.stack([G[0, 0] * x + G[0, 1] * y + d[0], G[1, 0] * x + G[1, 1] * y + d[1]])[None]
        back = torch.linalg.inv(torch.eye(2) + G)  # to where it was
        angle, scale = 0.4, 1.3

        def first(x, y):
            return torch.sin(0.21 * x + 0.05 * y) + torch.cos(0.13 * y - 0.08 * x)

        def second(x, y):
            return first(back[0, 0] * (x - d[0]) + back[0, 1] * (y - d[1]), back[1, 0] * (x - d[0]) + back[1, 1] * (y - d[1]))

        def changed(image, x, y):
            c, s = np.cos(angle) / scale, np.sin(angle) / scale
            return image(c * x + s * y, -s * x + c * y)

        tensors = first(x, y).expand(1, 4, 90, 120)
        tensors, flow, _, valid = self.change(flow, angle, scale, tensors)
        inside = valid[0, 0] == 1
        self.assertGreater(inside.float().mean(), 0.7)
        here = changed(first, x, y)
        self.assertLess((changed(second, x + flow[0, 0], y + flow[0, 1]) - here)[inside].abs().max(), 0.01)
        self.assertGreater((changed(second, x, y) - here)[inside].abs().max(), 0.5)
        # Channels are those of the nearest pixel: within half a diagonal times the steepest slope.
        self.assertLess((tensors[0, 0] - here)[inside].abs().max(), 0.5 * 2**0.5 * (0.22 + 0.16))

    def test_a_quarter_turn_moves_every_pixel(self):
        tensors = torch.rand(2, 4, 8, 8)
        fired = (torch.rand(2, 1, 8, 8) > 0.5).float()
        turned, flow, there, valid = self.change(torch.ones(2, 2, 8, 8), np.pi / 2, 1.0, tensors, fired)
        self.assertTrue(torch.equal(turned, torch.rot90(tensors, -1, (2, 3))))
        self.assertTrue(torch.equal(there, torch.rot90(fired, -1, (2, 3))))
        self.assertTrue(torch.allclose(flow[:, 0], torch.tensor(-1.0)) and torch.allclose(flow[:, 1], torch.tensor(1.0)))
        self.assertTrue((valid == 1).all())

    def test_changes_are_a_function_of_the_seed(self):
        angle, scale = random_change(1000, 17.0, (0.9, 1.5), seed=3)
        self.assertTrue(torch.equal(angle, random_change(1000, 17.0, (0.9, 1.5), seed=3)[0]))
        self.assertFalse(torch.equal(angle, random_change(1000, 17.0, (0.9, 1.5), seed=4)[0]))
        self.assertAlmostEqual(angle.abs().max().item(), np.radians(17), delta=0.01)
        self.assertTrue(0.9 <= scale.min() < 0.91 and 1.48 < scale.max() <= 1.5)


class Network(unittest.TestCase):
    def test_any_size(self):
        for width, height, levels in ((64, 48, 4), (61, 50, 3), (240, 180, 6)):
            network = FlowNetS(width=0.05, levels=levels)
            tensors = torch.rand(2, 4, height, width)
            flows = network(tensors)
            self.assertEqual(len(flows), levels - 1)
            for level, flow in enumerate(flows):
                padded = [-(-size // 2**levels) * 2**levels // (4 * 2**level) for size in (height, width)]
                self.assertEqual(flow.shape, (2, 2, *padded))
            self.assertEqual(network.full_flow(tensors).shape, (2, 2, height, width))

    def test_its_channels_are_the_papers(self):
        """Fig. 2 and 3 of FlowNet, with 4 channels of input and without biases: weights of every layer."""
        weights = [7 * 7 * 4 * 64, 25 * 64 * 128, 25 * 128 * 256, 9 * 256 * 256, 9 * 256 * 512, 9 * 512 * 512, 9 * 512 * 512,
                   9 * 512 * 512, 9 * 512 * 1024]
        weights += [16 * 1024 * 512, 16 * 1026 * 256, 16 * 770 * 128, 16 * 386 * 64]  # up-convolutions
        weights += [9 * 2 * inputs for inputs in (1024, 1026, 770, 386, 194)] + 4 * [16 * 2 * 2]  # flow, and raising it
        network = FlowNetS()
        self.assertEqual(sum(p.numel() for name, p in network.named_parameters() if not name.endswith("bias")), sum(weights))

    def test_end_point_error(self):
        truth, flow = torch.zeros(1, 2, 2, 2), torch.zeros(1, 2, 2, 2)
        flow[0, :, 0, 0] = torch.tensor([3.0, 4.0])
        flow[0, :, 1, 1] = 100.0
        mask = torch.tensor([[[[1.0, 1.0], [0.0, 0.0]]]])
        self.assertAlmostEqual(end_point_error(flow, truth, mask).item(), 2.5)
        self.assertEqual(end_point_error(flow, truth, 0 * mask).item(), 0)

    def test_the_loss_is_that_of_every_level(self):
        truth = torch.tensor([3.0, 4.0]).view(1, 2, 1, 1).expand(1, 2, 48, 64)
        valid = torch.ones(1, 1, 48, 64)
        valid[..., :10] = 0
        sizes = [(12, 16), (6, 8), (3, 4)]
        right = [truth[..., :h, :w] for h, w in sizes]
        self.assertAlmostEqual(training_loss(right, truth * valid, valid).item(), 0, places=5)
        wrong = [0 * flow for flow in right]
        self.assertAlmostEqual(training_loss(wrong, truth * valid, valid).item(), 5 * (1 + 0.5 + 0.25), places=4)
        self.assertAlmostEqual(training_loss([right[0], wrong[1], right[2]], truth * valid, valid).item(), 2.5, places=4)
        # With borders that forward() added: they do not count.
        larger = [torch.tensor([3.0, 4.0]).view(1, 2, 1, 1).expand(1, 2, h, w).clone() for h, w in ((16, 16), (8, 8), (4, 4))]
        larger[0][..., 12:, :] = 99
        self.assertAlmostEqual(training_loss(larger, truth, torch.ones(1, 1, 48, 64)).item(), 0, places=5)


class Datasets(unittest.TestCase):
    OPTIONS = {"width": 24, "height": 16, "seed": 5}

    def loaded(self, workers, batch=3, **more):
        dataset = esim.torch.AffineFlowDataset(block=batch, **{**self.OPTIONS, **more})
        return list(torch.utils.data.DataLoader(dataset, batch, num_workers=workers))

    def test_every_sample_belongs_to_one_worker_of_one_process(self):
        for world, workers, block, count in itertools.product((1, 3), (1, 2, 5), (1, 4), (0, 7, 40)):
            seen = collections.Counter()
            for rank in range(world):
                dataset = esim.torch.AffineFlowDataset(first=100, count=count, block=block, rank=rank, world=world)
                for worker in range(workers):
                    own = list(dataset.indices(worker, workers))
                    self.assertEqual(own, sorted(own))
                    seen.update(own)
            self.assertEqual(seen, collections.Counter(range(100, 100 + count)))
        endless = esim.torch.AffineFlowDataset(block=2, rank=1, world=2).indices(1, 2)
        self.assertEqual(list(itertools.islice(endless, 4)), [6, 7, 14, 15])

    def test_batches_are_the_same_with_any_number_of_workers(self):
        alone = self.loaded(0, count=10)
        self.assertEqual([len(batch[0]) for batch in alone], [3, 3, 3, 1])
        for workers in (1, 3):
            for ours, theirs in zip(alone, self.loaded(workers, count=10), strict=True):
                for a, b in zip(ours, theirs):
                    self.assertTrue(torch.equal(a, b))
        later = self.loaded(0, first=3, count=7)
        self.assertTrue(torch.equal(later[0][0], alone[1][0]))
        self.assertFalse(torch.equal(self.loaded(0, count=3, seed=6)[0][0], alone[0][0]))

    def test_samples_are_the_sequences(self):
        tensor, target, fired = next(iter(esim.torch.AffineFlowDataset(first=2, **self.OPTIONS)))
        sequence = esim.dataset.AffineSequences(**self.OPTIONS)[2]
        np.testing.assert_array_equal(tensor, esim.event_tensor(sequence.events, 24, 16, t0=0, t1=esim.ns(sequence.duration)))
        np.testing.assert_array_equal(target, sequence.optical_flow)
        np.testing.assert_array_equal(fired[0], tensor[0] + tensor[1] > 0)
        self.assertEqual({part.dtype for part in (tensor, target, fired)}, {torch.float32})
        flow = next(iter(esim.torch.AffineFlowDataset(first=2, target="motion_field", **self.OPTIONS)))[1]
        np.testing.assert_array_equal(flow, sequence.motion_field)

    def test_what_is_refused(self):
        for options in ({"target": "depth"}, {"block": 0}, {"first": -1}, {"count": -1}, {"rank": 2, "world": 2}):
            with self.assertRaises(ValueError):
                esim.torch.AffineFlowDataset(**options)
        with self.assertRaises((esim.Error, TypeError)):
            next(iter(esim.torch.AffineFlowDataset(contrast_treshold=0.2)))

    def test_the_manuals_code_runs(self):
        blocks = re.findall(r"^```python\n(.*?)^```", (EXAMPLE.parents[1] / "docs/learning.md").read_text(), re.DOTALL | re.MULTILINE)
        self.assertEqual(len(blocks), 2)
        names = {}
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            for block in blocks:
                exec(compile(block, "docs/learning.md", "exec"), names)
        self.assertEqual(printed.getvalue(), "".join(f"torch.Size([8, {channels}, 96, 128]) " for channels in (4, 2, 1)).strip() + "\n")

    def test_the_package_does_without_pytorch(self):
        code = "import esim, sys; sys.exit('torch' in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", code]).returncode, 0)


class Stored(Temporary):
    """Datasets on disk, written by Python's own libraries in the layout of `esim dataset`."""

    SIZE, COUNT, WIDTH, HEIGHT = 3, 7, 12, 8  # sequences of a shard, all of them

    def write(self, kind, contents):
        """The sequences' arrays, and a folder that holds those named by `contents`."""
        folder = self.folder / f"{kind}-{len(contents)}"
        folder.mkdir()
        (folder / "dataset.json").write_text(json.dumps({"sequences": self.COUNT, "shard_size": self.SIZE, "format": kind,
                                                         "made_by": {"duration_s": 0.04}}))
        sequences = []
        for i in range(self.COUNT):
            random = np.random.default_rng(i)
            events = np.zeros(5 * i, esim.EVENT_DTYPE)  # the first has none
            events["t"] = np.sort(random.integers(0, 40_000_001, len(events)))
            events["x"], events["y"] = random.integers(0, self.WIDTH, len(events)), random.integers(0, self.HEIGHT, len(events))
            events["p"] = random.choice([-1, 1], len(events))
            tensor = esim.event_tensor(events, self.WIDTH, self.HEIGHT, t0=0, t1=0.04)
            optical_flow, flow = random.normal(size=(2, 2, self.HEIGHT, self.WIDTH)).astype(np.float32)
            optical_flow[:, 0, 0] = np.nan
            sequences.append({**{f"events/{name}": events[name] for name in "txyp"},
                              "tensor": tensor, "optical_flow": optical_flow, "motion_field": flow})
        for number, start in enumerate(range(0, self.COUNT, self.SIZE)):
            own = [{name: s[name] for name in contents} for s in sequences[start : start + self.SIZE]]
            path = folder / f"shard-{number:06}"
            self.write_hdf5(path, own) if kind == "hdf5" else self.write_tar(path, start, own)
        return folder, sequences

    @staticmethod
    def write_hdf5(path, sequences):
        with h5py.File(f"{path}.h5", "w") as file:
            file["index"] = np.arange(len(sequences))
            for name in sequences[0]:
                arrays = [s[name] for s in sequences]
                file[name] = np.concatenate(arrays) if "/" in name else np.stack(arrays)
            if "events/t" in sequences[0]:
                file["events/start"] = np.cumsum([0] + [len(s["events/t"]) for s in sequences])

    @staticmethod
    def write_tar(path, start, sequences):
        with tarfile.open(f"{path}.tar", "w", format=tarfile.USTAR_FORMAT) as archive:
            for i, arrays in enumerate(sequences, start):
                files = {f"{i:08}.{name.replace('/', '.')}.npy": array for name, array in arrays.items()}
                for name, array in files.items():
                    content = io.BytesIO()
                    np.save(content, array)
                    entry = tarfile.TarInfo(name)
                    entry.size = content.tell()
                    content.seek(0)
                    archive.addfile(entry, content)

    def test_samples(self):
        events = [f"events/{name}" for name in "txyp"]
        for kind, contents in itertools.product(("hdf5", "webdataset"), (["tensor", "optical_flow"], [*events, "optical_flow", "motion_field"])):
            folder, sequences = self.write(kind, contents)
            stored = esim.torch.EventTensorDataset(folder)
            self.assertEqual(len(stored), self.COUNT)
            for i in (6, 0, 3, 2, 5):
                tensor, optical_flow, fired = stored[i]
                np.testing.assert_array_equal(tensor, sequences[i]["tensor"])
                np.testing.assert_array_equal(optical_flow, np.nan_to_num(sequences[i]["optical_flow"]))
                known = np.isfinite(sequences[i]["optical_flow"][0])
                np.testing.assert_array_equal(fired[0], (sequences[i]["tensor"][:2].sum(axis=0) > 0) & known)
            with self.assertRaises(IndexError):
                stored[self.COUNT]
            loaded = list(torch.utils.data.DataLoader(stored, batch_size=4, num_workers=2))  # after it was opened here
            self.assertTrue(torch.equal(loaded[1][0][2], stored[6][0]))
            if "motion_field" in contents:
                np.testing.assert_array_equal(esim.torch.EventTensorDataset(folder, target="motion_field")[4][1], sequences[4]["motion_field"])
            else:
                with self.assertRaisesRegex(esim.Error, "has no motion_field"):
                    esim.torch.EventTensorDataset(folder, target="motion_field")[0]

    @unittest.skipUnless("ESIM_PROGRAM" in os.environ, "needs the program, as ESIM_PROGRAM")
    def test_what_the_program_writes(self):
        sequences = esim.dataset.AffineSequences(width=24, height=16, seed=3)
        for kind, contents in (("hdf5", "optical_flow"), ("webdataset", "optical_flow,tensor")):
            folder = self.folder / kind
            subprocess.run([os.environ["ESIM_PROGRAM"], "dataset", "affine", "--count", "3", "--width", "24", "--height", "16", "--seed", "3",
                            "--format", kind, "--contents", contents, "--out", folder], check=True, capture_output=True)
            stored = esim.torch.EventTensorDataset(folder)
            self.assertEqual(len(stored), 3)
            for i in range(3):
                np.testing.assert_array_equal(stored[i][0], sequences[i].tensor())
                np.testing.assert_array_equal(stored[i][1], sequences[i].optical_flow)

    def test_what_is_damaged(self):
        for kind, ending in (("hdf5", "h5"), ("webdataset", "tar")):
            folder, _ = self.write(kind, ["tensor", "optical_flow"])
            shard = folder / f"shard-000001.{ending}"
            whole = shard.read_bytes()
            for content in (b"", whole[:600], b"nonsense" * 1000, whole[: len(whole) // 2]):
                shard.write_bytes(content)
                with self.assertRaisesRegex(esim.Error, "shard-000001"):
                    stored = esim.torch.EventTensorDataset(folder)
                    for i in (3, 4, 5):
                        stored[i]
            shard.unlink()
            with self.assertRaisesRegex(esim.Error, r"shard-000001.* is missing \(1 of 3"):
                esim.torch.EventTensorDataset(folder)
            (folder / "dataset.json").write_text('{"sequences": 3}')
            with self.assertRaisesRegex(esim.Error, "dataset.json is damaged"):
                esim.torch.EventTensorDataset(folder)
        with self.assertRaisesRegex(esim.Error, "is not a dataset"):
            esim.torch.EventTensorDataset(self.folder)
        with self.assertRaises(ValueError):
            esim.torch.EventTensorDataset(self.folder, target="depth")


class Learning(Temporary):
    def settings(self, *changes):
        return read_settings(EXAMPLE / "small.yaml", [*TINY, *changes])

    def test_it_learns(self):
        """On sequences that it has not seen, the error falls to less than half of that of predicting no motion."""
        training = Training(read_settings(EXAMPLE / "small.yaml", ["workers=0", "iterations=600", "report_every=300"]))
        train(training, self.folder)
        epe, zero = training.validate()
        self.assertGreater(zero, 1.0)
        self.assertLess(epe, 0.5 * zero)
        with open(self.folder / "log.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["iteration"] for row in rows], ["0", "300", "600"])
        self.assertGreater(float(rows[0]["validation_epe_px"]), 0.8 * zero)
        self.assertAlmostEqual(float(rows[-1]["validation_epe_px"]), epe, delta=1e-3)

        predict, settings = load_predictor(self.folder / "last.pt")
        self.assertEqual(settings["simulation"]["duration"], 0.04)
        tensors, _flow, _fired = training.validation_batches[0]
        predicted = np.stack([predict(tensor.numpy()) for tensor in tensors])
        expected = training.network.full_flow(tensors).detach()
        np.testing.assert_allclose(predicted, expected, atol=1e-3)

    def test_what_is_resumed_goes_on_as_if_never_interrupted(self):
        for sequences in (0, 6):
            changes = (f"sequences={sequences}", "report_every=2", "validation=2", "halve_from=1")
            straight = Training(self.settings("iterations=4", *changes))
            folder = self.folder / str(sequences)
            (folder / "straight").mkdir(parents=True)
            (folder / "parts").mkdir()
            train(straight, folder / "straight")
            train(Training(self.settings("iterations=2", *changes)), folder / "parts")
            resumed = Training(straight.settings)
            resumed.restore(folder / "parts/last.pt")
            self.assertEqual(resumed.iteration, 2)
            train(resumed, folder / "parts")
            for (name, a), b in zip(straight.network.state_dict().items(), resumed.network.state_dict().values()):
                self.assertTrue(torch.equal(a, b), name)
            with open(folder / "parts/log.csv", newline="") as file:
                self.assertEqual([row["iteration"] for row in csv.DictReader(file)], ["0", "2", "4"])

    def test_kept_samples_hold_no_open_files(self):
        """However many sequences a training keeps: processes hand over each tensor in a file of shared memory."""
        training = Training(self.settings("simulation={width: 32, height: 24}", "workers=1", "batch=1", "sequences=60",
                                          "validation=20"))
        open_files = pathlib.Path("/proc/self/fd")
        before = len(list(open_files.iterdir()))
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        resource.setrlimit(resource.RLIMIT_NOFILE, (before + 100, hard))
        loader = training.batches()
        self.assertEqual(len(loader.dataset), 60)
        training.validate()
        self.assertLess(len(list(open_files.iterdir())), before + 20)
        expected = list(training.dataset(count=3))
        for kept, sample in zip(loader.dataset, expected):
            for a, b in zip(kept, sample):
                self.assertTrue(torch.equal(a, b))

    def test_passes_go_through_all_samples(self):
        batches = list(itertools.islice(Passes(10, 0, 4), 10))
        numbers = [number for batch in batches for number in batch]
        for turn in range(4):
            self.assertEqual(sorted(numbers[10 * turn : 10 * turn + 10]), list(range(10)))
        self.assertNotEqual(numbers[:10], numbers[10:20])
        self.assertEqual(list(itertools.islice(Passes(10, 12, 4), 7)), batches[3:])

    def test_the_rate_is_halved(self):
        training = Training(self.settings("iterations=1000", "rate=1.0", "halve_from=0.5", "halve_times=2"))
        rates = []
        for training.iteration in (0, 499, 500, 749, 750, 999):
            rates.append(training.rate())
        self.assertEqual(rates, [1, 1, 0.5, 0.5, 0.25, 0.25])

    def test_other_settings_and_damaged_checkpoints_are_refused(self):
        training = Training(self.settings())
        training.save(self.folder / "last.pt")
        with self.assertRaisesRegex(esim.Error, "trained with other settings: seed"):
            Training(self.settings("seed=9")).restore(self.folder / "last.pt")
        whole = (self.folder / "last.pt").read_bytes()
        damaged = self.folder / "damaged.pt"
        for content in (b"", whole[: len(whole) // 2], b"nonsense" * 100):
            damaged.write_bytes(content)
            with self.assertRaisesRegex(esim.Error, "damaged.pt is not a checkpoint"):
                load_checkpoint(damaged)
        torch.save([1, 2], damaged)
        with self.assertRaisesRegex(esim.Error, "is not a checkpoint of train.py"):
            load_checkpoint(damaged)
        with self.assertRaisesRegex(esim.Error, "checkpoint .*none.pt does not exist"):
            load_checkpoint(self.folder / "none.pt")

    def test_settings(self):
        self.assertEqual(self.settings("network.width=0.5")["network"]["width"], 0.5)
        self.assertEqual(self.settings("rate=1e-5")["rate"], 1e-5)
        self.assertEqual(self.settings("simulation={seed: 3}")["simulation"]["width"], 64)
        self.assertEqual(read_settings(EXAMPLE / "full.yaml")["network"]["levels"], 6)
        for change, message in (("batches=3", "unknown setting batches"), ("network.depth=3", "unknown setting depth"),
                                ("batch", "expected NAME=VALUE"), ("batch=2.5", "batch must be a whole number, not 2.5"), ("rate=fast", "rate must be a number"), ("network=3", "must be a map of these settings"),
                                ("simulation=3", "must be a map of these settings"),
                                ("network.normalise=1", "normalise must be true or false")):
            with self.assertRaisesRegex(esim.Error, message):
                self.settings(change)
        (self.folder / "bad.yaml").write_text("batch: [")
        with self.assertRaisesRegex(esim.Error, "bad.yaml is not valid YAML"):
            read_settings(self.folder / "bad.yaml")
        with self.assertRaisesRegex(esim.Error, "none.yaml: No such file"):
            read_settings(self.folder / "none.yaml")

    def test_the_programs(self):
        """train.py, resumed, and evaluate_rotation.py with its network, from the command line."""
        def run(program, *arguments):
            return subprocess.run([sys.executable, EXAMPLE / program, *arguments], capture_output=True, text=True)

        out = self.folder / "out"
        short = [EXAMPLE / "small.yaml", "--out", out, "--device", "cpu", "--threads", "1",
                 *(word for change in (*TINY, "report_every=1") for word in ("--set", change))]
        first = run("train.py", *short, "--set", "iterations=1")
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn("already has a training", run("train.py", *short).stderr)
        second = run("train.py", *short, "--set", "iterations=2", "--resume")
        self.assertEqual(second.returncode, 0, second.stderr)
        self.assertEqual(load_checkpoint(out / "last.pt")["iteration"], 2)
        self.assertEqual({path.name for path in out.iterdir()} - {"tensorboard"}, {"last.pt", "log.csv", "figure.png", "curve.png"})
        self.assertIn("unknown setting", run("train.py", *short, "--set", "nothing=1").stderr)

        dataset = self.folder / "recording"
        dataset.mkdir()
        events = esim.dataset.AffineSequences(width=64, height=48)[0].events
        esim.save_events(dataset / "events.txt", events, 64, 48)
        (dataset / "calib.txt").write_text("60 60 32 24 0 0 0 0 0\n")
        (dataset / "imu.txt").write_text("".join(f"{i / 1000} 0 0 9.8 0.1 0.2 0.3\n" for i in range(50)))
        done = run("evaluate_rotation.py", dataset, "--size", "64", "48", "--checkpoint", out / "last.pt", "--out", self.folder / "eval")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.folder / "eval/figure.png").stat().st_size > 1000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
