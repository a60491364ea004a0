"""Certifies a plan and draws its tube.   certify_and_plot.py [PICTURE]"""
import sys
from pathlib import Path

import numpy as np

import forereach as fr

here = Path(__file__).parent
task = fr.Task.load(here / "rover.yaml")

# Twenty-four steps: speed up to the right and upwards, and brake to rest.
U = np.repeat([[2.8, 1.6], [-2.8, -1.6]], 12, axis=0)
decision = task.certify(U)
print(decision.message)
for advice in task.advise(decision):
    if advice["turns"]:
        print("it would be certified", advice["what"])

smaller = task.certify(U / 3)
print(smaller.message)
print("its last slice:", *(f"{name} in [{a:.4f}, {b:.4f}]" for name, (a, b) in zip(task.states, smaller.tube.hull[-1])))

ax = decision.plot()
smaller.plot(ax)
ax.figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "certify_and_plot.png")
