"""A learned policy proposes chunks of controls; the gate lets none through that is not certified.   gated_policy.py [PICTURE]"""
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import forereach as fr

task = fr.Task.load(Path(__file__).parent / "rover.yaml")
rng = np.random.default_rng(2)
half, width = 8, np.array([0.02, 0.02, 0.01, 0.01])


def demonstrate(way):
    push = way / (half * task.dt) ** 2
    return np.concatenate([np.repeat(push[None], half, 0), np.repeat(-push[None], half, 0)])


# Imitation: ridge regression from the way to go to a chunk (T, m), of demonstrations that know no obstacle.
ways = rng.uniform(-0.5, 0.5, (200, 2))
chunks = np.array([demonstrate(way) + rng.normal(0, 0.05, (2 * half, 2)) for way in ways])
weights = np.linalg.solve(ways.T @ ways + 1e-3 * np.eye(2), ways.T @ chunks.reshape(200, -1))


def policy(way, count):
    """(count, T, m): the learned chunk for the way and for some beside it."""
    return ((way + rng.normal(0, 0.15, (count, 2))) @ weights).reshape(count, 2 * half, 2)


places = np.concatenate([rng.uniform([0, 0], [1.6, 1.4], (100, 2)), np.zeros((100, 2))], axis=1)
goal = np.array([1.2, 0.95])
figure, axes = plt.subplots(1, 3, figsize=(12, 4), sharex=True, sharey=True)
for ax, count in zip(axes, [1, 16, 256]):
    took, driven = 0.0, 0
    for x in places:
        samples = policy(0.4 * (goal - x[:2]), count)
        begin = time.perf_counter()
        decisions = task.certify_many(samples, x0=(x, width))
        took += time.perf_counter() - begin
        certified = [d for d in decisions if d.certified]
        driven += bool(certified)
        if certified:
            best = min(certified, key=lambda d: np.linalg.norm(goal - d.tube.center[-1, :2]))
            ax.plot(*best.tube.center[:, :2].T, color="tab:blue")
        else:
            ax.plot(*x[:2], "x", color="tab:orange")
    print(f"{count} samples: from {driven} of {len(places)} places a certified chunk, {took / len(places) * 1e3:.2f} ms each")
    ax.set(title=f"{count} samples: {driven} of {len(places)}", aspect="equal")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "gated_policy.png")
