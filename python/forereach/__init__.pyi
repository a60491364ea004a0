from ._forereach import (
    Bus as Bus,
    Decision as Decision,
    Error as Error,
    Log as Log,
    Supervisor as Supervisor,
    Task as Task,
    Tube as Tube,
)

__all__ = ["Bus", "Decision", "Error", "Log", "Supervisor", "Task", "Tube"]
