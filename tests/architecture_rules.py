"""Rules on the structure of the sources, as functions that take the project's folder and yield problems.

architecture_test.py applies them to the project, architecture_rules_test.py to small projects that break them.
"""

import re

SOURCE = "src/esim"
# Besides ours, only these may be included in public headers: the standard library, POSIX and Eigen.
LIGHT = re.compile(r"[a-z_0-9]+|(sys|netinet|arpa)/\w+\.h|(unistd|fcntl|poll|signal)\.h|Eigen/\w+")
# What any .cpp file may include besides: these are used in many folders, or need no linking.
EVERYWHERE = re.compile(LIGHT.pattern + r"|(cpuid|dlfcn|immintrin|netdb|stdio|stdlib|termios|aedat4_generated)\.h|fmt/\w+\.h|hwy/.*|Random123/.*")
# Headers of all other libraries, and the targets of CMake that folders link to for them.
LIBRARIES = {
    r"CLI/.*": "CLI11::CLI11",
    r"Imf\w+\.h": "OpenEXR::OpenEXR",
    r"assimp/.*": "assimp::assimp",
    r"boost/.*": "Boost::headers",
    r"bzlib\.h": "BZip2::BZip2",
    r"blosc\.h": "Blosc::blosc",
    r"(cairo(-ft)?|ft2build)\.h": "Cairo::Cairo",
    r"dds/.*": "ros2_dds",
    r"draco/.*": "draco::draco",
    r"embree[34]/.*": "embree",
    r"epoxy/.*": "Epoxy::epoxy",
    r"hdf5\.h": "HDF5::HDF5",
    r"isa-l/.*": "ISAL::ISAL",
    r"jpeglib\.h": "JPEG::JPEG",
    r"libavcodec/.*": "ffmpeg_avcodec",
    r"libavformat/.*": "ffmpeg_avformat",
    r"libavutil/.*": "ffmpeg_avutil",
    r"libswscale/.*": "ffmpeg_swscale",
    r"lz4\w*\.h": "LZ4::LZ4",
    r"meshoptimizer\.h": "meshoptimizer::meshoptimizer",
    r"nanobind/.*": "nanobind",
    r"nlohmann/.*": "nlohmann_json::nlohmann_json",
    r"opencv2/core\b.*": "opencv_core",
    r"opencv2/imgcodecs\b.*": "opencv_imgcodecs",
    r"opencv2/imgproc\b.*": "opencv_imgproc",
    r"opencv2/video\b.*": "opencv_video",
    r"png\.h": "PNG::PNG",
    r"sqlite3\.h": "SQLite::SQLite3",
    r"tbb/.*": "TBB::tbb",
    r"webp/.*": "WebP::webp",
    r"yaml-cpp/.*": "yaml-cpp",
    r"zip\.h": "LibZip::zip",
    r"zlib\.h": "ZLIB::ZLIB",
    r"zstd\.h": "Zstd::Zstd",
}
NOT_INCLUDED = {"opencv_core"}  # linked without an #include of its own: the other modules of OpenCV include it
MAX_FILES = 22
MAX_LINES = 450


def text_of(path):
    return path.read_text(encoding="utf-8")


def sources(folder, suffixes=(".h", ".cpp")):
    return sorted(path for path in folder.rglob("*") if path.suffix in suffixes)


def includes(path):
    return re.findall(r'^\s*#include\s+[<"]([^>"]+)[>"]', text_of(path), re.MULTILINE)


def table(root, first_column):
    """The first and the last column of the table in ARCHITECTURE.md whose first column has this title."""
    lines = iter(text_of(root / "ARCHITECTURE.md").splitlines())
    for line in lines:
        if line.startswith(f"| {first_column} |"):
            break
    next(lines, None)
    rows = {}
    for line in lines:
        if not line.startswith("|"):
            break
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        for name in re.findall(r"`(\w+)`", cells[0]):
            rows[name] = set(cells[-1].split())
    return rows


def libraries(root):
    """The folders of src/esim, each with the folders that it includes."""
    return table(root, "folder of `src/esim/`")


def folder_of(root, path):
    return path.relative_to(root / SOURCE).parts[0]


