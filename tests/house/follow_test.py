"""tests/install/follow sees a page that says other than what its commands print, and says nothing of one that is right."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path


class Follow(unittest.TestCase):
    def follow(self, text, *options):
        root = Path(self.enterContext(tempfile.TemporaryDirectory()))
        for name in ("config", "examples", "tests"):
            (root / name).mkdir()
        (root / "page.md").write_text(text)
        command = [sys.executable, "tests/install/follow", root, *options, root / "page.md"]
        ended = subprocess.run(command, capture_output=True, text=True)
        return ended.returncode, ended.stdout + ended.stderr, (root / "page.md").read_text()

    def block(self, text):
        return self.follow(f"```console\n{text}```\n")[0]

    def test_compares_what_is_printed(self):
        self.assertEqual(self.block("$ echo 1\n1\n$ echo warning >&2; echo 2\n2\n"), 0)
        self.assertEqual(self.block("$ echo 1\n2\n"), 1)
        self.assertEqual(self.block("$ seq 5\n1\n...\n5\n"), 0)
        self.assertEqual(self.block("$ seq 5\n1\n...\n4\n"), 1)
        self.assertEqual(self.block("$ echo took 7.1e-3 s\ntook 12 s\n"), 0)
        self.assertEqual(self.block("$ echo took 7 m\ntook 12 m\n"), 1)

    def test_a_command_without_output_could_do_it(self):
        self.assertEqual(self.block("$ (exit 1)\n$ echo 1\n"), 0)
        self.assertEqual(self.block("$ (exit 2)\n"), 1)
        self.assertEqual(self.block("$ no_such_program\n"), 1)

    def test_files_of_the_page_are_there_and_a_page_without_commands_is_none(self):
        self.assertEqual(self.follow("<!-- a.txt -->\n```text\nword\n```\n```console\n$ cat \\\n  a.txt\nword\n```\n")[0], 0)
        self.assertEqual(self.follow("```text\n$ echo\n```\n")[0], 1)

    def test_writes_what_is_printed(self):
        self.assertEqual(self.follow("```console\n$ echo 1\n2\n```\n", "--write")[2], "```console\n$ echo 1\n1\n```\n")


if __name__ == "__main__":
    unittest.main()
