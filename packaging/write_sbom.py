"""Prints the components of esim's packages as a CycloneDX list (JSON): what packaging/licences.txt lists, in the versions
that are installed here, and the packages of the studio's page.

    python3 packaging/write_sbom.py VERSION
"""

import datetime
import json
import os
import re
import subprocess
import sys
import uuid
from pathlib import Path

HERE = Path(__file__).parent


def debian_version(package):
    result = subprocess.run(["dpkg-query", "--show", "--showformat=${Version}", package], capture_output=True, text=True)
    return result.stdout if result.returncode == 0 else None


def built_version(name):
    """Of a library that packaging/build-libraries or requirements.txt name: NAME=VERSION."""
    for file in ("build-libraries", "requirements.txt"):
        found = re.search(rf"\b{name}==?([\w.+~-]+)", (HERE / file).read_text())
        if found:
            return found[1]
    return None


def licences(text):
    """`A|B` and `A+B` of licences.txt as an expression of SPDX."""
    return [{"expression": text.replace("|", " OR ").replace("+", " AND ")}]


def bundled_libraries():
    for line in (HERE / "licences.txt").read_text().splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        name, licence, source = line.split()
        package = source if not source.startswith("@") else None
        version = debian_version(package) if package else built_version(name)
        if version is None:
            sys.exit(f"packaging/write_sbom.py: {package or name} is not installed; run scripts/setup --with-wheel")
        kind, _, where = ("deb/debian", package, package) if package else ("generic", None, name)
        qualifier = "?distro=debian-12" if package else ""
        yield {"type": "library", "name": name, "version": version, "licenses": licences(licence),
               "bom-ref": name, "purl": f"pkg:{kind}/{where}@{version.replace('+', '%2B').replace(':', '%3A')}{qualifier}"}


def page_packages():
    """The closure of the page's dependencies in package-lock.json, without those of its development."""
    packages = json.loads((HERE.parent / "studio/package-lock.json").read_text())["packages"]
    for path, package in sorted(packages.items()):
        if not path or package.get("dev") or package.get("devOptional"):
            continue
        name = path.rpartition("node_modules/")[2]
        yield {"type": "library", "name": name, "version": package["version"], "licenses": licences(package["license"]),
               "bom-ref": f"npm:{name}", "purl": f"pkg:npm/{name.replace('@', '%40')}@{package['version']}"}


def main():
    version = sys.argv[1]
    components = sorted([*bundled_libraries(), *page_packages()], key=lambda component: component["bom-ref"])
    content = json.dumps(components, sort_keys=True)
    time = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    print(json.dumps({
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": uuid.uuid5(uuid.NAMESPACE_URL, f"esim {version} {content}").urn,
        "version": 1,
        "metadata": {
            "timestamp": time.isoformat().replace("+00:00", "Z"),
            "component": {"type": "application", "name": "esim", "version": version, "licenses": licences("MIT"), "bom-ref": "esim"},
        },
        "components": components,
        "dependencies": [{"ref": "esim", "dependsOn": [component["bom-ref"] for component in components]}],
    }, indent=1))


main()
