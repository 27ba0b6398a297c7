//! Camera nodes: a station that has a pair of its cameras read by another process gives the poses of one that reads
//! them all itself, knows the node's clock, and goes on without it.
//!
//! All programs play one recording, from one time, in slow motion: what is compared is what they make of the images,
//! not whether this machine has time for all of them.

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::geometry::isometry;
use locoman_protocol::messages::{ClockOffset, Tracking, Verdict};
use locoman_protocol::{Endpoints, Link, Subscription};
use locoman_tests::programs::{operator_recording, program, root};
use nalgebra::Isometry3;

/// The pair that the node reads.
const REMOTE: [&str; 2] = ["left_zed_left", "left_zed_right"];
/// Of the recorded speed.
const SPEED: f64 = 0.2;
/// From the recording's begin, as recorded: how much is compared, and after what. Before that the shells are found,
/// and which image is searched first is chance.
const COMPARED_S: std::ops::Range<f64> = 1.0..3.5;
/// Programs start, and a shared processor is slow at it.
const LEAD_NS: u64 = 4_000_000_000;
const PATIENCE: Duration = Duration::from_secs(60);

/// A program that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Already gone is as good.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What all programs of a test share.
struct Stage {
    folder: tempfile::TempDir,
    recording: PathBuf,
    endpoint: String,
    start_ns: u64,
}

impl Stage {
    fn set() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let recording = operator_recording(folder.path()).unwrap();
        let rig = fs::read_to_string(root().join("configs/rigs/two_zed_pairs.toml")).unwrap();
        fs::write(folder.path().join("local.toml"), &rig).unwrap();
        let remote = REMOTE.iter().fold(rig, |rig, id| {
            let line = format!("id = \"{id}\"\n");
            assert!(rig.contains(&line));
            rig.replace(&line, &format!("{line}source = {{ remote = true }}\n"))
        });
        fs::write(folder.path().join("remote.toml"), remote).unwrap();
        let settings = fs::read_to_string(root().join("configs/teleop.toml")).unwrap();
        assert!(settings.contains("straggler_ms = 5"));
        // In slow motion there is time to wait for every camera.
        let settings = settings.replace("straggler_ms = 5", "straggler_ms = 100");
        fs::write(folder.path().join("teleop.toml"), settings).unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        Self { folder, recording, endpoint, start_ns: monotonic_ns() + LEAD_NS }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn start(&self, task: &[&str], rig: &str, log: &str) -> Running {
        let mut command = program("locoman-teleop").unwrap();
        let log = fs::File::create(self.path(log)).unwrap();
        command.arg("--configs").arg(self.folder.path()).args(task);
        command.arg("--replay").arg(&self.recording).arg("--rig").arg(self.path(rig));
        command.args(["--shells", "configs/shells/standard.toml", "--speed", &SPEED.to_string()]);
        command.args(["--replay-at", &self.start_ns.to_string()]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
        Running(command.spawn().unwrap())
    }

    fn station(&self, rig: &str) -> (Running, Listener) {
        let task = ["run", "--console", "127.0.0.1:0", "--listen", &self.endpoint];
        let task = [&task[..], &["--connect", "tcp/127.0.0.1:9"]].concat();
        (self.start(&task, rig, "station.log"), Listener::connect(&self.endpoint))
    }

    fn node(&self, more: &[&str]) -> Running {
        let cameras = REMOTE.join(",");
        let task = ["detect", "--cameras", &cameras, "--connect", &self.endpoint];
        self.start(&[&task[..], more].concat(), "remote.toml", "node.log")
    }
}

/// Hears what a station tracks.
struct Listener {
    heard: Arc<Mutex<Vec<Tracking>>>,
    _subscription: Subscription,
    _link: Link,
}

impl Listener {
    fn connect(endpoint: &str) -> Self {
        let link = Link::open("locoman", &Endpoints::connect(&[endpoint])).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let to = Arc::clone(&heard);
        let subscription =
            link.subscribe::<Tracking>(move |received| to.lock().unwrap().push(received.message)).unwrap();
        Self { heard, _subscription: subscription, _link: link }
    }

    fn last(&self) -> Option<Tracking> {
        self.heard.lock().unwrap().last().cloned()
    }

