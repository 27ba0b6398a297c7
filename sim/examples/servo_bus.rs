//! The virtual servos alone, for anyone who speaks the protocol: prints the path of the pseudo-terminal and answers
//! there until its standard input ends. `sim/scripts/servo_bus.py` holds it to the maker's own library.

use std::io::Read;

use locoman_sim::servo_bus::{VirtualBus, VirtualBusSetup};

fn main() -> anyhow::Result<()> {
    let new_servos = std::env::args().any(|argument| argument == "--new");
    let bus = VirtualBus::open(&VirtualBusSetup { new_servos, ..VirtualBusSetup::default() })?;
    println!("{}", bus.path());
    std::io::stdin().read_to_end(&mut Vec::new())?;
    Ok(())
}
