//! Links over real sockets on free loopback ports.

#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests: a panic is the report")]

use locoman_protocol::messages::{Detections, Event, OperatorCommand, RobotState};
use locoman_protocol::{Endpoints, Link, LinkError, Received, Subscription, Wire};
use std::net::TcpListener;
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};
use zenoh::Wait;

/// No test waits for longer; it says nothing about how long things take.
const WATCHDOG: Duration = Duration::from_secs(10);

fn free_endpoint() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    format!("tcp/{}", listener.local_addr().unwrap())
}

fn pair(robot: &str) -> (Link, Link) {
    let endpoint = free_endpoint();
    let listening = Link::open(robot, &Endpoints::listen(&endpoint)).unwrap();
    let connecting = Link::open(robot, &Endpoints::connect(&[endpoint])).unwrap();
    (listening, connecting)
}

fn collect<M: Wire>(link: &Link) -> (Subscription, Receiver<Received<M>>) {
    let (sender, receiver) = mpsc::channel();
    let subscription = link.subscribe(move |received| drop(sender.send(received))).unwrap();
    (subscription, receiver)
}

/// Sends until something arrives: what is sent before the sides know each other is lost, by design.
fn send_until_received<M: Wire + Clone>(
    sender: &mut locoman_protocol::Sender<M>,
    received: &Receiver<Received<M>>,
    message: &M,
) -> Received<M> {
    let begin = Instant::now();
    while begin.elapsed() < WATCHDOG {
        sender.send(1, message.clone()).unwrap();
        if let Ok(received) = received.recv_timeout(Duration::from_millis(20)) {
            return received;
        }
    }
    panic!("nothing arrived within {WATCHDOG:?}");
}

fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < WATCHDOG, "{what} did not happen within {WATCHDOG:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn messages_go_both_ways_with_their_headers() {
    let (robot, operator) = pair("go1");
    let (_commands, commands) = collect::<OperatorCommand>(&robot);
    let (_states, states) = collect::<RobotState>(&operator);
    let mut command_sender = operator.sender::<OperatorCommand>().unwrap();
    let mut state_sender = robot.sender::<RobotState>().unwrap();

    let command = OperatorCommand { engagement: 42, ..OperatorCommand::default() };
    let first = send_until_received(&mut command_sender, &commands, &command);
    let header = first.message.header().unwrap();
    assert_eq!((first.message.engagement, header.source, header.capture_ns), (42, operator.source(), 1));
    assert!(header.send_ns > 0 && first.received_ns >= header.send_ns);

    let sent = command_sender.send(2, command).unwrap();
    let second = commands.recv_timeout(WATCHDOG).unwrap().message;
    assert_eq!(sent, second, "the sender gives back what it sent");
    assert!(second.header().unwrap().sequence > header.sequence);

    let state = RobotState { phase: "stance".to_owned(), ..RobotState::default() };
    let state = send_until_received(&mut state_sender, &states, &state).message;
    assert_eq!((state.phase.as_str(), state.header.unwrap().source), ("stance", robot.source()));
}

#[test]
fn two_senders_on_one_key_do_not_repeat_a_sequence_number() {
    let (robot, operator) = pair("go1");
    let (_subscription, received) = collect::<Event>(&robot);
    let mut first = operator.sender::<Event>().unwrap();
    let mut second = operator.sender::<Event>().unwrap();
    send_until_received(&mut first, &received, &Event::default());
    let a = first.send(0, Event::default()).unwrap().header.unwrap().sequence;
    let b = second.send(0, Event::default()).unwrap().header.unwrap().sequence;
    assert_eq!(b, a + 1);
}

#[test]
fn one_subscription_hears_every_camera() {
    let (solver, detector) = pair("go1");
    let (_subscription, received) = collect::<Detections>(&solver);
    for camera in ["zed0_left", "zed0_right"] {
        let mut sender = detector.sender_named::<Detections>(camera).unwrap();
        let message = Detections { camera: camera.to_owned(), ..Detections::default() };
        let begin = Instant::now();
        while send_until_received(&mut sender, &received, &message).message.camera != camera {
            assert!(begin.elapsed() < WATCHDOG);
        }
    }
    assert!(matches!(detector.sender::<Detections>(), Err(LinkError::Key(_))));
}

