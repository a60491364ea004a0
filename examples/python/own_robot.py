"""A robot that executes certified plans and nothing else, until Ctrl-C.   own_robot.py [URL [KEYS]]"""
import sys
import time
from pathlib import Path

import numpy as np

import forereach as fr


class Rover:
    def __init__(self):
        self.x = np.zeros(4)  # px, py, vx, vy

    def state(self):  # your sensors
        return self.x

    def hold(self):  # your brakes
        self.x[2:] = 0

    def steps_to_rest(self, lower, upper):  # their time
        return 0

    def move(self, u, dt):  # your actuators, for one step; the drag is what the nominal model lacks
        self.x[:2] += dt * self.x[2:] + dt * dt / 2 * u
        self.x[2:] += dt * u - 0.001 * self.x[2:]


url, keys = (sys.argv[1:] + ["", ""])[:2]
task = fr.Task.load(Path(__file__).parent / "rover.yaml")
rover = Rover()
supervisor = fr.Supervisor(task, rover, key=keys, url=url)
boundary = time.time_ns() // 1000
try:
    while True:
        supervisor.listen(boundary)
        if supervisor.control is not None:  # a simulated step; yours has ended by now
            rover.move(supervisor.control, task.dt)
        supervisor.boundary(boundary)
        boundary += round(task.dt * 1e6)
except KeyboardInterrupt:
    counts = supervisor.counts
    print(f"{counts['started']} plans, {counts['steps']} steps, {counts['steps_inside']} inside their slices")
