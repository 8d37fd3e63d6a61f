"""AEDAT 4 between esim and other programs: iniVation's dv-processing, and the independent readers aedat and faery.

Run as: aedat_interop_test.py PROGRAM

Needs the packages of requirements.txt, from PyPI; skips where they are missing.
"""

import datetime
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv[1]

try:
    import aedat
    import dv_processing as dv
    import faery
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; pip install -r tests/interop/requirements.txt")
    sys.exit(77)  # skipped, to CTest

SIZE = (346, 260)
COUNT = 20_000
IMAGE = (np.arange(SIZE[0] * SIZE[1]) % 251).astype(np.uint8).reshape(SIZE[1], SIZE[0])


def convert(*arguments):
    subprocess.run([PROGRAM, "convert", *map(str, arguments)], check=True, capture_output=True, text=True)


def write_theirs(path, compression):
    """Events, two frames and the IMU, read with dv-processing."""
    config = dv.io.MonoCameraWriter.DAVISConfig("DAVIS346_test", SIZE)
    config.compression = compression
    writer = dv.io.MonoCameraWriter(str(path), config)
    events = dv.EventStore()
    for i in range(COUNT):
        events.push_back(1_000_000 + 10 * i, i % SIZE[0], i % SIZE[1], i % 3 == 0)
    writer.writeEvents(events)
    frame = dv.Frame(1_005_000, IMAGE)
    frame.exposure = datetime.timedelta(microseconds=2000)
    writer.writeFrame(frame)
    writer.writeImu(dv.IMU(1_001_000, 20, 1, 0, -0.5, 0, 90, 0, 0, 0, 0))
    writer.writeTrigger(dv.Trigger(1_002_000, dv.TriggerType.EXTERNAL_SIGNAL_RISING_EDGE))


def read_by_dv(path):
    recording = dv.io.MonoCameraRecording(str(path))
    batches, frames, imu, triggers = [], [], [], []
    while (events := recording.getNextEventBatch()) is not None:
        batches.append(events.numpy())
    while (frame := recording.getNextFrame()) is not None:
        frames.append(frame)
    while (batch := recording.getNextImuBatch()) is not None:
        imu.extend(batch)
    while (batch := recording.getNextTriggerBatch()) is not None:
        triggers.extend((trigger.timestamp, trigger.type) for trigger in batch)
    return recording, np.concatenate(batches), frames, imu, triggers


class Aedat(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="esim_interop_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.theirs, self.ours = self.folder / "theirs.aedat4", self.folder / "ours.aedat4"

    def test_what_dv_processing_writes_comes_back_to_it_the_same(self):
        for name in ("NONE", "LZ4", "LZ4_HIGH", "ZSTD", "ZSTD_HIGH"):
            for written in ("aedat4", "aedat4-zstd"):
                with self.subTest(compression=name, written=written):
                    for path in (self.theirs, self.ours):
                        path.unlink(missing_ok=True)
                    write_theirs(self.theirs, getattr(dv.CompressionType, name))
                    convert(self.theirs, self.ours, "--format", written)
                    recording, events, frames, imu, triggers = read_by_dv(self.ours)
                    self.assertEqual(tuple(recording.getEventResolution()), SIZE)
                    self.assertEqual(tuple(recording.getFrameResolution()), SIZE)
                    self.assertEqual(recording.getCameraName(), "DAVIS346_test")
                    np.testing.assert_array_equal(events, read_by_dv(self.theirs)[1])
                    self.assertEqual([frame.timestamp for frame in frames], [1_005_000])
                    self.assertEqual(frames[0].exposure, datetime.timedelta(microseconds=2000))
                    np.testing.assert_array_equal(frames[0].image, IMAGE)
                    kinds = dv.TriggerType
                    signal = (1_002_000, kinds.EXTERNAL_SIGNAL_RISING_EDGE)
                    exposure = [(1_005_000, kinds.APS_EXPOSURE_START), (1_007_000, kinds.APS_EXPOSURE_END)]
                    self.assertEqual(triggers, [signal, *exposure])
                    self.assertEqual([m.timestamp for m in imu], [1_001_000])
                    np.testing.assert_allclose(imu[0].getAccelerations(), [9.81007, 0, -4.905035], rtol=1e-6)
                    np.testing.assert_allclose(imu[0].getAngularVelocities(), [0, np.pi / 2, 0], rtol=1e-6)

    def test_independent_readers_agree(self):
        for written in ("aedat4", "aedat4-zstd"):
            with self.subTest(written=written):
                for path in (self.theirs, self.ours):
                    path.unlink(missing_ok=True)
                write_theirs(self.theirs, dv.CompressionType.LZ4)
                convert(self.theirs, self.ours, "--format", written)
                decoder = aedat.Decoder(str(self.ours))
                kinds = {stream["type"] for stream in decoder.id_to_stream().values()}
                self.assertEqual(kinds, {"events", "frame", "imus", "triggers"})
                packets = list(decoder)
                t = np.concatenate([packet["events"]["t"] for packet in packets if "events" in packet])
                np.testing.assert_array_equal(t, 1_000_000 + 10 * np.arange(COUNT))
                frame = next(packet["frame"] for packet in packets if "frame" in packet)
                np.testing.assert_array_equal(frame["pixels"], IMAGE)
                stream = faery.events_stream_from_file(str(self.ours))
                self.assertEqual(stream.dimensions(), SIZE)
                self.assertEqual(sum(len(packet) for packet in stream), COUNT)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
