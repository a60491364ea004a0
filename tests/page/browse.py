#!/usr/bin/env python3
"""browse.py FOREREACH SAMPLES [DIRECTORY]: opens pages in Chromium and uses them as a person would.

Prints how long a page of many decisions takes; times are not judged. With DIRECTORY it leaves the pages and pictures of
them there. Exits 1 with a sentence at the first thing that is not as it should be, also if Chromium is missing."""
import os
import shutil
import subprocess
import sys
import tempfile

from browser import Browser

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MANY = 100_000
DECISIONS = 97  # of the recorded course


def check(condition, what):
    if not condition:
        sys.exit(f"not so: {what}")


def equal(found, wanted, what):
    check(found == wanted, f"{what}: found {found!r}, wanted {wanted!r}")


def is_quiet(browser, path):
    """Without errors, and without any request but the page itself."""
    equal(browser.errors, [], "no errors in the console")
    others = [url for url in browser.requests if url != "file://" + os.path.abspath(path) and not url.startswith("data:")]
    equal(others, [], "no requests")


def text(browser, selector):
    return browser.run(f"document.querySelector({selector!r}).textContent")


def shown(browser):
    return int(text(browser, "#shown").split(" of ")[0].replace("\u202f", ""))


def choose(browser, name, value):
    browser.run(f"(() => {{ const s = document.getElementById('f-{name}'); s.value = {value!r};"
                "s.dispatchEvent(new Event('change')); })()")


def type_into(browser, field, value):
    browser.run(f"(() => {{ const s = document.getElementById({field!r}); s.value = {value!r};"
                "s.dispatchEvent(new Event('input'));"
                "return new Promise(done => setTimeout(done, 150)); })()")  # the page waits until typing has paused


def reset(browser):
    browser.run("(() => { document.getElementById('reset').click(); return new Promise(done => setTimeout(done, 10)); })()")


def column(browser, index):
    """What the rows in view show in a column, from the top."""
    return browser.run("[...document.querySelectorAll('.row')].filter(r => !r.hidden).sort((a, b) => a.ariaRowIndex - b.ariaRowIndex)"
                       f".map(r => r.children[{index}].textContent)")


