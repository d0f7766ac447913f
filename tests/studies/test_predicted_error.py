"""The study of predicted errors: tables of rows with known averages."""


def test_shares_and_ratios_are_averages_over_draws(study):
    rows = [
        study.Row("white", draw, "m", "yaw", name, covered, 2.0, 2.0 * ratio)
        for draw, name, covered, ratio in (
            (0, "u", 1.0, 1.0),
            (0, "r", 0.8, 2.0),
            (1, "u", 0.9, 3.0),
            (1, "r", 0.5, 4.0),
        )
    ]
    assert "| white | `m` | 2 | 80 ± 10 | 95 |  |  |  |  | 65 |" in study.coverage_table(rows)
    assert "| white | `m` | 2.5 (1.3 to 3.7) |" in study.size_table(rows)
