//! Bristle simulates the contact of an abrasive brush filament with a workpiece.

pub mod contact;
pub mod equations;
pub mod filament;
pub mod settings;
pub mod tool;
pub mod workpiece;
pub mod integrate;
pub mod metrics;
pub mod simulation;
