"""Every subject of a folder fitted on Dask, with the table of `ndof cohort`: python dask_cohort.py SUBJECTS OUT.parquet

Run it on a machine as it is, or give the address of a scheduler as the third argument.
"""

import sys

# ANCHOR: cohort
import ndof


def cohort(client, folder, **options):
    """One task a subject. A worker that dies takes nothing with it: its tasks are done again, with the same bytes."""
    subjects = ndof.subjects(folder)
    rows = client.map(ndof.fit_row, list(subjects), list(subjects.values()), **options)
    return ndof.cohort_table(client.gather(rows))


# ANCHOR_END: cohort
# ANCHOR: long
def long_spectra(client, load, samples, tasks, *, fs, nperseg):
    """Cross-spectra of one recording too long for a machine: each worker loads its own stretch, `load(start, stop)`."""

    def part(share):
        return ndof.cross_spectra(load(share.start, share.stop), fs, nperseg=nperseg, share=share)

    return ndof.merge(client.gather(client.map(part, ndof.shares(samples, tasks=tasks, nperseg=nperseg))))


# ANCHOR_END: long
# ANCHOR: main
if __name__ == "__main__":
    from dask.distributed import Client, LocalCluster

    folder, out, *scheduler = sys.argv[1:]
    # Processes of one thread each: results do not depend on it, and no two compete for a processor.
    with Client(*scheduler) if scheduler else Client(LocalCluster(processes=True, threads_per_worker=1)) as client:
        client.run(ndof.set_threads, 1)
        cohort(client, folder, nperseg=512, band=(0.5, 10)).to_parquet(out)
# ANCHOR_END: main
