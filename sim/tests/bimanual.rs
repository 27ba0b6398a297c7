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
    for _ in 0..8 {
        sut.run(0.1);
        let s = sut.snapshot();
        for side in 0..2 {
            let g = &s.grippers[side];
            println!(
                "bi {side} pose {:.3?} {:.2?} target {:.3?} {:.2?}",
                g.pose.translation.vector.as_slice(),
                g.pose.rotation.scaled_axis().as_slice(),
                g.target.translation.vector.as_slice(),
                g.target.rotation.scaled_axis().as_slice()
            );
        }
        println!(
            "bi truth {:.4?} est {:.4?}",
            sut.truth.world_from_torso.translation.vector.as_slice(),
            s.torso.pose.translation.vector.as_slice()
        );
        println!("bi torso {:.3?} {:.3?}", s.torso.pose, s.torso.target);
    }
    sut.run(1.0);
    sut.request(Mode::Stance);
    sut.run(1.0);
}
