//! Bristle simulates the contact of an abrasive brush filament with a workpiece.

pub mod equations;