def folders_are_listed(root):
    listed = set(libraries(root))
    present = {path.name for path in (root / SOURCE).iterdir() if path.is_dir()}
    for name in sorted(present - listed):
        yield f"{SOURCE}/{name}: the table in ARCHITECTURE.md does not list this folder"
    for name in sorted(listed - present):
        yield f"ARCHITECTURE.md: the folder {name} does not exist"


def includes_are_listed(root):
    allowed = libraries(root)
    used = {name: set() for name in allowed}
    for path in sources(root / SOURCE):
        own = folder_of(root, path)
        for name in includes(path):
            if not name.startswith("esim/"):
                continue
            target = name.split("/")[1]
            if target == own:
                if own == "backends" and name.split("/")[2] != path.relative_to(root / SOURCE).parts[1]:
                    yield f"{path}: includes another renderer: {name}"
                continue
            used.setdefault(own, set()).add(target)
            if target not in allowed.get(own, ()):
                yield f"{path}: includes {name}, but ARCHITECTURE.md does not list {target} for {own}"
    for own, targets in allowed.items():
        for target in sorted(targets - used[own]):
            yield f"ARCHITECTURE.md: lists {target} for {own}, but none of its files includes it"


def dependencies_have_an_order(root):
    above = set()
    for own, targets in libraries(root).items():
        for target in sorted(targets - above):
            yield f"ARCHITECTURE.md: {own} includes {target}, which is not above it in the table"
        above.add(own)


def modules(root):
    """The modules of src/esim/CMakeLists.txt: their names with the folders and with the libraries that they link to."""
    text = text_of(root / SOURCE / "CMakeLists.txt")
    more = {}  # linked in a line of their own
    for name, external in re.findall(r"^target_link_libraries\(esim_backends_(\w+) (?:PUBLIC|PRIVATE) (.*?)\)", text, re.MULTILINE):
        more[f"backends/{name}"] = set(external.split())
    for name, arguments in re.findall(r"^ *esim_module\((\S+)(.*?)\)", text, re.MULTILINE | re.DOTALL):
        folders, external, names = set(), set(), set()
        for word in arguments.split():
            if word in ("DEPENDS", "PUBLIC", "PRIVATE"):
                names = folders if word == "DEPENDS" else external
            elif word != "UNITY":
                names.add(word)
        renderers = sorted(path.name for path in (root / SOURCE / "backends").iterdir()) if "${" in name else []
        for module in [f"backends/{renderer}" for renderer in renderers] or [name]:
            yield module, folders, external | more.get(module, set())


def cmake_matches_the_table(root):
    path = root / SOURCE / "CMakeLists.txt"
    linked = {}
    for name, folders, _ in modules(root):
        own = name.split("/")[0]
        linked.setdefault(own, set()).update("backends" if n.startswith("backends_") else n for n in folders)
    allowed = libraries(root)
    for own in sorted(set(linked) | set(allowed)):
        for name in sorted(linked.get(own, set()) - allowed.get(own, set())):
            yield f"{path}: {own} links to {name}, which ARCHITECTURE.md does not list"
        for name in sorted(allowed.get(own, set()) - linked.get(own, set())):
            yield f"{path}: {own} does not link to {name}, which ARCHITECTURE.md lists"


def external_libraries(folder):
    """The libraries whose headers are included in a folder, with one of the files that do so; for an unknown header,
    None."""
    found = {}
    for path in sources(folder):
        for name in re.findall(r"^\s*#include\s+<([^>]+)>", text_of(path), re.MULTILINE):
            libraries = [target for pattern, target in LIBRARIES.items() if re.fullmatch(pattern, name)]
            if libraries:
                found.setdefault(libraries[0], path)
            elif not EVERYWHERE.fullmatch(name):
                found[None] = f"{path}: includes {name}"
    return found


