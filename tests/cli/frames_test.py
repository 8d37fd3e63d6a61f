"""Frame cameras as users meet them: files, report, messages.

Run as: frames_test.py ESIM_PROGRAM SCENES_FOLDER, with the standard library of Python alone.
"""

import csv
import json
import pathlib
import struct
import sys
import unittest
import zlib

from program import ProgramTest, run

SCENES = pathlib.Path(sys.argv[2]).absolute()
FAST = ["--set", "camera.width=64", "--set", "camera.height=48", "--set", "duration_s=0.2",
        "--set", "output.preview=false"]


def read_png(path):
    """Bits per number and the rows of a PNG: numbers if it is grey, three per pixel if it is in colour."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, compressed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            channels = {0: 1, 2: 3}[colour]
        compressed += body if kind == b"IDAT" else b""
        at += length + 12
    raw, step = zlib.decompress(compressed), channels * bits // 8
    before, rows = bytes(width * step), []
    for y in range(height):
        kind, line = raw[y * (width * step + 1)], bytearray(raw[y * (width * step + 1) + 1:(y + 1) * (width * step + 1)])
        for i in range(len(line)):
            a = line[i - step] if i >= step else 0
            b, c = before[i], before[i - step] if i >= step else 0
            paeth = min((a, b, c), key=lambda v: abs(a + b - c - v))
            line[i] = (line[i] + [0, a, b, (a + b) // 2, paeth][kind]) % 256
        rows.append(struct.unpack(f">{channels * width}{'B' if bits == 8 else 'H'}", line))
        before = bytes(line)
    return bits, rows


class Frames(ProgramTest):
    def simulate(self, *arguments, scenario=SCENES / "poster.yaml"):
        result = run("simulate", scenario, "--out", self.out, "--force", *FAST, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads((self.out / "report.json").read_text())

    @property
    def place(self):
        """The files of the only camera."""
        return self.out / "cam0"

    def frames(self):
        with open(self.place / "frames.csv", newline="") as file:
            return list(csv.DictReader(file))

    def test_a_recording_holds_what_the_manual_says(self):
        report = self.simulate("--set", "frame_camera={rate_hz: 50, exposure_s: 0.004, gain: 1.5}")
        listed = self.frames()
        self.assertEqual(list(listed[0]), ["index", "t_ns", "exposure_ns", "gain", "exposure_start_ns", "bits"])
        times = [int(frame["t_ns"]) for frame in listed]
        self.assertEqual([b - a for a, b in zip(times, times[1:])], [20_000_000] * 8)
        self.assertEqual({frame["exposure_ns"] for frame in listed}, {"4000000"})
        self.assertEqual({frame["gain"] for frame in listed}, {"1.5"})
        names = sorted(p.name for p in (self.place / "frames").iterdir())
        self.assertEqual(names, [f"{i:06}.png" for i in range(9)])
        self.assertEqual(report["cameras"][0]["frames_written"], 9)
        self.assertGreater(report["wall_s_by_stage"]["frames"], 0)
        bits, rows = read_png(self.place / "frames" / "000003.png")
        self.assertEqual((bits, len(rows[0]), len(rows)), (8, 64, 48))
        self.assertGreater(len({number for row in rows for number in row}), 50, "hardly an image")

    def test_more_than_eight_bits_are_in_files_of_sixteen(self):
        self.simulate("--set", "frame_camera={bits: 8}")
        narrow = read_png(self.place / "frames" / "000002.png")[1]
        self.simulate("--set", "frame_camera={bits: 12}")
        bits, wide = read_png(self.place / "frames" / "000002.png")
        self.assertEqual(bits, 16)
        self.assertGreater(max(map(max, wide)), 1000)
        for y in range(48):
            for x in range(64):
                self.assertLessEqual(abs(wide[y][x] / 4095 - narrow[y][x] / 255), 0.51 / 255 + 0.51 / 4095)

    def test_without_one_there_are_no_frames(self):
        report = self.simulate()
        self.assertFalse((self.place / "frames").exists() or (self.place / "frames.csv").exists())
        self.assertNotIn("frames_written", report["cameras"][0])

    def test_the_same_bytes_with_any_number_of_threads_and_from_the_resolved_scenario(self):
        noisy = ["--set", "frame_camera={shot_noise: true, read_noise_e: 8, auto_exposure: {target: 0.3}}"]
        recordings = []
        for arguments in (["--threads", "1"], ["--threads", "3"], None):
            if arguments is not None:
                self.simulate(*noisy, *arguments)
            else:
                again = self.folder / "again"
                self.assertEqual(run("simulate", self.out / "scenario.yaml", "--out", again).returncode, 0)
                self.out = again
            recordings.append([p.read_bytes() for p in sorted((self.place / "frames").iterdir())] +
                              [(self.place / "frames.csv").read_bytes()])
        self.assertEqual(recordings[0], recordings[1])
        self.assertEqual(recordings[0], recordings[2])
        self.assertGreater(len({frame["exposure_ns"] for frame in self.frames()}), 1)

    def test_each_camera_has_frames_of_its_own(self):
        text = (SCENES / "poster.yaml").read_text().replace("poster/", str(SCENES / "poster") + "/")
        scenario = self.folder / "s.yaml"
        scenario.write_text("\n".join(line for line in text.splitlines() if not line.startswith("camera:")) + """
