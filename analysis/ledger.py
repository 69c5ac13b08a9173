"""The ledger of the paper as one page: every equation as printed, what it is, and its proof.

Run it with ``python analysis/ledger.py [OUT]``; it proves every claim, writes ``ledger.html`` into
OUT (``report`` if not given) and prints the claims that are not as printed.
"""

import re
import sys
from collections import Counter
from pathlib import Path

import jinja2
import latex2mathml.converter
from markupsafe import Markup

import vsctrl as vs
from vsctrl.derive.claims import as_text

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Trajectory generation by visual servoing: the equations, proved</title>
<style>
:root {
  color-scheme: light dark;
  --paper: #fdfdfb; --ink: #1c2330; --soft: #5c6472; --rule: #d9dbe0; --card: #f4f5f2;
  --holds: #1b7f5c; --erratum: #b3261e; --conditional: #8a5d00; --ambiguous: #5b4bb3;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171c; --ink: #e4e6ea; --soft: #9aa3b0; --rule: #333944; --card: #1c2027;
    --holds: #4fc79b; --erratum: #ff8a80; --conditional: #e0b24a; --ambiguous: #aea2ff;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 62rem;
  background: var(--paper); color: var(--ink);
  font: 16px/1.5 "Source Serif 4", Charter, Georgia, "Times New Roman", serif;
}
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.25rem; margin: 3rem 0 0; }
p { max-width: 46rem; margin: .3rem 0; }
.soft, .proof { color: var(--soft); font-size: .92rem; }
.claim {
  display: grid; grid-template-columns: 9.5rem minmax(0, 1fr); gap: 0 1.2rem;
  padding: .9rem 0; border-top: 1px solid var(--rule);
}
.claim:target { background: var(--card); }
.number { font-weight: 600; text-decoration: none; color: inherit; }
.badge { display: block; font-size: .88rem; }
.badge::before { content: "● "; }
.holds { color: var(--holds); } .erratum { color: var(--erratum); }
.conditional { color: var(--conditional); } .ambiguous { color: var(--ambiguous); }
.formula { overflow-x: auto; padding: .25rem 0; }
.correction {
  border-left: 3px solid var(--rule); padding-left: .8rem; margin: .5rem 0;
}
.found { font-size: .86rem; overflow-wrap: anywhere; }
@media (max-width: 40rem) { .claim { grid-template-columns: 1fr; } .badge { display: inline; } }
@media print { .claim { break-inside: avoid; } body { max-width: none; } }
</style>
</head>
<body>
<header>
<h1>The equations of the paper, proved</h1>
<p>Berry, Martinet and Gallice, <i>Trajectory generation by visual servoing</i> (1997), statement
by statement. {{ rows|length }} claims:
{%- for status, number in counts %}
 <span class="{{ status }}">{{ number }} {{ words[status] }}</span>
{{- ";" if not loop.last else "." }}
{%- endfor %}</p>
<p class="soft">Each status is what SymPy found when this page was written: a statement holds where
its residual simplifies to exactly zero; an erratum has a place where the printed form fails and a
corrected form whose residual is zero; a conditional statement fails in general and holds under the
condition named; an ambiguous one has readings that differ. The interaction matrix, Lᵀ in the
paper, is L here.</p>
</header>
{% for section, members in sections %}
<h2>{{ "Abstract" if section == "abstract" else "Section " ~ section }}</h2>
{% for claim, proof in members %}
<article class="claim" id="{{ claim.equation|anchor }}">
<div><a class="number" href="#{{ claim.equation|anchor }}">{{ claim.equation }}</a>
<span class="badge {{ proof.found }}">{{ proof.found }}</span></div>
<div>
{% if claim.formula %}
<div class="formula">{{ claim.formula|math }}</div>
{% endif %}
{% if not claim.formula or claim.statement is wordy %}
<p>{{ claim.statement }}</p>
{% endif %}
{% if claim.correction %}
<p class="correction">{{ claim.correction|code }}</p>
{% endif %}
<p class="proof">{{ proof.explanation|code }}
{%- if proof.residual != "0" %}
 <span class="found">{{ found[proof.found] }}: {{ proof.residual }}.</span>
{%- endif %}</p>
</div>
</article>
{% endfor %}
{% endfor %}
</body>
</html>
"""
WORDS = {
    "holds": "hold as printed",
    "conditional": "hold under a condition",
    "ambiguous": "can be read in ways that differ",
    "erratum": "are errata",
}
FOUND = {"conditional": "In general", "ambiguous": "Readings", "erratum": "As printed"}


def main(out: Path | None = None) -> Path:
    """Prove every claim, write ``ledger.html`` into ``out`` and return its path."""
    proved = [(claim, claim.prove()) for claim in vs.derive.ledger()]
    failed = [claim.equation for claim, proof in proved if not proof]
    if failed:
        raise SystemExit(f"The proofs of {', '.join(failed)} do not confirm their status.")
    folder = out or Path("report")
    folder.mkdir(parents=True, exist_ok=True)
    written = folder / "ledger.html"
    written.write_text(page(proved), encoding="utf-8")
    print(as_text(claim for claim, _ in proved if claim.status != "holds"))
    return written


def page(proved: list[tuple[vs.derive.Claim, vs.derive.Proof]]) -> str:
    """The text of the page: all text escaped, formulas as MathML, no script."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"math": mathml, "anchor": anchor, "code": code}
    environment.tests["wordy"] = re.compile("[a-z]{5}").search
    sections: dict[str, list[tuple[vs.derive.Claim, vs.derive.Proof]]] = {}
    for claim, proof in proved:
        sections.setdefault(claim.section, []).append((claim, proof))
    number = Counter(proof.found for _, proof in proved)
    return environment.from_string(PAGE).render(
        rows=proved,
        counts=[(status, number[status]) for status in WORDS],
        words=WORDS,
        found=FOUND,
        sections=list(sections.items()),
    )


def mathml(latex: str) -> Markup:
    """A formula in LaTeX as MathML."""
    text = latex2mathml.converter.convert(latex, display="block")
    return Markup(re.sub(r' xmlns="[^"]*"', "", text))


def anchor(equation: str) -> str:
    """What a link says after #: eq-14 for (14)."""
    return "eq-" + re.sub(r"\W+", "-", equation).strip("-")


def code(text: str) -> Markup:
    """Text with names in backquotes as code."""
    parts = re.split("`+", text)
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else part for i, part in enumerate(parts)
    )


if __name__ == "__main__":
    print(f"\n{main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)}")
