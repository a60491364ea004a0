"""A task in the paper's words, and the executed steps of a log."""
import os

import numpy as np

from . import _forereach


def anywhere(domain):
    """X_0 as large as the domain: nothing is assumed of a start that is not given."""
    try:
        lower, upper = (np.array(domain["state"][end], float) for end in ("lower", "upper"))
        return {"center": lower / 2 + upper / 2, "half_width": upper / 2 - lower / 2}
    except (KeyError, TypeError, ValueError):  # then the domain is refused where the task is read
        return {"center": [], "half_width": []}


def spelled_out(equations, domain, L, declaration={}, **others):
    """The keys of a task file. What is not said is as in the paper: exact data, no obstacles, certificates at samples."""
    states = list(equations.get("states", [])) if isinstance(equations, dict) else []
    task = {"initial_set": anywhere(domain), "projection": states[:2], "between": "samples", "obstacles": []}
    declaration = dict(lipschitz=L, **{"noise_bound": [0] * len(states), **declaration})
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
