"""Tasks and decisions in Python: what the command decides, bit for bit; what a user does wrong; threads."""
import ctypes
import gc
import json
import os
import subprocess
import sys
import tempfile
import threading
import unittest
from fractions import Fraction
from pathlib import Path

import numpy as np

import forereach as fr

FOREREACH = os.environ["FOREREACH_BUILD"] + "/cli/forereach"
BICYCLE = "config/bicycle.yaml"


def plan(name):
    """The plan and its file."""
    file = f"config/plans/{name}.csv"
    columns = Path(file).read_text().splitlines()[0].split(",")
    numbers = np.loadtxt(file, delimiter=",", skiprows=1)
    assert columns == fr.Task.load(task_of(name)).inputs
    return numbers, file


def task_of(name):
    return {"pedestrian_brake": "config/pedestrian.yaml", "truck_turn": "config/truck.yaml"}.get(name, BICYCLE)


class Decisions(unittest.TestCase):
    def test_are_those_of_the_command_bit_for_bit(self):
        for name in ["bicycle_certified", "bicycle_safety", "bicycle_domain", "pedestrian_brake", "truck_turn"]:
            with self.subTest(name):
                controls, file = plan(name)
                decision = fr.Task.load(task_of(name)).certify(controls)
                command = [FOREREACH, "certify", "--json", "--config", task_of(name), "--plan", file]
                said = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
                for key in ["outcome", "cause", "step", "obstacle", "message"]:
                    self.assertEqual(getattr(decision, key), said[key], key)
                self.assertEqual(decision.certified, said["outcome"] == "certified")
                if said["obstacle"] is None:
                    self.assertIsNone(decision.clearance)
                else:
                    self.assertAlmostEqual(decision.clearance, said["margin"] - said["threshold"], 12)
                    self.assertLessEqual(Fraction(decision.clearance), Fraction(said["margin"]) - Fraction(said["threshold"]))
                self.assertEqual(len(decision.tube), len(said["tube"]))
                self.assertEqual(decision.tube.center.tolist(), [each["center"] for each in said["tube"]])
                self.assertEqual(decision.tube.half_width.tolist(), [each["half_width"] for each in said["tube"]])
                generators = [each.T.tolist() for each in decision.tube.generators]
                self.assertEqual(generators, [each["generators"] for each in said["tube"]])
                self.assertTrue((decision.tube.hull[..., 0] <= decision.tube.center - decision.tube.half_width).all())

    def test_have_no_tube_where_the_observations_contradict_the_declaration(self):
        decision = fr.Task.load("config/bicycle_falsified.yaml").certify(plan("bicycle_certified")[0])
        self.assertEqual((decision.outcome, decision.cause, decision.step), ("abstain_falsified", "pairwise", None))
        self.assertEqual((len(decision.tube), decision.tube.hull.shape, decision.clearance), (0, (0, 6, 2), None))
        self.assertTrue(decision.plot())

    def test_do_not_depend_on_the_layout_in_memory(self):
        task, controls = fr.Task.load(BICYCLE), plan("bicycle_safety")[0]
        expected = task.certify(controls).tube.hull
        padded = np.zeros((24, 4))
        padded[::2, ::2] = controls
        for same in [np.asfortranarray(controls), controls[::-1][::-1], padded[::2, ::2], controls.tolist()]:
            np.testing.assert_array_equal(task.certify(same).tube.hull, expected)
        whole = np.zeros((5, 2), dtype=np.int32)
        np.testing.assert_array_equal(task.certify(whole).tube.hull, task.certify(np.zeros((5, 2))).tube.hull)

    def test_outlive_their_task_and_own_what_they_were_given(self):
        controls = plan("bicycle_safety")[0].copy()
        decision = fr.Task.load(BICYCLE).certify(controls)
        gc.collect()
        controls[:] = 0
        self.assertEqual(decision.step, 11)
        self.assertNotEqual(decision.controls.tolist(), controls.tolist())
        self.assertTrue(decision.plot())
        hull = decision.tube.hull
        del decision
        gc.collect()
        self.assertEqual(hull.shape, (13, 6, 2))

    def test_of_many_are_those_of_each(self):
        task, controls = fr.Task.load(BICYCLE), plan("bicycle_safety")[0]
        many = np.stack([controls * factor for factor in np.linspace(0, 1, 20)])
        for threads in [None, 1, 3]:
            for one, alone in zip(task.certify_many(many, threads=threads), map(task.certify, many), strict=True):
                self.assertEqual(one.message, alone.message)
                np.testing.assert_array_equal(one.tube.hull, alone.tube.hull)
        centers = np.array([[0, 0, 0, 12, 0, 0.3], [0, -5, 0, 12, 0, 0.3]])
        widths = np.full((2, 6), 0.01)
        own = task.certify_many(np.stack([controls, controls]), x0=(centers, widths))
        for i in range(2):
            self.assertEqual(own[i].message, task.certify(controls, x0=(centers[i], widths[i])).message)
        self.assertNotEqual(own[0].message, own[1].message)
        self.assertEqual(task.certify_many(np.zeros((0, 3, 2))), [])

    def test_of_many_end_with_the_first_certified_one_if_asked(self):
        task = fr.Task.load(BICYCLE)
        good, bad = plan("bicycle_certified")[0], plan("bicycle_safety")[0]
        for threads in [1, 3]:
            found = task.certify_many(np.stack([bad, bad, good, bad, good]), threads=threads, until_certified=True)
            self.assertEqual([decision.certified for decision in found], [False, False, True])
            self.assertEqual(len(task.certify_many(np.stack([bad, bad]), until_certified=True)), 2)

    def test_show_what_would_turn_them(self):
        task = fr.Task.load(BICYCLE)
        advice = task.advise(task.certify(plan("bicycle_safety")[0]))
        self.assertIn("obstacles", [each["change"] for each in advice if each["turns"]])
        self.assertEqual(task.advise(task.certify(plan("bicycle_certified")[0])), [])

    def test_are_drawn_as_they_were_made_whatever_was_learned_since(self):
        task = fr.Task.load("examples/python/rover.yaml")
        controls = np.repeat([[2.0, 1.2], [-2.0, -1.2]], 10, axis=0)
        before = task.certify(controls)
        drawn = before._picture()["tube"]
        self.assertEqual(len(drawn), len(before.tube))
        for corners, center in zip(drawn, before.tube.center):
            self.assertTrue((corners.min(axis=0) < center[:2]).all() and (center[:2] < corners.max(axis=0)).all())
        for v in np.linspace(-1.9, 1.9, 200):
            self.assertEqual(task.observe([0, 0, v, v, 0, 0], [0.05 * v, 0.05 * v, v, v]), "")
        self.assertEqual([each.tolist() for each in before._picture()["tube"]], [each.tolist() for each in drawn])
        after = task.certify(controls)
        self.assertNotEqual(after._picture()["tube"][-1].tolist(), drawn[-1].tolist())
        axes = after.plot()
        self.assertIs(before.plot(axes), axes)
        self.assertGreaterEqual(len(axes.patches), len(drawn) + len(after.tube) + 6)

    def test_of_a_task_that_is_not_planar_are_not_drawn(self):
        task = fr.Task.load("config/drive/quadrotor.yaml")
        decision = task.certify(np.zeros((1, len(task.inputs))))
        self.assertRaisesRegex(fr.Error, "plot: the task has 3 safety coordinates", decision.plot)

    def test_load_matplotlib_only_to_draw(self):
        program = f"import sys, forereach as fr\nfr.Task.load({BICYCLE!r})\nprint('matplotlib' in sys.modules)"
        said = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, check=True).stdout
        self.assertEqual(said, "False\n")


