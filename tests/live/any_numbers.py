#!/usr/bin/env python3
"""any_numbers.py HOSTILE ROUNDS [SEED]: the live page in Chromium under messages whose fields hold any numbers.

HOSTILE makes the news, by the watcher; the page takes them one after the other, without a server and its pauses. Each must
be shown whole: what cannot be drawn is said and marked, and that must not happen. Prints its seed. Exits 1 with a sentence
at the first thing that is not as it should be, also if Chromium is missing."""
import json
import os
import random
import re
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../page"))
from browser import Browser  # noqa: E402

STUB = "window.EventSource = class { constructor() { window.source = this; this.on = {}; } addEventListener(name, f) { this.on[name] = f; } };"
SHOWN = ("({old: [...document.querySelectorAll('.old')].map(e => e.id), problem: document.getElementById('problem').textContent,"
         "level: document.getElementById('level').textContent,"
         "figures: [...document.querySelectorAll('#figures .value')].map(e => e.textContent),"
         "texts: ['figures', 'facts', 'certifier', 'step-name', 'trust'].map(id => document.getElementById(id).textContent)})")


def check(condition, what):
    if not condition:
        sys.exit(f"not so: {what}")


def feed(browser, text):
    browser.run(f"source.on.message({{data: {json.dumps(text)}}})")
    return browser.run(SHOWN)


def counted(number):
    return f"{number:,}".replace(",", "\u202f")


def try_any_numbers(browser, ask, seeds):
    for seed in seeds:
        news = ask(seed)
        shown = feed(browser, news)
        chance = random.Random(seed)
        if chance.random() < .3:
            browser.run("(() => { const all = document.querySelectorAll('#decisions button'); if (!all.length) return;"
                        f"all[{chance.randrange(60)} % all.length].click(); const step = document.getElementById('step');"
                        f"step.value = {chance.randrange(130)}; step.dispatchEvent(new Event('input')); }})()")
        if chance.random() < .3:
            browser.run("document.getElementById('follow').click()")
        told = f"of seed {seed}: {news[:3000]}"
        check(browser.errors == [], f"no errors: {browser.errors} {told}")
        check(shown["old"] == [] and "Not shown" not in shown["problem"], f"all is shown: {shown} {told}")
        check(shown["figures"][0] == counted(json.loads(news)["now"]["counts"]["decisions"]), f"figures are new: {shown} {told}")
        wrong = re.search(r"NaN|undefined|null|\[object", " ".join(shown["texts"]))
        check(not wrong, f"{wrong and wrong.group()} is no number to show: {shown['texts']} {told}")


def break_parts(browser, ask):
    """What cannot be drawn is told and marked, and nothing else suffers; with the next news all is well."""
    good = json.loads(ask(1))
    good["now"]["certifier"] = good["now"]["certifier"] or {}
    good["now"]["certifier"].update(level="OK", heard=good["now"]["utime"], state="armed", elapsed_us={"p50": 1, "p99": 2})
    good["now"]["certifier"].setdefault("obstacles", {"in_force": 1, "known": True})
    shown = feed(browser, json.dumps(good))
    check(shown["old"] == [] and shown["level"] == "OK", f"a good document is shown: {shown}")
    bad = json.loads(json.dumps(good))
    bad["now"]["certifier"].update(level="ERROR", elapsed_us=None)
    shown = feed(browser, json.dumps(bad))
    check(shown["old"] == ["figures", "facts"], f"figures that cannot be drawn are marked: {shown}")
    check(re.search(r"Not shown anew since \d\d:\d\d:\d\d UTC: the figures", shown["problem"]), f"and the page says so: {shown}")
    check(shown["level"] == "ERROR", f"the state is drawn all the same: {shown}")
    shown = feed(browser, json.dumps(good))
    check(shown["old"] == [] and "Not shown" not in shown["problem"], f"all is shown again: {shown}")
    shown = feed(browser, "{")
    check(shown["old"] == ["main"] and "Not shown anew" in shown["problem"], f"news that cannot be read make all old: {shown}")
    check(len(browser.errors) == 2, f"errors are in the console, too: {browser.errors}")


def main():
    hostile, rounds = os.path.abspath(sys.argv[1]), int(sys.argv[2])
    first = int(sys.argv[3]) if len(sys.argv) > 3 else random.randrange(1 << 40)
    print(f"seed {first}")
    with subprocess.Popen([hostile, "any"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as program, Browser() as browser:
        def ask(seed):
            program.stdin.write(f"{seed}\n")
            program.stdin.flush()
            return program.stdout.readline()

        address = program.stdout.readline().strip()
        browser.call("Page.addScriptToEvaluateOnNewDocument", source=STUB)
        browser.errors = []
        browser.call("Page.navigate", url=address)
        while not browser.run("Boolean(window.source?.on.message)"):
            pass
        try_any_numbers(browser, ask, range(first, first + rounds))
        break_parts(browser, ask)
        program.stdin.close()


if __name__ == "__main__":
    main()
