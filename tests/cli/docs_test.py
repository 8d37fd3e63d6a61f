"""The documentation as its readers meet it: its examples run, its options exist, its links lead somewhere.

Run as: docs_test.py ESIM_PROGRAM PROJECT_FOLDER [SITE [TEST ...]], with the standard library of Python alone. SITE is the folder of a site
that scripts/docs has built. The blocks of Python are run by python/tests/test_docs.py. See pages.py.
"""

import html.parser
import pathlib
import re
import sys
import tempfile
import unittest
import urllib.parse

from pages import NEVER_RUN, RUN, Examples, blocks, make_recording, pages
from program import ESIM, ProgramTest, run

PROJECT = pathlib.Path(sys.argv[2]).absolute()
sys.path.insert(0, str(PROJECT / "docs/site"))
import hooks  # noqa: E402

SITE = pathlib.Path(sys.argv[3]).absolute() if len(sys.argv) > 3 else None
MIGRATING = ["docs/migrating.md", "docs/migrating-rpg-esim.md", "docs/migrating-video.md"]  # pages with tables of options
INSTALL = "docs/install.md"  # scripts/wheel runs its commands, in bare systems


def anchors(page):
    """The anchors of its headings, as GitHub names them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)).strip().lower().replace(" ", "-") for heading in headings}


def option_in(token):
    """The key and the value that `--set key=value` or `path.to.key=value` name, if it is one."""
    setting = re.fullmatch(r"--set ([a-z_]+)(?:=(.*))?|((?!.*\.(?:csv|txt|mp4|conf)$)[a-z_]+(?:\.[a-z_]+)+)(?:=(.*))?", token)
    return (setting[1] or setting[3], setting[2] or setting[4]) if setting else (None, None)


class Blocks(ProgramTest):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory(prefix="esim_docs_")
        cls.addClassCleanup(scratch.cleanup)
        cls.recording = pathlib.Path(scratch.name, "recording")
        make_recording(ESIM, cls.recording)

    def test_what_does_not_run_says_why(self):
        for page in pages():
            for block in blocks(page):
                if page != INSTALL and block.language in NEVER_RUN:
                    self.assertTrue(block.reason, f"{page}:{block.line}: a block of {block.language} needs <!-- not run: REASON --> above it")
                self.assertIn(block.language, RUN | NEVER_RUN | {"", "text", "bibtex", "yaml-options"}, f"{page}:{block.line}")

    def test_the_files_that_getting_started_names_are_made(self):
        page = "docs/getting-started.md"
        Examples(page, ESIM, self.folder, self.recording).run()
        for path in re.findall(r"`(out/[\w./]+\.\w+)`", (PROJECT / page).read_text()):
            self.assertTrue((self.folder / path).exists(), f"{page} names {path}, which no command makes")


def add_page(page):
    """Adds the test of one page."""

    def test(self):
        Examples(page, ESIM, self.folder, self.recording).run()

    setattr(Blocks, f"test_{re.sub('[^a-z]', '_', page)}", test)


for name in pages():
    if name != "docs/getting-started.md" and any(block.language in ("sh", "yaml") and not block.reason for block in blocks(name)):
        add_page(name)


class Options(unittest.TestCase):
    def test_every_option_that_migrating_names_exists(self):
        """Second columns of its tables: `--flags` of the commands, and the last part of every `key.of.a.scenario`."""
        flags = set(re.findall(r"--[a-z-]+", "".join(run(command, "--help").stdout for command in ("simulate", "video"))))
        options = run("options").stdout
        names = set(re.findall(r"^ *(\w+):", options, re.MULTILINE))
        values = set(re.findall(r"[\w.-]+", options))
        lines = [line for page in MIGRATING for line in (PROJECT / page).read_text().splitlines()]
        rows = [line.split(" | ") for line in lines if line.startswith("| ")]
        found = 0
        for row in rows:
            for token in re.findall(r"`([^`]+)`", row[1]):
                for flag in re.findall(r"--[a-z-]+", token):
                    self.assertIn(flag, flags, row)
                    found += 1
                key, value = option_in(token)
                if key:
                    self.assertIn(key.split(".")[-1], names, row)
                    self.assertTrue(not value or value in values, row)
                    found += 1
        self.assertGreater(found, 90, "the tables are not read as they should be")


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        for page in [*PROJECT.glob("*.md"), *(PROJECT / "docs").rglob("*.md"), PROJECT / "studio/README.md"]:
            text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
            for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", text):
                if "://" not in target:
                    path = page.parent / target if target else page
                    self.assertTrue(path.exists(), f"{page.relative_to(PROJECT)} links to {target}")
                    if anchor:
                        self.assertIn(anchor, anchors(path), f"{page.relative_to(PROJECT)} links to {target}#{anchor}")

    def test_the_readme_lists_every_page(self):
        listed = set(re.findall(r"\]\((docs/[\w/-]+\.md)\)", (PROJECT / "README.md").read_text()))
        self.assertEqual({str(page.relative_to(PROJECT)) for page in (PROJECT / "docs").rglob("*.md")}, listed)


class Navigation(unittest.TestCase):
    """Of the site: docs/site/hooks.py."""

    def test_it_has_every_page_that_the_readme_lists(self):
        readme = (PROJECT / "README.md").read_text()
        found = re.findall(r"[\w/-]+\.md", str(hooks.navigation(readme)))
        self.assertLessEqual(set(re.findall(r"\]\((docs/[\w/-]+\.md)\)", readme)), set(found))
        self.assertEqual(len(found), len(set(found)))

    def test_every_option_has_an_anchor(self):
        listing = run("options").stdout
        table = hooks.option_tables(listing)
        self.assertEqual(table.count("<tr"), len(listing.splitlines()))
        for anchor in ("duration_s", "renderer.mesh.engine", "cameras.event_camera.contrast_threshold"):
            self.assertIn(f'<tr id="{anchor}">', table)


class Page(html.parser.HTMLParser):
    """Of a page of the site: its anchors, its links, and what browsers load with it."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.links, self.loaded = {"", "__comments"}, set(), set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.anchors |= {attributes.get("id"), attributes.get("name")}
        if tag in ("a", "area"):
            self.links.add(attributes.get("href") or "")
        self.loaded |= {attributes[name] for name in ("src", "poster", "data") if attributes.get(name)}
        if tag == "link" and attributes.get("rel") not in ("canonical", "next", "prev"):
            self.loaded.add(attributes.get("href") or "")


