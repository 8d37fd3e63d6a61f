"""Runs an interpolator in ONNX for the command `esim video --interpolator`: src/esim/video/model_process.cpp starts this
package, with the model, the width and height of the frames and their number of planes, and describes what both send."""

import socket
import struct
import sys

import numpy as np

from . import Error, onnx


def _receive(connection, size):
    """Bytes, or None at the end of the connection."""
    data = bytearray(size)
    view = memoryview(data)
    while view:
        came = connection.recv_into(view)
        if came == 0:
            return None
        view = view[came:]
    return data


def _refuse(connection, error):
    known = isinstance(error, (Error, ImportError))
    text = (str(error) if known else f"{type(error).__name__}: {error}").encode()
    connection.sendall(struct.pack("=I", len(text)) + text)


def main(path, width, height, planes):
    connection = socket.socket(fileno=0)
    shape = (planes, height, width)
    try:
        interpolator = onnx(path)
        interpolator.check_size(height, width)
    except Exception as error:
        _refuse(connection, error)
        return
    connection.sendall(struct.pack("=I", 0))
    size = 4 * planes * height * width
    while (request := _receive(connection, 8 + 2 * size)) is not None:
        (fraction,) = struct.unpack_from("=d", request)
        values = np.frombuffer(request, np.float32, offset=8).reshape(2, *shape)
        frames = [np.ascontiguousarray(f[0] if planes == 1 else np.moveaxis(f, 0, 2)) for f in values]
        try:
            image = interpolator(*frames, fraction)
        except Exception as error:
            _refuse(connection, error)
            continue
        image = image[None] if planes == 1 else np.moveaxis(image, 2, 0)
        connection.sendall(struct.pack("=I", 0) + np.ascontiguousarray(image, np.float32).tobytes())


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
