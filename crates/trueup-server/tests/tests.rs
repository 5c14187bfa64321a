//! The server as others meet it: those who are meant to, and those who are not.

mod attacks;
mod hostile_files;
mod server;
mod sessions;
