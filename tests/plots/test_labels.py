"""Names beside points: they hide neither each other nor the points, and stay inside the axes."""

from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from flybystab.plots.labels import label_points


def labelled(points, others=None):
    figure = Figure(figsize=(4, 3), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set(xscale="log", xlim=(1, 100), ylim=(0, 1))
    assert label_points(axes, points, others, fontsize=7) is axes
    figure.draw_without_rendering()
    return axes, [Text.get_window_extent(text) for text in axes.texts]  # without the line to the point


def test_neighbours_keep_apart_inside_the_axes():
    rng = np.random.default_rng(0)
    crowd = np.column_stack([10 ** rng.normal(1.0, 0.05, 8), rng.normal(0.5, 0.03, 8)])
    points = [(1.0, 0.0, "the lower corner"), (100.0, 1.0, "the upper corner")]
    points += [(*xy, f"body {i}") for i, xy in enumerate(crowd)]
    axes, boxes = labelled(points)
    assert len(boxes) == len(points)
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    frame = axes.get_window_extent().padded(1.0)
    assert all(frame.contains(*box.min) and frame.contains(*box.max) for box in boxes)
    marks = axes.transData.transform([(x, y) for x, y, _ in points])
    assert not any(box.contains(*mark) for box in boxes for mark in marks)


def test_a_lone_point_has_its_name_close_by():
    _, (box,) = labelled([(10.0, 0.5, "alone")])
    assert box.width < 60
    axes, _ = labelled([(10.0, 0.5, "alone")])
    mark = axes.transData.transform((10.0, 0.5))
    nearest = np.clip(mark, box.min, box.max)
    assert np.hypot(*(nearest - mark)) < 12


def test_names_without_a_place_are_left_out():
    _, boxes = labelled([(10.0, 0.5, f"one of very many names {i}") for i in range(60)])
    assert 3 < len(boxes) < 60
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_names_with_dollar_signs_and_control_characters_are_shown_as_they_are():
    # $x^$ is no formula that matplotlib can read
    axes, boxes = labelled([(10.0, 0.5, "$x^$"), (50.0, 0.2, "\x1b[31mred"), (2.0, 0.8, "1 $ and 2 $")])
    assert len(boxes) == 3
    assert sorted(t.get_text() for t in axes.texts) == ["1 \\$ and 2 \\$", r"\$x^\$", r"\x1b[31mred"]
    _, same = labelled([(10.0, 0.5, "x^")])
    assert boxes[0].width > same[0].width  # the two signs are drawn
