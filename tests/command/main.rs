//! Runs the `hbao` command as its users run it. Each module tests one promise, and all are compiled into one program.

#[path = "../rig/mod.rs"]
mod rig;

mod bench;
mod cameras;
mod cli;
mod command_line;
mod compare;
mod formats;
mod glx;
mod hostile_commands;
mod image;
mod page;
mod paper;
mod refusals;
mod scenes;
mod sequence;
mod tiles;
mod trade;
mod tune;
