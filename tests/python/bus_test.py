"""A robot and a planner in Python against the certifier process, on a signed loopback bus; and what either end does wrong."""
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings
from pathlib import Path

import numpy as np

import forereach as fr
from drawn import colours

# Of the build, or those that are installed.
BUILD = os.environ.get("FOREREACH_BUILD")
FOREREACH = f"{BUILD}/cli/forereach" if BUILD else "forereach"
CERTIFIER = f"{BUILD}/certifier/process/forereach-certifier" if BUILD else "forereach-certifier"
TASK = "examples/python/rover.yaml"
# Below the ports that the kernel hands out by itself, and of this process alone.
URL = f"udpm://239.255.76.67:{10_000 + os.getpid() % 10_000}?ttl=0"
# A robot ends by it, and would inherit that it is ignored, as what a script starts with & does.
signal.signal(signal.SIGINT, signal.default_int_handler)


def now():
    return time.time_ns() // 1000


class Rover:
    def __init__(self):
        self.x, self.held, self.failing = np.zeros(4), 0, None

    def state(self):
        if self.failing:
            raise self.failing
        return self.x

    def hold(self):
        self.held += 1
        self.x[2:] = 0


class BusTest(unittest.TestCase):
    def setUp(self):
        self.scratch = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.keys = str(self.scratch / "keys")
        subprocess.run([FOREREACH, "keygen", "--robot", "rover", self.keys], check=True, capture_output=True)

    def start(self, *command):
        """A process, which ends with the test."""
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

        def end():
            process.kill()
            process.communicate()

        self.addCleanup(end)
        return process

    def start_certifier(self, task=TASK):
        certifier = self.start(CERTIFIER, "--config", task, "--lcm-url", URL, "--key", self.keys, "--state",
                               str(self.scratch / "state"))
        self.assertIn("ready", certifier.stdout.readline())


class Drive(BusTest):
    def test_own_planner_takes_own_robot_to_the_goal_in_certified_plans(self):
        self.start_certifier()
        robot = self.start(sys.executable, "-B", "examples/python/own_robot.py", URL, self.keys)
        picture = self.scratch / "picture.png"
        planner = subprocess.run([sys.executable, "-B", "examples/python/own_planner.py", picture, URL, self.keys],
                                 capture_output=True, text=True, timeout=200)
        self.assertEqual(planner.returncode, 0, planner.stderr)
        plans = int(re.search(r"at the goal after (\d+) certified plans", planner.stdout)[1])
        self.assertGreater(plans, 1)
        self.assertGreater(colours(picture), 0)
        robot.send_signal(signal.SIGINT)
        said = robot.communicate(timeout=60)[0]
        driven, steps, inside = map(int, re.search(r"(\d+) plans, (\d+) steps, (\d+) inside", said).groups())
        self.assertGreater(driven, 1)
        self.assertEqual(inside, steps)

    def test_the_mowers_planner_takes_the_mower_to_the_goal_in_certified_plans(self):
        task = "examples/mower/mower.yaml"
        self.start_certifier(task)
        robot = self.start(sys.executable, "-B", "examples/mower/robot.py", task, URL, self.keys)
        command = [sys.executable, "-B", "examples/mower/planner.py", task, "0.8", "0.8", URL, self.keys]
        planner = subprocess.run(command, capture_output=True, text=True, timeout=200)
        self.assertEqual(planner.returncode, 0, planner.stderr)
        self.assertGreater(int(re.search(r"at the goal after (\d+) certified plans", planner.stdout)[1]), 1)
        robot.send_signal(signal.SIGINT)
        driven, steps, inside = map(int, re.search(r"(\d+) plans, (\d+) steps, (\d+) inside", robot.communicate(timeout=60)[0]).groups())
        self.assertGreater(driven, 1)
        self.assertEqual(inside, steps)


