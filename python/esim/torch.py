"""Datasets for PyTorch: `import esim.torch`. The rest of the package does not need PyTorch.

Samples are tuples of float32 tensors:

- input, (4, height, width): `esim.event_tensor`, counts of ON and OFF events and their latest times from 0 to 1;
- target, (2, height, width): to the right, and downwards; optical flow in px over the window (optical_flow), or motion
  field in px/s (motion_field);
- fired, (1, height, width): 1 for pixels with at least one event and a known target, otherwise 0; unknown targets are
  0.
"""

import itertools

import numpy as np
import torch
import torch.distributed
import torch.utils.data

from ._errors import Error
from ._renamed import present_name
from ._represent import event_tensor
from ._shards import Shards
from ._types import EVENT_DTYPE
from .dataset import AffineSequences

TARGETS = ("optical_flow", "motion_field")
OLD_TARGETS = {"displacement": "optical_flow", "flow": "motion_field"}


def to_sample(tensor, target):
    """Converts arrays (4, height, width) and (2, height, width) to a sample."""
    tensor, target = np.array(tensor, np.float32), np.array(target, np.float32)
    known = np.isfinite(target).all(axis=0)
    target[:, ~known] = 0
    fired = ((tensor[0] + tensor[1] > 0) & known).astype(np.float32)[None]
    return torch.from_numpy(tensor), torch.from_numpy(target), torch.from_numpy(fired)


class AffineFlowDataset(torch.utils.data.IterableDataset):
    """Events of random affine motions with optical flow, simulated on demand. Only the images are read from disk.

    Sample i depends only on i and on the options, including the seed. Samples come in order, in blocks of `block`
    consecutive samples. In a distributed training, process r of R takes the blocks r, r + R, ..., and of these, worker w
    of W of its DataLoader takes w, w + W, .... If `block` is the batch size, batches and their order do not depend on
    the number of workers.

    Parameters
    ----------
    images : path, optional
        A folder. Default: generated dead-leaves textures.
    seed : int
    first, count : int
        Samples are first, ..., first + count - 1, in all processes together; without count they are endless. To continue
        an interrupted training, set first to the number of samples that it has used.
    block : int
        The batch size.
    target : {"optical_flow", "motion_field"}
    rank, world : int, optional
        Rank of this process and number of processes. Default: from torch.distributed if initialised, otherwise 0 of 1.
    **options
        Options of `esim.dataset.AffineSequences`: width, height, duration, contrast_threshold, ....
    """

    def __init__(self, images=None, *, seed=1, first=0, count=None, block=1, target="optical_flow", rank=None, world=None,
                 **options):
        target = present_name(target, OLD_TARGETS)
        if target not in TARGETS:
            raise ValueError(f"target must be one of {TARGETS}, not {target!r}")
        if block < 1 or first < 0 or (count is not None and count < 0):
            raise ValueError("block must be at least 1, first and count at least 0")
        distributed = torch.distributed.is_available() and torch.distributed.is_initialized()
        self.rank = (torch.distributed.get_rank() if distributed else 0) if rank is None else rank
        self.world = (torch.distributed.get_world_size() if distributed else 1) if world is None else world
        if not 0 <= self.rank < self.world:
            raise ValueError(f"rank must be between 0 and {self.world - 1}, not {self.rank}")
        self.first, self.count, self.block, self.target = first, count, block, target
        self.options = {"images": images, "seed": seed, **options}

    def indices(self, worker=0, workers=1):
        """The indices of the samples of a worker, in order."""
        share, shares = self.rank + self.world * worker, self.world * workers
        for start in itertools.count(share * self.block, shares * self.block):
            for i in range(start, start + self.block):
                if self.count is not None and i >= self.count:
                    return
                yield self.first + i

    def __iter__(self):
        sequences = AffineSequences(**self.options)  # each worker's own
        worker = torch.utils.data.get_worker_info()
        for i in self.indices(worker.id, worker.num_workers) if worker else self.indices():
            sequence = sequences[i]
            yield to_sample(sequence.tensor(), getattr(sequence, self.target))


class EventTensorDataset(torch.utils.data.Dataset):
    """Samples of a dataset that `esim dataset` has written, in HDF5 or WebDataset tar files, by index.

    Parameters
    ----------
    folder : path
    target : {"optical_flow", "motion_field"}

    Raises
    ------
    esim.Error
        If the folder is not a dataset, or if the dataset is incomplete, damaged, or lacks the target.
    """

    def __init__(self, folder, *, target="optical_flow"):
        target = present_name(target, OLD_TARGETS)
        if target not in TARGETS:
            raise ValueError(f"target must be one of {TARGETS}, not {target!r}")
        self.shards, self.target = Shards(folder), target

    def __len__(self):
        return len(self.shards)

    def __getitem__(self, i):
        """Returns sample i; computes its event tensor from the events if the dataset does not contain it."""
        target = self.shards.array(i, self.target)
        if target is None:
            raise Error(f"{self.shards.folder} has no {self.target}; make it with `esim dataset --contents {self.target}`")
        tensor = self.shards.array(i, "tensor")
        if tensor is None:
            columns = {name: self.shards.array(i, f"events/{name}") for name in "txyp"}
            events = np.zeros(len(columns["t"]), EVENT_DTYPE)
            for name, column in columns.items():
                events[name] = column
            height, width = target.shape[1:]
            tensor = event_tensor(events, width, height, t0=0, t1=self.shards.duration_s)
        return to_sample(tensor, target)
