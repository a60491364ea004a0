"""docs/index.md and the links of all documents are seen to be right and wrong; formulas and headers are set as they are meant."""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, "docs/site")
import formulas
import headers


def plain(html):
    """Its formulas in brackets, with _ below and ^ above."""
    html = re.sub(r'<mover accent="true"><mi>(.)</mi><mo[^>]*>(.)</mo></mover>', r"<mi>\1\2</mi>", html)
    html = re.sub(r"</?mrow>", "", html)
    atom = r"(<(m[ino])\b[^>]*>[^<]*</\2>)"
    html = re.sub(rf"<msub>{atom}(.*?)</msub>", r"\1_{\3}", html)
    html = re.sub(rf"<msup>{atom}(.*?)</msup>", r"\1^{\3}", html)
    html = html.replace("<math>", "[[").replace("</math>", "]]")
    return re.sub(r"<[^>]*>", "", html)


class Formulas(unittest.TestCase):
    def test_are_found_in_prose_by_their_form(self):
        for text, set_ in [
            ("a center c, and a slack s >= 0", "a center [[c]], and a slack [[s]] [[≥]] [[0]]"),
            ("x_t lies in X_{t+1}", "[[x_{t}]] lies in [[X_{t+1}]]"),
            ("r_k(z) <= w^_k for z, z' in Z_cert", "[[r_{k}(z)]] [[≤]] [[w^_{k}]] for [[z]], [[z′]] in [[Z_{cert}]]"),
            ("the set <c, G> + [-s, s]", "the set [[⟨c,G⟩]] [[+]] [[[−s,s]]]"),
            ("|b|_inf", "[[|b|_{∞}]]"),
            ("below 2^-53. []", "below [[2^{−53}]]. □"),
            ("Z_t = X_t x {u_t}", "[[Z_{t}]] [[=]] [[X_{t}]] [[×]] [[{u_{t}}]]"),
            ("sigma, the sum", "[[σ]], the sum"),
            ("sum_l L_kl", "[[∑_{l}L_{kl}]]"),
        ]:
            self.assertEqual(plain(formulas.typeset(text)), set_, text)

    def test_are_not_found_in_words_numbers_units_and_references(self):
        for text in ["a plan in 4-D, n-by-m, of 0.1 s", "either (a) or (b)", "a robot's 64 m", "see 3.12 and (3.9)", "signed_square of it"]:
            self.assertNotIn("<math", formulas.typeset(text), text)
        self.assertEqual(plain(formulas.typeset("of x_t (3.12)")), "of [[x_{t}]] (3.12)")

    def test_may_wrap_so_that_none_is_too_long_for_a_phone(self):
        text = "[max_i (r~_ik - eps_k - D_ik), min_i (r~_ik + eps_k + D_ik)] <= sum_l L_kl |z_l - z_il|"
        for part in formulas.typeset(text).split(" "):
            self.assertLess(len(plain(part)), 40)

    def test_keep_every_word_of_a_page(self):
        text = Path("docs/soundness.md").read_text()
        letters = lambda each: re.sub(r"[^A-Za-z]", "", each)
        kept = letters(re.sub(r"<[^>]*>", "", formulas.typeset(text)).replace("&lt;", "").replace("&gt;", "").replace("&amp;", ""))
        for greek in [*formulas.GREEK, *formulas.WRITTEN]:
            text = re.sub(rf"(?<![A-Za-z]){greek}(?![a-z])", "", text)
        self.assertGreater(len(kept), 0.97 * len(letters(text)))


class Headers(unittest.TestCase):
    def test_are_contract_and_declarations_without_what_is_private(self):
        text = ("/** A box.\n\nIt is closed: box_tree.h. */\n#pragma once\n#include <span>\nnamespace forereach {\n\nclass Box final {\n public:\n"
                "  /** @param k at least 0. @throws std::out_of_range if k is too large. */\n  double lower(int k) const;\n\n"
                " private:\n  double secret_;\n};\n\n}  // namespace forereach\n")
        content = headers.sections(text)
        self.assertEqual(headers.first_sentence(content), "A box.")
        html = headers.html(content, lambda name: "to.html" if name == "box_tree.h" else None)
        self.assertIn('<a href="to.html"><code>box_tree.h</code></a>', html)
        self.assertIn("<li><code>k</code> at least", html)
        self.assertIn("<li>throws <code>std::out_of_range</code> if", html)
        self.assertIn("double lower(int k) const;", html)
        for hidden in ["secret_", "namespace", "#include", "private", "public"]:
            self.assertNotIn(hidden, html)


class Documents(unittest.TestCase):
    def test_have_less_than_55000_words_together(self):
        self.assertLess(sum(len(page.read_text().split()) for page in Path("docs").rglob("*.md")), 55_000)


class Links(unittest.TestCase):
    def check(self, **files):
        root = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (root / "docs").mkdir()
        for name, text in files.items():
            (root / "docs" / f"{name}.md").write_text(text)
        ended = subprocess.run([sys.executable, "docs/site/make", "--check", root], capture_output=True, text=True)
        self.assertEqual(ended.returncode, 1 if ended.stdout else 0, ended.stderr)
        return ended.stdout.splitlines()

    def test_hold_here(self):
        ended = subprocess.run([sys.executable, "docs/site/make", "--check"], capture_output=True, text=True)
        self.assertEqual((ended.returncode, ended.stdout), (0, ""))

    def test_that_are_broken_and_documents_that_are_not_listed_are_named(self):
        page = "# A page\n## Two words: `x_t`, here\n## Twice\n## Twice\n"
        good = "[a](page.md) [web](https://example.org) `[no](link.md)`"
        self.assertEqual(self.check(index=good, page=page), [])
        here = page + "[b](#two-words-x_t-here) [c](page.md#twice-1) [d](index.md)\n```\n[e](no.md)\n## Not\n```\n"
        self.assertEqual(self.check(index=good, page=here), [])
        broken = page + "[b](#twice-2) [c](no.md) ![d](no.png) [e](index.md#not)\n"
        self.assertEqual(self.check(index=good, page=broken), [
            "docs/page.md: #twice-2: no such heading", "docs/page.md: index.md#not: no such heading",
            "docs/page.md: no.md: no such file", "docs/page.md: no.png: no such file"])
        self.assertEqual(self.check(index=good, page=page, other="# Other"), ["docs/index.md: lists docs/other.md 0 times, must be once"])
        self.assertEqual(self.check(index=good + good, page=page), ["docs/index.md: lists docs/page.md 2 times, must be once"])


if __name__ == "__main__":
    unittest.main()
