//! Tests of the program as its users call it, in one program of tests: each further one would be linked on its own.

mod program;

mod advise;
mod commands;
mod formats;
mod resume;
mod tutorial;
mod uncertainty;
mod validation;
