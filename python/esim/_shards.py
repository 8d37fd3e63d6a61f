"""Datasets as `esim dataset` writes them, read sequence by sequence. HDF5 needs h5py, and Blosc's filter for it."""

import json
import os
import pathlib
import tarfile

import numpy as np

from ._errors import Error

MOST_OPEN = 64  # files


class Hdf5Shard:
    """A shard of HDF5."""

    def __init__(self, path):
        import h5py

        try:
            self._file = h5py.File(path, "r")
            self._count = len(self._file["index"])
        except (OSError, KeyError) as problem:
            raise Error(f"{path} is no shard of a dataset, or it is damaged: {problem}") from None
        self._path = path

    def __len__(self):
        return self._count

    def array(self, k, name):
        """An array of sequence k of the shard; None where there is none of that name."""
        if name not in self._file:
            return None
        try:
            start = self._file.get(f"{name.split('/')[0]}/start") if "/" in name else None
            return self._file[name][k] if start is None else self._file[name][start[k] : start[k + 1]]
        except OSError as problem:
            raise Error(f"cannot read {name} of sequence {k} of {self._path}: {problem}; is Blosc's filter for HDF5 there "
                        "(`import hdf5plugin`)?") from None


class TarShard:
    """A shard of WebDataset's layout: files KEY.NAME.npy."""

    def __init__(self, path):
        self._path, self._places = path, {}
        try:
            with tarfile.open(path, "r:") as archive:
                for member in archive:
                    key, _, name = member.name.partition(".")
                    self._places.setdefault(key, {})[name] = member.offset_data
        except (OSError, tarfile.TarError) as problem:
            raise Error(f"{path} is no shard of a dataset, or it is damaged: {problem}") from None
        self._keys = sorted(self._places)
        self._file = open(path, "rb")

    def __len__(self):
        return len(self._keys)

    def array(self, k, name):
        """As Hdf5Shard's."""
        place = self._places[self._keys[k]].get(name.replace("/", ".") + ".npy")
        if place is None:
            return None
        self._file.seek(place)
        try:
            return np.lib.format.read_array(self._file, allow_pickle=False)
        except ValueError as problem:
            raise Error(f"{self._path}, byte {place}: {name} is damaged: {problem}") from None


class Shards:
    """All sequences of a dataset's folder, in the order of their files. May be pickled, and copied into other processes.

    Parameters
    ----------
    folder : path

    Raises
    ------
    esim.Error
        Where there is no dataset, or it is not whole.
    """

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        try:
            plan = json.loads((self.folder / "dataset.json").read_text())
            size, count, kind = int(plan["shard_size"]), int(plan["sequences"]), plan["format"]
            self.duration_s = float(plan["made_by"]["duration_s"])
        except FileNotFoundError:
            raise Error(f"there is no dataset in {self.folder}: dataset.json is missing") from None
        except (ValueError, KeyError, TypeError) as problem:
            raise Error(f"{self.folder / 'dataset.json'} is damaged: {problem!r}") from None
        self._size, self._count = size, count
        self._kind, ending = (Hdf5Shard, "h5") if kind == "hdf5" else (TarShard, "tar")
        self._paths = [self.folder / f"shard-{k:06}.{ending}" for k in range(-(-count // size))]
        missing = [path.name for path in self._paths if not path.exists()]
        if missing:
            raise Error(f"{self.folder}: {missing[0]} is missing ({len(missing)} of {len(self._paths)} files are); "
                        "`esim dataset` goes on where it was interrupted")
        self._open, self._process = {}, None

    def __getstate__(self):
        return {**self.__dict__, "_open": {}, "_process": None}

    def __len__(self):
        return self._count

    def array(self, i, name):
        """An array of sequence i: "flow", "events/t", ...; None where the dataset does not hold it."""
        if not 0 <= i < self._count:
            raise IndexError(f"sequences have numbers from 0 to {self._count - 1}, not {i}")
        if self._process != os.getpid() or len(self._open) >= MOST_OPEN:  # open files are not shared with other processes
            self._open, self._process = {}, os.getpid()
        number, k = divmod(i, self._size)
        if number not in self._open:
            self._open[number] = self._kind(self._paths[number])
        shard = self._open[number]
        if k >= len(shard):
            raise Error(f"{self._paths[number]} holds {len(shard)} sequences, and not number {k}: it is damaged")
        return shard.array(k, name)
