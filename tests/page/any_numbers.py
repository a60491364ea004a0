#!/usr/bin/env python3
"""any_numbers.py FOREREACH SAMPLES ROUNDS [SEED]: pages of logs some of whose messages hold any numbers, in Chromium.

Every part of a page is drawn, for every decision and filter: what cannot be drawn is said and marked, and that must not
happen. Prints its seed. Exits 1 with a sentence at the first thing that is not as it should be, also if Chromium is missing."""
import os
import random
import re
import subprocess
import sys
import tempfile

from browser import Browser

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
USE = """(() => {
  for (let k = 0; k < 60; ++k) document.getElementById('next').click();
  for (const head of document.querySelectorAll('[data-sort]')) document.querySelector(`[data-sort=${head.dataset.sort}]`).click();
  for (const select of document.querySelectorAll('#filters select')) {
    select.selectedIndex = select.options.length - 1;
    select.dispatchEvent(new Event('change'));
    select.selectedIndex = 0;
  }
  document.getElementById('f-outcome').dispatchEvent(new Event('change'));
  for (const step of [0, 3, 128]) {
    document.getElementById('step').value = step;
    document.getElementById('step').dispatchEvent(new Event('input'));
  }
  return {old: [...document.querySelectorAll('.old')].map(e => e.id), problem: document.getElementById('problem').textContent,
    texts: ['figures', 'times', 'facts', 'envelope', 'step-name', 'what'].map(id => document.getElementById(id).textContent)};
})()"""
# Breaks the figures' element, so that they cannot be drawn, and draws all again.
BREAK = """(() => {
  const figures = document.getElementById('figures');
  figures.replaceChildren = () => { throw new Error('broken'); };
  document.getElementById('f-outcome').dispatchEvent(new Event('change'));
  const broken = {old: figures.classList.contains('old'), problem: document.getElementById('problem').textContent};
  delete figures.replaceChildren;
  document.getElementById('f-outcome').dispatchEvent(new Event('change'));
  return {...broken, still: document.querySelectorAll('.old').length};
})()"""


def check(condition, what):
    if not condition:
        sys.exit(f"not so: {what}")


def main():
    forereach, samples = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    first = int(sys.argv[4]) if len(sys.argv) > 4 else random.randrange(1 << 40)
    print(f"seed {first}")
    with tempfile.TemporaryDirectory() as directory, Browser() as browser:
        for seed in range(first, first + int(sys.argv[3])):
            log, page = (os.path.join(directory, f"{seed}.{end}") for end in ("lcmlog", "html"))
            subprocess.run([samples, "any", log, str(seed)], check=True)
            made = subprocess.run([forereach, "report", log, "--config", "tests/data/course.yaml", "--out", page], cwd=ROOT,
                                  capture_output=True, text=True)
            check(made.returncode == 0, f"there is a report of seed {seed}: {made.stderr}")
            browser.open(page)
            used = browser.run(USE)
            told = f"of seed {seed}: {used}"
            check(browser.errors == [], f"no errors: {browser.errors} {told}")
            check(used["old"] == [] and used["problem"] == "", f"all is shown {told}")
            check(not re.search(r"NaN|undefined|null|\[object", " ".join(used["texts"])), f"what is shown are numbers {told}")
            os.remove(log), os.remove(page)
            if seed == first:
                broken = browser.run(BREAK)
                check(broken["old"] and "Not shown anew since" in broken["problem"] and "the figures (broken)" in broken["problem"],
                      f"figures that cannot be drawn are told and marked: {broken}")
                check(broken["still"] == 0, f"and no longer when they are: {broken}")


if __name__ == "__main__":
    main()
