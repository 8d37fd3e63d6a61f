"""Reads datasets of `esim dataset` sequence by sequence. HDF5 needs h5py and the Blosc filter for HDF5."""

import json
import os
import pathlib
import tarfile

import numpy as np

from ._errors import Error

MAX_OPEN = 64  # files

# Names of arrays in datasets that older versions have written.
OLD_NAMES = {"motion_field": "flow", "optical_flow": "displacement"}


class Hdf5Shard:
    """A shard in HDF5."""

    def __init__(self, path):
        import h5py

        try:
            self._file = h5py.File(path, "r")
            self._count = len(self._file["index"])
        except (OSError, KeyError) as problem:
            raise Error(f"{path} is not a shard of a dataset, or is damaged: {problem}") from None
        self._path = path

    def __len__(self):
        return self._count

    def array(self, k, name):
        """An array of sequence k of the shard; None if it does not exist."""
        if name not in self._file:
            return None
        try:
            start = self._file.get(f"{name.split('/')[0]}/start") if "/" in name else None
            return self._file[name][k] if start is None else self._file[name][start[k] : start[k + 1]]
        except OSError as problem:
            raise Error(f"cannot read {name} of sequence {k} of {self._path}: {problem}; check that the Blosc "
                        "filter for HDF5 is available (`import hdf5plugin`)") from None


class TarShard:
    """A shard in the layout of WebDataset: files KEY.NAME.npy."""

    def __init__(self, path):
        self._path, self._places = path, {}
        try:
            with tarfile.open(path, "r:") as archive:
                for member in archive:
                    key, _, name = member.name.partition(".")
                    self._places.setdefault(key, {})[name] = member.offset_data
        except (OSError, tarfile.TarError) as problem:
            raise Error(f"{path} is not a shard of a dataset, or is damaged: {problem}") from None
        self._keys = sorted(self._places)
        self._file = open(path, "rb")

    def __len__(self):
        return len(self._keys)

    def array(self, k, name):
        """As in Hdf5Shard."""
        place = self._places[self._keys[k]].get(name.replace("/", ".") + ".npy")
        if place is None:
            return None
        self._file.seek(place)
        try:
            return np.lib.format.read_array(self._file, allow_pickle=False)
        except ValueError as problem:
            raise Error(f"{self._path}, byte {place}: {name} is damaged: {problem}") from None


class Shards:
    """All sequences of a dataset folder, in the order of their files. Can be pickled and copied to other processes.

    Parameters
    ----------
    folder : path

    Raises
    ------
    esim.Error
        If the folder is not a dataset, or the dataset is incomplete.
    """

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        try:
            plan = json.loads((self.folder / "dataset.json").read_text())
            size, count, kind = int(plan["shard_size"]), int(plan["sequences"]), plan["format"]
            self.duration_s = float(plan["made_by"]["duration_s"])
        except FileNotFoundError:
            raise Error(f"{self.folder} is not a dataset: dataset.json is missing") from None
        except (ValueError, KeyError, TypeError) as problem:
            raise Error(f"{self.folder / 'dataset.json'} is damaged: {problem!r}") from None
        self._size, self._count = size, count
        self._kind, ending = (Hdf5Shard, "h5") if kind == "hdf5" else (TarShard, "tar")
        self._paths = [self.folder / f"shard-{k:06}.{ending}" for k in range(-(-count // size))]
        missing = [path.name for path in self._paths if not path.exists()]
        if missing:
            raise Error(f"{self.folder}: {missing[0]} is missing ({len(missing)} of {len(self._paths)} files are); "
                        "continue it with the same `esim dataset` command")
        self._open, self._process = {}, None

    def __getstate__(self):
        return {**self.__dict__, "_open": {}, "_process": None}

    def __len__(self):
        return self._count

    def array(self, i, name):
        """An array of sequence i: "motion_field", "events/t", ...; None if the dataset does not contain it."""
        if not 0 <= i < self._count:
            raise IndexError(f"index must be between 0 and {self._count - 1}, not {i}")
        if self._process != os.getpid() or len(self._open) >= MAX_OPEN:  # do not share open files with other processes
            self._open, self._process = {}, os.getpid()
        number, k = divmod(i, self._size)
        if number not in self._open:
            self._open[number] = self._kind(self._paths[number])
        shard = self._open[number]
        if k >= len(shard):
            raise Error(f"{self._paths[number]} has {len(shard)} sequences, but number {k} is missing: it is damaged")
        array = shard.array(k, name)
        return shard.array(k, OLD_NAMES[name]) if array is None and name in OLD_NAMES else array
