"""A planner: goes to a goal in certified plans that end at rest.   own_planner.py [PICTURE [URL [KEYS]]]"""
import sys
from pathlib import Path

import numpy as np

import forereach as fr

picture, url, keys = (sys.argv[1:] + ["own_planner.png", "", ""][len(sys.argv) - 1 :])[:3]
task = fr.Task.load(Path(__file__).parent / "rover.yaml")
bus = fr.Bus(task, key=keys, url=url)
goal = np.array([1.2, 0.95])
rng = np.random.default_rng(1)
width = np.array([0.02, 0.02, 0.01, 0.01])
half = 8  # steps of speeding up, and as many of braking


def sample(x, count=64):
    """(count, T, m): pushes towards the goal, more or less, each with its braking tail."""
    to_goal = goal - x[:2]
    angles = np.arctan2(to_goal[1], to_goal[0]) + rng.normal(0, 0.9, count)
    far = rng.uniform(0.2, 1, count) * min(np.linalg.norm(to_goal), 0.4)
    push = far / (half * task.dt) ** 2
    push = np.stack([push * np.cos(angles), push * np.sin(angles)], axis=1)[:, None]
    return np.concatenate([np.repeat(push, half, 1), np.repeat(-push, half, 1)], axis=1)


certified, ax = 0, None
while True:
    state = bus.robot_state(timeout=30)
    if state is None:
        sys.exit("no robot is heard")
    if state["mode"] != "standing":
        continue
    x = state["state"]
    if np.linalg.norm(goal - x[:2]) < 0.1:
        break
    # Those that the task certifies here, nearest first; the certifier has the last word.
    good = [d for d in task.certify_many(sample(x), x0=(x, width)) if d.certified]
    good.sort(key=lambda d: np.linalg.norm(goal - d.tube.center[-1, :2]))
    for decision in good[:1]:
        start = state["utime"] + round(6 * task.dt * 1e6)
        plan = bus.propose(decision.controls, (x, width), start, progress_steps=half)
        for answer in bus.decisions(timeout=5):
            if answer["outcome"] != "rejected":  # as those before the certifier is armed
                print(answer["message"])
            if answer["plan_id"] == plan and answer["certified"]:
                certified += 1
                ax = decision.plot(ax)
                while (later := bus.robot_state(timeout=30)) and later["utime"] <= start:
                    pass
if ax:
    ax.figure.savefig(picture)
print(f"at the goal after {certified} certified plans")
