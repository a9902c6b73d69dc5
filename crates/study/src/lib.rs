//! Experiments and studies as data: the pipeline from design to report.
