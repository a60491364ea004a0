#!/usr/bin/env python3
"""browse_live.py FOREREACH CERTIFIER PLANNER ROBOT HOSTILE [PICTURE.png]: watches a demo in Chromium, by `forereach live`.

The demo drives with keys on a bus of its own on the loopback interface, beside a stranger without a key.
A page of HOSTILE's messages is shown, too. Exits 1 with a sentence at the first thing that is not as it should be, also if Chromium is missing."""
import os
import random
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests/page"))
from browser import Browser  # noqa: E402


def check(condition, what):
    if not condition:
        sys.exit(f"not so: {what}")


def await_line(path, text, seconds=30):
    end = time.monotonic() + seconds
    while True:
        with open(path) as file:
            for line in file:
                if text in line:
                    return line
        check(time.monotonic() < end, f"{path} has no {text!r}: {open(path).read()}")
        time.sleep(.05)


class Demo:
    """The processes of scripts/demo without its logger, and `forereach live`."""

    def __init__(self, forereach, certifier, planner, robot, directory):
        self.directory, self.processes = directory, []
        port = random.randrange(20000, 40000)
        url = f"udpm://239.255.76.67:{port}?ttl=0"
        self.keys = subprocess.run([forereach, "keygen", "--robot", "demo", os.path.join(directory, "keys")], check=True,
                                   capture_output=True, text=True).stdout.strip()
        task = ["--config", "config/demo.yaml", "--lcm-url", url]
        key = ["--key", self.keys]
        self.start("live", [forereach, "live", *task, "--key", os.path.join(self.keys, "verify.pub"), "--port", "0"])
        self.address = await_line(self.path("live"), "http://").strip()
        self.start("certifier", [certifier, *task, *key, "--state", os.path.join(directory, "state")])
        self.start("planner", [planner, *task, *key])
        for name in ("certifier", "planner"):
            await_line(self.path(name), "ready")
        self.start("obstacles", [forereach, "obstacles", "--config", "config/demo_traffic.yaml", "--lcm-url", url, *key])
        await_line(self.path("obstacles"), "obstacles of")
        # A stranger, whose messages are whole and not signed.
        self.start("stranger", [forereach, "obstacles", "--config", "config/demo_traffic.yaml", "--lcm-url", url])
        self.start("robot", [robot, *task, *key])

    def path(self, name):
        return os.path.join(self.directory, name + ".log")

    def start(self, name, command):
        with open(self.path(name), "w") as log:
            self.processes.append(subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log))

    def stop(self):
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            process.wait(20)


def text(browser, selector):
    return browser.run(f"document.querySelector({selector!r}).textContent")


def wait_for(browser, script, what, seconds=60):
    end = time.monotonic() + seconds
    while not (value := browser.run(script)):
        check(time.monotonic() < end, f"{what}; the page says {text(browser, 'main')[:2000]!r}")
        time.sleep(.1)
    return value


def decisions(browser):
    return int(browser.run("document.querySelector('#figures .value').textContent").replace("\u202f", ""))


def choose(browser, outcome):
    """The newest decision in the table with this outcome, and that its tube is drawn."""
    script = ("(() => { for (const row of document.querySelectorAll('#decisions tbody tr')) {"
              f"if (row.children[1].textContent !== {outcome!r}) continue;"
              "row.querySelector('button').click();"
              "if (document.querySelectorAll('#svg .tube path').length > 5) return true; } return false; })()")
    wait_for(browser, script, f"a decision with the outcome {outcome!r} has its tube")
    check(browser.run("document.querySelectorAll('tr.chosen').length") == 1, "the chosen row is marked")
    check(browser.run("document.getElementById('follow').ariaPressed") == "false", "the page shows the decision")
    before = browser.run("document.querySelector('#svg .tube .now').outerHTML")
    browser.run("(() => { const s = document.getElementById('step'); s.value = Number(s.value) > 1 ? 1 : 3;"
                "s.dispatchEvent(new Event('input')); })()")
    check(browser.run("document.querySelector('#svg .tube .now').outerHTML") != before, "the slider steps through it")


