"""The mower's robot: it executes certified plans and nothing else, until Ctrl-C.   robot.py TASK [URL [KEYS]]"""
import sys
import time

from mower import Mower

import forereach as fr

task, url, keys = (sys.argv[1:] + ["", ""])[:3]
task, mower = fr.Task.load(task), Mower()
supervisor = fr.Supervisor(task, mower, key=keys, url=url)
boundary = time.time_ns() // 1000
try:
    while True:
        supervisor.listen(boundary)
        if supervisor.control is not None:  # a simulated step; yours has ended by now
            mower.move(supervisor.control, task.dt)
        supervisor.boundary(boundary)
        boundary += round(task.dt * 1e6)
except KeyboardInterrupt:
    counts = supervisor.counts
    print(f"{counts['started']} plans, {counts['steps']} steps, {counts['steps_inside']} inside their slices")