def libraries_are_linked(root):
    """Headers of all libraries are in one folder of the system, so that the compiler would not notice a missing link."""
    path = root / SOURCE / "CMakeLists.txt"
    known = set(LIBRARIES.values())
    for name, _, external in modules(root):
        included = external_libraries(root / SOURCE / name)
        if None in included:
            yield f"{included.pop(None)}, which LIBRARIES in tests/architecture_rules.py must list"
        for target in sorted(set(included) - external):
            yield f"{included[target]}: includes a header of {target}, to which {path} does not link {name}"
        for target in sorted((external & known) - set(included) - NOT_INCLUDED):
            yield f"{path}: links {name} to {target}, of which none of its files includes a header"
    for top, allowed in (("apps/esim", {"CLI11::CLI11"}), ("python/src", {"nanobind"})):
        for target, user in external_libraries(root / top).items():
            if target not in allowed:
                yield f"{user}: only src/esim uses {target or 'other libraries'}"


def private_headers(root):
    """Headers that say `// Private to FOLDER`, by the name by which they are included, with FOLDER."""
    found = {}
    for path in sources(root / SOURCE, (".h",)):
        declared = re.search(r"^// Private to (\.cpp files|[\w/]+)[.:]", text_of(path), re.MULTILINE)
        if declared:
            found[str(path.relative_to(root / "src"))] = declared[1]
    return found


def exceptions_for_heavy_headers(root):
    sentence = re.search(r"Highway is the exception \(([^)]*)\)", text_of(root / "ARCHITECTURE.md").replace("\n", " "))
    return {f"esim/{name}" for name in re.findall(r"`([^`]+)`", sentence[1])} if sentence else set()


def public_headers_are_light(root):
    private, exceptions = private_headers(root), exceptions_for_heavy_headers(root)
    for name in sorted(exceptions):
        if not (root / "src" / name).is_file():
            yield f"ARCHITECTURE.md: {name} does not exist"
    for path in sources(root / SOURCE, (".h",)):
        own = str(path.relative_to(root / "src"))
        if own in private or own in exceptions:
            continue
        for name in includes(path):
            if not name.startswith("esim/") and not LIGHT.fullmatch(name):
                yield f"{path}: a public header includes {name}; write '// Private to FOLDER' above its namespace, or move it"


def private_headers_stay_private(root):
    private = private_headers(root)
    for path in sources(root / SOURCE, (".h",)):
        own = str(path.relative_to(root / "src"))
        if "rivate to" in text_of(path) and own not in private:
            yield f"{path}: write '// Private to FOLDER.' or '// Private to .cpp files.' on a line of its own"
        folder = private.get(own, "")
        if folder and folder != ".cpp files" and not own.startswith(f"esim/{folder}/"):
            yield f"{path}: says that it is private to {folder}, in which it is not"
    for top in ("src", "apps", "python", "bench", "examples", "tests"):
        for path in sources(root / top):
            user = str(path.relative_to(root / top))
            for name in includes(path):
                folder = private.get(name)
                if folder is None:
                    continue
                if path.suffix == ".h" and top != "tests" and user not in private:
                    yield f"{path}: a public header includes {name}, which is private to {folder}"
                if folder == ".cpp files":
                    continue
                inside = f"esim/{folder}/" if top == "src" else f"{folder.split('/')[0]}/"
                if top not in ("src", "tests") or not user.startswith(inside):
                    yield f"{path}: includes {name}, which is private to {folder}"


def namespaces_match_folders(root):
    """A file of src/esim/a/b is in esim::inline a, of backends/b in esim::inline backends::inline b. Specialisations of
    templates may be in esim itself. The names of studio, app and python need their prefix."""
    for top, names in ((SOURCE, None), ("apps/esim", "esim::app"), ("python/src", "esim::python")):
        for path in sources(root / top):
            parts = path.relative_to(root / top).parts
            expected = names or f"esim::inline {parts[0]}"
            if not names and parts[0] == "backends":
                expected += f"::inline {parts[1]}"
            if not names and parts[0] == "studio":
                expected = "esim::studio"
            text = text_of(path)
            opened = re.findall(r"^namespace (esim[^{]*?) ?\{\n\n?(.*)", text, re.MULTILINE)
            if not any(name.startswith(expected) for name, _ in opened):
                if not (names and re.search(r"^(int main|NB_MODULE)", text, re.MULTILINE)):
                    yield f"{path}: must be in namespace {expected}"
            for name, first in opened:
                specialises = name == "esim" and first.startswith("template <>")
                if not re.match(re.escape(expected) + r"(::\w+)*$", name) and not specialises:
                    yield f"{path}: namespace {name} must be {expected}"


