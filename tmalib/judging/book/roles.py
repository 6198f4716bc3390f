"""Numbers and verdicts of the ledger inside a sentence; one that the ledger does not have fails the build::

{printed}`paper; table; row; column`    the number as printed
{ours}`paper; table; row; column`       ours, with as many digits; or in a format, `...; column; .1f`
{verdict}`paper; table; row; column`    the verdict on one number
{verdict}`words <paper; table>`         the words, which must be the verdict on every number meant
{count}`paper; table`                   how many numbers; `paper; table; verdict`: with this verdict
{tested}`name`                          a number of the figure of all probabilities, or `name; .1f`
{version}`package`                      the version of an installed package
"""

from importlib.metadata import version as version_of

from docutils import nodes
from sphinx.util.docutils import SphinxRole

from ..drawings import counts
from ..paper import read_papers
from .ledger import ALL_SYMBOLS, claims_under, parse_key, written


class LedgerRole(SphinxRole):
    """A role that writes what ``find(env, text)`` returns; what that refuses is an error of the page."""

    def __init__(self, find):
        self.find = find

    def run(self):
        try:
            text = self.find(self.env, self.text)
        except (KeyError, ValueError) as problem:
            message = self.inliner.reporter.error(f"ledger: {problem}", line=self.lineno)
            return [self.inliner.problematic(self.rawtext, self.rawtext, message)], [message]
        return [nodes.inline(text, text, classes=["ledger"])], []


def printed(env, text):
    paper, *key = parse_key(text, 4)
    return read_papers()[paper].printed(*key).printed


def ours(env, text):
    key = parse_key(text, 4)
    (claim,) = claims_under(env, key[:4])
    return format(claim.ours, key[4]) if len(key) > 4 else written(claim)[1]


def verdict(env, text):
    words, _, key = text.removesuffix(">").rpartition("<")
    verdicts = {claim.verdict for claim in claims_under(env, parse_key(key, 2))}
    said = words.strip() or ", ".join(verdicts)
    if verdicts != {said}:
        raise ValueError(f"the sentence says {said!r}, the ledger {sorted(verdicts)} of {key}")
    return said


def count(env, text):
    *key, last = parse_key(text, 1)
    if last not in ALL_SYMBOLS:
        return str(len(claims_under(env, (*key, last))))
    return f"{sum(claim.verdict == last for claim in claims_under(env, tuple(key)))} {last}"


def tested(env, text):
    name, *form = parse_key(text, 1)
    return format(float(counts(claims_under(env))[name]), form[0] if form else ".0f")


def version(env, text):
    return version_of(text)