class Block(BusTest):
    """All classes of the module in a few lines."""
    TEXT = """
task = fr.Task.load("task.yaml")
fr.Task(equations=equations, domain=domain, L=L, data=data)
d = task.certify(U, x0=(center, half_width))
d.outcome, d.step, d.cause, d.message, d.tube.center, d.tube.generators, d.tube.hull, d.clearance
task.certify_many(Us)
task.advise(d); task.declare(); task.fit(log); task.observe(z, x_next); d.plot(ax)
fr.Log("run.lcmlog").decisions()
bus = fr.Bus(task, key="keys/planner.key"); bus.propose(U, x0, start); bus.decisions(); bus.robot_state()
robot = fr.Supervisor(task, key="keys/robot.key")
"""

    def test_runs_as_it_stands(self):
        text = Path("config/bicycle_text.yaml").read_text().replace("models/", f"{Path.cwd()}/config/models/")
        text = text.replace("data/bicycle_corridor_400.csv", "steps.csv")
        (self.scratch / "task.yaml").write_text(text + f"bus: {{url: '{URL}'}}\n")
        lines = Path("config/data/bicycle_corridor_400.csv").read_text().splitlines(True)
        (self.scratch / "steps.csv").write_text("".join(lines[:60]))
        (self.scratch / "run.lcmlog").write_bytes(Path("tests/data/course.lcmlog").read_bytes())
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.scratch)
        half = [0.025, 0.025, 0.005, 0.025, 0.01, 0.002]
        given = {
            "fr": fr, "U": np.zeros((12, 2)), "center": [0, 0, 0, 12, 0, 0.3], "half_width": half, "ax": None,
            "x0": ([0, 0, 0, 12, 0, 0.3], half), "Us": np.zeros((3, 12, 2)), "start": now() + 1_000_000,
            "equations": {"states": {"x": "m", "v": "m/s"}, "inputs": {"a": "m/s^2"}, "parameters": {"dt": 0.1},
                          "next": {"x": "x + dt*v", "v": "v + dt*a"}},
            "domain": {"state": {"lower": [-9, -3], "upper": [9, 3]}, "input": {"lower": [-1], "upper": [1]}},
            "L": [[0, 0, 0], [0, 0.02, 0]], "data": ([[0, 1, 0]], [[0.1, 0.99]]), "log": fr.Log("run.lcmlog"),
            "z": [0, 0, 0, 12, 0, 0, 0, 0], "x_next": [1.2, 0, 0, 12, 0, 0],
        }
        exec(self.TEXT, given)
        self.assertEqual(given["task"].num_observations, 60)
        robot, bus, begin = given["robot"], given["bus"], now()
        robot.listen(begin)
        self.assertIsNone(robot.boundary(begin, state=given["center"]))
        self.assertEqual(bus.robot_state(timeout=30)["state"].tolist(), given["center"])