@unittest.skipUnless(SITE, "needs a site: scripts/docs --check")
class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pages = {path: Page(path) for path in SITE.rglob("*.html")}

    def test_every_link_leads_somewhere(self):
        wrong = set()
        of_doxygen = "#nested-classes"  # its links to private classes, which it does not show
        for path, page in self.pages.items():
            for link in (page.links | page.loaded) - {of_doxygen}:
                target = urllib.parse.urlsplit(link)
                if target.scheme or target.netloc:
                    continue
                file = (path.parent / urllib.parse.unquote(target.path)).resolve() if target.path else path
                anchor = urllib.parse.unquote(target.fragment)
                if not file.exists() or (file in self.pages and anchor not in self.pages[file].anchors):
                    wrong.add(f"{path.relative_to(SITE)} links to {link}")
        self.assertEqual(sorted(wrong), [])

    def test_the_references_have_every_command_and_every_python_name(self):
        package = (PROJECT / "python/esim/__init__.py").read_text().split("__all__ = [")[1]
        names = {f"esim.{name}" for name in re.findall(r'"(\w+)"', package)} - {"esim.__version__"}
        self.assertLessEqual(names, self.pages[SITE / "reference/python.html"].anchors)
        commands = re.findall(r"^  (\w+) ", run("--help").stdout.split("Subcommands:\n")[1].split("\n\n")[0], re.MULTILINE)
        self.assertLessEqual({f"esim-{name}" for name in commands}, self.pages[SITE / "reference/commands.html"].anchors)

    def test_nothing_is_loaded_from_another_host(self):
        loaded = {link for page in self.pages.values() for link in page.loaded}
        for sheet in SITE.rglob("*.css"):
            loaded |= set(re.findall(r"""(?:@import\s*|url\()["']?([^"')]+)""", sheet.read_text()))
        self.assertGreater(len(loaded), 10)
        self.assertEqual({link for link in loaded if re.match(r"(https?:)?//", link)}, set())


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=1)
