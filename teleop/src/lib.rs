//! teleop
