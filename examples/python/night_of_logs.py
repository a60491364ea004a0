"""What the certifier decided in recorded runs, and how fast.   night_of_logs.py LOGS [PICTURE [TASK]]"""
import sys

import matplotlib.pyplot as plt
import numpy as np

import forereach as fr

logs, picture, task = (sys.argv[1:] + ["night_of_logs.png", ""][len(sys.argv) - 2 :])[:3]
log = fr.Log(logs, config=task)
decisions = log.decisions()  # pandas.DataFrame(decisions) is a table
minutes = (decisions["utime"] - decisions["utime"].min()) / 60e6

figure, (above, below) = plt.subplots(2, 1, sharex=True)
for outcome in np.unique(decisions["outcome"]):
    these = decisions["outcome"] == outcome
    print(f"{outcome}: {these.sum()}, median {np.median(decisions['elapsed_us'][these]):.0f} us")
    above.plot(minutes[these], decisions["elapsed_us"][these], ".", label=outcome)
    below.plot(minutes[these], np.arange(1, these.sum() + 1))
print(f"{len(log.withdrawals()['utime'])} withdrawals, {len(log.gaps()['utime'])} gaps")
above.set(yscale="log", ylabel="decision, us")
above.legend()
below.set(xlabel="minutes", ylabel="decisions so far")
figure.savefig(picture)
