"""The whole site, made anew twice: the same bytes; on a phone no page scrolls sideways, and a browser fetches nothing from elsewhere.

  site_in_browser.py BUILD
"""
import filecmp
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "page"))
from browser import Browser

PHONE = 360  # pixels


def width_on_phone(browser, page):
    browser.call("Page.navigate", url=page.as_uri())
    while browser.run(f"document.readyState != 'complete' || location.href != {page.as_uri()!r}"):
        time.sleep(.01)
    return browser.run("document.scrollingElement.scrollWidth")


def main():
    with tempfile.TemporaryDirectory() as scratch:
        prefix, *sites = (Path(scratch) / name for name in ("prefix", "first", "second"))
        subprocess.run(["cmake", "--install", sys.argv[1], "--prefix", prefix], check=True, capture_output=True)
        for site in sites:
            subprocess.run(["/usr/bin/python3", "-B", "docs/site/make", prefix, site], check=True, stdout=subprocess.DEVNULL)
        first, second = ([path.relative_to(site) for path in sorted(site.rglob("*")) if path.is_file()] for site in sites)
        assert first == second, set(first) ^ set(second)
        differing = [path for path in first if not filecmp.cmp(sites[0] / path, sites[1] / path, shallow=False)]
        assert not differing, f"not the same twice: {differing}"
        pages = sorted(sites[0].rglob("*.html"))
        assert len(pages) > 150, len(pages)
        soundness = (sites[0] / "soundness.html").read_text()
        assert "<math>" in soundness and "\\" not in soundness
        with Browser() as browser:
            browser.call("Emulation.setDeviceMetricsOverride", width=PHONE, height=640, deviceScaleFactor=2, mobile=True)
            wide = [page.name for page in pages if width_on_phone(browser, page) > PHONE]
            assert not wide, f"scroll sideways: {wide}"
            foreign = [url for url in browser.requests if not url.startswith("file://")]
            assert not foreign and not browser.errors, (foreign, browser.errors)
    print(f"{len(pages)} pages, the same twice, as wide as a phone")


main()
