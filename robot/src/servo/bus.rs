//! One exchange with servos at a time: ask, wait for the answer, judge it.

use std::time::{Duration, Instant};

use super::{
    ServoError,
    line::Line,
    registers::{AnyRegister, Register},
    wire::{
        self, Instruction, Scanner, Status,
        instruction::{self, Span},
        packet::Packet,
        timing,
    },
};

/// What a ping finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    /// Its id.
    pub id: u8,
    /// Its model.
    pub model: u16,
    /// Version of its program.
    pub firmware: u8,
}

/// A line with servos behind it.
pub struct Bus<L> {
    line: L,
    baud: u32,
    slack: Duration,
    request: Vec<u8>,
    scanner: Scanner,
}

impl<L: Line> Bus<L> {
    /// A bus of this speed, whose servos may answer so much later than the line takes.
    pub fn new(line: L, baud: u32, slack: Duration) -> Self {
        Self { line, baud, slack, request: Vec::with_capacity(256), scanner: Scanner::default() }
    }

    /// Bits a second.
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// Changes the line's speed; that of the servos is theirs.
    pub fn set_baud(&mut self, baud: u32) -> Result<(), ServoError> {
        self.line.set_baud(baud)?;
        self.baud = baud;
        Ok(())
    }

    /// How often something came that looked like a packet and was none.
    pub fn damaged(&self) -> u64 {
        self.scanner.damaged()
    }

    /// Asks one servo for its model.
    pub fn ping(&mut self, id: u8) -> Result<Found, ServoError> {
        instruction::plain(id, Instruction::Ping, &mut self.request);
        let status = self.ask(id, "ping", timing::status_bytes(3))?;
        found(&status).ok_or_else(|| self.silent(id))
    }

    /// Everyone who answers within the time that all 253 could need.
    pub fn scan(&mut self) -> Result<Vec<Found>, ServoError> {
        /// Each servo waits for those with lower ids, by the maker's library.
        const TURN: Duration = Duration::from_millis(3);
        instruction::plain(wire::BROADCAST, Instruction::Ping, &mut self.request);
        let turns = TURN * u32::from(wire::MAX_ID);
        let deadline = self.send(timing::status_bytes(3) * usize::from(wire::MAX_ID))? + turns;
        let mut servos = Vec::new();
        while let Some(packet) = self.receive(deadline)? {
            servos.extend(Status::of_packet(&packet).and_then(|status| found(&status)));
        }
        Ok(servos)
    }

    /// Reads registers of one servo.
    pub fn read(&mut self, id: u8, span: Span, what: &'static str) -> Result<Status, ServoError> {
        instruction::read(id, span, &mut self.request);
        let status = self.ask(id, what, timing::status_bytes(usize::from(span.length)))?;
        if status.data.len() == usize::from(span.length) { Ok(status) } else { Err(self.silent(id)) }
    }

    /// Reads one register, as an unsigned number.
    pub fn read_register<const N: usize>(
        &mut self,
        id: u8,
        register: Register<N>,
    ) -> Result<u32, ServoError> {
        let status = self.read(id, register.span(), register.name)?;
        Ok(status.data.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }

    /// Writes one register.
    pub fn write<const N: usize>(
        &mut self,
        id: u8,
        register: Register<N>,
        value: u32,
    ) -> Result<(), ServoError> {
        self.write_any(id, register.into(), value.into())
    }

    /// Writes a register of any length; a negative value as its two's complement.
    pub fn write_any(&mut self, id: u8, register: AnyRegister, value: i64) -> Result<(), ServoError> {
        let bytes = value.to_le_bytes();
        let length = usize::from(register.span.length).min(bytes.len());
        let address = register.span.address;
        instruction::write_registers(id, Instruction::Write, address, &bytes[..length], &mut self.request);
        self.ask(id, register.name, timing::status_bytes(0)).map(|_| ())
    }

    /// Writes `N` bytes to each of several servos; none answers.
    pub fn sync_write<const N: usize>(
        &mut self,
        address: u16,
        data: &[(u8, [u8; N])],
    ) -> Result<(), ServoError> {
        instruction::sync_write(address, data, &mut self.request);
        self.send(0).map(|_| ())
    }

    /// Reads the same registers of several servos; those that did not answer are missing in the result.
    ///
    /// With `fast` all answer in one packet. Either way a servo that is silent may silence those behind it.
    pub fn sync_read(&mut self, span: Span, ids: &[u8], fast: bool) -> Result<Vec<Status>, ServoError> {
        let length = usize::from(span.length);
        let kind = if fast { Instruction::FastSyncRead } else { Instruction::SyncRead };
        instruction::sync_read(kind, span, ids, &mut self.request);
        let asked = |status: &Status| ids.contains(&status.id) && status.data.len() == length;
        if fast {
            let answer = wire::fast::answer_bytes(ids.len(), length);
            let deadline = self.send(answer)?;
            let mut buffer = [0; wire::MAX_PACKET_BYTES];
            loop {
                let statuses = wire::fast::read(self.scanner.pending(), length);
                if statuses.len() == ids.len() {
                    return Ok(statuses.into_iter().filter(asked).collect());
                }
                match self.line.receive(&mut buffer, deadline)? {
                    0 => return Ok(statuses.into_iter().filter(asked).collect()),
                    bytes => self.scanner.push(&buffer[..bytes]),
                }
            }
        }
        let deadline = self.send(ids.len() * timing::status_bytes(length))?;
        let mut statuses = Vec::with_capacity(ids.len());
        while statuses.len() < ids.len() {
            let Some(packet) = self.receive(deadline)? else { break };
            statuses.extend(Status::of_packet(&packet).filter(asked));
        }
        Ok(statuses)
    }

    /// Sends the request, with nothing of earlier exchanges in the way; until when `answer` bytes may take.
    fn send(&mut self, answer: usize) -> Result<Instant, ServoError> {
        let sent = self.line.forget_input().and_then(|()| self.line.send(&self.request));
        let bytes = self.request.len() + answer;
        self.request.clear();
        self.scanner.clear();
        sent?;
        Ok(Instant::now() + Duration::from_nanos(timing::bytes_ns(bytes, self.baud)) + self.slack)
    }

    /// The next packet that comes before the deadline.
    fn receive(&mut self, deadline: Instant) -> Result<Option<Packet>, ServoError> {
        let mut buffer = [0; wire::MAX_PACKET_BYTES];
        loop {
            if let Some(packet) = self.scanner.next_packet() {
                return Ok(Some(packet));
            }
            match self.line.receive(&mut buffer, deadline)? {
                0 => return Ok(None),
                bytes => self.scanner.push(&buffer[..bytes]),
            }
        }
    }

    /// Sends the request and waits for the answer of one servo.
    fn ask(&mut self, id: u8, register: &'static str, answer: usize) -> Result<Status, ServoError> {
        let deadline = self.send(answer)?;
        while let Some(packet) = self.receive(deadline)? {
            match Status::of_packet(&packet) {
                Some(Status { id: from, refusal: Some(refusal), .. }) if from == id => {
                    return Err(ServoError::Refused { id, register, refusal });
                }
                Some(status) if status.id == id => return Ok(status),
                _ => {}
            }
        }
        Err(self.silent(id))
    }

    fn silent(&self, id: u8) -> ServoError {
        ServoError::Silent { id, waited_ms: self.slack.as_secs_f64() * 1000.0 }
    }
}

fn found(status: &Status) -> Option<Found> {
    let [a, b, firmware] = *status.data.first_chunk::<3>()?;
    (status.data.len() == 3).then_some(Found { id: status.id, model: u16::from_le_bytes([a, b]), firmware })
}