class Mistakes(unittest.TestCase):
    def refuses(self, words, call, *arguments, **named):
        with self.assertRaisesRegex(fr.Error, words) as raised:
            call(*arguments, **named)
        self.assertNotIn("\n", str(raised.exception))
        self.assertIsInstance(raised.exception, ValueError)

    def test_of_a_plan_name_what_it_is_and_what_it_has_to_be(self):
        task = fr.Task.load(BICYCLE)
        for words, controls in [
            ("U: has 1 dimensions, must have 2", np.zeros(3)),
            ("0 steps, must be 1 to 128", np.zeros((0, 2))),
            ("129 steps, must be 1 to 128", np.zeros((129, 2))),
            ("3 inputs, the model has 2", np.zeros((4, 3))),
            ("0 inputs, the model has 2", np.zeros((4, 0))),
            ("step 1: steer_rate is nan, must be finite", [[0, 0], [0, np.nan]]),
            ("jerk is inf", [[np.inf, 0]]),
            ("dtype complex128, must be of real numbers", np.zeros((4, 2), complex)),
            ("dtype object", np.zeros((4, 2), object)),
            ("dtype object", None),
            ("dtype <U1", np.full((4, 2), "1")),
            ("dtype float128", np.zeros((4, 2), np.longdouble)),
            ("dtype bool", np.zeros((4, 2), bool)),
            ("U: is no array", [[1, 2], [3]]),
        ]:
            self.refuses(words, task.certify, controls)
        self.refuses("Us: has 2 dimensions, must have 3", task.certify_many, np.zeros((4, 2)))
        self.refuses("plan 1: plan: step 0: jerk is nan", task.certify_many, np.full((2, 1, 2), [[[0.0]], [[np.nan]]]))
        self.refuses("0 threads", task.certify_many, np.zeros((2, 3, 2)), threads=0)

    def test_of_an_initial_set(self):
        task, controls = fr.Task.load(BICYCLE), np.zeros((3, 2))
        for words, x0 in [
            ("must be a pair", 1),
            ("must be a pair", ([0], [0], [0])),
            ("center has 5 entries, half_width 6", (np.zeros(5), np.zeros(6))),
            ("dimension 4, the model has 6 states", (np.zeros(4), np.zeros(4))),
            ("not a finite interval", (np.zeros(6), np.full(6, -1.0))),
            ("not a finite interval", (np.full(6, np.nan), np.zeros(6))),
            ("must have 1", (np.zeros((2, 6)), np.zeros((2, 6)))),
        ]:
            self.refuses(words, task.certify, controls, x0=x0)
        self.refuses("2 centers and 3 half-widths", task.certify_many, np.zeros((2, 3, 2)), (np.zeros((2, 6)), np.zeros((3, 6))))
        self.refuses("2 initial sets, must be 1 or 3", task.certify_many, np.zeros((3, 3, 2)), (np.zeros((2, 6)), np.zeros((2, 6))))

    def test_of_a_task_are_the_commands(self):
        self.refuses("nosuch.yaml: cannot be read", fr.Task.load, "nosuch.yaml")
        text = Path(BICYCLE).read_text()
        self.refuses(r"config/here.yaml:\d+: certifier.zonotope_order: 0 .*", fr.Task,
                     text.replace("zonotope_order: 5", "zonotope_order: 0"), path="config/here.yaml")
        self.refuses("task:1: model: missing", fr.Task, {})
        self.refuses("must be a dict or the text", fr.Task, 3)
        self.refuses("is no value of a task file", fr.Task, {"model": object()})

    def test_of_the_threads_arithmetic_are_seen_at_each_call(self):
        task, controls = fr.Task.load(BICYCLE), plan("bicycle_certified")[0]
        libm = ctypes.CDLL("libm.so.6")
        upward = {"x86_64": 0x800, "aarch64": 0x400000}[os.uname().machine]
        self.assertEqual(libm.fesetround(upward), 0)
        try:
            self.refuses("does not round to nearest", task.certify, controls)
            self.refuses("does not round to nearest", task.certify_many, controls[None])
        finally:
            libm.fesetround(0)
        self.assertTrue(task.certify(controls).certified)


