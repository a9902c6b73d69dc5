"""Spark on two processors of this machine, with the Java that is there."""

import os
import shutil
import sys

import pytest

import cohort
import ndof

if shutil.which("java") is None:
    pytest.skip("there is no java", allow_module_level=True)
pyspark = pytest.importorskip("pyspark")

import spark_cohort  # noqa: E402  (from examples/, which cohort puts on the path)


@pytest.fixture(scope="module")
def spark():
    from pyspark.sql import SparkSession

    os.environ["PYSPARK_PYTHON"] = sys.executable
    # Workers look for modules where this process does.
    os.environ["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    session = (
        SparkSession.builder.master("local[2, 3]")  # two processors, three attempts a task
        .config("spark.ui.enabled", "false")
        .config("spark.driver.host", "127.0.0.1")
        .config("spark.driver.memory", "1g")
        .getOrCreate()
    )
    yield session
    session.stop()


def test_spark_gives_the_table_of_the_command_line(spark, many):
    folder, expected = many
    cohort.assert_same(ndof.cohort_table(spark_cohort.cohort(spark, folder, **cohort.OPTIONS).toPandas().to_dict("records")), expected)


def test_a_task_that_dies_is_done_again(spark, tmp_path):
    cohort.make(tmp_path, 1, 6)
    rows = [ndof.fit_row(subject, files, **cohort.OPTIONS) for subject, files in ndof.subjects(tmp_path).items()]
    died = tmp_path / "died"

    def fit(batches):
        for batch in batches:
            if "subject-00-03" in batch["subject"].tolist() and not died.exists():
                died.touch()
                os._exit(1)
            yield batch.assign(value=[ndof.fit_row(s, list(f), **cohort.OPTIONS).get("K_x_x") for s, f in zip(batch["subject"], batch["files"])])

    table = spark.createDataFrame(list(ndof.subjects(tmp_path).items()), "subject string, files array<string>").repartition(3)
    found = table.mapInPandas(fit, "subject string, files array<string>, value double").toPandas().sort_values("subject")
    assert died.exists()
    assert found["subject"].tolist() == [row["subject"] for row in rows]
    assert found["value"].tolist()[:6] == [row["K_x_x"] for row in rows[:6]]