def use_course(browser, path):
    browser.open(path)
    total = shown(browser)
    check(total > 20, "the course has decisions")

    # Filters act on figures, table and charts.
    choose(browser, "outcome", "certified")
    certified = shown(browser)
    check(0 < certified < total, "a filter leaves some")
    equal(browser.run("[...document.querySelectorAll('#figures .value')].slice(0, 2).map(e => e.textContent)"),
          [str(certified), "100.0 %"], "figures follow the filter")
    equal(set(column(browser, 3)), {"certified"}, "rows follow the filter")
    equal(browser.run("document.getElementById('advice').hidden"), True, "a certificate needs no advice")
    check("certified" in browser.run("document.getElementById('trend').getAttribute('aria-label')"), "charts follow the filter")
    reset(browser)
    equal(shown(browser), total, "all are shown again")
    choose(browser, "outcome", "abstain_safety")
    abstained = shown(browser)
    reset(browser)
    type_into(browser, "f-search", "may touch")
    equal(shown(browser), abstained, "a search finds sentences")
    digest = browser.run("[...document.querySelectorAll('#digests dd')][0].textContent")
    type_into(browser, "f-search", digest[:16])
    equal(shown(browser), 1, "a search finds a digest")
    reset(browser)

    # The table sorts both ways, rows without a value last.
    browser.run("document.querySelector('[data-sort=step]').click()")
    steps = [int(s) for s in column(browser, 5) if s]
    equal(steps, sorted(steps), "steps rise")
    browser.run("document.querySelector('[data-sort=step]').click()")
    steps = [int(s) for s in column(browser, 5) if s]
    equal(steps, sorted(steps, reverse=True), "steps fall")
    browser.run("document.querySelector('[data-sort=time]').click()")

    # By keyboard: choose a decision, go to it, step through its tube.
    choose(browser, "outcome", "abstain_safety")
    browser.run("document.getElementById('grid').focus()")
    browser.key("Home", 36)
    first = text(browser, "#sentence")
    browser.key("ArrowDown", 40)
    check(text(browser, "#sentence") != first, "an arrow chooses the next decision")
    check(not browser.run("document.getElementById('advice').hidden"), "an abstention has advice")
    check("It would be certified" in text(browser, "#advice"), "what would have helped: " + text(browser, "#advice"))
    check(browser.run("document.querySelectorAll('#advice li').length") > 1, "every change has its line")
    browser.key("Enter", 13)
    equal(browser.run("document.activeElement.id"), "step", "Enter goes to the slider")
    binding = browser.run("Number(document.getElementById('step').value)")
    check(text(browser, "#sentence").find(f"step {binding}") >= 0 or text(browser, "#sentence").find(f"steps {binding}") >= 0,
          "the slider begins at the binding step")
    before = browser.run("document.querySelector('#svg .tube .now').outerHTML")
    browser.key("ArrowLeft", 37)
    equal(browser.run("Number(document.getElementById('step').value)"), binding - 1, "an arrow moves the slider")
    check(browser.run("document.querySelector('#svg .tube .now').outerHTML") != before, "the slice moves along")
    check(browser.run("document.querySelectorAll('#svg .tube path').length") > 10, "the tube is drawn")
    check(browser.run("document.querySelectorAll('#svg circle').length") > 5, "obstacles are drawn")
    box = browser.run("document.getElementById('svg').getAttribute('viewBox')")
    browser.run("document.getElementById('svg').focus()")
    browser.key("+", 187, "+")
    check(browser.run("document.getElementById('svg').getAttribute('viewBox')") != box, "plus zooms")
    browser.key("0", 48, "0")
    equal(browser.run("document.getElementById('svg').getAttribute('viewBox')"), box, "0 shows all")
    reset(browser)
    is_quiet(browser, path)
    return text(browser, "#command")


def use_hostile(browser, path):
    browser.open(path)
    equal(browser.run("window.hacked"), None, "no text became a script")
    equal(browser.run("document.querySelectorAll('img').length"), 0, "no text became an element")
    equal(browser.run("document.querySelectorAll('script:not([type])').length"), 3, "no further scripts")
    equal(browser.run("document.getElementById('problem').hidden"), True, "the page is shown")
    equal(shown(browser), 20, "every decision is shown")
    for index in range(20):
        browser.run("document.getElementById('next').click()")
    for sort in ["time", "plan", "source", "outcome", "cause", "step", "obstacle", "clearance", "latency"]:
        browser.run(f"document.querySelector('[data-sort={sort}]').click()")
    type_into(browser, "f-search", "</SCRIPT>")
    check(shown(browser) > 0, "texts are searched as they are")
    type_into(browser, "f-search", "9" * 400)
    is_quiet(browser, path)


# Two robots with the same plans.
def use_robots(browser, path):
    browser.open(path)
    equal(shown(browser), 2 * DECISIONS, "every decision of both robots is shown")
    check("/b" in text(browser, "#by-robot"), "robots have a table")
    events = text(browser, "#events")
    choose(browser, "robot", browser.run("document.getElementById('f-robot').options[2].value"))
    equal(shown(browser), DECISIONS, "a robot is chosen")
    check("/b" in text(browser, "#facts"), "a decision names its robot")
    check("/b/one.lcmlog" in text(browser, "#command"), "the command is that of the robot's log")
    check(text(browser, "#events") != events, "the robot's events are its own")
    is_quiet(browser, path)


