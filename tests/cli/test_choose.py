"""Two models of one name would be one row and one file."""

import json

import pytest

from hydrodamp.identification.stepwise import StepwiseSelection

LINE = "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls --models "
TWO = "models:\n- {name: heavy, terms: {X: u|u|, N: r|r|}}\n- {name: light, terms: {X: u, N: r}}\n"


@pytest.mark.parametrize(
    ("key", "listed"),
    [
        ("Sparse", "mine.yaml,sparse"),
        ("Linear", "linear,mine.yaml"),
    ],
)
def test_two_models_of_one_name_are_refused(key, listed, folder, call, monkeypatch):
    (folder / "mine.yaml").write_text(f"name: {key}\nterms: {{X: [u], Y: [v]}}\n", "utf-8")
    monkeypatch.setattr(StepwiseSelection, "select", lambda *_: pytest.fail("selected for minutes"))
    done = call(LINE + listed, 2)
    assert f"two different models are called '{key}'" in done.stderr


def test_one_model_of_a_file_goes_by_its_name(folder, call):
    (folder / "two.yaml").write_text(TWO, "utf-8")
    document = json.loads(call(f"{LINE}linear,two.yaml:light --json").stdout)
    assert [row["model"] for row in document["rows"]] == ["linear", "light"]
    assert "two.yaml" in document["provenance"]["files"]
    one = call("identify a.csv --vehicle planar.yaml --method ls --json --model two.yaml:heavy")
    assert set(json.loads(one.stdout)["coefficients"]) == {"X_u|u|", "N_r|r|"}


IDENTIFY = "identify a.csv --vehicle planar.yaml"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "list models two.yaml:lihgt",
            "there is no model 'lihgt'. Did you mean 'light'? There are: heavy",
        ),
        (f"{IDENTIFY} --model two.yaml", "names several models: heavy, light"),
    ],
)
def test_models_that_are_not_there(folder, call, line, said):
    (folder / "two.yaml").write_text(TWO, "utf-8")
    done = call(line, 2)
    assert said in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    "line",
    [
        "compare lamp.csv --train one --test two --models linear,sparse",
        "identify lamp.csv --model sparse",
        "compare lamp.csv --folds 2 --models sparse",
    ],
)
def test_a_command_that_is_missed_is_told_before_terms_are_selected(
    folder, call, monkeypatch, line
):
    text = (folder / "ab.csv").read_text("utf-8")
    (folder / "lamp.csv").write_text(text.replace("turn", "lamp", 1), "utf-8")
    monkeypatch.setattr(StepwiseSelection, "select", lambda *_: pytest.fail("selected for minutes"))
    said = " ".join(call(f"{line} --vehicle planar.yaml", 2).output.split())
    assert "there is no command 'turn', which an actuator of 'planar' uses" in said