class Tasks(unittest.TestCase):
    SMALL = {
        "model": {"states": {"x": "m", "v": "m/s"}, "inputs": {"a": "m/s^2"}, "parameters": {"dt": 0.1},
                  "next": {"x": "x + dt*v", "v": "v + dt*a"}},
        "domain": {"state": {"lower": [-9, -3], "upper": np.array([9, 3])}, "input": {"lower": [-1], "upper": [1]}},
        "declaration": {"lipschitz": {"v": {"v": 0.02}}, "noise_bound": [np.float64(1e-9), 1e-9]},
        "transitions": "small.csv",
        "task": {"initial_set": {"center": [0, 0], "half_width": [0.1, 0.1]}, "projection": ["x"], "between": "samples",
                 "obstacles": []},
    }

    def small(self, **changes):
        directory = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (directory / "small.csv").write_text("x,v,a,x_next,v_next\n0,0,0,0,0\n")
        return fr.Task({**self.SMALL, **changes}, path=str(directory / "small.yaml"))

    def test_are_dicts_with_the_keys_of_a_task_file(self):
        task = self.small()
        self.assertEqual((task.states, task.inputs, task.dt, task.num_observations), (["x", "v"], ["a"], 0.1, 1))
        self.assertTrue(task.certify([[0.5], [-0.5]]).certified)
        text = Path(BICYCLE).read_text()
        np.testing.assert_array_equal(fr.Task(text, path=BICYCLE).certify(plan("bicycle_safety")[0]).tube.hull,
                                      fr.Task.load(BICYCLE).certify(plan("bicycle_safety")[0]).tube.hull)

    def test_are_keys_by_name_and_arrays_of_observed_steps(self):
        keys = {key: value for key, value in self.SMALL.items() if key != "transitions"}
        z, x_next = np.array([[0, 1, 0], [0, -1, 0.5]]), np.array([[0.1, 0.99], [-0.1, -0.94]])
        task = fr.Task(**keys, data=(z, x_next))
        self.assertEqual(task.num_observations, 2)
        with tempfile.TemporaryDirectory() as directory:
            rows = np.hstack([z, x_next])
            np.savetxt(f"{directory}/small.csv", rows, "%.17g", ",", header="x,v,a,x_next,v_next", comments="")
            file = fr.Task(self.SMALL, path=f"{directory}/task")
        for same in [fr.Task(keys, data=(z, x_next)), fr.Task(self.SMALL, data=(np.asfortranarray(z), x_next.tolist())), file]:
            np.testing.assert_array_equal(same.certify([[0.5]] * 9).tube.hull, task.certify([[0.5]] * 9).tube.hull)
        known, less_known = (np.ptp(fr.Task(keys, data=(z, x_next, late)).certify([[0.5]]).tube.hull[1], axis=1)
                             for late in ([0, 0], [0.01, 0.01]))
        self.assertTrue((less_known > known).all(), "of steps that may have been longer or shorter")
        self.assertNotIn("transitions", keys)
        for words, data in [
            ("must be a pair .z, x_next.", z[:1]),
            ("data: z: has 1 dimensions", (z[0], x_next)),
            ("data: z has 2 rows and 2 columns, has to have 2 rows, at least 1, and 3 columns", (z[:, :2], x_next)),
            ("data: x_next has 1 rows and 2 columns, has to have 2 rows", (z, x_next[:1])),
            ("data: z has 0 rows", (z[:0], x_next[:0])),
            ("data: x_next has a number that is not finite", (z, x_next * np.nan)),
            ("dt_error: transitions: 1 durations, must be 2 or none", (z, x_next, [0])),
            ("dt_error: transition 1: a duration is off by -0.1 s", (z, x_next, [0, -0.1])),
            ("dt_error: transition 1: a duration is off by (nan|NaN|inf)", (z, x_next, [0, np.inf])),
            ("dt_error: transition 1: a duration is off by 0.05 s, outside", (z, x_next, [0, 0.05])),
            (r"data:3: v: -5 is outside \[-3, 3\] of domain.state", (z * [1, 5, 1] * [[0.2], [1]], x_next)),
        ]:
            self.assertRaisesRegex(fr.Error, words, fr.Task, keys, data=data)
        self.assertRaisesRegex(fr.Error, "must be a dict or a text, or its keys by name", fr.Task)
        self.assertRaisesRegex(fr.Error, "must be a dict or a text, or its keys by name", fr.Task, keys, model={})
        self.assertRaisesRegex(fr.Error, "no_such", fr.Task, **keys, no_such=1)

    def test_are_given_in_the_papers_words(self):
        data = (np.array([[0, 1, 0], [0, -1, 0.5]]), np.array([[0.1, 0.99], [-0.1, -0.94]]))
        paper = dict(equations=self.SMALL["model"], domain=self.SMALL["domain"], data=data)
        task = fr.Task(L={"v": {"v": 0.02}}, **paper)
        exact = {**self.SMALL, "declaration": {"lipschitz": {"v": {"v": 0.02}}, "noise_bound": [0, 0]}}
        U, x0 = [[0.5]] * 9, ([0, 0.5], [0.1, 0.1])
        expected = fr.Task(exact, data=data).certify(U, x0).tube.hull
        for same in [task, fr.Task(L=np.array([[0, 0, 0], [0, 0.02, 0]]), path="here", **paper),
                     fr.Task(L={"v": {"v": 0.02}}, task=self.SMALL["task"], declaration={"state_error": {}}, **paper)]:
            np.testing.assert_array_equal(same.certify(U, x0).tube.hull, expected)
        decision = task.certify(U, x0)
        self.assertEqual((decision.certified, decision.obstacle, decision.clearance), (True, None, None))
        self.assertIn("no obstacle", decision.message)
        self.assertTrue(decision.plot())
        unsaid = task.certify(U)
        self.assertFalse(unsaid.certified)
        np.testing.assert_allclose(unsaid.tube.hull[0], [[-9, 9], [-3, 3]])
        noisy = fr.Task(L={"v": {"v": 0.02}}, declaration={"noise_bound": [0, 0.01]}, **paper).certify(U, x0)
        self.assertGreater(np.ptp(noisy.tube.hull[1, 1]), np.ptp(expected[1, 1]))
        for missing in ["equations", "domain"]:
            self.assertRaisesRegex(TypeError, missing, fr.Task, L=[[0]], **{k: v for k, v in paper.items() if k != missing})
        self.assertRaisesRegex(TypeError, "L", fr.Task, **paper)
        self.assertRaisesRegex(TypeError, "model", fr.Task, L=[[0]], model={}, **paper)
        self.assertRaisesRegex(TypeError, "lipschitz", fr.Task, L=[[0]], declaration={"lipschitz": [[0]]}, **paper)
        self.assertRaisesRegex(fr.Error, "model", fr.Task, L=[[0]], **{**paper, "equations": "x"})
        for domain in ["x", {}, {"state": {"lower": [-9, -3], "upper": [9, 3, 3]}}, {"state": {"lower": "x", "upper": [9, 3]}}]:
            self.assertRaisesRegex(fr.Error, "domain", fr.Task, L=[[0] * 3] * 2, **{**paper, "domain": domain})
        self.assertRaisesRegex(fr.Error, "transitions: missing", fr.Task, L=[[0] * 3] * 2, **{**paper, "data": None})
        self.assertRaisesRegex(fr.Error, "lipschitz", fr.Task, L=[[0]], **paper)

    def test_learn_what_they_observe(self):
        task = self.small()
        before = task.certify([[0.5]] * 10)
        for v in np.linspace(-1, 1, 21):
            self.assertEqual(task.observe([0, v, 0], [0.1 * v, 0.99 * v]), "")
        self.assertEqual(task.num_observations, 22)
        after = task.certify([[0.5]] * 10)
        self.assertLess(after.tube.half_width[-1, 1], before.tube.half_width[-1, 1])
        self.assertIn("domain", task.observe([0, 5, 0], [0.5, 5]))
        self.assertNotEqual(task.observe([0, np.nan, 0], [0, 0]), "")
        self.assertRaisesRegex(fr.Error, "z: 2 entries, must have 3", task.observe, [0, 0], [0, 0])
        self.assertRaisesRegex(fr.Error, "x_next: 1 entries, must have 2", task.observe, [0, 0, 0], [0])
        self.assertEqual(task.observe([0, 0.5, 0], [0.05, 0.9]), "")  # far beyond the declared slope
        self.assertEqual(task.certify([[0.5]]).outcome, "abstain_falsified")
        self.assertEqual(task.advise(before), [])  # by what was known then

    def test_fit_and_declare_from_their_observations(self):
        task = self.small(model={**self.SMALL["model"], "parameters": {"dt": 0.1, "drag": 0.0},
                                 "next": {"x": "x + dt*v", "v": "v + dt*a - drag*v"}})
        rng = np.random.default_rng(1)
        for v in rng.uniform(-1, 1, 30):
            self.assertEqual(task.observe([0, v, 0], [0.1 * v, 0.99 * v + rng.normal(0, 1e-10)]), "")
        self.assertAlmostEqual(task.fit(parameters=["drag"])["parameters"]["drag"], 0.01, 6)
        self.assertEqual(task.fit()["parameters"], task.fit(None, ["drag"])["parameters"])
        found = task.declare(by=["v"], factor=1.0, estimate_disturbance=False)
        self.assertEqual((found["lipschitz"].shape, found["disturbance"].tolist()), ((2, 3), [0, 0]))
        self.assertTrue(0.0099 < found["lipschitz"][1, 1] < 0.0101, found)
        self.assertRaises(fr.Error, task.fit, None, ["nosuch"])
        self.assertRaisesRegex(TypeError, "list", task.fit, ["drag"])
        self.assertRaises(fr.Error, task.declare, by=["nosuch"])

    def test_serve_many_threads_while_they_learn(self):
        task, failures = self.small(), []
        stop = threading.Event()

        def certify():
            try:
                while not stop.is_set():
                    assert task.certify([[0.5]] * 20).outcome in ("certified", "abstain_safety")
                    assert len(task.certify_many(np.zeros((4, 5, 1)))) == 4
            except BaseException as failure:
                failures.append(failure)

        threads = [threading.Thread(target=certify) for _ in range(4)]
        for thread in threads:
            thread.start()
        for v in np.linspace(-1, 1, 600):
            self.assertEqual(task.observe([0, v, 0], [0.1 * v, 0.99 * v]), "")
        stop.set()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])
        self.assertEqual(task.num_observations, 601)
        np.testing.assert_array_equal(task.certify([[0.5]]).tube.hull, task.certify([[0.5]]).tube.hull)

    def test_do_not_hold_pythons_lock_while_they_work(self):
        task = fr.Task.load(BICYCLE)
        many = np.repeat(plan("bicycle_safety")[0][None], 2000, 0)
        state = []

        def certify():
            state.append("begun")
            task.certify_many(many, threads=1)
            state.append("done")

        def is_seen_at_work():
            state.clear()
            thread = threading.Thread(target=certify)
            thread.start()
            while not state:
                threading.Event().wait(1e-4)
            seen = state == ["begun"]
            thread.join()
            return seen

        switching = sys.getswitchinterval()
        sys.setswitchinterval(1000)  # nobody takes the lock from a thread that keeps it
        try:
            self.assertTrue(any(is_seen_at_work() for _ in range(100)))
        finally:
            sys.setswitchinterval(switching)


if __name__ == "__main__":
    unittest.main()
