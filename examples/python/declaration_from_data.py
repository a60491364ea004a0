"""Proposes a declaration from a car's recorded steps, for some factors.   declaration_from_data.py [PICTURE]"""
import sys

import matplotlib.pyplot as plt

import forereach as fr
from ready_tasks import CONFIG

task = fr.Task.load(str(CONFIG / "bicycle.yaml"))
columns = ["v", "delta", "steer_rate"]  # on which its residual may depend
at = [(task.states + task.inputs).index(name) for name in columns]
theta = task.states.index("theta")

figure, ax = plt.subplots()
for i, factor in enumerate([1.0, 1.5, 2.0]):
    found = task.declare(by=[",".join(columns)], factor=factor, estimate_disturbance=False)
    print(f"# factor {factor}: {found['held_out_outside']} of {found['held_out_slices']} slices miss the step left out")
    print(found["yaml"])
    ax.bar([k + 0.25 * i for k in range(len(at))], found["lipschitz"][theta, at], 0.25, label=f"factor {factor}")
ax.set_xticks(range(len(at)), columns)
ax.set(ylabel="slope of theta", title="proposed from data; it proves nothing")
ax.legend()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "declaration_from_data.png")
