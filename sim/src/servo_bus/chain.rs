//! Who answers a packet, in which order, and with which bytes.
//!
//! In a sync read each servo answers when the one before has. What servos do behind one that is silent is not
//! documented; here they are silent too, the worse case for the driver.

use std::time::Duration;

use locoman_robot::servo::wire::instruction::Span;
use locoman_robot::servo::wire::packet::Packet;
use locoman_robot::servo::wire::{BROADCAST, Request, Status, fast};

use super::servo::VirtualServo;

/// Servos on one line.
#[derive(Debug, Clone)]
pub struct Chain {
    /// The servos.
    pub servos: Vec<VirtualServo>,
}

/// What a packet brought about.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reply {
    /// The bytes of all answers.
    pub bytes: Vec<u8>,
    /// How long the servos wait before they answer, altogether.
    pub delay: Duration,
}

impl Chain {
    /// Does what a packet says, heard at a line's speed, and gives the answers.
    pub fn answer(&mut self, packet: &Packet, baud: u32, now_ns: u64) -> Reply {
        let Some(request) = Request::of_packet(packet) else { return Reply::default() };
        for servo in self.servos.iter_mut().filter(|servo| hears(servo, baud)) {
            servo.step(now_ns);
            servo.hear(now_ns);
        }
        match &request {
            Request::SyncRead { span, ids, fast } => self.sync_read(*span, ids, *fast, baud),
            Request::SyncWrite { span, data } => {
                for (id, data) in data {
                    self.write(*id, span.address, data, baud);
                }
                Reply::default()
            }
            Request::BulkWrite(writes) => {
                for (id, address, data) in writes {
                    self.write(*id, *address, data, baud);
                }
                Reply::default()
            }
            Request::BulkRead(reads) => {
                let mut reply = Reply::default();
                for (id, span) in reads {
                    if !self.answer_one(*id, baud, &Request::Read(*span), &mut reply) {
                        break;
                    }
                }
                reply
            }
            _ => self.each(packet.id, &request, baud),
        }
    }

    /// The servos with this id that hear the line; of two with the same id both act, and their answers collide.
    fn named(&mut self, id: u8, baud: u32) -> Vec<&mut VirtualServo> {
        self.servos.iter_mut().filter(|servo| servo.id() == id && hears(servo, baud)).collect()
    }

    fn each(&mut self, id: u8, request: &Request, baud: u32) -> Reply {
        let mut reply = Reply::default();
        if id != BROADCAST {
            self.answer_one(id, baud, request, &mut reply);
            return reply;
        }
        let mut ids: Vec<u8> = self.servos.iter().map(VirtualServo::id).collect();
        ids.sort_unstable();
        ids.dedup();
        // Of broadcasts only pings are answered.
        let mut unheard = Reply::default();
        for id in ids {
            let reply = if *request == Request::Ping { &mut reply } else { &mut unheard };
            self.answer_one(id, baud, request, reply);
        }
        reply
    }

    fn write(&mut self, id: u8, address: u16, data: &[u8], baud: u32) {
        for servo in self.named(id, baud) {
            // A sync write is not answered, so its refusal is not heard.
            let _ = servo.write(address, data);
        }
    }

    /// Adds one servo's answer; false if it is silent.
    fn answer_one(&mut self, id: u8, baud: u32, request: &Request, reply: &mut Reply) -> bool {
        let mut answers = Vec::new();
        for servo in self.named(id, baud) {
            let delay = servo.answer_delay();
            let Some(status) = servo.answer(request).filter(|_| !servo.is_mute()) else { continue };
            let mut bytes = Vec::new();
            status.write(&mut bytes);
            if servo.is_damaged() {
                damage(&mut bytes);
            }
            answers.push((bytes, delay));
        }
        let collide = answers.len() > 1;
        let Some((mut bytes, delay)) = answers.into_iter().next() else { return false };
        if collide {
            damage(&mut bytes);
        }
        reply.bytes.extend(bytes);
        reply.delay += delay;
        true
    }

    fn sync_read(&mut self, span: Span, ids: &[u8], fast: bool, baud: u32) -> Reply {
        let mut reply = Reply::default();
        if !fast {
            for id in ids {
                if !self.answer_one(*id, baud, &Request::Read(span), &mut reply) {
                    break;
                }
            }
            return reply;
        }
        let mut blocks: Vec<Status> = Vec::new();
        let mut damaged = false;
        for id in ids {
            let Some(servo) = self.named(*id, baud).into_iter().next() else { break };
            let outcome = servo.table.read(span).map(<[u8]>::to_vec);
            if servo.is_mute() || outcome.is_err() {
                break;
            }
            reply.delay += servo.answer_delay();
            damaged |= servo.is_damaged();
            blocks.push(servo.status(*id, outcome));
        }
        if !blocks.is_empty() {
            fast::write(&blocks, ids.len(), usize::from(span.length), &mut reply.bytes);
        }
        if damaged {
            damage(&mut reply.bytes);
        }
        reply
    }
}

fn hears(servo: &VirtualServo, baud: u32) -> bool {
    servo.is_powered() && servo.baud() == baud
}

/// Turns one bit over, in the middle.
fn damage(bytes: &mut [u8]) {
    let middle = bytes.len() / 2;
    if let Some(byte) = bytes.get_mut(middle) {
        *byte ^= 0x10;
    }
}
