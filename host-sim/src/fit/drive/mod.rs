//! Identification of a drive from torque and angle, or force and position.
//!
//! An integrating plant hides its faults in an open-loop simulation: a small wrong force becomes a
//! large wrong position, and a large short one vanishes. So drives are judged by force: the measured
//! motion goes through the inverse model and the force that it asks for is compared with the measured
//! one.

pub mod butterworth;
pub mod decimate;
pub mod inverse;
pub mod record;
