"""Tests the rules of architecture_rules.py: a small project that follows them has no problem, and each way of breaking a
rule is reported by that rule."""

import pathlib
import tempfile
import unittest

import architecture_rules as rules

ARCHITECTURE = """\
Highway is the exception (`scene/texture.h`), because texture lookups must be inlined.

| folder of `src/esim/` | content | includes |
|---|---|---|
| `core` | images |  |
| `scene` | scenes | core |
| `backends` | renderers | core scene |
| `studio` | the server | scene |

| folder of `studio/src/` | content | imports |
|---|---|---|
| `ui` | elements |  |
| `api` | requests | ui |

Text after the table.
"""

FILES = {
    "ARCHITECTURE.md": ARCHITECTURE,
    "src/esim/CMakeLists.txt": "esim_module(core PRIVATE TBB::tbb)\n"
                               "esim_module(scene UNITY DEPENDS core\n  PUBLIC Eigen3::Eigen PRIVATE nlohmann_json::nlohmann_json)\n"
                               "esim_module(backends/plane DEPENDS core)\nesim_module(backends/mesh DEPENDS scene)\n"
                               "esim_module(studio DEPENDS scene)\n",
    "src/esim/core/image.h": "#include <sys/stat.h>\n#include <vector>\nnamespace esim::inline core {\n}\n\n"
                             "namespace esim {\n\ntemplate <>\ninline int kNames<int>;\n}\n",
    "src/esim/core/vectors.h": "#include <hwy/highway.h>\n// Private to .cpp files: includes hwy/highway.h.\n"
                               "namespace esim::inline core {\n}\n",
    "src/esim/core/parallel.cpp": "#include <tbb/parallel_for.h>\nnamespace esim::inline core {\n}\n",
    "src/esim/scene/scene.h": '#include <Eigen/Core>\n#include "esim/core/image.h"\nnamespace esim::inline scene {\n}\n',
    "src/esim/scene/texture.h": "#include <hwy/highway.h>\nnamespace esim::inline scene {\n}\n",
    "src/esim/scene/gltf.h": "#include <nlohmann/json.hpp>\n// Private to scene: includes nlohmann/json.hpp.\n"
                             "namespace esim::inline scene {\n}\n",
    "src/esim/scene/scene.cpp": '#include "esim/scene/gltf.h"\n#include "esim/core/vectors.h"\n'
                                "namespace esim::inline scene {\n}\n",
    "src/esim/backends/plane/plane.cpp": '#include "esim/core/image.h"\nnamespace esim::inline backends::inline plane {\n}\n',
    "src/esim/backends/mesh/mesh.h": "// Private to backends/mesh.\nnamespace esim::inline backends::inline mesh::detail {\n}\n",
    "src/esim/backends/mesh/mesh.cpp": '#include "esim/backends/mesh/mesh.h"\n#include "esim/scene/scene.h"\n'
                                       "namespace esim::inline backends::inline mesh {\n}\n",
    "src/esim/studio/studio.cpp": '#include "esim/scene/scene.h"\nnamespace esim::studio {\n}\n',
    "apps/esim/main.cpp": "int main() {}\n",
    "apps/esim/run.cpp": "#include <CLI/CLI.hpp>\nnamespace esim::app {\n}\n",
    "python/src/module.cpp": "#include <nanobind/nanobind.h>\nNB_MODULE(_esim, m) {}\n",
    "python/src/arrays.cpp": "namespace esim::python {\n}\n",
    "tests/scene/gltf_test.cpp": '#include "esim/scene/gltf.h"\n',
    "studio/src/main.ts": 'import { get } from "./api/http.ts";\n',
    "studio/src/ui/dom.ts": "export const h = 1;\n",
    "studio/src/api/http.ts": 'import { h } from "../ui/dom.ts";\n',
}

