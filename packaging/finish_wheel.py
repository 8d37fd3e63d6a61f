"""Adds the licences of the bundled libraries to a wheel that auditwheel has repaired, and packs it reproducibly.

    python packaging/finish_wheel.py WHEEL LIBRARIES TARGET-FOLDER

LIBRARIES is the folder that packaging/build-libraries has filled. Fails if licences.txt does not list a bundled library, or
lists it under a licence that is not allowed.
"""

import base64
import hashlib
import os
import re
import subprocess
import sys
import time
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
COMMON = Path("/usr/share/common-licenses")
MAX_BYTES = 60_000_000
ALLOWED = re.compile(
    r"(MIT|Apache-2\.0|BSD-[23]-Clause|Zlib|libpng-2\.0|bzip2-1\.0\.6|FTL|IJG|BSL-1\.0|LGPL-[23](\.\d)?(-or-later|-only)?|MPL-(1\.1|2\.0)|HPND)"
)


def licence_table():
    """By name of a library: its licence, and the Debian package with its text, or @ and a file in LIBRARIES."""
    table = {}
    for line in (HERE / "licences.txt").read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            name, licence, source = line.split()
            table[name] = (licence, source)
    return table


def check(name, licence):
    for part in re.split(r"\+|\|", licence):  # both apply, or either
        if not ALLOWED.fullmatch(part):
            sys.exit(f"packaging/licences.txt: {name} is under {part}, which is not allowed in the wheel")


def bundled_libraries(names):
    """Without hash and version: libfoo-1a2b3c4d.so.1.2 is libfoo."""
    found = (re.match(r"[^/]+\.libs/(lib[^/]+?)-[0-9a-f]{8}\.so", name) for name in names)
    return {match[1] for match in found if match}


def licence_text(source, libraries):
    path = libraries / source[1:] if source.startswith("@") else Path("/usr/share/doc") / source / "copyright"
    text = path.read_text(errors="replace")
    referred = sorted(set(re.findall(r"/usr/share/common-licenses/([A-Z][\w.-]*[\w])", text)))
    return text, [name for name in referred if (COMMON / name).is_file()]


def add_licences(files, info, libraries):
    table = licence_table()
    found = bundled_libraries(files)
    missing = sorted(found - set(table))
    if missing:
        sys.exit(f"packaging/licences.txt does not list {', '.join(missing)}, which the wheel contains")
    common, lines = set(), []
    for name, (licence, source) in sorted(table.items()):
        if name.startswith("lib") and name not in found:  # others are linked statically
            continue
        check(name, licence)
        text, referred = licence_text(source, libraries)
        files[f"{info}/licenses/bundled/{source.lstrip('@')}.txt"] = (text.encode(), False)
        common.update(referred)
        lines.append(f"{name:24}{licence}\n")
    for name in sorted(common):
        files[f"{info}/licenses/bundled/common/{name}.txt"] = ((COMMON / name).read_bytes(), False)
    text = (HERE / "licences-in-wheel.txt").read_text() + "\n" + "".join(lines)
    files[f"{info}/licenses/bundled/README.txt"] = (text.encode(), False)
    print(f"  {len(lines)} libraries in it, under licences that are allowed")


def digest(content):
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


def pack(files, info, target):
    stamp = time.gmtime(max(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), 315532800))[:6]
    record = "".join(f"{name},sha256={digest(content)},{len(content)}\n" for name, (content, _) in sorted(files.items()))
    files[f"{info}/RECORD"] = ((record + f"{info}/RECORD,,\n").encode(), False)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (content, executable) in sorted(files.items()):
            entry = zipfile.ZipInfo(name, stamp)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if executable else 0o100644) << 16
            archive.writestr(entry, content)


def main():
    wheel, libraries, folder = map(Path, sys.argv[1:])
    with zipfile.ZipFile(wheel) as archive:
        files = {
            entry.filename: (archive.read(entry), bool(entry.external_attr >> 16 & 0o100))
            for entry in archive.infolist()
            if not entry.is_dir()
        }
    info = next(name.partition("/")[0] for name in files if name.endswith(".dist-info/WHEEL"))
    files.pop(f"{info}/RECORD")
    add_licences(files, info, libraries)
    target = folder / wheel.name
    pack(files, info, target)
    size = target.stat().st_size
    print(f"  {target}: {size / 1e6:.1f} MB, {sum(len(content) for content, _ in files.values()) / 1e6:.0f} MB unpacked")
    if size > MAX_BYTES:
        sys.exit(f"{target} is larger than {MAX_BYTES / 1e6:.0f} MB")
    subprocess.run([sys.executable, "-m", "zipfile", "--test", target], check=True, stdout=subprocess.DEVNULL)


main()