def folders_stay_small(root):
    for top in ("src", "apps", "python"):
        for folder in [root / top, *sorted(path for path in (root / top).rglob("*") if path.is_dir())]:
            if "__pycache__" in folder.parts:
                continue
            files = [path for path in folder.iterdir() if path.is_file() and path.suffix != ".pyc"]
            if len(files) > MAX_FILES:
                yield f"{folder}: has {len(files)} files, more than {MAX_FILES}; make a folder for those that belong together"


def files_stay_small(root):
    for path in sources(root / SOURCE):
        lines = len(text_of(path).splitlines())
        if lines >= MAX_LINES:
            yield f"{path}: has {lines} lines, and must have fewer than {MAX_LINES}; split it"


def the_library_neither_prints_nor_exits(root):
    for path in sources(root / SOURCE):
        found = re.search(r"std::c(out|err)|\bprintf\(|fmt::print|std::exit|\babort\(", text_of(path))
        if found:
            yield f"{path}: the library must not call {found.group()}"


def messages_of_the_library_name_no_flags(root):
    """Python's users read them too: a RemediableError lets each interface say what to do (core/remedy.h)."""
    commands = {"blender", "dataset", "evaluate", "studio"}  # only for the command line, or for other programs
    manual = {"read.h", "schema.h"}  # kSetter, for interfaces that give no other; help of options, in docs/scenario.md
    for path in sources(root / SOURCE):
        if folder_of(root, path) in commands or path.name in manual:
            continue
        code = re.sub(r"^\s*//.*$", "", text_of(path), flags=re.MULTILINE)
        found = re.search(r'"(?:[^"\\\n]|\\.)*(?<![\w-])--[a-z][^"\n]*"', code)
        if found:
            yield f"{path}: a message names a flag: {found.group()}"


def input_files_are_noted(root):
    """Reports of recordings list every file that was read: core/inputs/used_files.h."""
    readers = {"geometry", "motion", "scene", "frame_camera", "video", "scenario"}
    for path in sources(root / SOURCE):
        if folder_of(root, path) not in readers:
            continue
        for line in text_of(path).splitlines():
            found = re.search(r"std::ifstream|\bfopen\(|YAML::LoadFile", line)
            if found and "open_input(" not in line and '"/proc/' not in line:
                yield f"{path}: must open input files by open_input(), not by {found.group()}"


def the_page_imports_in_order(root):
    allowed = table(root, "folder of `studio/src/`")
    page = root / "studio" / "src"
    present = {path.name for path in page.iterdir() if path.is_dir()}
    for name in sorted(present ^ set(allowed)):
        yield f"studio/src/{name}: must be both a folder and a row of the table in ARCHITECTURE.md"
    used = {name: set() for name in allowed}
    for path in sources(page, (".ts",)):
        own = path.relative_to(page).parts[0]
        if own.endswith(".ts"):  # main.ts and shell.ts put the page together
            continue
        for name in re.findall(r'(?:\bfrom|\bimport\(?)\s*["\'](\.[^"\']+)["\']', text_of(path)):
            target = (path.parent / name).resolve().relative_to(page.resolve()).parts[0]
            if target == own:
                continue
            used.setdefault(own, set()).add(target)
            if target not in allowed.get(own, ()):
                yield f"{path}: imports {name}, but ARCHITECTURE.md does not list {target} for {own}"
    above = set()
    for own, targets in allowed.items():
        for target in sorted(targets - used[own]):
            yield f"ARCHITECTURE.md: lists {target} for {own}, but none of its files imports it"
        for target in sorted(targets - above):
            yield f"ARCHITECTURE.md: {own} imports {target}, which is not above it in the table"
        above.add(own)


RULES = [
    folders_are_listed,
    includes_are_listed,
    dependencies_have_an_order,
    cmake_matches_the_table,
    libraries_are_linked,
    public_headers_are_light,
    private_headers_stay_private,
    namespaces_match_folders,
    folders_stay_small,
    files_stay_small,
    the_library_neither_prints_nor_exits,
    messages_of_the_library_name_no_flags,
    input_files_are_noted,
    the_page_imports_in_order,
]
