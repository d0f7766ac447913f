"""The study of adequacy: rows with known counts, and one draw."""

import hydrodamp as hd


def test_terms_are_dropped_by_label(study):
    model = study.drop_terms(hd.catalog["fossen"], ["X_u", "N_r|r|"])
    assert set(hd.catalog["fossen"].labels) - set(model.labels) == {"X_u", "N_r|r|"}


def test_results_are_counted_by_form_and_size(study):
    log = "ROV", 45.0, 1.0, 0, "fossen"
    rows = [
        study.Row(*log, study.TRUE_FORM, [], 0.0, "adequate", [], []),
        study.Row(*log, study.TRUE_FORM, [], 0.0, "effective", ["N"], ["N_v"]),
        study.Row(*log, study.LACKS_ONE, ["N_r"], 7.0, "effective", ["M", "N"], ["N_r"]),
        study.Row(*log, study.LACKS_ONE, ["N_r|r|"], 3.0, "adequate", [], []),
        study.Row(*log, study.LACKS_ONE, ["X_u"], 20.0, "inadequate", ["X"], ["X_v"]),
        study.Row(*log, study.LACKS_THREE, ["X_u", "Y_v", "Z_w"], 4.0, "none", [], []),
    ]
    assert [row.is_right for row in rows] == [True, False, True, False, True, False]
    text = study.summarise(rows)
    assert "| ROV | true | 1 | 2 | 50 | 1 | 1 | 0 |" in text
    assert "| all |  |  | 6 | 50 | 2 | 2 | 1 |" in text
    for line in ("2 to 5 | 1 | 0 | 0 | 0 | 0", "5 to 10 | 1 | 1 | 1 | 0 | 1"):
        assert f"| {line} |" in text
    assert r"| ROV | 45 | 1 | fossen | lacks one | N_r\|r\| | 3.0 | adequate |" in text


def test_a_missing_term_is_one_that_the_log_determines(study):
    true, wrong = study.simulate("ROV", 45.0, 0.0, 0)
    assert (true.form, wrong.form, true.is_right) == (study.TRUE_FORM, study.LACKS_ONE, True)
    assert len(wrong.missing) == 1
    assert wrong.size >= study.MIN_SIZE
