"""The mower's planner: arcs that end at rest, the nearest to the goal first.   planner.py TASK X Y [URL [KEYS]]"""
import itertools
import sys

import numpy as np

import forereach as fr

path, goal_x, goal_y, url, keys = (sys.argv[1:] + ["", ""])[:5]
task, goal = fr.Task.load(path), np.array([float(goal_x), float(goal_y)])
bus = fr.Bus(task, key=keys, url=url, source="mower")
width = np.array([0.02, 0.02, 0.02, 0.01, 0.01])
drive, stop = 12, 20  # steps
arcs = np.zeros((60, drive + stop, 2))
arcs[:, :drive] = np.array(list(itertools.product([0, 0.15, 0.3, 0.4], np.linspace(-0.9, 0.9, 15))))[:, None]


def left(decision):
    """How far a plan leaves the mower from the goal: metres, and what it has to turn there."""
    x, y, theta = decision.tube.center[-1, :3]
    way = goal - [x, y]
    turn = np.arctan2(way[1], way[0]) - theta
    return np.linalg.norm(way) + 0.3 * abs(np.arctan2(np.sin(turn), np.cos(turn)))


certified, busy_until = 0, 0
while True:
    state = bus.robot_state(timeout=30)
    if state is None:
        sys.exit("no robot is heard")
    if state["mode"] != "standing" or state["utime"] <= busy_until:
        continue
    x = state["state"]
    if np.linalg.norm(goal - x[:2]) < 0.3:
        break
    good = [each for each in task.certify_many(arcs, x0=(x, width)) if each.certified]
    if not good:
        sys.exit("no arc is certified here")
    best = min(good, key=left)
    start = state["utime"] + round(5 * task.dt * 1e6)
    bus.propose(best.controls, (x, width), start, progress_steps=drive)
    if any(answer["certified"] for answer in bus.decisions(timeout=5)):
        certified, busy_until = certified + 1, start
print(f"at the goal after {certified} certified plans")
