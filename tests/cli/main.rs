//! The program from outside: each command, exit code and message.

mod arm_geometry;
mod cohort;
mod commands;
mod curl;
mod cycles;
mod damage;
mod design;
mod errors;
mod examples;
mod faults;
mod fit_model;
mod in_time;
mod input;
mod joints;
mod limits;
mod live;
mod privacy;
mod reference;
mod relaxation;
mod responses;
mod schemas;
mod simulator;
mod stream;
mod studies;
mod support;
mod written_robot;
