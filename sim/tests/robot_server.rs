//! The simulated robot behind its socket: keeps time, answers whoever commands, survives nonsense.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use locoman_protocol::clock::monotonic_ns;
use locoman_robot::plant::wire::{self, MAX_DATAGRAM};
use locoman_robot::plant::{JointCommand, Sensors};
use locoman_sim::robot::server::{Counters, serve};
use locoman_sim::robot::{EXCHANGE_NS, Options, SimRobot, Truth};
use triple_buffer::triple_buffer;

/// Nothing here takes this long unless it hangs.
const WATCHDOG: Duration = Duration::from_secs(20);

/// Runs a server on a free port while `client` talks to it; the truth at the end.
fn with_server(client: impl FnOnce(SocketAddr)) -> (Option<Truth>, Counters) {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let options = Options { posture: "standing".into(), ..Options::default() };
    let mut robot = SimRobot::new(&configs, &options).unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap();
    let (mut truth, mut truth_out) = triple_buffer(&None);
    let (counters, stop) = (Counters::default(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let server = scope.spawn(|| serve(&mut robot, &socket, &mut truth, &counters, &stop));
        client(address);
        stop.store(true, Ordering::Relaxed);
        server.join().unwrap().unwrap();
    });
    (*truth_out.read(), counters)
}

fn client(server: SocketAddr) -> UdpSocket {
    let client = UdpSocket::bind("127.0.0.1:0").unwrap();
    client.connect(server).unwrap();
    client.set_read_timeout(Some(WATCHDOG)).unwrap();
    client
}

fn send(client: &UdpSocket, command: &JointCommand) {
    let mut buffer = [0; MAX_DATAGRAM];
    client.send(wire::encode(command, &mut buffer).unwrap()).unwrap();
}

fn receive(client: &UdpSocket) -> Sensors {
    let mut buffer = [0; MAX_DATAGRAM];
    let length = client.recv(&mut buffer).unwrap();
    wire::decode(&buffer[..length]).unwrap()
}

#[test]
fn sensors_come_every_exchange_on_the_clock_of_this_machine() {
    let (truth, counters) = with_server(|server| {
        let client = client(server);
        let begin_ns = monotonic_ns();
        send(&client, &JointCommand::damping());
        let samples: Vec<Sensors> = (0..200).map(|_| receive(&client)).collect();
        let end_ns = monotonic_ns();
        for pair in samples.windows(2) {
            assert!(pair[1].time_ns >= pair[0].time_ns + EXCHANGE_NS);
        }
        assert!(samples[0].time_ns > begin_ns && samples[199].time_ns <= end_ns);
        // 200 samples of 2.5 ms cannot have come earlier than their time.
        assert!(end_ns - begin_ns >= 199 * EXCHANGE_NS);
    });
    // Damped from standing: it went down, so the command did arrive.
    assert!(truth.unwrap().world_from_torso.translation.z < 0.27);
    assert_eq!(counters.malformed.load(Ordering::Relaxed), 0);
}

#[test]
fn the_last_command_stays_in_force_and_the_newest_commander_is_answered() {
    let (truth, _) = with_server(|server| {
        let (first, second) = (client(server), client(server));
        let mut open = JointCommand::damping();
        open.opening = [1.0, 0.0];
        send(&first, &JointCommand::damping());
        receive(&first);
        send(&second, &open);
        let deadline = Instant::now() + WATCHDOG;
        while receive(&second).opening[0] < 0.95 {
            assert!(Instant::now() < deadline, "the gripper never opened");
        }
    });
    assert!(truth.unwrap().opening[0] > 0.9 && truth.unwrap().opening[1] < 0.1);
}

#[test]
fn nonsense_is_counted_and_changes_nothing() {
    let (_, counters) = with_server(|server| {
        let client = client(server);
        client.send(b"LMS1").unwrap();
        client.send(b"GET / HTTP/1.1").unwrap();
        client.send(&[]).unwrap();
        send(&client, &JointCommand::damping());
        receive(&client);
    });
    assert_eq!(counters.malformed.load(Ordering::Relaxed), 3);
}
