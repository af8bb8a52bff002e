//! Tests of the program as its users call it. They form one test program, because each further one
//! would have to be linked.

mod program;

mod advise;
mod brush;
mod calibrate;
mod catalogue;
mod check;
mod commands;
mod converge;
mod corpora;
mod first;
mod formats;
mod hostile;
mod kinds;
mod metrics;
mod mistakes;
mod packing;
mod pages;
mod poses;
mod random_input;
mod removal;
mod resume;
mod scripting;
mod speed;
mod stability;
mod tools;
mod turns;
mod uncertainty;
mod width;
