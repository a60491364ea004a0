"""A C++ header as a page: its comments /** ... */ as prose, and below each the declarations that it is about."""
import re
from html import escape
from textwrap import dedent

from formulas import typeset

COMMENT = re.compile(r"^[ ]*/\*\*(.*?)\*/[ ]*\n", re.M | re.S)
NOT_SHOWN = re.compile(
    r"^(?:#pragma once|#include .*|FOREREACH_ARITHMETIC_\w+|namespace [\w:]* ?\{|\} *// *namespace.*)\n", re.M)
PRIVATE = re.compile(r"^( *) private:\n.*?(?=^\1\};)", re.M | re.S)
MARK = {"param": "", "tparam": "", "throws": "throws ", "pre": "before: ", "post": "after: ", "return": "returns "}


def sections(text):
    """[(comment, code)], the first of them about the file."""
    text = PRIVATE.sub("", re.sub(r"(?<=\n) ?public:\n", "", text))
    parts = COMMENT.split(text)
    code = [dedent(re.sub(r"\n{3,}", "\n\n", NOT_SHOWN.sub("", part))).strip("\n") for part in parts[::2]]
    return [(comment.strip(), below) for comment, below in zip(parts[1::2], code[1:])]


def words(text, link):
    """`code` and names of headers in a piece of prose."""
    def each(match):
        said = escape(match.group().strip("`"), quote=False)
        to = link(match.group().strip("`")) if match.group().strip("`").endswith(".h") else None
        return f'<a href="{to}"><code>{said}</code></a>' if to else f"<code>{said}</code>" if match.group()[0] == "`" else said
    pieces = re.split(r"(`[^`\n]+`|\b[\w/]+\.h\b)", text)
    return "".join(each(re.match(".*", piece, re.S)) if i % 2 else typeset(piece) for i, piece in enumerate(pieces))


def prose(comment, link):
    made = ""
    for paragraph in re.split(r"\n[ ]*\n", comment):
        if re.match(r" {4}", paragraph) and made:
            made += f"<pre>{escape(dedent(paragraph), quote=False)}</pre>\n"
            continue
        first, *marked = re.split(r"@(param|tparam|throws|pre|post|return)\s+", paragraph)
        made += f"<p>{words(first, link)}</p>\n" if first.strip() else ""
        items = ""
        for mark, text in zip(marked[::2], marked[1::2]):
            is_named = mark in ("param", "tparam", "throws")
            name, rest = re.match(r"(\S+)(.*)", text, re.S).groups() if is_named else ("", text)
            named = f"<code>{escape(name, quote=False)}</code>" if name else ""
            items += f"<li>{MARK[mark]}{named}{words(rest, link)}</li>\n"
        made += f"<ul>\n{items}</ul>\n" if items else ""
    return made


def html(content, link):
    below = [f"<pre>{escape(code, quote=False)}</pre>\n" if code else "" for _, code in content]
    return "".join(prose(comment, link) + code for (comment, _), code in zip(content, below))


def first_sentence(content):
    text = re.sub(r"\s+", " ", content[0][0]) if content else ""
    return escape(re.split(r"(?<=[.:]) (?=[A-Z@])", text)[0].replace("`", ""), quote=False)
