"""The files of one figure, as a cell shows it."""

import base64

import pytest
from nbformat import v4

from tmalib.judging.export import write_figure


def shown(svg, pdf=b"%PDF"):
    data = {"image/svg+xml": svg, "application/pdf": base64.b64encode(pdf).decode()}
    return v4.new_output("display_data", data)


def test_a_figure_is_written_in_both_formats(tmp_path):
    cell = v4.new_code_cell(outputs=[v4.new_output("stream", text="a word"), shown("<svg>α</svg>")])
    assert write_figure(cell, tmp_path, "toy/fig") == ["toy/fig.svg", "toy/fig.pdf"]
    assert (tmp_path / "toy/fig.svg").read_text(encoding="utf-8") == "<svg>α</svg>"
    assert (tmp_path / "toy/fig.pdf").read_bytes() == b"%PDF"


@pytest.mark.parametrize("count", [0, 2])
def test_a_cell_that_shows_none_or_two_is_refused(tmp_path, count):
    cell = v4.new_code_cell(outputs=[shown("<svg/>")] * count)
    with pytest.raises(ValueError, match=f"toy/fig shows {count} figures"):
        write_figure(cell, tmp_path, "toy/fig")
    assert not list(tmp_path.iterdir())
