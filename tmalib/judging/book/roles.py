"""Numbers and verdicts of the ledger inside a sentence; one that the ledger does not have fails the build::

{printed}`paper; table; row; column`    the number as printed
{ours}`paper; table; row; column`       ours, with as many digits; or in a format, `...; column; .1f`
{verdict}`paper; table; row; column`    the verdict on one number
{verdict}`words <paper; table>`         the words, which must be the verdict on every number meant
{count}`paper; table`                   how many numbers; `paper; table; verdict`: with this verdict
{deviation}`name`                       a number of the figure of all deviations
"""

from docutils import nodes
from sphinx.util.docutils import ReferenceRole, SphinxRole

from ..deviations import counts
from ..verdict import SYMBOLS
from .ledger import load_claims, load_papers, ours_text, parse_key


class _Fails:
    """A role whose `text_for` says what to write, or raises."""

    def run(self):
        try:
            text = self.text_for()
        except (KeyError, ValueError) as problem:
            message = self.inliner.reporter.error(f"ledger: {problem}", line=self.lineno)
            return [self.inliner.problematic(self.rawtext, self.rawtext, message)], [message]
        return [nodes.inline(text, text, classes=["ledger"])], []

    def chosen(self, key):
        """The judged rows whose key starts so."""
        found = [claim for claim in load_claims(self.env) if claim.key[: len(key)] == key]
        if not found:
            raise ValueError(f"nothing is judged under {'; '.join(key)!r}")
        return found


class PrintedRole(_Fails, SphinxRole):
    def text_for(self):
        paper, *key = parse_key(self.text, 4)
        return load_papers(self.env)[paper].printed(*key).printed


class OursRole(_Fails, SphinxRole):
    def text_for(self):
        key = parse_key(self.text, 4)
        (claim,) = self.chosen(key[:4])
        return format(claim.ours, key[4]) if len(key) > 4 else ours_text(claim)


class VerdictRole(_Fails, ReferenceRole):
    def text_for(self):
        key = parse_key(self.target, 2)
        verdicts = {claim.verdict for claim in self.chosen(key)}
        said = self.title if self.has_explicit_title else ", ".join(verdicts)
        if verdicts != {said}:
            raise ValueError(f"the sentence says {said!r}, the ledger {sorted(verdicts)} of {key}")
        return said


class CountRole(_Fails, SphinxRole):
    def text_for(self):
        *key, last = parse_key(self.text, 1)
        if last not in SYMBOLS:
            return str(len(self.chosen((*key, last))))
        return f"{sum(claim.verdict == last for claim in self.chosen(tuple(key)))} {last}"


class DeviationRole(_Fails, SphinxRole):
    def text_for(self):
        name, *form = parse_key(self.text, 1)
        return format(float(counts(load_claims(self.env))[name]), form[0] if form else ".0f")


def setup(app):
    roles = {"printed": PrintedRole, "ours": OursRole, "verdict": VerdictRole, "count": CountRole}
    for name, role in (roles | {"deviation": DeviationRole}).items():
        app.add_role(name, role())
