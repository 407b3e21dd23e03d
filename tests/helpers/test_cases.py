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
