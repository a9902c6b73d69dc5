//! Estimators against analytic truth, against each other and against other implementations.

mod coverage;
mod draws;
mod edges;
mod identities;
mod judgement;
mod periodic;
mod refusals;
mod scipy;
mod time_domain;
mod truth;
mod windows;