def use_many(browser, path):
    seconds = browser.open(path)
    equal(shown(browser), MANY, "every decision is shown")
    took = {"open": seconds}

    def measure(name, script):
        took[name] = browser.run("(async () => { const t = performance.now(); " + script +
                                 "; document.body.offsetHeight; await new Promise(requestAnimationFrame);"
                                 "return (performance.now() - t) / 1000; })()")

    change = "s.dispatchEvent(new Event('change'))"
    measure("filter", "const s = document.getElementById('f-outcome'); s.value = 'certified'; " + change)
    check(0 < shown(browser) < MANY, "a filter leaves some")
    measure("all", "const s = document.getElementById('f-outcome'); s.selectedIndex = 0; " + change)
    measure("sort", "document.querySelector('[data-sort=clearance]').click()")
    measure("scroll to the end", "const g = document.getElementById('grid'); g.scrollTop = g.scrollHeight; await new Promise(requestAnimationFrame)")
    check(browser.run("Math.max(...[...document.querySelectorAll('.row')].filter(r => !r.hidden).map(r => r.ariaRowIndex))") == MANY,
          "the last row is reached")
    check(browser.run("document.querySelectorAll('.row').length") < 60, "only rows in view are elements")
    type_into(browser, "f-search", "margin 1.5")
    check(0 < shown(browser) < MANY, "a search finds some")
    measure("search", "const s = document.getElementById('f-search'); s.value = 'margin 2.71'; " + "document.getElementById('f-cause').dispatchEvent(new Event('change'))")
    is_quiet(browser, path)
    size = os.path.getsize(path) / 1e6
    print(f"{MANY} decisions, {size:.1f} MB: " + ", ".join(f"{name} {value:.2f} s" for name, value in took.items()))


def main():
    forereach, samples = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    with tempfile.TemporaryDirectory() as scratch:
        directory = sys.argv[3] if len(sys.argv) > 3 else scratch
        page = lambda name: os.path.join(directory, name + ".html")
        for name in ("course", "before", "robots", "hostile", "many", "empty"):
            if os.path.exists(page(name)):
                os.remove(page(name))
        log = ["tests/data/course.lcmlog", "--config", "tests/data/course.yaml"]
        subprocess.run([forereach, "report", *log, "--advice-seconds", "1000", "--out", page("course")], cwd=ROOT, check=True)
        subprocess.run([forereach, "report", *log, "--before", log[0], "--out", page("before")], cwd=ROOT, check=True)
        for robot in ("a", "b"):
            os.makedirs(os.path.join(scratch, "night", robot))
            shutil.copy(os.path.join(ROOT, log[0]), os.path.join(scratch, "night", robot, "one.lcmlog"))
        subprocess.run([forereach, "report", os.path.join(scratch, "night"), *log[1:], "--out", page("robots")], cwd=ROOT, check=True)
        subprocess.run([samples, "hostile", page("hostile")], check=True)
        subprocess.run([samples, "many", page("many"), str(MANY)], check=True)
        subprocess.run([samples, "empty", page("empty")], check=True)
        with Browser() as browser:
            command = use_course(browser, page("course"))
            if len(sys.argv) > 3:
                take_pictures(browser, page("course"), directory)
            browser.open(page("course"), 390, 844, phone=True)
            check(browser.run("document.documentElement.scrollWidth <= 390"), "the page is no wider than a phone")
            browser.open(page("before"))
            check("before: " in text(browser, "#figures"), "figures before are beside the others")
            is_quiet(browser, page("before"))
            browser.open(page("empty"))
            equal(shown(browser), 0, "a run without decisions has a page")
            is_quiet(browser, page("empty"))
            use_robots(browser, page("robots"))
            use_hostile(browser, page("hostile"))
            use_many(browser, page("many"))
        # The command that a page names decides again.
        check(command.startswith("forereach replay "), "a page names a command: " + command)
        again = subprocess.run(forereach + command.removeprefix("forereach"), shell=True, cwd=ROOT, check=True,
                               capture_output=True, text=True).stdout
        check(again.count(": recorded ") == 1 and again.count(": replayed ") == 1, "the command decides one plan again: " + again)


def take_pictures(browser, path, directory):
    for name, width, height, phone in (("desktop", 1280, 900, False), ("phone", 390, 844, True)):
        browser.open(path, width, height, phone)
        choose(browser, "outcome", "abstain_safety") if name == "phone" else None
        browser.screenshot(os.path.join(directory, name + ".png"), whole=True)


if __name__ == "__main__":
    main()
