"""Numbers and ticks of the pages of reports."""

import math

import pytest

pytest.importorskip("jinja2", reason="the pages of reports need jinja2 (pip install jinja2)")
pytest.importorskip("matplotlib", reason="the pages of reports need matplotlib (pip install matplotlib)")

from crt.report import figures, plots, text  # noqa: E402


def test_numbers_are_short_have_units_and_their_interval():
    assert [text.number(value) for value in (0.9996, 123456, 1.234e-7, None, 0, 999999)] == \
        ["1.00", "123000", "1.23·10⁻⁷", "–", "0", "1.00·10⁶"]
    assert text.number(-0.5, 2) == "−0.50"
    assert [text.percent(0.001, 1), text.seconds(0.9996), text.seconds(0.0123), text.seconds(600)] == \
        ["0.1 %", "1.00 s", "12.3 ms", "10.0 min"]
    assert [text.count(1024), text.count(1234567)] == ["1024", "1\u202f234\u202f567"]
    assert text.value_and_bounds({"value": 2, "low": 1.9, "high": 2.1}, "seconds") == \
        ("2.00 s", "1.90–2.10 s")
    assert text.value_and_bounds({"value": 0, "low": -1, "high": 1}, "number", 1) == ("0", "−1 to 1")
    assert text.value_and_bounds(None, "number") == ("–", "")
    assert text.error({"value": 0.001, "low": 0, "high": 0.0031}) == ("below 0.310 %", "")
    assert text.measured(0.2394603, [0.2394103, 0.2395103]) == ("0.239460", "[0.239410, 0.239510]")
    assert text.measured(1.0, None) == ("1", "") and text.measured(None, None) == ("", "")
    assert text.measured(-1234.6, [-1250, -1219])[0] == "−1235"


RANGES = [(low, low * factor) for low in (3e-9, 0.0007, 0.95, 1, 37)
          for factor in (1.04, 1.3, 2, 7, 30, 400, 1e6, 1e13)]


@pytest.mark.parametrize("low, high", RANGES)
def test_labels_of_an_axis_never_touch(low, high):
    for tick, ticks in ((figures.seconds_tick, plots.log_ticks), (figures.percent_tick, plots.log_ticks),
                        (figures.number_tick, plots.linear_ticks)):
        with plots.style():
            figure, axes = plots.canvas(3)
            if ticks is plots.log_ticks:
                axes.set_xscale("log")
            axes.set_xlim(low, high)
            plots.set_ticks(axes.xaxis, ticks(low, high), tick)
            plots.spread_labels(figure, axes.xaxis)
            figure.draw_without_rendering()
            assert not plots.touching(axes.xaxis)
            labels = [label.get_text() for label in axes.get_xticklabels()]
            assert 2 <= len(labels) <= 7 and len(set(labels)) == len(labels)


def test_ticks_are_round_and_within():
    assert plots.log_ticks(0.08, 400) == pytest.approx([0.1, 1, 10, 100])
    assert plots.log_ticks(0.15, 3.2) == pytest.approx([0.2, 0.5, 1, 2])
    assert plots.log_ticks(0.75, 1.33) == pytest.approx([0.8, 1, 1.2])
    assert plots.power_ticks(1, 2**20) == [2.0**e for e in range(0, 21, 3)]
    assert plots.power_ticks(0.9, 40) == [1, 2, 4, 8, 16, 32]
    assert plots.linear_ticks(-0.015, 0.015) == pytest.approx([-0.01, 0, 0.01])
    for low, high in RANGES:
        assert all(low * (1 - 1e-9) <= tick <= high * (1 + 1e-9) for tick in plots.log_ticks(low, high))
    assert all(math.log2(tick).is_integer() for tick in plots.power_ticks(3, 5000))