#[test]
fn robots_do_not_hear_each_others_commands() {
    let endpoint = free_endpoint();
    let robot = Link::open("one", &Endpoints::listen(&endpoint)).unwrap();
    let operator = Link::open("two", &Endpoints::connect(&[endpoint])).unwrap();
    let (subscription, _received) = collect::<OperatorCommand>(&robot);
    let mut sender = operator.sender::<OperatorCommand>().unwrap();
    wait_until("connecting", || operator.peers() == 1 && robot.peers() == 1);
    for _ in 0..50 {
        sender.send(0, OperatorCommand::default()).unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(subscription.received(), 0);
}

#[test]
fn a_missing_peer_is_no_error_and_a_restarted_one_is_found_again() {
    let endpoint = free_endpoint();
    let begin = Instant::now();
    let operator = Link::open("go1", &Endpoints::connect(&[&endpoint])).unwrap();
    assert!(begin.elapsed() < WATCHDOG, "opening waits for nobody");
    let mut sender = operator.sender::<OperatorCommand>().unwrap();
    sender.send(0, OperatorCommand::default()).unwrap();

    for life in 0..3 {
        let robot = Link::open("go1", &Endpoints::listen(&endpoint)).unwrap();
        let (_subscription, received) = collect::<OperatorCommand>(&robot);
        let command = OperatorCommand { engagement: life, ..OperatorCommand::default() };
        let received = send_until_received(&mut sender, &received, &command);
        assert_eq!(received.message.header.unwrap().source, operator.source());
        robot.close();
        wait_until("noticing the end", || operator.peers() == 0);
    }
}

#[test]
fn what_is_too_long_or_of_another_type_is_dropped_and_counted() {
    let endpoint = free_endpoint();
    let robot = Link::open("go1", &Endpoints::listen(&endpoint)).unwrap();
    let (subscription, received) = collect::<OperatorCommand>(&robot);
    let stranger = zenoh::open(
        zenoh::Config::from_json5(&format!(
            r#"{{ mode: "client", connect: {{ endpoints: ["{endpoint}"] }},
            scouting: {{ multicast: {{ enabled: false }} }} }}"#
        ))
        .unwrap(),
    )
    .wait()
    .unwrap();
    let long = vec![0x42; 3_000];
    let other = b"not protobuf".to_vec();
    for payload in [long, other] {
        let before = subscription.undecodable();
        wait_until("dropping", || {
            stranger.put("locoman/1/go1/command", payload.clone()).wait().unwrap();
            subscription.undecodable() > before
        });
    }
    assert_eq!(subscription.received(), 0);
    assert!(received.try_recv().is_err());
    stranger.close().wait().unwrap();
}

#[test]
fn a_busy_port_is_one_error_with_the_remedy() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = holder.local_addr().unwrap().port();
    let error = Link::open("go1", &Endpoints::listen(&format!("tcp/127.0.0.1:{port}"))).unwrap_err();
    assert!(matches!(error, LinkError::PortInUse { .. }));
    let text = error.to_string();
    for part in [&format!("tcp/127.0.0.1:{port}"), "in use", "ss -ltnp", "--listen"] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn an_address_of_another_machine_is_refused_with_the_remedy() {
    let error = Link::open("go1", &Endpoints::listen("tcp/192.0.2.1:7447")).unwrap_err();
    assert!(error.to_string().contains("address of this machine"), "{error}");
}

#[test]
fn closing_does_not_hang() {
    let (robot, operator) = pair("go1");
    wait_until("connecting", || operator.peers() == 1);
    let begin = Instant::now();
    operator.close();
    robot.close();
    let lonely = Link::open("go1", &Endpoints::connect(&[free_endpoint()])).unwrap();
    lonely.close();
    assert!(begin.elapsed() < WATCHDOG);
}
