"""A task in the paper's words, and the executed steps of a log."""
import os

import numpy as np

from . import _forereach


def spelled_out(equations, domain, L, declaration={}, **others):
    """The keys of a task file. What is not said is as in the paper: exact data, no obstacles, certificates at samples."""
    states = list(equations.get("states", [])) if isinstance(equations, dict) else []
    zeros = [0] * len(states)
    task = {"initial_set": {"center": zeros, "half_width": zeros}, "projection": states[:2], "between": "samples", "obstacles": []}
    declaration = dict(lipschitz=L, **{"noise_bound": zeros, **declaration})
    return dict(model=equations, domain=domain, declaration=declaration, **{"task": task, **others})


def steps_of(log, dt):
    """(z, x_next), (N, n + m) and (N, n), of the executed steps that lasted dt s, give or take less than half of it."""
    steps = (log if isinstance(log, _forereach.Log) else _forereach.Log(os.fspath(log))).transitions()
    lasted = np.abs(steps["duration_us"] / 1e6 - dt) < dt / 2
    rows = [np.hstack(row) for row in zip(*(steps[name][lasted] for name in ["state", "input", "next_state"]))]
    rows = [row for row in rows if np.isfinite(row).all()]
    if not rows:
        raise _forereach.Error(f"log: no executed step of {dt} s")
    n = len(steps["next_state"][0])
    return np.array(rows)[:, :-n], np.array(rows)[:, -n:]