class Ends(BusTest):
    def supervisor(self, robot):
        return fr.Supervisor(fr.Task.load(TASK), robot, key=self.keys, url=URL)

    def test_of_a_robot_hold_without_a_certified_plan_and_count(self):
        rover = Rover()
        supervisor = self.supervisor(rover)
        self.assertIsNone(supervisor.boundary(now()))
        self.assertIsNone(supervisor.control)
        self.assertEqual((supervisor.counts["boundaries"], supervisor.counts["started"]), (1, 0))
        self.assertFalse(supervisor.halted)
        supervisor.expect(fr.Task.load(TASK))

    def test_of_a_robot_say_what_its_functions_raise_and_go_on(self):
        rover, raised = Rover(), []
        supervisor = self.supervisor(rover)
        hook, sys.unraisablehook = sys.unraisablehook, lambda each: raised.append(each.exc_value)
        self.addCleanup(setattr, sys, "unraisablehook", hook)
        rover.failing = ZeroDivisionError("no sensor")
        self.assertIsNone(supervisor.boundary(now()))
        self.assertIn("no sensor", [str(each) for each in raised])
        rover.failing = KeyboardInterrupt()
        self.assertRaises(KeyboardInterrupt, supervisor.boundary, now())
        rover.failing, rover.x = None, "no numbers"
        self.assertIsNone(supervisor.boundary(now()))
        self.assertIn("state: is of dtype", str(raised[-1]))
        rover.x, before = np.zeros(4), supervisor.counts["errors"]
        self.assertGreater(before, 0)
        self.assertIsNone(supervisor.boundary(now()))
        self.assertEqual(supervisor.counts["errors"], before)

    def test_of_a_robot_that_its_caller_measures_execute_certified_plans_and_hold_at_once(self):
        self.start_certifier()
        task = fr.Task.load(TASK)
        robot, bus = fr.Supervisor(task, key=self.keys, url=URL), fr.Bus(task, key=self.keys, url=URL)
        x, step, boundary = np.zeros(4), round(task.dt * 1e6), now()

        def move():
            if robot.control is not None:
                x[:2] += task.dt * x[2:] + task.dt**2 / 2 * robot.control
                x[2:] += task.dt * robot.control

        proposed = boundary
        while robot.counts["steps"] < 3:
            robot.listen(boundary)
            move()
            if robot.boundary(boundary, state=x, state_error=np.zeros(4)) is None and boundary > proposed:
                proposed = boundary + 16 * step
                bus.propose([[0.5, 0.0]] * 8 + [[-0.5, 0.0]] * 8, (x, np.full(4, 0.01)), boundary + 8 * step)
            boundary += step
        robot.listen(boundary)
        move()
        x[2] += 1e-3  # inside the slice, and no motion of what the task declares
        self.assertIsNotNone(robot.boundary(boundary, state=x, state_error=np.zeros(4)))
        later = now() + 20_000_000
        robot.listen(later)
        if not robot.halted:
            self.skipTest("the machine is too busy: a step off its time teaches nothing, so there is no fault")
        self.assertLess(now(), later)
        self.assertIsNone(robot.control)
        self.assertTrue(robot.halted)
        self.assertEqual(robot.counts["steps_inside"], 4)

    def test_of_a_robot_that_restarted_take_a_plan_before_they_are_given_a_state(self):
        self.start_certifier()
        task = fr.Task.load(TASK)
        before, anew = (fr.Supervisor(task, key=Path(self.keys), url=URL) for _ in range(2))
        bus, x, step, boundary, start = fr.Bus(task, key=Path(self.keys), url=URL), np.zeros(4), round(task.dt * 1e6), now(), 0
        while anew.counts["accepted"] == 0:
            before.listen(boundary)
            before.boundary(boundary, state=x)
            if boundary > start:
                start = boundary + 8 * step
                bus.propose([[0.5, 0.0]] * 8 + [[-0.5, 0.0]] * 8, (x, np.full(4, 0.01)), start)
            anew.listen(now())
            boundary += step
        anew.boundary(boundary, state=x)
        self.assertEqual((anew.counts["errors"], anew.counts["boundaries"]), (0, 1))

    def test_of_a_robot_without_functions_say_what_their_caller_has_to_give(self):
        task = fr.Task.load(TASK)
        own, other = fr.Supervisor(task, key=self.keys, url=URL), self.supervisor(Rover())
        for words, call in [
            ("if the supervisor has no robot, and only then", lambda: own.boundary(now())),
            ("if the supervisor has no robot, and only then", lambda: other.boundary(now(), state=np.zeros(4))),
            ("if the supervisor has no robot, and only then", lambda: other.boundary(now(), state_error=np.zeros(4))),
            ("state: 3 entries, must have 4", lambda: own.boundary(now(), state=np.zeros(3))),
            ("state_error: 5 entries, must have 4", lambda: own.boundary(now(), state=np.zeros(4), state_error=np.zeros(5))),
            ("state: is of dtype", lambda: own.boundary(now(), state="x")),
        ]:
            self.assertRaisesRegex(fr.Error, words, call)
        self.assertEqual((own.counts["boundaries"], other.counts["boundaries"]), (0, 0))

    def test_of_a_planner_hear_the_robots_states_and_send_only_what_fits(self):
        task = fr.Task.load(TASK)
        bus = fr.Bus(task, key=self.keys, url=URL)
        rover = Rover()
        supervisor = self.supervisor(rover)
        rover.x[:2] = 0.25, -0.5
        self.assertIsNone(bus.robot_state())
        begin = now()
        supervisor.boundary(begin + 60_000_000)  # a clock that is far ahead does not count
        supervisor.boundary(begin)
        state = bus.robot_state(timeout=30)
        self.assertEqual((state["utime"], state["mode"], state["state"].tolist()), (begin, "standing", [0.25, -0.5, 0, 0]))
        self.assertIsNone(state["executing_plan_id"])
        self.assertIsNone(bus.robot_state())  # that one was taken
        x0, U = (np.zeros(4), np.full(4, 0.01)), np.zeros((4, 2))
        first, second = bus.propose(U, x0, begin), bus.propose(U, x0, begin)
        self.assertGreater(second, first)
        for words, call in [
            ("3 inputs, the model has 2", lambda: bus.propose(np.zeros((4, 3)), x0, begin)),
            ("129 steps", lambda: bus.propose(np.zeros((129, 2)), x0, begin)),
            ("must be finite", lambda: bus.propose(np.full((4, 2), np.nan), x0, begin)),
            ("dimension 3", lambda: bus.propose(U, (np.zeros(3), np.zeros(3)), begin)),
            ("half", lambda: bus.propose(U, (np.zeros(4), np.full(4, -1.0)), begin)),
            ("progress_steps: 5", lambda: bus.propose(U, x0, begin, progress_steps=5)),
            ("Us: has no plan", lambda: bus.propose_many(np.zeros((0, 4, 2)), x0, begin)),
            ("3 inputs, the model has 2", lambda: bus.propose_many(np.zeros((2, 4, 3)), x0, begin)),
            ("at most 256 plans and 7680 numbers", lambda: bus.propose_many(np.zeros((31, 128, 2)), x0, begin)),
            ("timeout", lambda: bus.decisions(timeout=-1)),
            ("timeout", lambda: bus.withdrawals(timeout=-1)),
            ("timeout", lambda: bus.robot_state(timeout=float("nan"))),
        ]:
            self.assertRaisesRegex(fr.Error, words, call)

    def test_are_answered_by_the_certifier_each_source_by_itself(self):
        self.start_certifier()
        task = fr.Task.load(TASK)
        buses = [fr.Bus(task, key=self.keys, url=URL, source=name) for name in ["one", "other"]]
        plan = buses[0].propose(np.zeros((4, 2)), (np.zeros(4), np.full(4, 0.01)), now())
        answer = buses[0].decisions(timeout=60)
        self.assertEqual([(each["plan_id"], each["outcome"]) for each in answer], [(plan, "rejected")])
        plans = buses[0].propose_many(np.zeros((30, 128, 2)), (np.zeros(4), np.full(4, 0.01)), now())
        self.assertEqual(plans, list(range(plans[0], plans[0] + 30)))
        self.assertGreater(plans[0], plan)
        answer = buses[0].decisions(timeout=60)
        self.assertEqual([(each["plan_id"], each["outcome"]) for each in answer], [(plans[0], "rejected")])
        self.assertEqual((buses[1].decisions(), buses[1].withdrawals(), buses[1].advice()), ([], [], []))

    def test_of_a_planner_get_a_plan_near_a_refused_one_which_is_certified(self):
        self.start_certifier()
        self.start(sys.executable, "-B", "examples/python/own_robot.py", URL, self.keys)
        task = fr.Task.load(TASK)
        bus = fr.Bus(task, key=self.keys, url=URL)
        width = np.array([0.02, 0.02, 0.01, 0.01])
        push = 3 * np.array([0.9, 0.5]) / np.hypot(0.9, 0.5)
        U = np.concatenate([np.tile(push, (10, 1)), np.tile(-push, (10, 1))])  # ends at the first obstacle

        def decide(U, repair):
            """The state that it was planned from, and the decision; nothing before the certifier is armed."""
            state = bus.robot_state(timeout=30)
            plan = bus.propose(U, (state["state"], width), state["utime"] + round(6 * task.dt * 1e6), 10, repair)
            return next((each for each in bus.decisions(timeout=5) if each["plan_id"] == plan
                         and each["outcome"] != "rejected"), None)

        def soon(wanted):
            return next(filter(None, (wanted() for _ in range(400))))  # the certifier hears the robot for 3 s first

        refused = soon(lambda: decide(U, True))
        self.assertEqual(refused["outcome"], "abstain_safety")
        repair = bus.repairs(timeout=10)[0]
        self.assertEqual((repair["plan_id"], repair["pushed"]), (refused["plan_id"], True))
        self.assertEqual(repair["U"].shape[1], 2)
        self.assertTrue(0 < repair["nearness"] < 0.75)
        self.assertTrue(soon(lambda: decide(repair["U"], False))["certified"])
        self.assertEqual(bus.repairs(), [])

    def test_of_a_planner_hear_how_a_refused_plan_would_have_to_give_way(self):
        path = self.scratch / "rover.yaml"
        path.write_text(Path(TASK).read_text().replace("gate: {", "gate: {advice: send, "))
        (self.scratch / "rover.csv").write_text(Path("examples/python/rover.csv").read_text())
        self.start_certifier(str(path))
        self.start(sys.executable, "-B", "-c", Path("examples/python/own_robot.py").read_text().replace(
            'Path(__file__).parent / "rover.yaml"', repr(str(path))), URL, self.keys)
        task = fr.Task.load(path)
        bus = fr.Bus(task, key=self.keys, url=URL)
        push = 3 * np.array([0.9, 0.5]) / np.hypot(0.9, 0.5)
        U = np.concatenate([np.tile(push, (10, 1)), np.tile(-push, (10, 1))])  # ends at the first obstacle
        for _ in range(400):
            state = bus.robot_state(timeout=30)
            plan = bus.propose(U, (state["state"], np.array([0.02, 0.02, 0.01, 0.01])), state["utime"] + 300_000, 10)
            if any(each["outcome"] == "abstain_safety" for each in bus.decisions(timeout=5)):
                break
        advice = bus.advice(timeout=10)[0]
        self.assertEqual(advice["plan_id"], plan)
        change = advice["changes"][0]
        self.assertEqual((change["kind"], change["index"]), ("obstacle", 0))
        self.assertGreater(change["value"], 0)
        self.assertAlmostEqual(float(np.linalg.norm(change["direction"])), 1)

    def test_take_the_keys_of_their_role_alone(self):
        task = fr.Task.load(TASK)
        self.assertRaisesRegex(fr.Error, "robot.key", fr.Bus, task, key=self.keys + "/robot.key", url=URL)
        self.assertRaisesRegex(fr.Error, "nosuch", fr.Bus, task, key="nosuch", url=URL)
        self.assertRaisesRegex(fr.Error, "planner.key", fr.Supervisor, task, Rover(), key=self.keys + "/planner.key", url=URL)
        self.assertRaisesRegex(fr.Error, "http", fr.Bus, task, key=self.keys, url="http://here")
        self.assertRaisesRegex(fr.Error, "source", fr.Bus, task, key=self.keys, url=URL, source="x" * 32)
        with self.assertWarnsRegex(UserWarning, "UNSIGNED"):
            fr.Bus(task, url=URL)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaises(UserWarning, fr.Bus, task, url=URL)

    def test_belong_to_the_thread_that_opened_them(self):
        bus = fr.Bus(fr.Task.load(TASK), key=self.keys, url=URL)
        supervisor, refused = self.supervisor(Rover()), []

        def use(call):
            try:
                call()
            except fr.Error as error:
                refused.append(str(error))

        for call in [bus.decisions, bus.robot_state, lambda: supervisor.boundary(now()), lambda: supervisor.listen(0)]:
            thread = threading.Thread(target=use, args=[call])
            thread.start()
            thread.join()
        self.assertEqual(len(refused), 4, refused)

    def test_end_waiting_when_they_are_interrupted(self):
        program = ("import forereach as fr, sys; bus = fr.Bus(fr.Task.load(sys.argv[1]), key=sys.argv[2], url=sys.argv[3]);"
                   "print('waits', flush=True); bus.decisions(timeout=1e6)")
        waiting = self.start(sys.executable, "-B", "-c", program, TASK, self.keys, URL)
        self.assertEqual(waiting.stdout.readline(), "waits\n")
        waiting.send_signal(signal.SIGINT)
        self.assertIn("KeyboardInterrupt", waiting.communicate(timeout=60)[0])


if __name__ == "__main__":
    unittest.main()
