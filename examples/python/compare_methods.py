"""The same plan by two methods and three orders: how wide its tube is.   compare_methods.py [PICTURE]"""
import sys

import matplotlib.pyplot as plt
import numpy as np

import forereach as fr
from ready_tasks import CONFIG

file = CONFIG / "bicycle.yaml"
text = file.read_text()
U = np.loadtxt(CONFIG / "plans" / "bicycle_certified.csv", delimiter=",", skiprows=1)

figure, ax = plt.subplots()
for method in ["centred", "paper"]:
    for order in [2, 5, 8]:
        changed = text.replace("{method: centred, zonotope_order: 5}", f"{{method: {method}, zonotope_order: {order}}}")
        decision = fr.Task(changed, path=str(file)).certify(U)
        print(f"{method}, order {order}: {decision.message}")
        width = decision.tube.half_width[:, :2].max(axis=1)
        ax.plot(width, label=f"{method}, order {order}", linestyle="-" if method == "centred" else "--")
ax.set(xlabel="step", ylabel="half-width of position, m")
ax.legend()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "compare_methods.png")
