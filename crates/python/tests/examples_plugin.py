"""What the examples of several docstrings share, computed once: given to pytest with -p."""

import pytest

import ndof


@pytest.fixture(scope="session")
def shared_results():
    return {"diagnosis": ndof.diagnose(ndof.simulate("spring-array", trials=3).recordings), "study": ndof.study("arm")}


@pytest.fixture(autouse=True)
def names_of_examples(request, doctest_namespace):
    example = getattr(request.node, "dtest", None)
    if example is not None and any(word in example.name for word in ("Diagnosis", "StudyResult", "StudyCase")):
        doctest_namespace.update(request.getfixturevalue("shared_results"))
