"""Typesets the plain notation of our pages as MathML, which browsers draw by themselves: x_t, r~_ik, w^, |z_l - z_il| <= r_l.

A formula is found by its form: names with a subscript, single letters, Greek names, and what operators and brackets join to
these. Words end it. It may wrap at its outer relations and sums, so that a line of a phone is never too short for it.
"""
import re
from html import escape

GREEK = dict(zip("alpha beta gamma delta eps eta theta lambda mu pi rho sigma tau phi".split(), "αβγδεηθλμπρστφ"))
FUNCTIONS = set("abs atan2 ball ceiling conv cos diag dist dt exp fl floor growth hypot log log1p lower max mid min pow sin sqrt "
                "sup tan tanh ulp union unit upper".split())
SIGNS = {"<=": "≤", ">=": "≥", "+-": "±", "-+": "∓", "->": "→", "<-": "←", "..": "…", ".": "·", "*": "·", "-": "−"}
WRITTEN = {"inf": "∞", "int": "∫", "sum": "∑", "union": "∪"}
BREAKS = {"=", "<", ">", "<=", ">=", "+", "-", "+-", "-+", "->", "<-"}  # where a formula may wrap
LONGEST = 24  # characters of what may not wrap
CLOSING = {"(": ")]", "[": "])", "{": "}", "<": ">"}  # of intervals one end may be open

# A hat is a ^ with nothing to raise; a sign directly behind a name, and before none, is raised.
NAME = r"(?P<name>[A-Za-z]+\d?(?![A-Za-z0-9]))"
AFTER = (r"(?P<accent>~|\^(?=[\s_,.;:)\]|]|$))?(?P<prime>'+(?![A-Za-z]))?"
         r"(?P<sup>\^(?:\{[^}]*\}|\([^)]*\)|-?\w+?(?=_|\b)))?(?P<sub>_(?:\{[^}]*\}|[A-Za-z0-9]+(?:,[a-z](?:\+1)?)?))?"
         r"(?P<sup2>\^(?:\{[^}]*\}|\([^)]*\)|-?\w+))?(?P<raised>(?:\+-|[+-])(?=[\s,)\]|^]|$)(?P<last>\^-?\w+)?)?")
TOKEN = re.compile(
    r"(?P<word>\d*[A-Za-z]+(?:-[A-Za-z]+)+|\d+-[A-Za-z]\w*|[\d.]+'s\b|[A-Za-z]+'[a-z]\w*|[A-Za-z]\w*[.:]\w+)"
    rf"|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![A-Za-z_]))(?P<power>\^(?:-?\w+|\([^)]*\)))?|{NAME}{AFTER}"
    r"|(?P<open>[(\[{]|<(?=[^\s=<]))|(?P<sign><=|>=|\+-|-\+|->|<-|\.\.|(?<=\s)\.(?=\s)|[=+\-*/<])"
    r"|(?P<close>[)\]}]|(?<=\S)>(?=[\s,.;:)]|$))(?P<closed_sup>\^(?:\{[^}]*\}|-?\w+(?:_\w+)?|\([^)]*\)))?(?P<closed_sub>_\w+)?"
    r"|(?P<bar>\|)(?P<bar_sup>\^-?\w+)?(?P<bar_sub>_\w+)?|(?P<late>>)|(?P<comma>[,;:])|(?P<space>\s+)|(?P<other>.)")


class Token:
    def __init__(self, match):
        self.kind, self.text, self.parts = match.lastgroup, match.group(), match.groupdict()
        for kind in ("word", "number", "name", "open", "close", "bar"):
            if self.parts[kind]:
                self.kind = kind
        if self.kind == "late":
            self.kind = "sign"
        self.strong = self.weak = False
        if self.kind == "name":
            name, letter = self.parts["name"], len(self.parts["name"].rstrip("0123456789")) == 1
            marked = any(self.parts[part] for part in ("accent", "prime", "sup", "sub", "sup2", "raised"))
            self.strong = (name in GREEK or name == "inf" or (letter and (name not in "aAI" or marked))
                           or bool(self.parts["sub"] or self.parts["accent"]))
            self.weak = not self.strong and (name in FUNCTIONS or name == "Box" or letter)
            is_identifier = len(name) > 2 and len(self.parts["sub"] or "") > 4  # signed_square
            if is_identifier or not (self.strong or self.weak):
                self.kind = "word"
        if self.kind == "number" and self.parts["power"]:
            self.strong = True

    @property
    def is_text(self):
        return self.kind in ("word", "other")


def raised(text):
    return run(re.sub(r"^[{(]?|[})]$", "", text) if text[:1] == "{" else text)


