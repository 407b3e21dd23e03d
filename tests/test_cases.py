"""Tables of cases in one test: each case is tried once, every failure is listed."""

import pytest
from cases import each_of


def test_every_failure_is_listed_and_every_case_tried(tmp_path):
    tried = []

    @each_of(("value", "most"), [(1, 2), (5, 2), (2, 2), (9, 3)])
    def small(tmp_path, value, most):
        tried.append(value)
        (tmp_path / "file").touch(exist_ok=False)
        assert value <= most

    with pytest.raises(AssertionError, match="2 of 4 cases fail") as error:
        small(tmp_path=tmp_path)
    assert tried == [1, 5, 2, 9]
    assert "case 2 (5, 2): AssertionError" in str(error.value)
    assert "case 4 (9, 3): AssertionError" in str(error.value)
    assert "case 1" not in str(error.value)


def test_a_failure_inside_pytest_counts_and_labels_are_those_given():
    @each_of("text", ["a", "b"], ids=str.upper)
    def refused(text):
        with pytest.raises(ValueError, match="a"):
            raise ValueError(text)

    with pytest.raises(AssertionError, match="1 of 2 cases fail"):
        refused()
    with pytest.raises(AssertionError, match=r"^1 of 2 cases fail:\nB: "):
        refused()


def test_pytest_sees_the_fixtures_and_not_the_cases():
    import inspect

    @each_of("value", [1])
    def one(tmp_path, value):
        pass

    assert list(inspect.signature(one).parameters) == ["tmp_path"]


@pytest.mark.parametrize("values", [[], [(1, 2, 3)]])
def test_a_table_that_cannot_be_is_refused(values):
    with pytest.raises(AssertionError):
        each_of("a, b", values)


@pytest.mark.full
def test_the_hygiene_of_pictures_can_fail():
    from documents import check_hygiene
    from matplotlib.figure import Figure

    def picture(width=7.0, name="sag, mm", letters=9.0, legends=1, title="weights, g"):
        figure = Figure((width, 4), layout="constrained")
        for ax in figure.subplots(2, 1, sharex=True)[:legends]:
            ax.plot([1, 2], label="curve")
            ax.legend()
        for ax in figure.axes:
            ax.set_ylabel(name)
        figure.axes[1].set_xlabel("node")
        figure.axes[0].text(0.5, 1.5, "word", fontsize=letters)
        figure.axes[0].secondary_xaxis("top").set_xlabel("speed, rpm")
        figure.add_subplot(3, 1, 3, projection="polar").set_title(title)
        return figure

    check_hygiene(picture(), unitless=["node"])
    for broken in ({"width": 7.5}, {"name": "sag"}, {"letters": 8.9}, {"legends": 2}, {"title": "weights"}):
        with pytest.raises(AssertionError, match=r"in wide|no unit|letters|legends"):
            check_hygiene(picture(**broken), unitless=["node"])
    with pytest.raises(AssertionError, match="no unit"):
        check_hygiene(picture())
    cut = picture()
    cut.text(0.9, 0.5, "far too long to stand here")
    with pytest.raises(AssertionError, match="cut off"):
        check_hygiene(cut, unitless=["node"])