    fn wait_until<T>(&self, what: &str, mut found: impl FnMut(&Tracking) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(value) = self.last().as_ref().and_then(&mut found) {
                return value;
            }
            assert!(start.elapsed() < PATIENCE, "waited in vain for {what}; heard last: {:?}", self.last());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Poses by time in the recording (in whole milliseconds) and shell, with the number of tags and cameras.
    fn poses(&self, start_ns: u64) -> BTreeMap<(u64, String), (Isometry3<f64>, u32, u32)> {
        let mut poses = BTreeMap::new();
        for tracking in self.heard.lock().unwrap().iter() {
            let capture_ns = tracking.header.map_or(0, |header| header.capture_ns);
            let at_s = (capture_ns as f64 - start_ns as f64) * 1e-9 * SPEED;
            if !COMPARED_S.contains(&at_s) {
                continue;
            }
            for shell in tracking.shells.iter().filter(|shell| shell.verdict() == Verdict::Tracked) {
                let pose = isometry(shell.pose.as_ref().unwrap()).unwrap();
                let at_ms = (at_s * 1e3).round() as u64;
                poses.insert((at_ms, shell.shell.clone()), (pose, shell.tags, shell.cameras));
            }
        }
        poses
    }
}

fn clock(tracking: &Tracking) -> Option<ClockOffset> {
    tracking.cameras.iter().find(|camera| camera.camera == REMOTE[0])?.clock
}

fn wait_for_the_end(stage: &Stage) {
    let end_ns = stage.start_ns + (COMPARED_S.end / SPEED * 1e9) as u64 + 500_000_000;
    std::thread::sleep(Duration::from_nanos(end_ns.saturating_sub(monotonic_ns())));
}

fn log(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

#[test]
fn a_pair_read_by_a_node_gives_the_poses_of_one_read_here() {
    /// One machine has one clock, and what is left of the exchange's delays moves a slow hand by micrometres.
    const AGREE_M: f64 = 0.05e-3;
    const AGREE_RAD: f64 = 0.05e-3 / 0.05;

    let stage = Stage::set();
    let local = {
        let (_station, listener) = stage.station("local.toml");
        wait_for_the_end(&stage);
        listener.poses(stage.start_ns)
    };
    assert!(local.len() > 5 * 60, "only {} poses: {}", local.len(), log(&stage.path("station.log")));

    let stage = Stage { start_ns: monotonic_ns() + LEAD_NS, ..stage };
    let (_station, listener) = stage.station("remote.toml");
    let _node = stage.node(&[]);
    wait_for_the_end(&stage);
    let remote = listener.poses(stage.start_ns);

    let offset = clock(&listener.last().unwrap()).expect("the node's clock is known");
    assert!(offset.offset_ns.unsigned_abs() <= offset.error_ns, "one clock, and its bound holds: {offset:?}");
    assert!(offset.error_ns < 500_000, "on one machine the way is short: {offset:?}");

    let mut alike = 0;
    let mut worst = (0.0_f64, 0.0_f64);
    for (key, (here, tags, cameras)) in &local {
        // An image that one of the two had no time for makes another pose.
        let Some((there, ..)) = remote.get(key).filter(|(_, t, c)| (t, c) == (tags, cameras)) else {
            continue;
        };
        let off = here.inverse() * there;
        worst = (worst.0.max(off.translation.vector.norm()), worst.1.max(off.rotation.angle()));
        alike += 1;
    }
    println!("{alike} of {} poses compared; worst {worst:?} m, rad; {offset:?}", local.len());
    assert!(10 * alike >= 9 * local.len(), "{alike} of {}: {}", local.len(), log(&stage.path("node.log")));
    assert!(worst.0 < AGREE_M && worst.1 < AGREE_RAD, "{worst:?} m, rad");
    let all_cameras = remote.values().any(|(_, _, cameras)| *cameras > 2);
    assert!(all_cameras, "shells are seen by cameras of both");
}

#[test]
fn a_node_with_another_clock_is_understood_and_when_it_dies_the_others_go_on() {
    const SHIFT_MS: f64 = 1234.5;
    const FOUND_MS: f64 = 0.5;

    let stage = Stage::set();
    let (_station, listener) = stage.station("remote.toml");
    let node = stage.node(&["--clock-shift-ms", &SHIFT_MS.to_string()]);
    let offset = listener
        .wait_until("the node's clock", |tracking| clock(tracking).filter(|offset| offset.exchanges >= 10));
    // Station = node + offset: the node is ahead.
    let error_ms = offset.offset_ns as f64 * 1e-6 + SHIFT_MS;
    assert!(error_ms.abs() < FOUND_MS, "{offset:?}");
    assert!(error_ms.abs() <= offset.error_ns as f64 * 1e-6, "its bound holds: {offset:?}");
    let seen_by = |tracking: &Tracking, least: u32| {
        let palm = tracking.shells.iter().find(|shell| shell.shell == "torso")?;
        (palm.verdict() == Verdict::Tracked && palm.cameras >= least).then_some(())
    };
    listener.wait_until("a shell seen by cameras of both", |tracking| seen_by(tracking, 3));

    drop(node);
    let start = Instant::now();
    while !log(&stage.path("station.log")).contains("left_zed_left is silent; the others go on") {
        assert!(start.elapsed() < PATIENCE, "nobody says that the node is silent");
        std::thread::sleep(Duration::from_millis(50));
    }
    let died_ns = monotonic_ns();
    listener.wait_until("the other pair to go on", |tracking| {
        let fresh = tracking.header.is_some_and(|header| header.capture_ns > died_ns);
        seen_by(tracking, 1).filter(|()| fresh)
    });
}
