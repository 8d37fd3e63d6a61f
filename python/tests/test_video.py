"""esim.video, and learned interpolators: callables, and models in ONNX that these tests build themselves."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import esim
from conftest import ROOT

PROGRAM = os.environ.get("ESIM_PROGRAM", "")
WIDTH, HEIGHT = 64, 48
FPS = 50


@pytest.fixture
def images(tmp_path):
    """A folder of frames: a smooth pattern that moves to the right by 2.5 px per frame."""
    folder = tmp_path / "images"
    folder.mkdir()
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    for i in range(4):
        picture = (127 + 60 * np.sin((x - 2.5 * i) / 3) + 60 * np.sin(y / 4)).astype(np.uint8)
        (folder / f"{i}.pgm").write_bytes(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + picture.tobytes())
    return folder


def blend(frame0, frame1, fraction):
    return (1 - fraction) * frame0 + fraction * frame1


def events_of(path):
    events = esim.load_events(path)
    return [events[name].tobytes() for name in ("t", "x", "y", "p")]  # without the padding between them


# Callables.


def test_a_callable_makes_the_images_between_frames(images, tmp_path):
    calls = []

    def interpolate(frame0, frame1, fraction):
        assert frame0.dtype == frame1.dtype == np.float32 and frame0.shape == frame1.shape == (HEIGHT, WIDTH)
        assert type(fraction) is float and 0 < fraction < 1
        calls.append((frame0[3, 5], fraction))
        return blend(frame0, frame1, fraction)

    report = esim.video(images, tmp_path / "out", interpolator=interpolate, fps=FPS)
    assert report["status"] == "complete" and report["frames"] == 4
    assert len(calls) == report["steps"] - 3, "the frames themselves are not interpolated"
    light = esim.linear_light(np.frombuffer((images / "0.pgm").read_bytes()[-WIDTH * HEIGHT :], np.uint8).reshape(HEIGHT, WIDTH))
    assert calls[0][0] == pytest.approx(light[3, 5], rel=1e-5), "frames are linear"
    fractions = [fraction for _, fraction in calls[: len(calls) // 3]]
    assert fractions == sorted(fractions) and len(fractions) >= 4
    assert report["interpolator"].endswith("interpolate")
    assert json.loads((tmp_path / "out" / "report.json").read_text()) == report


def test_the_interpolator_decides_the_events(images, tmp_path):
    def hold(frame0, frame1, fraction):
        return frame0

    esim.video(images, tmp_path / "hold.h5", interpolator=hold, fps=FPS)
    held = esim.load_events(tmp_path / "hold.h5")
    esim.video(images, tmp_path / "flow.h5", fps=FPS)
    flow = esim.load_events(tmp_path / "flow.h5")
    # If the images change only in the last step before a frame, all events are in that step.
    phase = held["t"] % 20_000_000
    assert len(held) > 1000 and ((phase == 0) | (phase > 15_000_000)).all()
    assert ((flow["t"] % 20_000_000 > 1) & (flow["t"] % 20_000_000 < 10_000_000)).sum() > len(flow) / 4


@pytest.mark.parametrize("bayer", [False, True])
def test_the_same_bytes_with_any_number_of_threads(images, tmp_path, bayer):
    files = []
    for threads in (1, 2, 5):
        out = tmp_path / f"{threads}.h5"
        esim.video(images, out, interpolator=blend, fps=FPS, threads=threads, bayer=bayer, overrides={"threshold_noise": 0.05})
        files.append(out.read_bytes())
    assert files[0] == files[1] == files[2]


def test_colour_frames(images, tmp_path):
    def swap(frame0, frame1, fraction):
        assert frame0.shape == (HEIGHT, WIDTH, 3)
        image = np.zeros_like(frame0)
        image[..., 0] = 0.8  # red
        return image

    esim.video(images, tmp_path / "out.h5", interpolator=swap, fps=FPS, bayer=True, duration_s=0.02, overrides={"contrast_threshold": 0.1})
    events = esim.load_events(tmp_path / "out.h5")
    first = events[events["t"] < 10_000_000]
    red = (first["x"] % 2 == 0) & (first["y"] % 2 == 0)
    assert (first["p"][red] == 1).mean() > 0.9 and (first["p"][~red] == -1).all()


def returns(value):
    return lambda frame0, frame1, fraction: value


def nan_at(frame0, frame1, fraction):
    image = frame0.copy()
    image[7, 9] = np.nan
    return image


@pytest.mark.parametrize(
    "interpolator, message",
    [
        (returns(np.zeros((3, 4))), r"its image must have the shape of the frames, \(48, 64\), not \(3, 4\)"),
        (returns(None), "its image must be floats"),
        (returns(np.zeros((HEIGHT, WIDTH), np.uint8)), "its image must be floats, linear intensity with 1 = white, not uint8"),
        (nan_at, r"its image must be finite and at least 0, not nan at pixel \(9, 7\)"),
        (returns(np.full((HEIGHT, WIDTH), -0.5)), r"not -0.5 at pixel \(0, 0\)"),
        (lambda a, b: a, "TypeError: .*takes 2 positional arguments"),
    ],
)
def test_bad_images_are_refused(images, tmp_path, interpolator, message):
    with pytest.raises(esim.Error, match="interpolator, for the image at 0.00[0-9]+ s between the frames at 0.0+ s and 0.020+ s: .*" + message):
        esim.video(images, tmp_path / "out", interpolator=interpolator, fps=FPS)


def test_an_exception_of_the_callable_is_the_cause_and_keeps_what_came_before(images, tmp_path):
    problem = ZeroDivisionError("no such image")
    count = 0

    def fail(frame0, frame1, fraction):
        nonlocal count
        count += 1
        if count == 15:
            raise problem
        return blend(frame0, frame1, fraction)

    with pytest.raises(esim.Error, match=r"for the image at 0.0[0-9]+ s.*ZeroDivisionError: no such image; the \d frames before.*incomplete") as raised:
        esim.video(images, tmp_path / "out", interpolator=fail, fps=FPS)
    assert raised.value.__cause__ is problem
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["status"] == "interrupted" and "no such image" in report["reason"]
    assert len(esim.load_events(tmp_path / "out")) > 100


def test_a_keyboard_interrupt_ends_the_conversion(images, tmp_path):
    def interrupt(frame0, frame1, fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        esim.video(images, tmp_path / "out", interpolator=interrupt, fps=FPS)

    lines = [f"{20_000_000 * i}, {i % 4}.pgm" for i in range(100_000)]
    (images / "images.csv").write_text("\n".join(lines))
    timer = threading.Timer(1.0, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        esim.video(images, tmp_path / "long")
    timer.join()
    assert json.loads((tmp_path / "long" / "report.json").read_text())["status"] == "interrupted"


def test_bad_arguments(images, tmp_path):
    out = tmp_path / "out"

    def refused(error, message, **arguments):
        with pytest.raises(error, match=message):
            esim.video(images, out, **{"fps": FPS, **arguments})
        assert not out.exists() and not (tmp_path / "out.incomplete").exists()

    refused(TypeError, "interpolator must be a function", interpolator="model.onnx")
    refused(esim.Error, "interpolator: must not be given if interpolation is off", interpolator=blend, interpolation=False)
    refused(esim.Error, "fps must be above 0", fps=0)
    refused(esim.Error, r"frames per second \(fps\)", fps=None)
    refused(esim.Error, "encoding must be one of", encoding="gamma")
    refused(esim.Error, "max_steps must be between 1", max_steps=0)
    refused(esim.Error, "did you mean contrast_threshold", overrides={"contrast_treshold": 1})
    refused(TypeError, "bayer must be True or False", bayer=1)
    out.mkdir()
    (out / "a").write_text("")
    with pytest.raises(esim.Error, match="exists"):
        esim.video(images, out, fps=FPS)


def test_warns_of_too_few_steps_and_of_motion_that_is_not_followed(images, tmp_path):
    with pytest.warns(esim.LossWarning, match="raise lambda_px or max_steps"):
        report = esim.video(images, tmp_path / "few", fps=FPS, max_steps=2)
    assert report["intervals_held_to_max_steps"] == 3 and report["notices"]
    random = np.random.default_rng(1)
    for i in range(4):  # frames that have nothing in common
        pixels = random.integers(0, 256, (HEIGHT, WIDTH), np.uint8)
        (images / f"{i}.pgm").write_bytes(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + pixels.tobytes())
    with pytest.warns(esim.LossWarning, match="the optical flow does not follow"):
        report = esim.video(images, tmp_path / "cuts", fps=FPS)
    assert report["changed_pixels_not_followed"] > 0.5 and report["intervals_mostly_not_followed"] == 3


def test_sRGB_interpolators_see_sRGB(images):
    light = np.float32([[0, 0.001, 0.2, 1, 4]])

    def see(frame0, frame1, fraction):
        assert frame0[0, 3] == pytest.approx(1, abs=1e-6) and frame0[0, 2] == pytest.approx(0.4845, abs=1e-4)
        return frame0

    np.testing.assert_allclose(esim.interpolators.srgb(see)(light, light, 0.5), light, rtol=1e-5)
    assert (esim.interpolators.srgb(returns(light - 1))(light, light, 0.5) >= 0).all()
    with pytest.raises(TypeError, match="must be a function"):
        esim.interpolators.srgb(None)


# Models in ONNX.

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
from onnx import TensorProto, helper  # noqa: E402


def make_model(path, *, channels=1, height="H", width="W", batch=1, time_shape=(1,), inputs=3, kind=TensorProto.FLOAT, extra=0.0):
    """A model that blends two frames by the time and adds a constant."""
    shape = [batch, channels, height, width]
    given = [
        helper.make_tensor_value_info("first", kind, shape),
        helper.make_tensor_value_info("second", kind, shape),
        helper.make_tensor_value_info("time", kind, time_shape),
    ][:inputs]
    nodes = [helper.make_node("Sub", ["second", "first"], ["difference"])]
    if inputs == 3:
        nodes += [helper.make_node("Mul", ["difference", "time"], ["part"]), helper.make_node("Add", ["first", "part"], ["between"])]
    else:
        nodes += [helper.make_node("Add", ["first", "difference"], ["between"])]
    nodes += [helper.make_node("Add", ["between", "extra"], ["image"])]
    constants = [helper.make_tensor("extra", kind, [1], [extra])]
    image = helper.make_tensor_value_info("image", kind, None)
    graph = helper.make_graph(nodes, "blend", given, [image], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, path)
    return path


def random_frames(*shape):
    random = np.random.default_rng(0)
    return random.random(shape, np.float32), random.random(shape, np.float32)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("time_shape", [(), (1,), (1, 1, 1, 1)])
@pytest.mark.parametrize("shape", [(HEIGHT, WIDTH), (33, 45), (33, 45, 3)])
def test_a_model_in_onnx(tmp_path, channels, time_shape, shape):
    path = make_model(tmp_path / "model.onnx", channels=channels, time_shape=time_shape)
    frames = random_frames(*shape)
    linear = esim.interpolators.onnx(path, encoding="linear")
    np.testing.assert_allclose(linear(*frames, 0.25), blend(*frames, 0.25), rtol=1e-5)
    # By default, models see and return sRGB.
    srgb = esim.interpolators.onnx(path)
    np.testing.assert_allclose(srgb(*frames, 0.25), esim.interpolators.srgb(blend)(*frames, 0.25), rtol=1e-4, atol=1e-6)


def test_models_that_do_not_fit_are_refused(tmp_path):
    def refused(message, **arguments):
        with pytest.raises(esim.Error, match=r"model\.onnx: .*" + message):
            esim.interpolators.onnx(make_model(tmp_path / "model.onnx", **arguments))

    refused(r"2 inputs instead of 3\. The inputs must be .*they are: first \(tensor\(float\)", inputs=2)
    refused("an input is not tensor", kind=TensorProto.DOUBLE)
    refused("do not have 1 or 3 channels", channels=2)
    refused("takes 2 frames at once", batch=2)
    refused("the fraction has more than one element", time_shape=(2,))
    interpolate = esim.interpolators.onnx(make_model(tmp_path / "model.onnx", height=HEIGHT, width=WIDTH + 2))
    with pytest.raises(esim.Error, match="takes frames that are 66 px wide, not 64 px; scale the video"):
        interpolate(*random_frames(HEIGHT, WIDTH), 0.5)
    with pytest.raises(esim.Error, match="no such file"):
        esim.interpolators.onnx(tmp_path / "none.onnx")
    (tmp_path / "broken.onnx").write_bytes(b"broken")
    with pytest.raises(esim.Error, match="broken.onnx: ONNX Runtime cannot load it"):
        esim.interpolators.onnx(tmp_path / "broken.onnx")


def test_without_onnxruntime(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(ImportError, match=r"onnxruntime is not installed; install it with `pip install onnxruntime`"):
        esim.interpolators.onnx(make_model(tmp_path / "model.onnx"))


# The command, which runs models in a process of its own.


def run_command(*arguments, cwd=None, **environment):
    environment = {**os.environ, "ESIM_PYTHON": sys.executable, **environment}
    command = [PROGRAM, "video", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=cwd)


needs_program = pytest.mark.skipif(not PROGRAM, reason="needs the program: ESIM_PROGRAM")


@needs_program
@pytest.mark.parametrize("bayer", [False, True])
def test_the_command_gives_the_same_events(images, tmp_path, bayer):
    model = make_model(tmp_path / "model.onnx", channels=3)
    flags = ["--bayer"] if bayer else []
    contents = []
    for threads in (1, 2, 5):
        out = tmp_path / f"command{threads}"
        result = run_command(images, "--fps", FPS, "--out", out, "--interpolator", model, "-j", threads, *flags)
        assert result.returncode == 0, result.stderr
        contents.append(events_of(out))
    esim.video(images, tmp_path / "package", fps=FPS, interpolator=esim.interpolators.onnx(model), bayer=bayer)
    assert contents[0] == contents[1] == contents[2] == events_of(tmp_path / "package")
    report = json.loads((tmp_path / "command1" / "report.json").read_text())
    assert report["interpolator"] == str(model)
    assert str(model) in json.dumps(report["inputs"])
    assert f"interpolator: {model}" in (tmp_path / "command1" / "video.yaml").read_text()


@needs_program
def test_the_command_refuses_what_does_not_fit(images, tmp_path):
    out = tmp_path / "out"

    def refused(message, *flags, model="model.onnx", **environment):
        result = run_command(images, "--fps", FPS, "--out", out, "--interpolator", tmp_path / model, *flags, **environment)
        assert result.returncode == 2, result.stderr
        assert message in " ".join(result.stderr.split())
        assert not out.exists() and not (tmp_path / "out.incomplete").exists()

    refused("no such file; name a model in ONNX")
    make_model(tmp_path / "model.onnx", inputs=2)
    refused("the model has 2 inputs instead of 3. The inputs must be frame 0, frame 1")
    make_model(tmp_path / "model.onnx", width=100)
    refused("takes frames that are 100 px wide, not 64 px")
    make_model(tmp_path / "model.onnx")
    refused("--no-interpolation", "--no-interpolation")
    refused("/none/python was not found; models need a Python with the package of esim (docs/install.md) and with onnxruntime", ESIM_PYTHON="/none/python")
    # A Python that has no package esim.
    refused("ended with exit status 1 before it was ready; models need a Python with the package of esim", PYTHONPATH="", PYTHONNOUSERSITE="1")
    # A package without onnxruntime.
    (tmp_path / "absent").mkdir()
    (tmp_path / "absent" / "onnxruntime.py").write_text("raise ImportError('No module', name='onnxruntime')")
    path = os.pathsep.join([str(tmp_path / "absent"), os.environ["PYTHONPATH"]])
    refused("model.onnx: onnxruntime is not installed; install it with `pip install onnxruntime`", PYTHONPATH=path)


@needs_program
def test_the_command_imports_nothing_from_the_current_folder(images, tmp_path):
    model = make_model(tmp_path / "model.onnx")
    for name in ("esim", "numpy", "socket"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file of the user')\n")
    result = run_command(images, "--fps", FPS, "--out", tmp_path / "out", "--interpolator", model, cwd=tmp_path)
    assert result.returncode == 0, result.stderr


@needs_program
def test_the_command_names_the_image_that_is_invalid(images, tmp_path):
    model = make_model(tmp_path / "model.onnx", extra=float("nan"))
    result = run_command(images, "--fps", FPS, "--out", tmp_path / "out", "--interpolator", model)
    assert result.returncode == 2
    assert "model.onnx, for the image at 0.00" in result.stderr and "pixel (0, 0) is nan" in result.stderr


def test_the_installed_command_runs_models_in_its_own_python(tmp_path):
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "esim"
    program.write_text('#!/bin/sh\necho "$ESIM_PYTHON" "$@"\n')
    program.chmod(0o755)
    shutil.copy(ROOT / "python" / "installed" / "main.py", tmp_path / "main.py")
    environment = {name: value for name, value in os.environ.items() if name != "ESIM_PYTHON"}
    command = [sys.executable, tmp_path / "main.py", "video", "clip.mp4"]
    shown = subprocess.run(command, capture_output=True, text=True, env=environment, check=True).stdout
    assert shown == f"{sys.executable} video clip.mp4\n"
    shown = subprocess.run(command, capture_output=True, text=True, env={**environment, "ESIM_PYTHON": "mine"}, check=True).stdout
    assert shown == "mine video clip.mp4\n"
