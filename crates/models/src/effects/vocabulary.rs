//! The words in which an effect is written.

pub(super) use super::card::{CHANNEL, Card, ParameterCard, Side, Trace, mechanical, plain};
pub(super) use super::effect::Effect;
pub(super) use super::evidence::Evidence;
pub(super) use super::form::{Action, Form, Knob, Operator, Scale, Sign};
pub(super) use super::injection::{Injection, Setting};
pub(super) use super::latency::Latency;
pub(super) use super::matrix::Matrix;
pub(super) use super::on_axis::on_axis;
pub(super) use super::parameters::{EffectError, Parameters, Value};
pub(super) use crate::force_law::{ForceLaw, Motion, Stage};
pub(super) use crate::time::laws;
pub(super) use std::sync::Arc;
