"""The reference of every public name, one page: ``python analysis/reference.py [OUT]``.

Writes ``reference.html`` into OUT (``report`` if not given): each name with its signature, what its
documentation says and its example, as the docstrings have them. The tests run the examples.
"""

import inspect
import re
import sys
import types
from html import escape
from pathlib import Path
from typing import Any

import vsctrl as vs
from vsctrl.files import write

ROOMS = ("vsctrl", "loop", "derive", "paper", "servo", "study", "plots")
HEAD = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>vsctrl: every public name</title>
<style>
:root { color-scheme: light dark; --paper: #fdfdfb; --ink: #1c2330; --soft: #5c6472;
  --rule: #d9dbe0; --card: #f4f5f2; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171c; --ink: #e4e6ea; --soft: #9aa3b0;
  --rule: #333944; --card: #1c2027; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 56rem; background: var(--paper);
  color: var(--ink); font: 16px/1.5 "Source Serif 4", Charter, Georgia, "Times New Roman", serif; }
h2 { margin: 3rem 0 .5rem; } h3 { margin: 1.6rem 0 .2rem; font-size: 1.05rem; }
section { border-top: 1px solid var(--rule); }
p, pre { margin: .4rem 0; max-width: 100%; } a { color: inherit; }
p { white-space: pre-line; } .call { color: var(--soft); overflow-wrap: anywhere; }
pre { background: var(--card); padding: .6rem .8rem; overflow-x: auto; font-size: .85rem; }
nav { columns: 11rem; font-size: .9rem; } nav a { display: block; overflow-wrap: anywhere; }
</style>
</head>
<body>
<main>
<h1>vsctrl: every public name</h1>
<p>Examples begin after <code>import vsctrl as vs</code> and <code>import numpy as np</code>.
They are run whenever the tests are.</p>
"""


def main(out: Path) -> Path:
    """Write the page and return its path."""
    out.mkdir(parents=True, exist_ok=True)
    parts = [HEAD]
    for room in ROOMS:
        print(f"{room} …", file=sys.stderr, flush=True)
        parts.append(chapter(room, vs if room == "vsctrl" else getattr(vs, room)))
    write(out / "reference.html", "".join([*parts, "</main>\n</body>\n</html>\n"]), "page")
    return out / "reference.html"


def chapter(room: str, module: types.ModuleType) -> str:
    """The names of a room, with links to each."""
    values = {name: getattr(module, name) for name in sorted(module.__all__)}
    prefix = "vs" if room == "vsctrl" else f"vs.{room}"
    shown = {n: v for n, v in values.items() if callable(v) and not isinstance(v, types.ModuleType)}
    links = "".join(f'<a href="#{prefix}.{name}">{name}</a>' for name in shown)
    said = paragraphs(inspect.getdoc(module) or "")
    entries = "".join(entry(f"{prefix}.{name}", value) for name, value in shown.items())
    return f'<h2 id="{room}">{prefix}</h2>{said}<nav aria-label="{prefix}">{links}</nav>{entries}'


def entry(name: str, value: Any) -> str:
    """One name: its signature and what its docstring says."""
    call = f'<p class="call">{escape(signature(value))}</p>'
    said = paragraphs(inspect.getdoc(value) or "")
    return f'<section><h3 id="{name}"><a href="#{name}">{name}</a></h3>{call}{said}</section>\n'


def signature(value: Any) -> str:
    """How it is called, without the types, which the text tells."""
    try:
        found = inspect.signature(value)
    except (TypeError, ValueError):
        return ""
    plain = [p.replace(annotation=p.empty) for p in found.parameters.values()]
    shown = str(found.replace(parameters=plain, return_annotation=found.empty))
    return re.sub(r"<function <lambda> at 0x\w+>|<factory>", "…", shown)


def paragraphs(text: str) -> str:
    """The paragraphs of a docstring, examples as they would be typed."""
    return "".join(
        f"<pre tabindex='0'>{escape(part)}</pre>"
        if part.lstrip().startswith(">>>")
        else f"<p>{escape(part)}</p>"
        for part in re.split(r"\n\n+", text)
        if part.strip()
    )


if __name__ == "__main__":
    print(main(Path(sys.argv[1] if len(sys.argv) > 1 else "report")))
