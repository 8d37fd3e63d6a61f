"""The files below a folder that programs open, by Linux's inotify, with the standard library of Python alone."""

import ctypes
import os
import pathlib
import struct

_OPEN, _OVERFLOW, _IS_FOLDER = 0x20, 0x4000, 0x40000000
_HEADER = struct.Struct("iIII")
_libc = ctypes.CDLL(None, use_errno=True)


class OpenedFiles:
    """From now on, lists which files of a folder and the folders in it are opened, by any program."""

    def __init__(self, folder):
        self._descriptor = _libc.inotify_init1(os.O_NONBLOCK)
        if self._descriptor < 0:
            raise OSError(ctypes.get_errno(), "inotify_init1")
        self._folders = {}
        for place in [folder, *(path for path in folder.rglob("*") if path.is_dir())]:
            watch = _libc.inotify_add_watch(self._descriptor, os.fsencode(place), _OPEN)
            if watch < 0:
                raise OSError(ctypes.get_errno(), "inotify_add_watch")
            self._folders[watch] = place

    def take(self):
        """The files that were opened since the beginning or the last call."""
        files = set()
        while True:
            try:
                data = os.read(self._descriptor, 1 << 16)
            except BlockingIOError:
                return files
            at = 0
            while at < len(data):
                watch, mask, _cookie, length = _HEADER.unpack_from(data, at)
                name = os.fsdecode(data[at + _HEADER.size : at + _HEADER.size + length].rstrip(b"\0"))
                at += _HEADER.size + length
                assert not mask & _OVERFLOW
                if name and not mask & _IS_FOLDER:
                    files.add(pathlib.Path(self._folders[watch], name))

    def close(self):
        os.close(self._descriptor)