def watch(browser, demo, picture):
    browser.open(demo.address, 1280, 1000)
    wait_for(browser, "document.getElementById('level').textContent === 'OK'", "the certifier's heartbeat is shown")
    wait_for(browser, "document.querySelector('#figures .value').textContent > 3", "decisions are shown")
    first = decisions(browser)
    wait_for(browser, "document.querySelectorAll('#svg .prediction').length > 0", "moving obstacles have predictions")
    wait_for(browser, "document.querySelectorAll('#body').length > 0 || document.querySelectorAll('#svg .dot').length > 0", "the robot is drawn")
    wait_for(browser, "document.querySelector('#legend').textContent.includes('executes')", "the plan that it executes is drawn")
    if picture:
        wait_for(browser, "document.querySelector('#figures .value').textContent > 8 && ['executes', 'abstain'].every(word => document.querySelector('#legend').textContent.includes(word))",
                 "an abstention is drawn beside it")
        browser.screenshot(picture)
    choose(browser, "certified")
    choose(browser, "abstain S")
    browser.run("document.getElementById('follow').click()")
    check(browser.run("document.getElementById('follow').ariaPressed") == "true", "the page follows the robot again")
    wait_for(browser, f"Number(document.querySelector('#figures .value').textContent.replaceAll('\\u202f', '')) > {first}", "counts grow")
    # The stranger is counted and has no effect.
    wait_for(browser, "document.getElementById('trust').textContent.includes('unsigned')", "messages of a stranger are counted")
    check("UNSIGNED" not in text(browser, "#trust"), "the page has a key")
    # Nothing but the page and its events was requested, and nothing was wrong.
    check(browser.errors == [], f"no errors: {browser.errors}")
    others = [url for url in browser.requests if url not in (demo.address, demo.address + "events") and not url.startswith("data:")]
    check(others == [], f"no other requests: {others}")
    browser.open(demo.address, 390, 844, phone=True)
    check(browser.run("document.documentElement.scrollWidth <= 390"), "the page is no wider than a phone")


def show_hostile_texts(browser, program):
    with subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as page:
        address = page.stdout.readline().strip()
        browser.open(address)
        wait_for(browser, "document.querySelectorAll('#decisions tbody tr').length >= 27", "every decision is listed")
        check(browser.run("window.hacked") is None, "no text became a script")
        check(browser.run("document.querySelectorAll('img').length") == 0, "no text became an element")
        check(browser.run("document.querySelectorAll('script').length") == 4, "no further scripts")
        check("onerror" in text(browser, "#decisions"), "texts are shown as they are")
        browser.run("for (const button of document.querySelectorAll('#decisions button')) button.click()")
        check(browser.errors == [], f"no errors: {browser.errors}")
        check([url for url in browser.requests if not url.startswith((address, "data:"))] == [], "no requests")
        browser.call("Page.navigate", url="about:blank")
        page.stdin.close()


def end(browser, demo):
    """What the page says when the server has gone."""
    demo.processes[0].terminate()
    check(demo.processes[0].wait(20) == 0, "forereach live ends with 0: " + open(demo.path("live")).read())
    wait_for(browser, "!document.getElementById('problem').hidden", "the page says that its connection is lost")
    check("old" in text(browser, "#problem"), "and how old its content is")


def main():
    picture = sys.argv[6] if len(sys.argv) > 6 else None
    *programs, hostile = [os.path.abspath(path) for path in sys.argv[1:6]]
    with tempfile.TemporaryDirectory() as directory, Browser() as browser:
        show_hostile_texts(browser, hostile)
        demo = Demo(*programs, directory)
        try:
            watch(browser, demo, picture)
            end(browser, demo)
        finally:
            demo.stop()


if __name__ == "__main__":
    main()
