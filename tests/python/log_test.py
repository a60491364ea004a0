"""Recorded runs as columns: those of `forereach export`."""
import csv
import json
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

    def test_of_executed_steps_are_fitted_as_the_command_fits_them(self):
        text = Path("config/bicycle_text.yaml").read_text().replace("models/", f"{Path.cwd()}/config/models/")
        text = text.replace("wheelbase: 2.5", "wheelbase: 2.3").replace("data/bicycle_corridor_400.csv", "steps.csv")
        steps = fr.Log(LOG, config=TASK).transitions()
        one_step = np.abs(steps["duration_us"] / 1e6 - 0.1) < 0.05
        rows = [np.hstack([steps[name][i] for name in ["state", "input", "next_state"]]) for i in np.flatnonzero(one_step)]
        states = ["x", "y", "theta", "v", "a", "delta"]
        header = ",".join(states + ["jerk", "steer_rate"] + [f"{state}_next" for state in states])
        np.savetxt(self.scratch / "steps.csv", rows, "%.17g", ",", header=header, comments="")
        (self.scratch / "task.yaml").write_text(text)
        command = [FOREREACH, "fit", "--json", "--config", self.scratch / "task.yaml"]
        said = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
        task = fr.Task(text, path=str(self.scratch / "task.yaml"), data=(np.zeros((1, 8)), np.zeros((1, 6))))
        for log in [fr.Log(LOG, config=TASK), LOG, Path(LOG)]:
            fit = task.fit(log)
            self.assertEqual(fit["parameters"], {each["name"]: each["after"] for each in said["parameters"]})
            self.assertEqual(len(fit["after"]), len(rows))
        self.assertGreater(len(rows), 60)
        self.assertNotEqual(fit["parameters"]["wheelbase"], 2.3)
        self.assertEqual(task.num_observations, 1)
        self.assertEqual(task.fit(LOG, ["wheelbase"])["parameters"], fit["parameters"])
        other = fr.Task("".join(text).replace("dt: 0.1,", "dt: 60,"), path=str(self.scratch / "task.yaml"),
                        data=(np.zeros((1, 8)), np.zeros((1, 6))))
        self.assertRaisesRegex(fr.Error, "log: no executed step of 60.0 s", other.fit, LOG)
        self.assertRaisesRegex(fr.Error, "nosuch", task.fit, "nosuch.lcmlog")
        small = fr.Task(equations={"states": {"x": "m"}, "inputs": {"u": "m/s"}, "parameters": {"dt": 0.1, "k": 1},
                                   "next": {"x": "x + k*dt*u"}},
                        domain={"state": {"lower": [-9], "upper": [9]}, "input": {"lower": [-1], "upper": [1]}},
                        L=[[0, 0]], data=([[0, 0]], [[0]]))
        self.assertRaisesRegex(fr.Error, "log: 6 states, and with inputs 8; the model has 1 and 2", small.fit, LOG)

    def test_warn_of_what_is_damaged_and_have_the_rest(self):
        whole = len(fr.Log(LOG, config=TASK).decisions()["utime"])
        damaged = bytearray(Path(LOG).read_bytes())
        record = damaged.index(b"\xed\xa1\xda\x01", len(damaged) // 2)
        damaged[record : record + 28] = bytes(28)
        file = self.scratch / "damaged.lcmlog"
        file.write_bytes(damaged)
        with self.assertWarnsRegex(UserWarning, "damaged in 1 place"):
            rest = len(fr.Log(file, config=Path(TASK)).decisions()["utime"])
        self.assertTrue(0 < rest <= whole)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaises(UserWarning, fr.Log(file, config=Path(TASK)).decisions)

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
