"""The scripts of examples/python that need no bus, and README's first lines of Python, run as they stand."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from drawn import colours


class Gallery(unittest.TestCase):
    def setUp(self):
        self.scratch = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def runs(self, script, *arguments):
        """What it prints. It has drawn a picture."""
        picture = self.scratch / "picture.png"
        before, after = arguments if arguments else ([], [])
        command = [sys.executable, "-B", f"examples/python/{script}.py", *before, picture, *after]
        ended = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertEqual(ended.stderr, "")
        self.assertGreater(colours(picture), 1, script)
        return ended.stdout

    def test_certifies_and_plots(self):
        said = self.runs("certify_and_plot")
        self.assertRegex(said, "(?s)^abstain S: .*it would be certified .*certified at its sample instants only")

    def test_declares_from_data(self):
        self.assertRegex(self.runs("declaration_from_data"), "lipschitz: {theta: {v: 0.0104")

    def test_compares_methods(self):
        said = self.runs("compare_methods")
        clear = dict(re.findall(r"(\w+, order \d): certified .*, ([\d.]+) m from", said))
        self.assertEqual(len(clear), 6, said)
        self.assertGreater(float(clear["centred, order 5"]), float(clear["paper, order 5"]))

    def test_gates_a_policys_samples(self):
        counts = re.findall(r"(\d+) samples: from (\d+) of 100", self.runs("gated_policy"))
        self.assertEqual([samples for samples, _ in counts], ["1", "16", "256"])
        certified = [int(places) for _, places in counts]
        self.assertTrue(0 < certified[0] < certified[1] <= certified[2], certified)

    def test_sums_up_a_night_of_logs(self):
        said = self.runs("night_of_logs", ["tests/data/course.lcmlog"], ["tests/data/course.yaml"])
        self.assertRegex(said, r"(?s)abstain_safety: \d+, median \d+ us.*certified: \d+.*0 withdrawals")

    def test_begins_with_the_readmes_lines(self):
        blocks = re.findall(r"```python\n(.*?)```", Path("README.md").read_text(), re.DOTALL)
        self.assertEqual(len(blocks), 1)
        ended = subprocess.run([sys.executable, "-B", "-c", blocks[0]], capture_output=True, text=True)
        self.assertEqual((ended.returncode, ended.stderr), (0, ""))
        self.assertRegex(ended.stdout, "^abstain S: at step 11 .*")


if __name__ == "__main__":
    unittest.main()
