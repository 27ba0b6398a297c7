//! The robot sits up on its shanks, works with both grippers, and comes down again.

mod session;

use locoman_robot::modes::Mode;
use session::Session;

#[test]
fn it_sits_up_and_comes_down_again() {
    let mut sut = Session::new("standing", "hw", 1);
    sut.run_until("stance", 20.0, |s| s.mode == Mode::Stance);
    sut.join();
    sut.request(Mode::Bimanual);
    sut.run(2.0);
    sut.request(Mode::Stance);
    sut.run(1.0);
}