def below(text):
    """A subscript: of several indices each is a letter."""
    if text[0] == "{":
        return run(text[1:-1])
    if text == "inf":
        return "<mo>∞</mo>"
    if text in GREEK:
        return f"<mi>{GREEK[text]}</mi>"
    if len(text) > 3 and text.isalpha():
        return f"<mi>{text}</mi>"
    tags = ["mn" if letter.isdigit() else "mi" if letter.isalpha() else "mo" for letter in text]
    return "<mrow>" + "".join(f"<{tag}>{letter}</{tag}>" for tag, letter in zip(tags, text)) + "</mrow>"


def scripts(base, sub, sup):
    if sub and sup:
        return f"<msubsup>{base}{sub}{sup}</msubsup>"
    return f"<msub>{base}{sub}</msub>" if sub else f"<msup>{base}{sup}</msup>" if sup else base


def named(parts):
    name = parts["name"]
    digit = name[-1] if name[-1].isdigit() and len(name) == 2 else ""
    base = f"<mo>{WRITTEN[name]}</mo>" if name in WRITTEN else f"<mi>{GREEK.get(name, name[:-1] if digit else name)}</mi>"
    if parts["accent"]:
        base = f'<mover accent="true">{base}<mo stretchy="false">{parts["accent"]}</mo></mover>'
    above = ""
    for part in ("sup", "sup2"):
        above += raised(parts[part][1:]) if parts[part] else ""
    if parts["raised"]:
        sign = parts["raised"].partition("^")[0]
        above += f"<mo>{SIGNS.get(sign, sign)}</mo>"
    if parts["last"]:
        base, above = scripts(base, "", above), raised(parts["last"][1:])
    sub = (f"<mn>{digit}</mn>" if digit else "") + (below(parts["sub"][1:]) if parts["sub"] else "")
    made = scripts(base, sub and f"<mrow>{sub}</mrow>", above and f"<mrow>{above}</mrow>")
    prime = "′" * len(parts["prime"] or "")
    return f'<mrow>{made}<mo lspace="0" rspace="0">{prime}</mo></mrow>' if prime else made


def fence(sign, sub, sup):
    base = f'<mo stretchy="false" lspace="0" rspace="0">{escape(sign)}</mo>'
    return scripts(base, sub and below(sub[1:]), sup and raised(sup[1:]))


def element(token, tokens, i):
    parts = token.parts
    if token.kind == "name":
        return named(parts)
    if token.kind == "number":
        digits = parts["number"]
        return scripts(f"<mn>{digits}</mn>", "", parts["power"] and raised(parts["power"][1:]))
    if token.kind == "open":
        return fence(parts["open"].replace("<", "⟨"), "", "")
    if token.kind == "close":
        return fence(parts["close"].replace(">", "⟩"), parts["closed_sub"], parts["closed_sup"])
    if token.kind == "bar":
        return fence("|", parts["bar_sub"], parts["bar_sup"])
    if token.kind == "space":  # a word of a formula keeps its distance
        near = [tokens[k].parts.get("name") or "" for k in (i - 1, i + 1) if 0 <= k < len(tokens)]
        wide = any(len(name.rstrip("0123456789")) > 1 and name not in GREEK for name in near) or (
            i + 1 < len(tokens) and tokens[i + 1].kind == "open")
        return '<mspace width="0.2em"></mspace>' if wide else ""
    if token.kind == "sign":
        before = next((each for each in reversed(tokens[:i]) if each.kind != "space"), None)
        is_first = before is None or before.kind in ("open", "comma", "sign", "bar")
        is_prefix = is_first and i + 1 < len(tokens) and tokens[i + 1].kind != "space"
        apart = ' form="prefix" lspace="0" rspace="0"' if is_prefix else ""
        return f"<mo{apart}>{escape(SIGNS.get(token.text, token.text))}</mo>"
    if token.kind == "times":
        return "<mo>×</mo>"
    tag = "mo" if token.kind == "comma" else "mtext"
    return f"<{tag}>{escape(token.text)}</{tag}>"


def tokens_of(text):
    return [Token(match) for match in TOKEN.finditer(text)]


def run(text):
    tokens = tokens_of(text)
    return "<mrow>" + "".join(element(token, tokens, i) for i, token in enumerate(tokens)) + "</mrow>"


def mark_times(tokens):
    """x between brackets is a product of sets."""
    for i in range(2, len(tokens) - 2):
        if tokens[i].text == "x" and tokens[i - 1].kind == tokens[i + 1].kind == "space":
            if tokens[i + 2].kind == "open" and (tokens[i - 2].kind == "close" or tokens[i - 2].strong):
                tokens[i].kind = "times"