# (rule, file, text in it or None for a new file, what replaces it, part of the problem)
VIOLATIONS = [
    (rules.folders_are_listed, "src/esim/walk/walk.cpp", None, "namespace esim::inline walk {\n}\n", "does not list"),
    (rules.folders_are_listed, "ARCHITECTURE.md", "| `scene` |", "| `walk` | x |  |\n| `scene` |", "does not exist"),
    (rules.includes_are_listed, "src/esim/core/image.h", "<vector>", '<vector>\n#include "esim/scene/scene.h"',
     "does not list scene for core"),
    (rules.includes_are_listed, "src/esim/studio/studio.cpp", "scene/scene.h", "core/image.h", "does not list core for studio"),
    (rules.includes_are_listed, "src/esim/backends/mesh/mesh.cpp", "esim/scene/scene.h", "esim/core/image.h",
     "lists scene for backends, but none"),
    (rules.includes_are_listed, "src/esim/backends/plane/plane.cpp", "esim/core/image.h", "esim/backends/mesh/mesh.h",
     "another renderer"),
    (rules.dependencies_have_an_order, "ARCHITECTURE.md", "| images |  |", "| images | scene |", "not above it"),
    (rules.cmake_matches_the_table, "src/esim/CMakeLists.txt", "studio DEPENDS scene", "studio DEPENDS scene core",
     "studio links to core"),
    (rules.cmake_matches_the_table, "src/esim/CMakeLists.txt", "mesh DEPENDS scene", "mesh DEPENDS core",
     "backends does not link to scene"),
    (rules.libraries_are_linked, "src/esim/scene/scene.cpp", "namespace", "#include <zip.h>\nnamespace",
     "includes a header of LibZip::zip, to which"),
    (rules.libraries_are_linked, "src/esim/scene/gltf.h", "<nlohmann/json.hpp>", "<tbb/task_arena.h>", "links scene to nlohmann"),
    (rules.libraries_are_linked, "src/esim/core/parallel.cpp", "<tbb/parallel_for.h>", "<vector>", "links core to TBB::tbb"),
    (rules.libraries_are_linked, "src/esim/scene/scene.cpp", "namespace", "#include <new_library.h>\nnamespace", "must list"),
    (rules.libraries_are_linked, "apps/esim/run.cpp", "CLI/CLI.hpp", "hdf5.h", "only src/esim uses HDF5::HDF5"),
    (rules.libraries_are_linked, "python/src/module.cpp", "nanobind/nanobind.h", "CLI/CLI.hpp", "only src/esim uses CLI11::CLI11"),
    (rules.public_headers_are_light, "src/esim/scene/gltf.h", "// Private to scene:", "//", "includes nlohmann/json.hpp"),
    (rules.public_headers_are_light, "src/esim/scene/scene.h", "<Eigen/Core>", "<zip.h>", "includes zip.h"),
    (rules.public_headers_are_light, "src/esim/scene/scene.h", "<Eigen/Core>", "<hwy/highway.h>", "includes hwy/highway.h"),
    (rules.public_headers_are_light, "ARCHITECTURE.md", "`scene/texture.h`", "`scene/gone.h`", "gone.h does not exist"),
    (rules.private_headers_stay_private, "src/esim/scene/scene.h", "<Eigen/Core>", '"esim/scene/gltf.h"', "a public header"),
    (rules.private_headers_stay_private, "src/esim/scene/scene.h", "<Eigen/Core>", '"esim/core/vectors.h"', "a public header"),
    (rules.private_headers_stay_private, "src/esim/studio/studio.cpp", "scene/scene.h", "scene/gltf.h", "private to scene"),
    (rules.private_headers_stay_private, "src/esim/backends/plane/plane.cpp", "esim/core/image.h",
     "esim/backends/mesh/mesh.h", "private to backends/mesh"),
    (rules.private_headers_stay_private, "apps/esim/run.cpp", "namespace", '#include "esim/scene/gltf.h"\nnamespace',
     "private to scene"),
    (rules.private_headers_stay_private, "tests/studio/studio_test.cpp", None, '#include "esim/scene/gltf.h"\n',
     "private to scene"),
    (rules.private_headers_stay_private, "src/esim/scene/gltf.h", "Private to scene", "Private to the scene", "on a line"),
    (rules.private_headers_stay_private, "src/esim/scene/gltf.h", "Private to scene", "Private to core", "in which it is not"),
    (rules.namespaces_match_folders, "src/esim/scene/scene.cpp", "inline scene", "inline core", "esim::inline scene"),
    (rules.namespaces_match_folders, "src/esim/scene/scene.cpp", "inline scene", "scene", "esim::inline scene"),
    (rules.namespaces_match_folders, "src/esim/scene/scene.cpp", "inline scene", "inline scenery", "esim::inline scene"),
    (rules.namespaces_match_folders, "src/esim/scene/scene.cpp", "namespace esim::inline scene {", "", "must be in"),
    (rules.namespaces_match_folders, "src/esim/backends/plane/plane.cpp", "::inline plane", "", "inline plane"),
    (rules.namespaces_match_folders, "src/esim/core/image.h", "template <>\n", "", "namespace esim must be"),
    (rules.namespaces_match_folders, "apps/esim/run.cpp", "::app", "", "must be esim::app"),
    (rules.namespaces_match_folders, "python/src/arrays.cpp", "::python", "", "must be esim::python"),
    (rules.files_stay_small, "src/esim/scene/long.cpp", None, "namespace esim::inline scene {\n}\n" + "\n" * 450, "452 lines"),
    (rules.the_library_neither_prints_nor_exits, "src/esim/scene/scene.cpp", "{\n", "{\nauto& out = std::cout;\n", "std::cout"),
    (rules.the_library_neither_prints_nor_exits, "src/esim/scene/scene.cpp", "{\n", "{\nstd::exit(1);\n", "std::exit"),
    (rules.messages_of_the_library_name_no_flags, "src/esim/scene/scene.cpp", "{\n", '{\nauto x = "use --force";\n', "--force"),
    (rules.input_files_are_noted, "src/esim/scene/scene.cpp", "{\n", "{\nstd::ifstream file(path);\n", "open_input"),
    (rules.input_files_are_noted, "src/esim/scene/scene.cpp", "{\n", "{\nYAML::LoadFile(path);\n", "YAML::LoadFile"),
    (rules.the_page_imports_in_order, "studio/src/ui/dom.ts", "export", 'import "../api/http.ts";\nexport', "list api for ui"),
    (rules.the_page_imports_in_order, "studio/src/ui/dom.ts", "export", 'const x = import("../api/http.ts");\nexport',
     "list api for ui"),
    (rules.the_page_imports_in_order, "studio/src/api/http.ts", 'import { h } from "../ui/dom.ts";', "", "none of its files"),
    (rules.the_page_imports_in_order, "studio/src/stage/stage.ts", None, "", "studio/src/stage"),
    (rules.the_page_imports_in_order, "ARCHITECTURE.md", "| elements |  |", "| elements | api |", "not above it"),
]


