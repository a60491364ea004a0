"""The mower as it is, in place of a real one: it turns slower than it is told, and loses speed where it turns."""
import math

import numpy as np


class Mower:
    def __init__(self):
        self.x = np.zeros(5)  # x, y (m), theta (rad), v (m/s), omega (rad/s)

    def state(self):  # your odometry
        return self.x

    def hold(self):  # your brakes
        self.x[3:] = 0

    def steps_to_rest(self, lower, upper):  # their time
        return 0

    def move(self, u, dt):  # your motors, for one step
        for _ in range(100):
            _, _, theta, v, omega = self.x
            rate = [v * math.cos(theta), v * math.sin(theta), omega, (u[0] - 0.03 * abs(omega) - v) / 0.2, (0.8 * u[1] - omega) / 0.2]
            self.x = self.x + np.array(rate) * dt / 100
