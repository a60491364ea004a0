"""ForeReach: certifies planned control sequences before a robot executes them."""

from ._forereach import Bus, Decision, Error, Log, Supervisor, Task, Tube

__all__ = ["Bus", "Decision", "Error", "Log", "Supervisor", "Task", "Tube"]