class Rules(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)

    def write(self, files):
        for name, text in files.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    def test_a_project_that_follows_the_rules_has_no_problem(self):
        self.write(FILES)
        for rule in rules.RULES:
            self.assertEqual(list(rule(self.root)), [], rule.__name__)

    def test_each_violation_is_reported(self):
        for rule, name, old, new, expected in VIOLATIONS:
            with self.subTest(rule=rule.__name__, file=name, new=new[:60]), tempfile.TemporaryDirectory() as folder:
                self.root = pathlib.Path(folder)
                if old is not None:
                    self.assertEqual(FILES[name].count(old), 1, "the violation must change one place")
                self.write({**FILES, name: new if old is None else FILES[name].replace(old, new)})
                problems = list(rule(self.root))
                self.assertTrue(any(expected in problem for problem in problems), problems)

    def test_a_folder_with_many_files_is_reported(self):
        for top in ("src/esim/core", "apps/esim", "python/esim", "src"):
            with self.subTest(top), tempfile.TemporaryDirectory() as folder:
                self.root = pathlib.Path(folder)
                present = sum(1 for name in FILES if str(pathlib.PurePath(name).parent) == top)
                self.write({**FILES, **{f"{top}/f{i}.txt": "" for i in range(rules.MAX_FILES - present)}})
                self.assertEqual(list(rules.folders_stay_small(self.root)), [])
                self.write({f"{top}/one_more.txt": ""})
                self.assertIn("23 files", "".join(rules.folders_stay_small(self.root)))

    def test_every_rule_is_tested(self):
        tested = {rule for rule, *_ in VIOLATIONS} | {rules.folders_stay_small}
        self.assertEqual(tested, set(rules.RULES))


if __name__ == "__main__":
    unittest.main()
