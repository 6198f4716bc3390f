"""The roles of the book write what the ledger says, and refuse a sentence that says something else."""

from types import SimpleNamespace

import pytest

from tmalib.judging import NOT_REPRODUCED, REPRODUCED
from tmalib.judging.book import ledger, roles


def role(find, text, monkeypatch):
    """What a role writes for a small ledger."""
    small = {("p", "T", "x", "a"): REPRODUCED, ("p", "T", "y", "a"): NOT_REPRODUCED}
    claims = [SimpleNamespace(key=key, verdict=word) for key, word in small.items()]
    monkeypatch.setattr(ledger, "read_claims", lambda path: claims)
    return find(SimpleNamespace(srcdir="book"), text)


def test_a_false_verdict_in_a_sentence_is_refused(monkeypatch):
    assert role(roles.verdict, "reproduced <p; T; x; a>", monkeypatch) == "reproduced"
    assert role(roles.verdict, "p; T; y; a", monkeypatch) == "not reproduced"
    for false in ("reproduced <p; T; y; a>", "reproduced <p; T>", "p; T"):
        with pytest.raises(ValueError, match=r"the sentence says"):
            role(roles.verdict, false, monkeypatch)
    with pytest.raises(ValueError, match="nothing is judged"):
        role(roles.verdict, "reproduced <p; T; z; a>", monkeypatch)


def test_counts_come_from_the_ledger(monkeypatch):
    assert role(roles.count, "p; T", monkeypatch) == "2"
    assert role(roles.count, "p; T; not reproduced", monkeypatch) == "1 not reproduced"
    assert role(roles.count, "p; inconclusive", monkeypatch) == "0 inconclusive"
    with pytest.raises(ValueError, match="nothing is judged"):
        role(roles.count, "p; T 2; reproduced", monkeypatch)
