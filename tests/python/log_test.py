"""Recorded runs as columns: those of `forereach export`."""
import csv
import os
import shutil
import subprocess
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy as np

import forereach as fr

FOREREACH = os.environ["FOREREACH_BUILD"] + "/cli/forereach"
LOG, TASK = "tests/data/course.lcmlog", "tests/data/course.yaml"


def as_text(value):
    """As the CSV file has it."""
    if value is None or isinstance(value, float) and not np.isfinite(value):
        return ""
    if isinstance(value, list):
        return " ".join(map(as_text, value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return str(value)


class Columns(unittest.TestCase):
    def setUp(self):
        self.scratch = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_are_those_of_the_export(self):
        out = self.scratch / "tables"
        command = [FOREREACH, "export", LOG, "--config", TASK, "--format", "csv", "-o", out]
        subprocess.run(command, check=True, capture_output=True)
        log, rows = fr.Log(LOG, config=TASK), 0
        for table in ["decisions", "executions", "withdrawals", "gaps"]:
            columns = getattr(log, table)()
            with open(out / f"{table}.csv", newline="") as file:
                reader = csv.DictReader(file)
                said = list(reader)
                self.assertEqual(list(columns), reader.fieldnames, table)
            rows += len(said)
            for name, column in columns.items():
                self.assertEqual(len(column), len(said), f"{table} {name}")
                for value, row in zip(column.tolist(), said):
                    text = row[name]
                    if column.dtype.kind in "if" and text:
                        self.assertEqual(float(value), float(text), f"{table} {name}")
                    elif isinstance(value, list):
                        self.assertEqual(value, [float(each) for each in text.split()])
                    else:
                        self.assertEqual(as_text(value), text, f"{table} {name}")
        self.assertGreater(rows, 100)

    def test_have_the_types_that_pandas_takes(self):
        decisions = fr.Log(LOG, config=TASK).decisions()
        kinds = {name: column.dtype.kind for name, column in decisions.items()}
        self.assertEqual([kinds[name] for name in ["utime", "plan_id", "margin", "step", "outcome"]], list("iiffO"))
        self.assertTrue(np.isnan(decisions["step"][decisions["outcome"] == "certified"]).all())
        empty = fr.Log(LOG, config=TASK).withdrawals()
        self.assertEqual((empty["message"].dtype.kind, empty["utime"].dtype.kind), ("O", "i"))

    def test_of_executed_steps_are_a_tasks_data(self):
        steps = fr.Log(LOG, config=TASK).transitions()
        state, applied, after = (np.stack(steps[name]) for name in ["state", "input", "next_state"])
        self.assertEqual((state.shape, applied.shape, after.shape), ((74, 6), (74, 2), (74, 6)))
        one_step = np.abs(steps["duration_us"] - 100_000) < 20_000
        self.assertGreater(one_step.sum(), 60)
        text = Path(TASK).read_text()
        task = fr.Task(text, path=TASK, data=(np.hstack([state, applied])[one_step], after[one_step]))
        self.assertEqual(task.num_observations, one_step.sum())
        self.assertEqual(task.declare(by=["v,delta"])["lipschitz"].shape, (6, 8))

    def test_warn_of_what_is_damaged_and_have_the_rest(self):
        whole = len(fr.Log(LOG, config=TASK).decisions()["utime"])
        damaged = bytearray(Path(LOG).read_bytes())
        record = damaged.index(b"\xed\xa1\xda\x01", len(damaged) // 2)
        damaged[record : record + 28] = bytes(28)
        file = self.scratch / "damaged.lcmlog"
        file.write_bytes(damaged)
        with self.assertWarnsRegex(UserWarning, "damaged in 1 place"):
            rest = len(fr.Log(str(file), config=TASK).decisions()["utime"])
        self.assertTrue(0 < rest <= whole)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaises(UserWarning, fr.Log(str(file), config=TASK).decisions)

    def test_of_what_is_no_log_are_an_error(self):
        empty = self.scratch / "empty"
        empty.mkdir()
        for words, path in [("nosuch", "nosuch.lcmlog"), ("README.md", "README.md"), ("empty", str(empty))]:
            self.assertRaisesRegex(fr.Error, words, fr.Log, path)

    def test_of_a_directory_are_those_of_its_runs(self):
        one = fr.Log(LOG, config=TASK).decisions()["utime"].tolist()
        for robot in ["a", "b"]:
            (self.scratch / robot).mkdir()
            shutil.copy(LOG, self.scratch / robot)
        both = fr.Log(str(self.scratch), config=TASK).decisions()
        self.assertEqual(both["utime"].tolist(), one + one)
        self.assertEqual(len(set(both["robot"])), 2)


if __name__ == "__main__":
    unittest.main()
