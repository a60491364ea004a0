"""Proposes a declaration from a car's recorded steps, for some factors.   declaration_from_data.py [PICTURE]"""
import sys
from pathlib import Path

import matplotlib.pyplot as plt

import forereach as fr

config = Path(__file__).parents[2] / "config"
task = fr.Task.load(str(config / "drive" / "unicycle.yaml"))
factors = [1.0, 1.5, 2.0]
found = [task.declare(by=["v,omega,a,alpha"], factor=factor, estimate_disturbance=False) for factor in factors]
print(found[1]["yaml"])
for factor, each in zip(factors, found):
    print(f"factor {factor}: {each['held_out_outside']} of {each['held_out_slices']} slices miss the step left out")

names = task.states + task.inputs
figure, axes = plt.subplots(len(task.states), 1, sharex=True, figsize=(6, 8))
for k, ax in enumerate(axes):
    for i, each in enumerate(found):
        ax.bar([l + 0.25 * i for l in range(len(names))], each["lipschitz"][k], 0.25, label=f"factor {factors[i]}")
    ax.set_ylabel(task.states[k])
axes[0].set_title("proposed slopes; they prove nothing")
axes[0].legend()
axes[-1].set_xticks(range(len(names)), names)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "declaration_from_data.png")
