"""Holds the #includes of src/esim against the arrows of ARCHITECTURE.md.

Run as: architecture_test.py ROOT_OF_THE_PROJECT
"""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv[1])
SOURCE = ROOT / "src" / "esim"

# Which modules a module may include. compose alone knows every backend and format; sim knows none.
ALLOWED = {
    "core": "",
    "blender": "core",
    "geometry": "core",
    "events": "core",
    "motion": "core geometry",
    "scene": "core geometry",
    "render": "core geometry motion",
    "backends": "core geometry motion scene render",
    "reproject": "core geometry motion render",
    "sampling": "core geometry render reproject",
    "sensors": "core events geometry render",
    "record": "core events geometry",
    "represent": "core events",
    "stats": "core events record",
    "visualise": "core events record stats",
    "truth": "core events geometry motion render",
    "video": "core scene",
    "sim": "core events geometry motion render reproject sampling sensors record truth video",
    "scenario": "core geometry sampling scene sensors video",
    "compose": "core blender geometry motion scene render backends sampling sensors record truth video sim scenario",
    "dataset": "core events geometry motion scene render backends sampling sensors record represent stats visualise truth sim "
               "scenario compose",
    "studio": "core events geometry motion scene render sampling sensors record stats visualise sim scenario compose",
    "evaluate": "core events geometry motion render sampling sensors record stats sim scenario compose",
}

# Heavy libraries, and the headers of ours that may include them: private ones, which only .cpp files include.
HEAVY = re.compile(r"^(embree[34]|assimp|epoxy|opencv2|hdf5|yaml-cpp|nlohmann|boost|fmt|tbb|libav|libsw|Imf|flatbuffers|aedat4_generated|lz4|zstd|zlib)")
PRIVATE_HEADERS = {"backends/opengl/gl_program.h", "backends/opengl/gl_read_back.h", "backends/opengl/gl_scene.h",
                   "backends/opengl/gl_shaders.h", "backends/opengl/gl_shadows.h", "backends/opengl/gl_targets.h",
                   "backends/raycast/edges.h", "backends/raycast/embree.h", "backends/raycast/lights.h", "backends/raycast/packet.h", "backends/raycast/raycast_scene.h",
                   "backends/raycast/surface.h", "backends/unrealcv/client.h", "backends/unrealcv/connection.h", "backends/unrealcv/dialect.h",
                   "backends/unrealcv/engine_image.h", "backends/unrealcv/session.h", "scenario/yaml_reader.h", "scene/import/gltf_document.h",
                   "record/formats/aedat4/buffers.h", "record/formats/hdf5_detail.h",
                   "record/formats/hdf5_input.h", "record/formats/hdf5_output_driver.h", "record/formats/millisecond_index.h", "event_camera/vector_math.h",
                   "studio/endpoints/endpoints.h", "studio/json.h", "studio/router.h", "studio/scenario_check.h", "studio/schema_json.h",
                   "studio/yaml_text.h"}


def includes(path):
    return re.findall(r'^\s*#include\s+[<"]([^>"]+)[>"]', path.read_text(), re.MULTILINE)


def files(pattern):
    return sorted(path for path in SOURCE.rglob(pattern))


def module_of(path):
    return path.relative_to(SOURCE).parts[0]


class Architecture(unittest.TestCase):
    def test_every_module_is_listed(self):
        self.assertEqual({p.name for p in SOURCE.iterdir() if p.is_dir()}, set(ALLOWED))

    def test_includes_follow_the_arrows(self):
        for path in files("*.h") + files("*.cpp"):
            module = module_of(path)
            for name in includes(path):
                if not name.startswith("esim/"):
                    continue
                target = name.split("/")[1]
                self.assertTrue(target == module or target in ALLOWED[module].split(), f"{path} includes {name}")
                if module == target == "backends":
                    own = path.relative_to(SOURCE).parts[1]
                    self.assertEqual(name.split("/")[2], own, f"{path} includes another backend: {name}")

    def test_heavy_libraries_stay_out_of_public_headers(self):
        for path in files("*.h"):
            if str(path.relative_to(SOURCE)) in PRIVATE_HEADERS:
                continue
            for name in includes(path):
                self.assertIsNone(HEAVY.match(name), f"{path} includes {name}")

    def test_private_headers_stay_private(self):
        for path in files("*.h"):
            if str(path.relative_to(SOURCE)) in PRIVATE_HEADERS:
                continue
            for name in includes(path):
                self.assertNotIn(name.removeprefix("esim/"), PRIVATE_HEADERS, f"{path} includes {name}")

    def test_files_stay_readable(self):
        for path in files("*.h") + files("*.cpp"):
            self.assertLess(len(path.read_text().splitlines()), 450, f"{path} has grown too long: split it")

    def test_the_library_neither_prints_nor_exits(self):
        for path in files("*.h") + files("*.cpp"):
            found = re.search(r"std::c(out|err)|\bprintf\(|fmt::print|std::exit|\babort\(", path.read_text())
            self.assertIsNone(found, f"{path}: {found and found.group()}")

    def test_messages_of_the_library_name_no_flags(self):
        """Python's users read them too: a RemediableError lets each interface name its own way out (core/remedy.h)."""
        commands = {"blender", "dataset", "evaluate", "studio", "video"}  # that only the command line runs, or other programs
        manual = {"read.h", "schema.h"}  # kSetter, for those who name no other; help of the options, in docs/scenario.md
        for path in files("*.h") + files("*.cpp"):
            if module_of(path) in commands or path.name in manual:
                continue
            code = re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.MULTILINE)
            found = re.search(r'"(?:[^"\\\n]|\\.)*(?<![\w-])--[a-z][^"\n]*"', code)
            self.assertIsNone(found, f"{path}: {found and found.group()}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
