"""Every subject of a folder fitted on Spark, with the table of `ndof cohort`: python spark_cohort.py SUBJECTS OUT.parquet

`spark-submit` runs it on a cluster; without one it runs on this machine.
"""

import sys

# ANCHOR: cohort
import pandas as pd

import ndof


def cohort(spark, folder, partitions=8, **options):
    """One row a subject. A task that fails is done again by Spark, with the same bytes."""
    subjects = ndof.subjects(folder)
    rows = (ndof.fit_row(subject, files, **options) for subject, files in subjects.items())
    # Which parameters there are: those of the first subject that can be fitted.
    first = next((row for row in rows if not row["error"]), {"subject": "", "error": ""})
    columns = list(first)
    schema = ", ".join(f"`{name}` {'string' if name in ('subject', 'warnings', 'error') else 'double'}" for name in columns)

    def fit(batches):
        ndof.set_threads(1)
        for batch in batches:
            fitted = [ndof.fit_row(subject, list(files), **options) for subject, files in zip(batch["subject"], batch["files"])]
            yield pd.DataFrame(fitted, columns=columns)

    table = spark.createDataFrame(list(subjects.items()), "subject string, files array<string>")
    return table.repartition(partitions).mapInPandas(fit, schema)


# ANCHOR_END: cohort
# ANCHOR: main
if __name__ == "__main__":
    from pyspark.sql import SparkSession

    folder, out = sys.argv[1:]
    spark = SparkSession.builder.appName("ndof").getOrCreate()
    cohort(spark, folder, nperseg=512, band=(0.5, 10)).write.mode("overwrite").parquet(out)
# ANCHOR_END: main