def balanced(tokens):
    """Pieces of a run in which every bracket has its partner, cut at commas outside of brackets."""
    stack, cut, bars = [], set(), []
    for i, token in enumerate(tokens):
        if token.kind == "open":
            stack.append(i)
        elif token.kind == "close":
            if stack and token.parts["close"] in CLOSING[tokens[stack[-1]].parts["open"]]:
                stack.pop()
            else:
                cut.add(i)
        elif token.kind == "bar":
            bars.append(i)
    cut.update(stack)
    if len(bars) % 2:
        cut.update(bars)
    depth, piece = 0, []
    for i, token in enumerate(tokens):
        if i in cut or (token.kind == "comma" and depth == 0):
            yield piece
            yield [token]
            piece = []
            continue
        depth += (token.kind == "open") - (token.kind == "close")
        piece.append(token)
    yield piece


def trimmed(piece):
    """(what stands before, the formula, what stands after)."""
    begin, end = 0, len(piece)
    first = 1 if piece and piece[0].kind == "space" else 0
    kinds = [token.kind for token in piece[first:first + 4]]
    if kinds == ["open", "name", "close", "space"] and len(piece[first + 1].text) == 1:
        begin = first + 3  # (b), of a list
    while begin < end:
        token = piece[begin]
        glued = token.text in ("-", "+-", "-+") and begin + 1 < end and piece[begin + 1].kind != "space"
        article = token.text in ("a", "A", "I") and begin + 1 < end and piece[begin + 1].kind == "space" and not (
            begin + 2 < end and piece[begin + 2].kind == "sign")
        if token.kind in ("space", "comma") or (token.kind == "sign" and not glued) or article:
            begin += 1
        else:
            break
    while end > begin:
        if piece[end - 1].kind in ("space", "comma", "sign"):
            end -= 1
        elif [token.kind for token in piece[begin:end][-4:]] == ["space", "open", "number", "close"]:
            end -= 4  # (3.12), a reference
        else:
            break
    return piece[:begin], piece[begin:end], piece[end:]


def is_formula(piece):
    names = [token for token in piece if token.kind == "name"]
    if not any(token.strong for token in piece):
        return False
    if len(piece) == 3 and piece[0].kind == "open" and piece[1].kind == "name" and len(piece[1].text) == 1:
        return False  # (b), of a list
    units = [token for token in names if token.text in ("s", "m")]
    return not (len(names) == len(units) == 1 and piece[0].kind == "number" and len(piece) == 3)


def plain(tokens):
    written = [SIGNS[token.text] if token.text in ("<=", ">=", "+-", "..") else token.text for token in tokens]
    return escape("".join(written), quote=False)


def split(piece, limit):
    """Atoms and signs between which a line may end: at brackets no deeper than the limit."""
    atoms, depth, bars = [[]], 0, 0
    for i, token in enumerate(piece):
        depth += (token.kind == "open") - (token.kind == "close")
        bars += token.kind == "bar"
        apart = 0 < i < len(piece) - 1 and piece[i - 1].kind == piece[i + 1].kind == "space"
        outer = depth + bars % 2 <= limit
        if outer and apart and (token.text in BREAKS or token.kind == "times"):
            atoms += [[token], []]
        elif outer and limit and token.kind == "space" and piece[i - 1].kind == "comma":
            atoms.append([])
        else:
            atoms[-1].append(token)
    for atom in atoms:
        if limit < 3 and len("".join(token.text for token in atom)) > LONGEST:
            yield from split(atom, limit + 1)
        else:
            yield atom


def math_of(piece):
    made = []
    for atom in split(piece, 0):
        while atom and atom[0].kind == "space":
            atom = atom[1:]
        while atom and atom[-1].kind == "space":
            atom = atom[:-1]
        inner = "".join(element(token, atom, i) for i, token in enumerate(atom))
        made += [f"<math><mrow>{inner}</mrow></math>"] if inner else []
    return " ".join(made)


def typeset(text):
    """HTML of a piece of prose, its formulas as MathML."""
    text = re.sub(r"(?<=\s)\[\](?=\s|$)", "□", text)  # what ends a proof
    tokens, out, piece = tokens_of(text), [], []
    mark_times(tokens)

    def flush():
        for part in balanced(piece):
            before, formula, after = trimmed(part)
            out.append(plain(before) + (math_of(formula) if is_formula(formula) else plain(formula)) + plain(after))
        piece.clear()

    for token in tokens:
        if token.is_text:
            flush()
            out.append(plain([token]))
        else:
            piece.append(token)
    flush()
    return "".join(out)


def display(block):
    """HTML of an indented block: each line is formulas, several blanks apart."""
    lines = []
    for line in block.strip("\n").splitlines():
        parts = [typeset(part) for part in re.split(r"\s{2,}", line.strip())]
        lines.append(f"<p class=formula>{' &emsp; '.join(parts)}</p>")
    return "\n".join(lines) + "\n"
