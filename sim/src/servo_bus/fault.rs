//! What can go wrong with a virtual servo, on demand.

use std::time::Duration;

/// One servo's fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServoFault {
    /// It gets hotter than its limit, says so and switches its torque off.
    Overheats,
    /// It is loaded beyond its power, says so and switches its torque off.
    Overloads,
    /// Its cable has come off: no power, no answers.
    Vanishes,
    /// The cable is on again: it starts as when it is switched on. Also ends heat and overload.
    Returns,
    /// Its answers come so much later.
    Late(Duration),
    /// So many of its next answers come with a wrong bit.
    Damaged(u32),
    /// So many of its next answers do not come.
    Mute(u32),
}
