//! The `hbao` command, run as its users run it: one module for each promise, all in one program.

#[path = "../rig/mod.rs"]
mod rig;

mod bench;
mod cli;
mod hostile_commands;
mod paper;
mod refusals;
mod trade;
mod tune;
