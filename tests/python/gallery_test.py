"""The page of examples/python prints and draws what it says, and README's first lines of Python run as they stand."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from drawn import colours

ROOT = Path(__file__).resolve().parents[2]


class Gallery(unittest.TestCase):
    def test_prints_and_draws_what_its_page_says(self):
        """Of the build, or of what is installed and its documents, in this folder."""
        scratch = self.enterContext(tempfile.TemporaryDirectory())
        command = [ROOT / "tests/install/follow", os.environ.get("FOREREACH_BUILD", "/usr"), "--into", scratch, "examples/python/README.md"]
        ended = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        pictures = re.findall(r"!\[.*?\]\((.*?)\)", Path("examples/python/README.md").read_text(), re.DOTALL)
        self.assertEqual(len(pictures), 5)
        for picture in pictures:
            self.assertGreater(colours(next(Path(scratch).rglob(picture))), 1, picture)

    def test_begins_with_the_readmes_lines(self):
        blocks = re.findall(r"```python\n(.*?)```", Path("README.md").read_text(), re.DOTALL)
        self.assertEqual(len(blocks), 1)
        ended = subprocess.run([sys.executable, "-B", "-c", blocks[0]], capture_output=True, text=True)
        self.assertEqual((ended.returncode, ended.stderr), (0, ""))
        self.assertRegex(ended.stdout, "^abstain S: at step 11 .*")


if __name__ == "__main__":
    unittest.main()
