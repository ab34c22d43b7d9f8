"""The drawing of error and seconds against the number of contacts."""

from harness.cost.curve import Point, Sample
from harness.report.figures.charts import contacts_chart


def point(contacts: int, error: float) -> Point:
    cpu = 0.05 * contacts
    errors = [error * (1.0 + 0.1 * k) for k in range(3)]
    samples = tuple(Sample(f"run {k}", "mug", errors[k], 2e-3, 0.05, cpu, cpu) for k in range(3))
    return Point("p", {}, {"contacts": contacts}, samples)


def test_no_two_settings_look_alike() -> None:
    curves = [(f"setting {n}", [(k, point(k, (n + 1) * 1e-3)) for k in (2, 4, 6)]) for n in range(12)]
    figure = contacts_chart(curves)
    for axes in figure.axes:
        drawn = [line for line in axes.lines if line.get_linestyle() != "None"]
        looks = [(line.get_color(), line.get_linestyle(), line.get_marker()) for line in drawn]
        assert len(set(looks)) == len(curves)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [name for name, _ in curves]
