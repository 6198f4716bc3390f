"""Phrases of a paper's text: measures with limits, as the paper's folder has them, and their judgement.

``phrases.toml`` says for each table of phrases and each of its rows what is measured, within which limits the
phrase holds, and where the limit comes from (`CHOSEN`). So no limit can be moved without its origin being
said, and the code that measures never decides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..montecarlo import Runs, Stream
from .paper import Paper
from .verdict import Ours, Verdicts, judge, within

CHOSEN = {  # where a limit comes from
    "paper": "limit from the paper's words",
    "derived": "limit that follows from the paper's number of runs",
    "before": "limit chosen by us before the value was seen",
    "after": "limit chosen by us after first values were seen",
}


@dataclass(frozen=True)
class Phrase:
    """A phrase: what measures it, the limits within which it holds, where they come from and it stands."""

    measure: str
    chosen: str
    at_least: float | None = None
    at_most: float | None = None
    where: str = ""
    erratum: str = ""  # on which the measure rests

    def __post_init__(self) -> None:
        if self.chosen not in CHOSEN:
            raise ValueError(f"chosen must be one of {list(CHOSEN)}, got {self.chosen!r}")
        if self.at_least is None and self.at_most is None:
            raise ValueError(f"a phrase needs at_least, at_most or both: {self.measure!r} has none")

    def holds(self, value: ArrayLike) -> Any:
        """Whether it holds, for one value or an array of them; a value that is NaN does not."""
        return within(value, self.at_least, self.at_most)

    def margin(self, value: Any) -> Any:
        """How many times better than the limit a value is; below one it does not hold."""
        value = np.asarray(value, dtype=float)
        with np.errstate(divide="ignore"):
            return value / self.at_least if self.at_most is None else self.at_most / np.abs(value)

    def decided(self, value: float, error: float, times: float = 3.0) -> bool:
        """Whether a value is so many standard errors away from each limit, on whichever side."""
        limits = [limit for limit in (self.at_least, self.at_most) if limit is not None]
        return all(abs(value - limit) >= times * error for limit in limits)


def phrases_of(paper: Paper, table: str) -> dict[str, Phrase]:
    """The phrases of a table of a `Paper`: a dict from row to `Phrase`.

    `ValueError` for a table without phrases, or whose rows are not those of kind text in the ledger.
    """
    if table not in paper.phrases:
        raise ValueError(f"{paper.key} has no phrases in {table!r}, only in {sorted(paper.phrases)}")
    found = {row: Phrase(**said) for row, said in paper.phrases[table].items()}
    rows = {key[1] for key, printed in paper.ledger.items() if key[0] == table and printed.kind == "text"}
    if rows != found.keys():
        raise ValueError(f"{paper.key}, {table}: phrases and ledger differ in {sorted(rows ^ found.keys())}")
    return found


def judge_phrases(
    paper: Paper, table: str, ours: Mapping[str, Ours | float], *, made_from: Iterable[Runs | Stream] = ()
) -> Verdicts:
    """Judge all phrases of a table of the ledger.

    Parameters
    ----------
    paper : Paper
    table : str
    ours : dict
        Row to `Ours` without limits, each row of the table once; a plain number stands for ``Ours(number)``.
    made_from : sequence of Runs or Stream

    Returns
    -------
    Verdicts

    Raises
    ------
    ValueError
        For other rows than those of the table.
    """
    phrases = phrases_of(paper, table)
    if set(ours) != set(phrases):
        raise ValueError(f"ours must be of the rows {list(phrases)}, got {list(ours)}")
    judged = {}
    for row, phrase in phrases.items():
        given = ours[row]
        found = given if isinstance(given, Ours) else Ours(float(given))
        measure = f"{phrase.measure} ({phrase.where})" if phrase.where else phrase.measure
        judged[row, "claim"] = replace(
            found,
            at_least=phrase.at_least,
            at_most=phrase.at_most,
            erratum=phrase.erratum,
            note="; ".join(filter(None, (measure, CHOSEN[phrase.chosen], found.note))),
        )
    return judge(paper, table, judged, made_from=made_from)
