//! What the diagnosis says of recordings whose cause is known: hidden by a generator of its own, or measured by others.

mod arm;
mod between;
mod blind;
mod channels;
mod drawn;
mod elsewhere;
mod findings;
mod measured;
mod plants;
mod records;
mod robot;
mod sensors;
mod slow_force;
mod varying;