cameras:
  - {width: 32, height: 24}
  - {name: fast, width: 48, height: 32, frame_camera: {rate_hz: 100}}
  - {name: blind, width: 16, height: 16, frame_camera: null}
frame_camera: {rate_hz: 20, bits: 16}
""")
        result = run("simulate", scenario, "--out", self.out, "--set", "duration_s=0.2")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(list((self.out / "cam0" / "frames").iterdir())), 3)
        self.assertEqual(len(list((self.out / "fast" / "frames").iterdir())), 19)
        self.assertEqual(read_png(self.out / "fast" / "frames" / "000000.png")[0], 16, "shared by the cameras")
        self.assertFalse((self.out / "blind" / "frames").exists())

    def test_colour_cameras_write_colour_frames_with_any_number_of_threads(self):
        place, recordings = self.place / "frames" / "000002.png", []
        for frame_camera in ("{}", "{demosaic: false}"):
            for threads in (1, 2):
                self.simulate("--set", "camera.colour=rggb", "--set", f"frame_camera={frame_camera}",
                              "--threads", threads)
                recordings.append((read_png(place), (self.place / "events.h5").read_bytes()))
        (colours, events), again, (mosaic, same_events), _ = recordings
        self.assertEqual((colours, events), again)
        self.assertEqual(events, same_events)
        for y, row in enumerate(mosaic[1]):  # each pixel keeps what it saw
            for x, number in enumerate(row):
                self.assertEqual(colours[1][y][3 * x + x % 2 + y % 2], number)

    def test_colour_is_refused_where_it_cannot_be(self):
        colour = ["--set", "camera.colour=rggb"]
        self.assert_refused(run("check", SCENES / "sprites.yaml", *FAST, *colour), "camera cam0: colour", "luminance only")
        self.assert_refused(run("check", SCENES / "poster.yaml", *FAST, *colour, "--set", "sampling={type: keyframes}"),
                            "camera cam0: sampling: keyframes", "colour: none")
        self.assert_refused(run("check", SCENES / "poster.yaml", *FAST, "--set", "camera.colour=bayer"), "rggb")

    def test_bad_options_are_one_line_that_names_them(self):
        for options, parts in (
                ("{exposure_s: 0.05}", ("camera cam0", "frame_camera.exposure_s", "longer than the frame interval")),
                ("{exposure_s: -0.01}", ("frame_camera.exposure_s", "out of range")),
                ("{line_delay_s: 0.001}", ("frame_camera.line_delay_s", "48 rows")),
                ("{read_noise_e: -1}", ("frame_camera.read_noise_e", "out of range")),
                ("{bits: 20}", ("frame_camera.bits", "out of range")),
                ("{response: {type: log}}", ("frame_camera.response.type", "linear")),
                ("{response: {type: measured, path: none.csv}}", ("none.csv",)),
                ("{colour: bayer}", ("frame_camera.colour", "unknown key"))):
            self.assert_refused(run("check", SCENES / "poster.yaml", *FAST, "--set", f"frame_camera={options}"), *parts)
        response = self.folder / "response.csv"
        response.write_text("0,0\n1,5\n2,4\n")
        measured = f"frame_camera={{response: {{type: measured, path: {response}}}}}"
        self.assert_refused(run("check", SCENES / "poster.yaml", *FAST, "--set", measured), "response.csv:3", "monotonic")

    def test_a_camera_without_events_takes_the_same_frames(self):
        frames = ["--set", "frame_camera={rate_hz: 50}", "--set", "truth.event_points=true"]
        self.simulate(*frames)
        expected = [p.read_bytes() for p in sorted((self.place / "frames").iterdir())]
        self.assertTrue((self.place / "event_points.ply").exists())
        report = self.simulate(*frames, "--set", "camera.events=false")
        self.assertEqual([p.read_bytes() for p in sorted((self.place / "frames").iterdir())], expected)
        self.assertEqual([name for name in ("events.h5", "event_points.ply") if (self.place / name).exists()], [])
        self.assertEqual(report["cameras"][0]["events"], 0)

    def test_says_so_where_no_frame_fits(self):
        result = run("check", SCENES / "poster.yaml", "--set", "duration_s=0.02", "--set", "frame_camera={rate_hz: 30}")
        self.assertIn("no exposure fits into the simulated time, 0.02 s", result.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
